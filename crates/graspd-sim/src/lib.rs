//! Differentiable contact between a hand and an object, and the losses of a grasp.
//!
//! A hand presses its palm a millimetre into a ball. How far are the contact forces from the wanted ones (here: none),
//! and how does that change with the hand's pose?
//!
//! ```
//! use graspd_geom::{Quaternion, SdfGrid, Vec3};
//! use graspd_hand::{Hand, HandOptions, HandPose, PoseGradient, allegro};
//! use graspd_sim::{Scene, SimulatedObject, SimulationParams};
//! use nalgebra::{Matrix3, Point3};
//!
//! // 4 cm in radius, sampled every 4 mm; of the density of water.
//! let corner = Vec3::new(-0.06, -0.06, -0.06);
//! let spacing = Vec3::new(0.004, 0.004, 0.004);
//! let sdf = SdfGrid::from_function(corner, spacing, [31; 3], |p| p.norm() - 0.04)?;
//! let inertia = Matrix3::from_diagonal_element(1.7e-4);
//! let ball = SimulatedObject::new(sdf, 0.268, Point3::origin(), inertia)?;
//!
//! // The palm faces along x.
//! let options = HandOptions { contact_points: 500, collision_spheres: 0, ..HandOptions::default() };
//! let hand = allegro(&options)?;
//! let pose = HandPose {
//!     translation: Vec3::new(-0.039, 0.0, 0.0) - hand.palm().center.into(),
//!     rotation: Quaternion::identity(),
//!     articulation: hand.open_articulation().to_vec(),
//! };
//!
//! let params = SimulationParams::default();
//! graspd_settings::Validate::validate(&params)?;
//! let mut scene = Scene::<f32>::new(&hand, &ball, &params);
//! scene.place(&pose);
//! let loss = scene.physics_loss(&vec![0.0; scene.wrench_len()]);
//! let mut gradient = PoseGradient::zero(pose.articulation.len());
//! scene.pull_back(&pose, &mut gradient);
//! assert!(loss > 0.0 && gradient.translation.x > 0.0); // Deeper in, the forces grow.
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! From small to large:
//! * [`ContactState`]: the contact law at one point, over any scalar: penalty force, friction, and the leaky gradient.
//! * [`SimulatedObject`] and [`step_twist`]: one time step of a rigid body under wrenches.
//! * [`task_loss`], [`range_loss`], [`limit_loss`] and [`sphere_overlap`]: what a grasp should make small.
//! * [`ForceStep`]: the target forces of given contacts, in their friction cones, exactly.
//! * [`Scene`]: all contacts of a hand at an object, their losses and the gradients by pose and by target wrenches.
//!
//! Everything is in SI units and in the object's frame, in which the object rests; wrenches act on the object, with
//! torques about its centre of mass. An optimisation alternates between two steps:
//!
//! 1. target wrenches: [`Scene::place`], [`Scene::contact_wrenches`], [`Scene::task`], [`Scene::target_gradient`];
//! 2. pose: [`Scene::place`], [`Scene::physics_loss`], [`Scene::intersection_loss`], [`Scene::pull_back`].
//!
//! Where both steps start from one pose, [`Scene::move_targets`] does the work of both in one pass over the contacts.
//!
//! # Source
//! Grasp'D: Differentiable Contact-rich Grasp Synthesis for Multi-fingered Hands (Turpin et al., ECCV 2022).

mod contact;
mod error;
mod force_step;
mod fused;
mod kernel;
mod losses;
mod object;
mod params;
mod scene;
mod step;
mod targets;

pub use contact::ContactState;
pub use error::SimulationError;
pub use force_step::{ForceContact, ForceStep, TargetForces};
pub use fused::{ForceWeights, TargetRule};
pub use kernel::Precision;
pub use losses::{
    intersection_loss_gradient, limit_loss, limit_loss_gradient, range_loss, range_loss_gradient,
    sphere_overlap,
};
pub use object::SimulatedObject;
pub use params::{ContactParams, SimulationParams, Twist, Wrench};
pub use scene::{Scene, TaskOutcome};
pub use step::{step_twist, task_loss};
pub use targets::TargetWrenches;
