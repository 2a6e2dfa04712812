//! The judge: metrics of grasps in plain `f64`, none of which shares contact code with what they judge.
//!
//! # Examples
//! All metrics of a grasp, from two meshes in one frame:
//! ```
//! use graspd_eval::{EvaluationSettings, ObjectUnderTest, evaluate};
//! use graspd_geom::{TriangleMesh, box_mesh, capsule_mesh};
//! use nalgebra::{Isometry3, Vector3};
//!
//! let carton = box_mesh(Vector3::new(0.06, 0.08, 0.05), 0.08);
//! let object = ObjectUnderTest::new(&carton)?;
//! // Two fingers, each pressed 0.4 mm into a side of the carton, 6 cm wide.
//! let finger = capsule_mesh(0.01, 0.03, 0.002);
//! let mut hand = TriangleMesh::default();
//! for x in [-0.0396, 0.0396] {
//!     hand.append(&finger.transformed(&Isometry3::translation(x, 0.0, 0.0)));
//! }
//! let metrics = evaluate(&object, &hand, &EvaluationSettings::default())?;
//! assert!((metrics.max_penetration_mm.unwrap() - 0.4).abs() < 0.02);
//! assert!(metrics.sim_displacement_cm.unwrap() < 0.1);
//! # Ok::<(), graspd_eval::EvaluationError>(())
//! ```
//!
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
//! let epsilon = grasp_quality(&wrenches)?.epsilon;
//! assert!(epsilon.is_force_closure());
//! assert!((epsilon.value - 0.55).abs() < 0.01);
//!
//! // Two of them cannot resist a torque about the line through both.
//! assert_eq!(grasp_quality(&wrenches[..2 * FRICTION_EDGES])?.epsilon.value, 0.0);
//! # Ok::<(), graspd_eval::EvaluationError>(())
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
mod metric;
mod penetration;
mod polygon;
mod report;
#[cfg(test)]
mod report_tests;
mod self_penetration;
mod settings;
#[cfg(test)]
mod test_shapes;
mod voxels;
mod wrench_space;

pub use displacement::{
    ConvexPiece, DecompositionSettings, DisplacementSettings, DynamicObject, FixedHand,
    ObjectMotion, ObjectPieces, PhysicsEngine, SIX_DIRECTIONS, ShakeOutcome, ShakeSettings,
    SimulationAnswer, SimulationJob, SixDisplacements, convex_parts, shake, simulate,
    simulate_six_directions,
};
pub use error::EvaluationError;
pub use ferrari_canny::{
    Epsilon, EpsilonSettings, ForceLimit, GraspQuality, NotForceClosure, ferrari_canny,
    grasp_quality,
};
pub use hull::{
    ConvexHull, DepthBounds, DepthSearch, HullFacet, HullShape, HullVolume, OriginDepth,
    VolumeMethod, VolumeSettings, convex_hull, hull_volume, origin_depth,
};
pub use interpenetration::interpenetration_volume_cm3;
pub use metric::{HOLDS_BELOW_CM, METRICS, Metric, MetricGetter, MetricKind};
pub use report::{GraspMetrics, ObjectUnderTest, evaluate};
pub use self_penetration::SelfPenetration;
pub use settings::{EvaluationSettings, Metrics};
pub use wrench_space::{Contact, FRICTION_EDGES, FingerModel, grasp_wrenches, largest_radius};
