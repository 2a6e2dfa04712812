//! Force closure of a few contacts, by which the annealing planner ranks its grasps.

use graspd_eval::{Contact, EpsilonSettings, FingerModel, ferrari_canny};
use nalgebra::Point3;

use crate::GraspError;
use crate::object::GraspObject;

/// Computes Ferrari and Canny's epsilon (L1) over every k-th contact, such that at most
/// `max_contacts` are taken; 0 for fewer than two, and where forces that only push cannot hold the
/// object. `edges`: those of the friction pyramids.
///
/// Torques are about the object's centre of mass, divided by its largest radius about it, as the judge has them.
///
/// # Errors
/// If epsilon cannot be computed.
pub(crate) fn epsilon_of_some(
    contacts: Vec<Contact>,
    max_contacts: usize,
    friction: f64,
    edges: usize,
    object: &GraspObject,
) -> Result<f64, GraspError> {
    let step = contacts.len().div_ceil(max_contacts).max(1);
    let contacts: Vec<Contact> = contacts.into_iter().step_by(step).collect();
    if contacts.len() < 2 {
        return Ok(0.0);
    }
    let center = Point3::from(object.simulated.center_of_mass());
    let scale = graspd_eval::largest_radius(&object.source.mesh.vertices, center);
    let wrenches = FingerModel::hard(friction, edges).wrenches(&contacts, center, scale);
    Ok(ferrari_canny(&wrenches, &EpsilonSettings::sum())?.value)
}
