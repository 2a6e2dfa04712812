//! Pieces as shapes of the engine: for the comparison with it only.

use parry3d_f64::bounding_volume::{Aabb, BoundingSphere};
use parry3d_f64::mass_properties::MassProperties;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use parry3d_f64::shape::{
    FeatureId, PolygonalFeatureMap, Shape, ShapeType, SupportMap, TypedShape,
};

use super::climbing::ClimbingPolyhedron;

impl PointQuery for ClimbingPolyhedron {
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        self.polyhedron().project_local_point(point, solid)
    }
    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        self.polyhedron().project_local_point_and_get_feature(point)
    }
}

impl RayCast for ClimbingPolyhedron {
    fn cast_local_ray_and_get_normal(
        &self,
        ray: &Ray,
        max_time_of_impact: f64,
        solid: bool,
    ) -> Option<RayIntersection> {
        self.polyhedron()
            .cast_local_ray_and_get_normal(ray, max_time_of_impact, solid)
    }
}

impl Shape for ClimbingPolyhedron {
    fn compute_local_aabb(&self) -> Aabb {
        self.polyhedron().compute_local_aabb()
    }
    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        self.polyhedron().compute_local_bounding_sphere()
    }
    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }
    fn scale_dyn(&self, scale: Vector, _num_subdivisions: u32) -> Option<Box<dyn Shape>> {
        Some(Box::new(Self::new(
            self.polyhedron().clone().scaled(scale)?,
        )))
    }
    fn compute_aabb(&self, position: &Pose) -> Aabb {
        self.bounds_at(position)
    }
    fn mass_properties(&self, density: f64) -> MassProperties {
        self.polyhedron().mass_properties(density)
    }
    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }
    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }
    fn ccd_thickness(&self) -> f64 {
        self.polyhedron().ccd_thickness()
    }
    fn ccd_angular_thickness(&self) -> f64 {
        self.polyhedron().ccd_angular_thickness()
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
