//! Whether a fitted hand holds the object: what its contact forces could stop.

use graspd_geom::{SdfGrid, Vec3};
use graspd_hand::HandPose;
use graspd_sim::{ForceContact, ForceStep, SimulatedObject, SimulationParams, TargetForces, Twist};
use nalgebra::Vector3;

use crate::fit::{FittedHand, HandFitter};

/// Skin nearer to the object than this can press on it \[m\].
const TOUCHING: f64 = 5e-4;
/// Skin that faces the object by more than this can press on it.
const MIN_FACING: f64 = 0.3;
/// No more contacts than this are taken into account.
const MAX_CONTACTS: usize = 100;
/// rho of the rating, for each contact: little, so that a motion remains only where forces cannot stop it.
const RELAXATION: f64 = 0.01;
/// Part of the friction that is counted on in the rating: what holds with less holds when contacts are not quite where
/// they should be, or wet.
const FRICTION_MARGIN: f64 = 0.4;
/// Factor by which rho falls until the task is done, and how often.
const EASING: f64 = 1e-2;
const MAX_EASINGS: usize = 8;

impl HandFitter<'_> {
    /// Returns the contacts of a hand: skin that touches the object and faces it, with the forces of the contact law.
    ///
    /// `stiffness` \[N/m\]: k_n, for each point of the skin.
    pub fn contacts(
        &self,
        object: &SimulatedObject,
        pose: &HandPose,
        stiffness: f64,
    ) -> Vec<ForceContact<f64>> {
        let vertices = self.hand.surface(pose).vertices;
        let skin = &self.fine.skin;
        let contact = |number: usize| {
            let p = skin.position(&vertices, number);
            let (distance, gradient) = object.sdf().distance_and_gradient(p.into());
            let inward = -Vector3::from(gradient.normalize_or_zero());
            let touches =
                distance < TOUCHING && inward.dot(&skin.outward(&vertices, number)) > MIN_FACING;
            touches.then(|| ForceContact {
                lever: Vec3::from(p) - object.center_of_mass(),
                inward: inward.into(),
                force: Vec3::from(inward) * (stiffness * (-distance).max(0.0)),
            })
        };
        let all: Vec<_> = (0..skin.len()).filter_map(contact).collect();
        let step = all.len().div_ceil(MAX_CONTACTS).max(1);
        all.into_iter().step_by(step).collect()
    }

    /// Rates a fit, the least best: its cost, if that is a gain, less the part of it that is the motion which its
    /// contacts leave the object in the worst of twelve directions.
    ///
    /// `friction`: the coefficient of the contacts, of which a part is counted on.
    pub fn rating(&self, object: &SimulatedObject, fitted: &FittedHand, friction: f64) -> f64 {
        if !self.settings.task {
            return fitted.cost;
        }
        let contacts = self.contacts(object, &fitted.pose, 0.0);
        let motion = remaining_motion(&contacts, FRICTION_MARGIN * friction, size(object.sdf()));
        fitted.cost.min(0.0) * (1.0 - motion) + fitted.cost.max(0.0)
    }

    /// Solves the force step at a pose from each velocity of the task: rho falls until the task is done to
    /// `task_limit`, if the contacts can.
    pub fn force_step(
        &self,
        object: &SimulatedObject,
        simulation: &SimulationParams,
        pose: &HandPose,
        task_limit: f64,
    ) -> Vec<TargetForces> {
        let contacts = self.contacts(object, pose, simulation.contact.normal_stiffness);
        let friction = simulation.contact.friction_coefficient;
        let share = task_limit / simulation.velocities.len() as f64;
        let solved = |twist: &Twist<f64>| {
            // Of the order of the response to a force.
            let mut relaxation = (simulation.time_step / object.mass()).powi(2);
            let mut targets = None;
            for _ in 0..MAX_EASINGS {
                let step = ForceStep::new(object, simulation.time_step, friction, relaxation);
                let made: TargetForces = step.solve(&contacts, twist);
                relaxation *= EASING;
                let is_done = made.task <= share;
                targets = Some(made);
                if is_done {
                    break;
                }
            }
            targets
        };
        simulation.velocities.iter().filter_map(solved).collect()
    }
}

/// Computes the part of a motion that contacts leave an object, in the worst of twelve directions: along and about
/// each axis of the object frame, both ways. 0 if they stop each at no cost of force, 1 if there is one that they do
/// not stop at all.
///
/// `size` \[m\]: the lever at which turns count as much as shifts.
pub(crate) fn remaining_motion(contacts: &[ForceContact<f64>], friction: f64, size: f64) -> f64 {
    let relaxation = RELAXATION * contacts.len().max(1) as f64;
    let step = ForceStep::normalized(size, friction, relaxation);
    let directions = (0..12).map(|number| {
        let mut twist = [0.0; 6];
        twist[number / 2] = if number % 2 == 0 { 1.0 } else { -1.0 };
        let [x, y, z, a, b, c] = twist;
        let twist = Twist {
            linear: Vec3::new(x, y, z),
            angular: Vec3::new(a, b, c),
        };
        step.solve(contacts, &twist).task.sqrt()
    });
    directions.fold(0.0, f64::max)
}

/// Half the diagonal of the grid's box \[m\].
fn size(sdf: &SdfGrid) -> f64 {
    let (low, high) = sdf.bounds();
    0.5 * (high - low).norm()
}
