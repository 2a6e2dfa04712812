//! The shake test: whether the object stays in the fixed hand while a force pulls it, whichever way the force points.
//!
//! In the style of published benchmarks of dexterous grasps: an object of 100 g, friction 0.6, a force of its weight
//! along each of the six axis directions for two seconds, success if it stays within 5 cm and 30 degrees each time.
//! Theirs squeeze with a controlled hand; here, as for the displacement, the hand is fixed at its pose, so that the
//! test needs nothing but two meshes.
//!
//! Fewer solver iterations than the displacement's 150 do: whether an object stays for two seconds
//! depends on what holds it in the end, not on its first jolt.

use graspd_settings::{AT_LEAST_ONE, NOT_NEGATIVE, POSITIVE, Ranges, Validate, ranges};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bodies::{DynamicObject, FixedHand};
use super::engine::PhysicsEngine;
use super::protocol::{DisplacementSettings, SIX_DIRECTIONS, World};
use crate::EvaluationError;

/// A body whose points are all slower than this \[m/s\] ...
const REST_SPEED: f64 = 2e-3;
/// ... for so long \[s\] is at rest under its constant force, and stays there: even if it crept on at that speed for
/// the rest of two seconds, it would get 4 mm far.
const REST_TIME: f64 = 0.1;

/// The constants of the shake test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ShakeSettings {
    /// Mass of the object, whatever its volume \[kg\].
    pub mass: f64,
    /// Friction coefficient between hand and object.
    pub friction: f64,
    /// The force at the centre of mass, as the acceleration of the free object \[m/s^2\].
    pub acceleration: f64,
    /// How long each force acts \[s\]; shorter if the object is lost or has come to rest.
    pub duration: f64,
    /// Time step \[s\].
    pub time_step: f64,
    /// Solver iterations in each step.
    pub solver_iterations: usize,
    /// The object is lost once its centre of mass has moved farther than this \[m\] ...
    #[serde(alias = "most_displacement")]
    pub max_displacement: f64,
    /// ... or it has turned farther than this \[rad\].
    #[serde(alias = "most_rotation")]
    pub max_rotation: f64,
}

impl Default for ShakeSettings {
    fn default() -> Self {
        Self {
            mass: 0.1,
            friction: 0.6,
            acceleration: 9.8,
            duration: 2.0,
            time_step: 1.0 / 240.0,
            solver_iterations: 40,
            max_displacement: 0.05,
            max_rotation: std::f64::consts::PI / 6.0,
        }
    }
}

impl Validate for ShakeSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            mass: POSITIVE.unit("kg"),
            friction: NOT_NEGATIVE,
            acceleration: NOT_NEGATIVE.unit("m/s^2"),
            duration: POSITIVE.unit("s"),
            time_step: POSITIVE.unit("s"),
            solver_iterations: AT_LEAST_ONE.unit("iterations"),
            max_displacement: POSITIVE.unit("m"),
            max_rotation: POSITIVE.unit("rad"),
        }
    }
}

impl ShakeSettings {
    /// One of the six pulls as a protocol.
    pub(super) fn under(&self, direction: [f64; 3]) -> DisplacementSettings {
        DisplacementSettings {
            mass: self.mass,
            gravity: self.acceleration,
            gravity_direction: direction,
            time_step: self.time_step,
            steps: (self.duration / self.time_step).ceil() as usize,
            solver_iterations: self.solver_iterations,
            friction: self.friction,
            hand_restitution: 0.0,
            object_restitution: 0.0,
        }
    }
}

/// Which forces of a shake test the hand has withstood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShakeOutcome {
    /// Whether the object stayed, for forces along +x, -x, +y, -y, +z, -z of the object's frame.
    pub withstood: [bool; 6],
}

impl ShakeOutcome {
    /// How many of the six forces were withstood.
    pub fn count(&self) -> usize {
        self.withstood.iter().filter(|stayed| **stayed).count()
    }

    /// Whether all of them were.
    pub fn is_success(&self) -> bool {
        self.count() == self.withstood.len()
    }
}

/// Pulls the object along each of the six axis directions, one after another, each time from its pose at rest
/// (the identity), the hand fixed.
///
/// A simulation that diverges counts as an object lost. The six run in parallel where rayon's pool has threads to
/// spare; the result does not depend on it.
///
/// # Errors
/// A setting out of range, or an engine that this program was built without.
///
/// # Source
/// Mass, friction, six forces and their duration: DexGraspBench, the benchmark of J. Chen et al., "BODex: scalable and
/// efficient robotic dexterous grasp synthesis using bilevel optimization", ICRA 2025.
pub fn shake(
    object: &DynamicObject,
    hand: &FixedHand,
    settings: &ShakeSettings,
    engine: PhysicsEngine,
) -> Result<ShakeOutcome, EvaluationError> {
    settings.validate()?;
    let world = engine.world(object, hand, &settings.under(SIX_DIRECTIONS[0]))?;
    let mut withstood = [false; 6];
    SIX_DIRECTIONS
        .into_par_iter()
        .map(|direction| stays(&*world, settings, direction))
        .zip(withstood.par_iter_mut())
        .for_each(|(stays, withstood)| *withstood = stays);
    Ok(ShakeOutcome { withstood })
}

/// Whether the object stays while one force pulls.
fn stays(world: &dyn World, settings: &ShakeSettings, direction: [f64; 3]) -> bool {
    let mut simulation = world.release(direction);
    let mut quiet_since = 0;
    for step in 0..settings.under(direction).steps {
        if simulation.step().is_err() {
            return false;
        }
        let motion = simulation.motion();
        if motion.displacement_cm() > 100.0 * settings.max_displacement
            || motion.rotation > settings.max_rotation
        {
            return false;
        }
        if simulation.max_speed() > REST_SPEED {
            quiet_since = step + 1;
        } else if (step + 1 - quiet_since) as f64 * settings.time_step >= REST_TIME {
            return true;
        }
    }
    true
}
