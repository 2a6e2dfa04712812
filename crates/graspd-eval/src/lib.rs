//! The judge: metrics of grasps in plain `f64`, none of which shares contact code with what they judge.
//!
//! # Example
//! Four contacts on a sphere of radius 3 cm, as a tetrahedron, hold it against any disturbance:
//! ```
//! use graspd_eval::{Contact, FRICTION_EDGES, grasp_quality, grasp_wrenches};
//! use nalgebra::{Point3, Vector3};
//!
//! let radius = 0.03;
//! let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
//! let contacts = corners.map(|corner| {
//!     let outward = Vector3::from(corner).normalize();
//!     Contact { point: Point3::from(outward * radius), normal: -outward }
//! });
//! let wrenches = grasp_wrenches(&contacts, 0.8, FRICTION_EDGES, Point3::origin(), radius);
//! let quality = grasp_quality(&wrenches);
//! assert!(quality.force_closure);
//! assert!((quality.epsilon - 0.55).abs() < 0.01);
//!
//! // Two of them cannot resist a torque about the line through both.
//! assert_eq!(grasp_quality(&wrenches[..2 * FRICTION_EDGES]).epsilon, 0.0);
//! ```

mod contact_area;
#[cfg(test)]
mod contact_tests;
mod contacts;
mod displacement;
mod error;
mod ferrari_canny;
mod hull;
mod interpenetration;
mod penetration;
mod polygon;
mod reduction;
mod report;
#[cfg(test)]
mod report_tests;
mod settings;
#[cfg(test)]
mod test_shapes;
mod voxels;
mod wrench_space;

pub use displacement::{
    ConvexPiece, DecompositionSettings, DisplacementSettings, DynamicObject, FixedHand,
    ObjectMotion, ObjectPieces, SIX_DIRECTIONS, SixDisplacements, simulate,
    simulate_six_directions,
};
pub use error::EvaluationError;
pub use ferrari_canny::{GraspQuality, NotForceClosure, epsilon_bounds, grasp_quality};
pub use hull::{
    ConvexHull, DepthBounds, HullFacet, HullShape, MOST_FACETS, convex_hull, convex_hull_limited,
    origin_depth_bounds,
};
pub use interpenetration::interpenetration_volume_cm3;
pub use reduction::reduce_contacts;
pub use report::{GraspMetrics, ObjectUnderTest, evaluate};
pub use settings::{EvaluationSettings, Metrics};
pub use wrench_space::{Contact, FRICTION_EDGES, grasp_wrenches, largest_radius};
