//! The faces and edges of a convex polyhedron, in clusters.
//!
//! A piece may have thousands of faces, but a triangle overlaps it somewhere: faces are kept in clusters of similar normals, with a box
//! about each cluster's normals, and edges in clusters and boxes in space.

use parry3d_f64::math::Vector;

/// Numbers that are worked on together.
pub(super) const LANES: usize = 4;
/// Blocks of sides or edges in a cluster.
pub(super) const BLOCKS: usize = 4;
/// Of a piece with more blocks of edges only those near a triangle can be looked at.
const MOST_EDGES: usize = 48;
/// A vertex of a convex surface is at most so far beyond a side, by rounding \[m\].
const MOST_DENT: f64 = 1e-5;
/// Cosine of the angle between the normals of triangles of one side.
const SAME_SIDE: f64 = 1.0 - 1e-12;

pub(super) type Lanes = [f64; LANES];

/// In blocks, the last one filled up.
pub(super) fn in_blocks<const K: usize>(rows: &[[f64; K]], filling: [f64; K]) -> Vec<[Lanes; K]> {
    (rows.chunks(LANES))
        .map(|chunk| {
            std::array::from_fn(|k| std::array::from_fn(|i| chunk.get(i).unwrap_or(&filling)[k]))
        })
        .collect()
}

/// The smaller; without the care for NaN that keeps processors from doing several at once.
#[inline(always)]
pub(super) fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// A side: its outward unit normal, its height along it, of its own first corner and of any, and the middle of its corners.
struct Side {
    normal: Vector,
    own_height: f64,
    height: f64,
    middle: Vector,
}

/// Sides and edges in clusters.
#[derive(Clone, Default)]
pub(super) struct Sides {
    /// Outward unit normals and heights: [`BLOCKS`] for each cluster, padded with sides at an endless height.
    pub(super) sides: Vec<[Lanes; 4]>,
    /// Of each cluster: the least and the largest components of its normals, a point of the polyhedron, and the least by which the
    /// planes of these normals are beyond the point.
    pub(super) bounds: Vec<[Lanes; 10]>,
    /// Starts and both normals: [`BLOCKS`] for each cluster, padded with edges between sides of one normal.
    pub(super) edges: Vec<[Lanes; 9]>,
    /// The least and the largest coordinates of each, padded with endlessly far ones ...
    pub(super) edge_boxes: Vec<[Lanes; 6]>,
    /// ... and of each cluster.
    pub(super) cluster_boxes: Vec<[Lanes; 6]>,
}

impl Sides {
    /// Of a closed convex surface; triangles of one plane are one side. Of a surface that is not convex nothing is known: a few of the
    /// library's hulls have a sliver with any normal.
    pub(super) fn new(vertices: &[Vector], faces: &[[u32; 3]]) -> Self {
        let in_cluster = BLOCKS * LANES;
        let (sides, side_of) = find_sides(vertices, faces);
        if sides
            .iter()
            .any(|side| side.height - side.own_height > MOST_DENT)
        {
            return Self::default();
        }
        let mut order: Vec<usize> = (0..sides.len()).collect();
        sort_into_clusters(&mut order, &|side| sides[side].normal);
        let mut rows: Vec<[f64; 4]> = (order.iter().map(|side| &sides[*side]))
            .map(|side| [side.normal.x, side.normal.y, side.normal.z, side.height])
            .collect();
        let clusters = order.len().div_ceil(in_cluster);
        let endless = [0.0, 0.0, 0.0, f64::MAX];
        rows.resize(clusters * in_cluster, endless);
        let bounds: Vec<_> = (order.chunks(in_cluster))
            .map(|members| bounds_of(members, &sides))
            .collect();
        let mut never = [0.0; 10];
        never[9] = f64::MAX;

        let edges = find_edges(vertices, faces, &side_of);
        let mut order: Vec<usize> = (0..edges.len()).collect();
        sort_into_clusters(&mut order, &|edge| edges[edge].0[0] + edges[edge].0[1]);
        let (mut starts, mut boxes, mut cluster_boxes) = (vec![], vec![], vec![]);
        for members in order.chunks(in_cluster) {
            let mut about = [Vector::MAX, Vector::MIN];
            for edge in members {
                let ([a, b], of_edge) = edges[*edge];
                let [one, other] = of_edge.map(|side| sides[side].normal);
                starts.push(joined([a, one, other]));
                boxes.push(joined([a.min(b), a.max(b)]));
                about = [about[0].min(a).min(b), about[1].max(a).max(b)];
            }
            cluster_boxes.push(joined(about));
        }
        let clusters = order.len().div_ceil(in_cluster);
        starts.resize(clusters * in_cluster, [0.0; 9]);
        boxes.resize(clusters * in_cluster, [f64::MAX; 6]);
        Self {
            sides: in_blocks(&rows, endless),
            bounds: in_blocks(&bounds, never),
            edges: in_blocks(&starts, [0.0; 9]),
            edge_boxes: in_blocks(&boxes, [f64::MAX; 6]),
            cluster_boxes: in_blocks(&cluster_boxes, [f64::MAX; 6]),
        }
    }

