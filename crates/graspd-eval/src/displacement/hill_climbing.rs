//! Hill-climbing support mapping of a convex polyhedron.
//!
//! A table over directions names a vertex near the support point; from there the climb along edges
//! to ever higher neighbours ends after a few steps. On a convex polyhedron no vertex but the
//! highest has only lower neighbours.

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::shape::{ConvexPolyhedron, PolygonalFeature, PolygonalFeatureMap, SupportMap};

use super::sat::{FaceClusters, LANES, in_blocks, lesser};

/// Cells along each side of the cube of directions.
const CELLS: usize = 6;
/// Extents of polyhedra with more blocks of vertices are found by climbing.
const MAX_SCANNED_BLOCKS: usize = 24;

/// A convex polyhedron with vertex adjacency, start vertices and clustered faces.
#[derive(Clone)]
pub(super) struct HillClimbingPolyhedron {
    polyhedron: ConvexPolyhedron,
    /// The neighbours of vertex v are `neighbors[first[v]..first[v + 1]]`.
    neighbors: Vec<u32>,
    first: Vec<u32>,
    /// For the middle of each cell of directions, the support vertex.
    starts: Vec<u32>,
    bounds: Aabb,
    /// Coordinates of the vertices, padded with copies of the first.
    corners: Vec<[[f64; LANES]; 3]>,
    pub(super) faces: FaceClusters,
}

