//! Time stepping of the built-in solver: a free object beside a fixed hand.

use std::sync::Arc;

use nalgebra::Vector3;
use parry3d_f64::math::Vector;

use super::bodies::{DynamicObject, FixedHand};
use super::narrow_phase::{HandSurface, NarrowPhaseScratch, PieceContacts};
use super::protocol::{DisplacementSettings, ObjectMotion, Simulation, World};
use super::rigid_body::RigidBody;
use super::solver::{Solver, StepSettings};
use crate::EvaluationError;

/// The protocol's solver iterations are spread over this many substeps of each step. One substep is too few: grasps
/// that press deep are thrown out. 150 substeps of one iteration tell held from lost grasps in the same way and move
/// held objects by at most 0.6 mm less, at twice the time.
pub(super) const SUBSTEPS: usize = 10;
/// Contacts are predicted this far ahead \[m\] while the object moves slowly ...
pub(super) const MIN_PREDICTION: f64 = 0.5e-3;
/// ... and over this many steps of its fastest point when it moves faster ...
pub(super) const PREDICTED_STEPS: f64 = 1.5;
/// ... up to this \[m\]: beyond it, what the object hits is found inside it by a few millimetres and pushed out.
pub(super) const MAX_PREDICTION: f64 = 3e-3;

/// The state from which all simulations under one protocol begin, whichever way gravity pulls.
///
/// The first narrow phase is the costliest; where the hand holds the object, hardly any pair is tested again.
#[derive(Clone)]
pub(super) struct ContactWorld {
    hand: Arc<HandSurface>,
    body: RigidBody,
    pieces: Vec<PieceContacts>,
    settings: StepSettings,
    /// Gravitational acceleration \[m/s^2\].
    gravity: f64,
    /// The object's centre of mass at first \[m\].
    center: Vector,
    /// Largest distance of a vertex from it \[m\].
    radius: f64,
}

impl ContactWorld {
    /// Places the object at the identity and finds its contacts; `settings` are valid.
    pub(super) fn new(
        object: &DynamicObject,
        hand: &FixedHand,
        settings: &DisplacementSettings,
    ) -> Self {
        let body = RigidBody::at_rest(object.center_of_mass, &object.unit_inertia);
        let substeps = SUBSTEPS.min(settings.solver_iterations);
        let mut scratch = NarrowPhaseScratch::default();
        let pieces = object.pieces.iter().map(|piece| {
            let mut contacts = PieceContacts::new(piece.clone(), &hand.surface);
            let lengths = [0.0, MIN_PREDICTION, 0.0];
            contacts.update(&hand.surface, &body, lengths, &mut scratch);
            contacts
        });
        Self {
            hand: hand.surface.clone(),
            center: body.center,
            pieces: pieces.collect(),
            body,
            settings: StepSettings {
                step: settings.time_step,
                substeps,
                iterations: settings.solver_iterations.div_ceil(substeps),
                friction: settings.friction,
                restitution: settings.hand_restitution * settings.object_restitution,
            },
            gravity: settings.gravity,
            radius: object.radius,
        }
    }
}

impl World for ContactWorld {
    fn release(&self, direction: [f64; 3]) -> Box<dyn Simulation> {
        let gravity = Vector3::from(direction).normalize() * self.gravity;
        Box::new(ContactSimulation {
            world: self.clone(),
            gravity: Vector::from(<[f64; 3]>::from(gravity)),
            travel: 0.0,
            steps_taken: 0,
            solver: Solver::default(),
            scratch: NarrowPhaseScratch::default(),
            active: Vec::new(),
        })
    }
}

/// An object released beside a fixed hand.
struct ContactSimulation {
    world: ContactWorld,
    gravity: Vector,
    /// Upper bound on the path length of any point of the object so far \[m\].
    travel: f64,
    steps_taken: usize,
    solver: Solver,
    scratch: NarrowPhaseScratch,
    /// Piece and manifold of those with points to solve: by piece, and by manifold within a piece.
    active: Vec<[usize; 2]>,
}

impl ContactSimulation {
    /// Updates the contact manifolds at the present pose.
    fn find_contacts(&mut self) {
        let ContactWorld {
            hand,
            body,
            pieces,
            settings,
            radius,
            ..
        } = &mut self.world;
        let speed = body.velocity.max_speed(*radius);
        let prediction =
            (PREDICTED_STEPS * speed * settings.step).clamp(MIN_PREDICTION, MAX_PREDICTION);
        let lengths = [self.travel, prediction, settings.step];
        self.active.clear();
        for (index, piece) in pieces.iter_mut().enumerate() {
            piece.update(hand, body, lengths, &mut self.scratch);
            let manifolds = piece.manifolds.iter().enumerate();
            let active = manifolds.filter(|(_, manifold)| manifold.is_active());
            self.active
                .extend(active.map(|(manifold, _)| [index, manifold]));
        }
    }

    /// Moves the object by one step under the active manifolds.
    fn solve_contacts(&mut self) {
        let ContactWorld {
            body,
            pieces,
            settings,
            radius,
            ..
        } = &mut self.world;
        let inverse_inertia = body.inverse_inertia_in_world();
        self.solver.clear();
        for &[piece, manifold] in &self.active {
            let manifold = &pieces[piece].manifolds[manifold];
            self.solver.add(manifold, body, &inverse_inertia, settings);
        }
        let (center, rotation) = (body.center, body.rotation);
        self.solver.solve(body, self.gravity, settings);
        for &[piece, manifold] in &self.active {
            self.solver
                .store_impulses(&mut pieces[piece].manifolds[manifold]);
        }
        let turn = body.rotation * rotation.inverse();
        let turned = 2.0 * Vector::new(turn.x, turn.y, turn.z).length() * *radius;
        self.travel += (body.center - center).length() + turned;
    }
}

impl Simulation for ContactSimulation {
    fn step(&mut self) -> Result<(), EvaluationError> {
        self.find_contacts();
        self.solve_contacts();
        if !self.world.body.is_finite() {
            let step = self.steps_taken;
            return Err(EvaluationError::Diverged { step });
        }
        self.steps_taken += 1;
        Ok(())
    }

    fn max_speed(&self) -> f64 {
        self.world.body.velocity.max_speed(self.world.radius)
    }

    fn motion(&self) -> ObjectMotion {
        let moved = self.world.body.center - self.world.center;
        ObjectMotion {
            displacement: moved.to_array(),
            rotation: self.world.body.rotation.to_scaled_axis().length(),
        }
    }
}