    /// Whether nothing is known of the surface.
    pub(super) fn are_unknown(&self) -> bool {
        self.sides.is_empty()
    }

    /// Whether there are so few edges that all can be looked at.
    pub(super) fn has_few_edges(&self) -> bool {
        self.edges.len() <= MOST_EDGES
    }
}

/// The components of vectors, one after another.
fn joined<const N: usize, const M: usize>(vectors: [Vector; N]) -> [f64; M] {
    std::array::from_fn(|k| vectors[k / 3].to_array()[k % 3])
}

/// The sides of a surface, and of each triangle its side; `None` of those without a normal.
fn find_sides(vertices: &[Vector], faces: &[[u32; 3]]) -> (Vec<Side>, Vec<Option<usize>>) {
    let mut sides: Vec<Side> = Vec::new();
    let mut counts: Vec<f64> = Vec::new();
    let side_of = (faces.iter())
        .map(|face| {
            let [a, b, c] = face.map(|vertex| vertices[vertex as usize]);
            let normal = (b - a).cross(c - a).try_normalize()?;
            let known = (sides.iter()).position(|side| side.normal.dot(normal) > SAME_SIDE);
            let side = known.unwrap_or_else(|| {
                // As far out as any vertex, so that rounding leaves none beyond.
                let heights = vertices.iter().map(|vertex| vertex.dot(normal));
                sides.push(Side {
                    normal,
                    own_height: a.dot(normal),
                    height: heights.fold(f64::MIN, f64::max),
                    middle: Vector::ZERO,
                });
                counts.push(0.0);
                sides.len() - 1
            });
            sides[side].middle += (a + b + c) / 3.0;
            counts[side] += 1.0;
            Some(side)
        })
        .collect();
    for (side, count) in sides.iter_mut().zip(counts) {
        side.middle /= count;
    }
    (sides, side_of)
}

/// The ends of each edge, and between which sides it is.
fn find_edges(
    vertices: &[Vector],
    faces: &[[u32; 3]],
    side_of: &[Option<usize>],
) -> Vec<([Vector; 2], [usize; 2])> {
    let mut beside: Vec<([u32; 2], usize)> = (faces.iter().enumerate())
        .flat_map(|(face, &[a, b, c])| {
            [[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], face))
        })
        .collect();
    beside.sort_unstable();
    (beside.chunk_by(|a, b| a.0 == b.0))
        .filter_map(|pair| {
            let &[(ends, one), (_, other)] = pair else {
                return None;
            };
            let sides = [side_of[one]?, side_of[other]?];
            let ends = ends.map(|vertex| vertices[vertex as usize]);
            (sides[0] != sides[1]).then_some((ends, sides))
        })
        .collect()
}

/// Sorts so that each run of a cluster's size is of similar keys.
fn sort_into_clusters(order: &mut [usize], key: &impl Fn(usize) -> Vector) {
    let in_cluster = BLOCKS * LANES;
    if order.len() <= in_cluster {
        return;
    }
    let keys = order.iter().map(|item| key(*item));
    let (low, high) = keys.fold((Vector::MAX, Vector::MIN), |(low, high), key| {
        (low.min(key), high.max(key))
    });
    let axis = (high - low).max_position();
    order.sort_by(|a, b| key(*a)[axis].total_cmp(&key(*b)[axis]));
    let half = order.len().div_ceil(2 * in_cluster) * in_cluster;
    let (one, other) = order.split_at_mut(half);
    sort_into_clusters(one, key);
    sort_into_clusters(other, key);
}

/// What bounds the ways along the normals of a cluster.
fn bounds_of(members: &[usize], sides: &[Side]) -> [f64; 10] {
    let members = members.iter().map(|side| &sides[*side]);
    let place = members.clone().map(|side| side.middle).sum::<Vector>() / members.len() as f64;
    let (mut low, mut high, mut beyond) = (Vector::MAX, Vector::MIN, f64::MAX);
    for side in members {
        (low, high) = (low.min(side.normal), high.max(side.normal));
        beyond = beyond.min(side.height - side.normal.dot(place));
    }
    let [[a, b, c], [d, e, f], [g, h, i]] = [low, high, place].map(|vector| vector.to_array());
    [a, b, c, d, e, f, g, h, i, beyond]
}
