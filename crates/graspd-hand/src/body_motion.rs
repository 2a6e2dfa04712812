//! How bodies move, and what the forces on them add up to.

use graspd_geom::{Rigid, Vec3};

use crate::Limit;

/// How bodies move with an articulation.
pub(crate) trait BodyMotion: Sync {
    /// Names the bodies.
    fn body_names(&self) -> &[String];
    /// Returns the limits of the articulation, `[n]`.
    fn limits(&self) -> &[Limit];
    /// Returns the body that `body` hangs on.
    fn parent(&self, body: usize) -> Option<usize>;
    /// Computes the bodies' frames in the base frame, `[bodies]`.
    fn body_poses(&self, articulation: &[f64]) -> Vec<Rigid<f64>>;
}

/// The bodies in one pose, and what the forces on their points add up to.
#[derive(Debug)]
pub(crate) struct BodyLoads {
    /// Pose of each body in the object frame.
    pub(crate) poses: Vec<Rigid<f64>>,
    /// Force on each body, object frame.
    pub(crate) forces: Vec<Vec3<f64>>,
    /// Torque on each body about its origin.
    pub(crate) torques: Vec<Vec3<f64>>,
}

impl BodyLoads {
    pub(crate) fn new(bodies: usize) -> Self {
        Self {
            poses: vec![Rigid::identity(); bodies],
            forces: vec![Vec3::zero(); bodies],
            torques: vec![Vec3::zero(); bodies],
        }
    }
}
