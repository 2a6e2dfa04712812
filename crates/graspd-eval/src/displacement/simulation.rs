//! The displacement: an object of convex pieces, released beside a fixed hand.
//!
//! What is chosen here, beyond the protocol, for every engine inside this program:
//! * The hand is one fixed triangle mesh. Contact normals are kept within the cone of the
//!   neighbouring faces' normals, so that neither edges between its triangles nor cuts between the
//!   object's pieces deflect the object.
//! * Contacts are soft constraints. Grasps press into the object by up to a millimetre, and
//!   opposite contacts cannot both be freed: stiffness then decides how hard they squeeze. The
//!   constants are rapier's for contacts with a fixed body (60 Hz, ten times critical damping: 142
//!   N per mm of penetration for 1 kg), which resolve a penetration within about 50 ms and add no
//!   energy.
//! * Lengths that rapier tunes for objects of metres are scaled to objects of decimetres.
//! * Friction acts at each contact point (Coulomb), not once per manifold.
//! * Contacts are predicted over 3 mm, and an object in free fall moves 6 mm in its fastest step:
//!   nothing thicker than 3 mm tunnels. There is no continuous collision detection; a thin shell
//!   may pass a finger, but only once it has fallen 2.5 cm and counts as lost.

use graspd_settings::Validate;
use rayon::prelude::*;

use super::bodies::{DynamicObject, FixedHand};
use super::engine::PhysicsEngine;
use super::protocol::{DisplacementSettings, ObjectMotion, SIX_DIRECTIONS, SixDisplacements};
use crate::EvaluationError;

/// Releases the object at its pose (the identity) under gravity, the hand fixed, and returns its motion.
///
/// The same input gives the same bits: everything runs on the calling thread.
///
/// # Errors
/// A setting out of range, an engine that this program was built without, or [`EvaluationError::Diverged`].
pub fn simulate(
    object: &DynamicObject,
    hand: &FixedHand,
    settings: &DisplacementSettings,
    engine: PhysicsEngine,
) -> Result<ObjectMotion, EvaluationError> {
    settings.validate()?;
    let world = engine.world(object, hand, settings)?;
    world.simulate(settings.gravity_direction, settings.steps)
}

/// [`simulate`] under gravity along each axis of the object's frame, whatever `settings.gravity_direction` says.
///
/// The six run in parallel where rayon's pool has threads to spare; the result does not depend on it.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_six_directions(
    object: &DynamicObject,
    hand: &FixedHand,
    settings: &DisplacementSettings,
    engine: PhysicsEngine,
) -> Result<SixDisplacements, EvaluationError> {
    let settings = DisplacementSettings {
        gravity_direction: SIX_DIRECTIONS[0],
        ..settings.clone()
    };
    settings.validate()?;
    let world = engine.world(object, hand, &settings)?;
    let results: Vec<_> = SIX_DIRECTIONS
        .into_par_iter()
        .map(|direction| {
            let motion = world.simulate(direction, settings.steps);
            motion.map(|motion| motion.displacement_cm())
        })
        .collect();
    let mut per_direction_cm = [0.0; 6];
    for (displacement, result) in per_direction_cm.iter_mut().zip(results) {
        *displacement = result?;
    }
    Ok(SixDisplacements {
        per_direction_cm,
        mean_cm: per_direction_cm.iter().sum::<f64>() / 6.0,
    })
}