impl HillClimbingPolyhedron {
    pub(super) fn new(polyhedron: ConvexPolyhedron) -> Self {
        let (vertices, faces) = polyhedron.to_trimesh();
        let mut edges: Vec<[u32; 2]> = (faces.iter())
            .flat_map(|&[a, b, c]| [[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let first = (0..=vertices.len() as u32)
            .map(|vertex| edges.partition_point(|edge| edge[0] < vertex) as u32)
            .collect();
        let mut shape = Self {
            polyhedron,
            neighbors: edges.iter().map(|edge| edge[1]).collect(),
            first,
            starts: Vec::new(),
            bounds: Aabb::from_points(vertices.iter().copied()),
            corners: {
                let rows: Vec<_> = vertices.iter().map(|p| p.to_array()).collect();
                in_blocks(&rows, rows[0])
            },
            faces: FaceClusters::new(&vertices, &faces),
        };
        // A vertex within a face has no edges, and from there no climb could start.
        let corners: Vec<u32> = (0..vertices.len() as u32)
            .filter(|&vertex| !shape.neighbors_of(vertex).is_empty())
            .collect();
        shape.starts = (0..6 * CELLS * CELLS)
            .map(|cell| {
                let direction = cell_middle(cell);
                let height = |vertex: &u32| vertices[*vertex as usize].dot(direction);
                let highest = corners
                    .iter()
                    .max_by(|a, b| height(a).total_cmp(&height(b)));
                highest.copied().unwrap_or(0)
            })
            .collect();
        shape
    }

    /// Returns the gap between the bounding boxes of three points and of the polyhedron; negative where they overlap.
    pub(super) fn gap_to_box(&self, points: &[Vector; 3]) -> f64 {
        let [a, b, c] = *points;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let gap = (low - self.bounds.maxs).max(self.bounds.mins - high);
        gap.max_element()
    }

    /// Returns the underlying polyhedron.
    #[cfg(any(test, feature = "rapier"))]
    pub(super) fn polyhedron(&self) -> &ConvexPolyhedron {
        &self.polyhedron
    }

    /// Returns the bounding box in its own frame.
    pub(super) fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Returns the bounding box at a pose.
    pub(super) fn bounds_at(&self, pose: &Pose) -> Aabb {
        let extents = [Vector::X, Vector::Y, Vector::Z]
            .map(|axis| self.extent_along(pose.rotation.inverse() * axis));
        let low = Vector::from(extents.map(|(low, _)| low));
        let high = Vector::from(extents.map(|(_, high)| high));
        Aabb::new(low + pose.translation, high + pose.translation)
    }

    /// Returns the least and the largest projection of its points onto a direction.
    pub(super) fn extent_along(&self, direction: Vector) -> (f64, f64) {
        if self.corners.len() > MAX_SCANNED_BLOCKS {
            let [low, high] = [-direction, direction].map(|to| self.local_support_point(to));
            return (low.dot(direction), high.dot(direction));
        }
        let [x, y, z] = direction.to_array();
        let (mut low, mut high) = ([f64::MAX; LANES], [f64::MAX; LANES]);
        for block in &self.corners {
            for i in 0..LANES {
                let height = block[0][i] * x + block[1][i] * y + block[2][i] * z;
                low[i] = lesser(height, low[i]);
                high[i] = lesser(-height, high[i]);
            }
        }
        (
            low.into_iter().fold(f64::MAX, lesser),
            -high.into_iter().fold(f64::MAX, lesser),
        )
    }

    fn neighbors_of(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        &self.neighbors[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }
}

/// Returns the cell of a direction: the face of the cube that it leaves by, and where on that face.
fn cell_of(direction: Vector) -> usize {
    let d = direction.to_array();
    let size = d.map(f64::abs);
    let axis = if size[0] >= size[1] && size[0] >= size[2] {
        0
    } else if size[1] >= size[2] {
        1
    } else {
        2
    };
    let scale = 0.5 * CELLS as f64 / size[axis];
    // A zero direction gives NaN, which casts to cell 0.
    let along =
        |k: usize| ((d[(axis + k) % 3] * scale + 0.5 * CELLS as f64) as usize).min(CELLS - 1);
    let face = 2 * axis + usize::from(d[axis] < 0.0);
    (face * CELLS + along(1)) * CELLS + along(2)
}

fn cell_middle(cell: usize) -> Vector {
    let (face, u, v) = (cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS);
    let middle = |i: usize| (2 * i + 1) as f64 / CELLS as f64 - 1.0;
    let axis = face / 2;
    let mut direction = [0.0; 3];
    direction[axis] = if face % 2 == 0 { 1.0 } else { -1.0 };
    direction[(axis + 1) % 3] = middle(u);
    direction[(axis + 2) % 3] = middle(v);
    Vector::from(direction)
}

impl SupportMap for HillClimbingPolyhedron {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let points = self.polyhedron.points();
        let mut best = self.starts[cell_of(direction)];
        let mut height = points[best as usize].dot(direction);
        loop {
            let from = best;
            for &next in self.neighbors_of(from) {
                let other = points[next as usize].dot(direction);
                if other > height {
                    (best, height) = (next, other);
                }
            }
            if best == from {
                return points[best as usize];
            }
        }
    }
}

impl PolygonalFeatureMap for HillClimbingPolyhedron {
    fn local_support_feature(&self, direction: Vector, feature: &mut PolygonalFeature) {
        self.polyhedron.local_support_feature(direction, feature);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::shape::Shape;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn climbs_end_where_a_look_at_every_vertex_does(
            points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 8..80),
            directions in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 40),
            motion in prop::array::uniform6(-1.0f64..1.0),
        ) {
            let points: Vec<_> = points.into_iter().map(Vector::from).collect();
            let Some(plain) = ConvexPolyhedron::from_convex_hull(&points) else { return Ok(()); };
            let climbing = HillClimbingPolyhedron::new(plain.clone());
            let axes = [Vector::X, -Vector::X, Vector::Y, Vector::Z, Vector::ZERO];
            for direction in directions.into_iter().map(Vector::from).chain(axes) {
                let expected = plain.local_support_point(direction).dot(direction);
                let found = climbing.local_support_point(direction).dot(direction);
                // Vertices as high as each other but for rounding are as good as each other.
                prop_assert!((found - expected).abs() < 1e-14, "{} {}", found, expected);
            }
            let [a, b, c, x, y, z] = motion;
            let pose = Pose::new(Vector::new(a, b, c), Vector::new(x, y, z));
            let (expected, found) = (plain.compute_aabb(&pose), climbing.bounds_at(&pose));
            prop_assert!((expected.mins - found.mins).length() < 1e-13);
            prop_assert!((expected.maxs - found.maxs).length() < 1e-13);
        }
    }
}
