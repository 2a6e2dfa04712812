//! A convex polyhedron that finds its support points by climbing from vertex to vertex.
//!
//! The engine asks for support points millions of times a simulation, and its own polyhedron looks at every vertex
//! each time. Here a table over directions names a vertex near the answer, and the climb along the edges from there
//! ends after a few steps; on a convex body no vertex but the farthest has only lower neighbours.

use parry3d_f64::bounding_volume::{Aabb, BoundingSphere};
use parry3d_f64::mass_properties::MassProperties;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use parry3d_f64::shape::{
    ConvexPolyhedron, FeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, ShapeType,
    SupportMap, TypedShape,
};

/// Cells along each side of the cube of directions.
const CELLS: usize = 6;

/// A convex polyhedron with what the climb needs.
#[derive(Clone)]
pub(super) struct ClimbingPolyhedron {
    polyhedron: ConvexPolyhedron,
    /// The neighbours of vertex v are `neighbors[first[v]..first[v + 1]]`.
    neighbors: Vec<u32>,
    first: Vec<u32>,
    /// For the middle of each cell of directions, the support vertex.
    starts: Vec<u32>,
}

impl ClimbingPolyhedron {
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

    fn neighbors_of(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        &self.neighbors[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }
}

/// The cell of a direction: the face of the cube that it leaves by, and where on that face.
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
    // From NaN, of a direction without length, comes cell 0.
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

impl SupportMap for ClimbingPolyhedron {
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

impl PolygonalFeatureMap for ClimbingPolyhedron {
    fn local_support_feature(&self, direction: Vector, feature: &mut PolygonalFeature) {
        self.polyhedron.local_support_feature(direction, feature);
    }
}

impl PointQuery for ClimbingPolyhedron {
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        self.polyhedron.project_local_point(point, solid)
    }
    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        self.polyhedron.project_local_point_and_get_feature(point)
    }
}

impl RayCast for ClimbingPolyhedron {
    fn cast_local_ray_and_get_normal(
        &self,
        ray: &Ray,
        max_time_of_impact: f64,
        solid: bool,
    ) -> Option<RayIntersection> {
        self.polyhedron
            .cast_local_ray_and_get_normal(ray, max_time_of_impact, solid)
    }
}

impl Shape for ClimbingPolyhedron {
    fn compute_local_aabb(&self) -> Aabb {
        self.polyhedron.compute_local_aabb()
    }
    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        self.polyhedron.compute_local_bounding_sphere()
    }
    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }
    fn scale_dyn(&self, scale: Vector, _num_subdivisions: u32) -> Option<Box<dyn Shape>> {
        Some(Box::new(Self::new(self.polyhedron.clone().scaled(scale)?)))
    }
    fn compute_aabb(&self, position: &Pose) -> Aabb {
        let rotation = position.rotation;
        let reach = |axis: Vector| {
            let point = self.local_support_point(rotation.inverse() * axis);
            (rotation * point + position.translation).dot(axis)
        };
        let axes = [Vector::X, Vector::Y, Vector::Z];
        let high = Vector::from(axes.map(reach));
        let low = Vector::from(axes.map(|axis| -reach(-axis)));
        Aabb::new(low, high)
    }
    fn mass_properties(&self, density: f64) -> MassProperties {
        self.polyhedron.mass_properties(density)
    }
    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }
    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }
    fn ccd_thickness(&self) -> f64 {
        self.polyhedron.ccd_thickness()
    }
    fn ccd_angular_thickness(&self) -> f64 {
        self.polyhedron.ccd_angular_thickness()
    }
    fn is_convex(&self) -> bool {
        true
    }
    fn as_support_map(&self) -> Option<&dyn SupportMap> {
        Some(self)
    }
    fn as_polygonal_feature_map(&self) -> Option<(&dyn PolygonalFeatureMap, f64)> {
        Some((self, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            let climbing = ClimbingPolyhedron::new(plain.clone());
            let axes = [Vector::X, -Vector::X, Vector::Y, Vector::Z, Vector::ZERO];
            for direction in directions.into_iter().map(Vector::from).chain(axes) {
                let expected = plain.local_support_point(direction).dot(direction);
                let found = climbing.local_support_point(direction).dot(direction);
                // Vertices as high as each other but for rounding are as good as each other.
                prop_assert!((found - expected).abs() < 1e-14, "{} {}", found, expected);
            }
            let [a, b, c, x, y, z] = motion;
            let pose = Pose::new(Vector::new(a, b, c), Vector::new(x, y, z));
            let (expected, found) = (plain.compute_aabb(&pose), climbing.compute_aabb(&pose));
            prop_assert!((expected.mins - found.mins).length() < 1e-13);
            prop_assert!((expected.maxs - found.maxs).length() < 1e-13);
        }
    }
}
