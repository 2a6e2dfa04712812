//! How a surface crosses a cube, for each of the 256 sets of corners inside.

/// The corners that an edge along each axis starts from; corner c lies at bits (x, y, z) = (c & 1, c >> 1 & 1, c >>
/// 2). Edge number = 4 axis + place in the list.
pub(super) const EDGE_STARTS: [[usize; 4]; 3] = [[0, 2, 4, 6], [0, 1, 4, 5], [0, 1, 2, 3]];

/// The corners of each face, counter-clockwise seen from outside the cube.
const FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// The number of the edge between two neighbouring corners.
fn edge_between(a: usize, b: usize) -> u8 {
    let (start, axis) = (a.min(b), (a ^ b).trailing_zeros() as usize);
    let place = (EDGE_STARTS[axis].iter()).position(|&corner| corner == start);
    (4 * axis + place.unwrap_or_default()) as u8
}

/// A bit for each face that an edge lies on.
fn faces_of(edge: u8) -> u8 {
    let (axis, place) = (edge as usize / 4, edge as usize % 4);
    let start = EDGE_STARTS[axis][place];
    let end = start | 1 << axis;
    (0..6)
        .filter(|&face| FACES[face].contains(&start) && FACES[face].contains(&end))
        .fold(0, |bits, face| bits | 1 << face)
}

/// The triangles of one case, by the edges that their corners lie on.
pub(super) type Triangles = Vec<[u8; 3]>;

/// The triangles of all cases, by the corners inside as bits; seen from outside the solid they turn counter-clockwise.
///
/// On a face with two opposite corners inside, these are kept apart, so that cubes that share a face agree about its
/// segments. Every crossed edge belongs to one loop of segments, so the triangles around its vertex form
/// one ring over the four cubes around the edge. No triangle has a side within a face that is not one of the
/// segments there: it could coincide with one of the neighbour's.
pub(super) fn all_cases() -> Vec<Triangles> {
    (0..256).map(triangles).collect()
}

fn triangles(inside: usize) -> Triangles {
    let mut loops = loops(inside);
    let mut result = Vec::new();
    for one in &mut loops {
        // Every loop has one: checked by a test.
        result.extend(cut(one).unwrap_or_default());
    }
    result
}

/// The closed walks along crossed edges, from edge to edge within faces.
fn loops(inside: usize) -> Vec<Vec<u8>> {
    let is_inside = |corner: usize| inside >> corner & 1 == 1;
    // The inside is left of a segment seen from outside the cube, hence right seen from within.
    let mut next = [None; 12];
    for face in FACES {
        for i in 0..4 {
            if is_inside(face[i]) || !is_inside(face[(i + 1) % 4]) {
                continue;
            }
            let entered = edge_between(face[i], face[(i + 1) % 4]);
            let mut last = i + 1;
            while is_inside(face[(last + 1) % 4]) {
                last += 1;
            }
            let left = edge_between(face[last % 4], face[(last + 1) % 4]);
            next[entered as usize] = Some(left);
        }
    }
    let mut loops = Vec::new();
    for start in 0..12 {
        let mut walk = Vec::new();
        let mut edge = start;
        while let Some(following) = next[edge as usize].take() {
            walk.push(edge);
            edge = following;
        }
        if !walk.is_empty() {
            loops.push(walk);
        }
    }
    loops
}

/// Cuts a polygon into triangles by diagonals none of which lies within a face of the cube.
fn cut(polygon: &[u8]) -> Option<Triangles> {
    if polygon.len() == 3 {
        return Some(vec![[polygon[0], polygon[1], polygon[2]]]);
    }
    for i in 0..polygon.len() {
        let [a, b, c] = [0, 1, 2].map(|k| polygon[(i + k) % polygon.len()]);
        if faces_of(a) & faces_of(c) != 0 {
            continue;
        }
        let rest: Vec<u8> = (polygon.iter().copied())
            .filter(|&edge| edge != b)
            .collect();
        if let Some(mut triangles) = cut(&rest) {
            triangles.push([a, b, c]);
            return Some(triangles);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loop_can_be_cut_and_every_crossed_edge_is_used() {
        for inside in 0..256 {
            let loops = loops(inside);
            let expected: usize = loops.iter().map(|one| one.len() - 2).sum();
            assert_eq!(triangles(inside).len(), expected, "{inside:08b}");
            let crossed = (0..12)
                .filter(|edge| {
                    let start = EDGE_STARTS[edge / 4][edge % 4];
                    (inside >> start ^ inside >> (start | 1 << (edge / 4))) & 1 == 1
                })
                .count();
            assert_eq!(
                loops.iter().map(Vec::len).sum::<usize>(),
                crossed,
                "{inside:08b}"
            );
        }
    }
}
