//! An object let go beside a fixed hand, step by step.

use std::sync::Arc;

use nalgebra::Vector3;
use parry3d_f64::math::Vector;

use super::body::Body;
use super::order::SolvingOrder;
use super::protocol::{DisplacementSettings, ObjectMotion};
use super::search::{HandSurface, SearchScratch, Touch};
use super::simulation::{DynamicObject, FixedHand};
use super::solver::{Solver, StepSettings};
use crate::EvaluationError;

/// The protocol's solver iterations are spread over this many substeps of each step. One substep is too few: grasps
/// that press deep are thrown out. 150 substeps of one iteration tell held from lost grasps in the same way and move
/// held objects by at most 0.6 mm less, at twice the time.
pub(super) const SUBSTEPS: usize = 10;
/// Contacts are sought this far ahead of touch \[m\] while the object moves slowly ...
pub(super) const LEAST_PREDICTION: f64 = 0.5e-3;
/// ... and over this multiple of the way that its fastest point makes in a step when it moves faster ...
pub(super) const PREDICTED_STEPS: f64 = 1.5;
/// ... up to this \[m\]: beyond it, what the object hits is found inside it by a few millimetres and pushed out.
pub(super) const MOST_PREDICTION: f64 = 3e-3;
/// An object at its pose beside a fixed hand, with the contacts of that pose found: what all simulations under one protocol
/// begin with, whichever way gravity pulls.
///
/// The first search for contacts is the largest; where the hand holds the object, hardly any pair is looked at again.
pub(super) struct Scene {
    hand: Arc<HandSurface>,
    body: Body,
    touches: Vec<Touch>,
    order: SolvingOrder,
    settings: StepSettings,
    gravity: f64,
    /// The object's centre of mass.
    center: Vector,
    /// Largest distance of a vertex from it \[m\].
    radius: f64,
}

impl Scene {
    /// The scene under a protocol; `settings` are valid.
    pub(super) fn new(
        object: &DynamicObject,
        hand: &FixedHand,
        settings: &DisplacementSettings,
    ) -> Self {
        let body = Body::at_rest(object.center_of_mass, &object.unit_inertia);
        let substeps = SUBSTEPS.min(settings.solver_iterations);
        let step_settings = StepSettings {
            step: settings.time_step,
            substeps,
            iterations: settings.solver_iterations.div_ceil(substeps),
            friction: settings.friction,
            restitution: settings.hand_restitution * settings.object_restitution,
        };
        let mut scratch = SearchScratch::default();
        let touches: Vec<_> = (object.pieces.iter())
            .map(|piece| {
                let mut touch = Touch::new(piece.clone(), &hand.surface);
                let lengths = [0.0, LEAST_PREDICTION, 0.0];
                touch.update(&hand.surface, &body, lengths, &mut scratch);
                touch
            })
            .collect();
        let boxes = touches.iter().map(|touch| touch.bounds_at(&body.pose()));
        let mut order = SolvingOrder::new(hand.surface.bounds(), boxes, LEAST_PREDICTION);
        order.update(|piece| touches[piece].has_contacts());
        Self {
            hand: hand.surface.clone(),
            center: body.center,
            body,
            touches,
            order,
            settings: step_settings,
            gravity: settings.gravity,
            radius: object.radius,
        }
    }

    /// Lets the object go under gravity in a direction of any length.
    pub(super) fn let_go(&self, direction: [f64; 3]) -> Fall {
        let gravity = Vector3::from(direction).normalize() * self.gravity;
        Fall {
            hand: self.hand.clone(),
            body: self.body.clone(),
            touches: self.touches.clone(),
            order: self.order.clone(),
            settings: self.settings,
            gravity: Vector::from(<[f64; 3]>::from(gravity)),
            center: self.center,
            radius: self.radius,
            travel: 0.0,
            steps_taken: 0,
            solver: Solver::default(),
            scratch: SearchScratch::default(),
            solved: Vec::new(),
        }
    }

    /// Lets the object go for so many steps.
    pub(super) fn simulate(
        &self,
        direction: [f64; 3],
        steps: usize,
    ) -> Result<ObjectMotion, EvaluationError> {
        let mut fall = self.let_go(direction);
        for _ in 0..steps {
            fall.step()?;
        }
        Ok(fall.motion())
    }
}

/// An object let go beside a fixed hand, under gravity.
pub(super) struct Fall {
    hand: Arc<HandSurface>,
    body: Body,
    touches: Vec<Touch>,
    order: SolvingOrder,
    settings: StepSettings,
    gravity: Vector,
    /// The object's centre of mass at first.
    center: Vector,
    /// Largest distance of a vertex from it \[m\].
    radius: f64,
    /// How far any of its points may have moved up to now, all along its way \[m\].
    travel: f64,
    steps_taken: usize,
    solver: Solver,
    scratch: SearchScratch,
    /// Piece and patch in the order in which they are solved.
    solved: Vec<[usize; 2]>,
}

impl Fall {
    /// Advances by one time step.
    ///
    /// # Errors
    /// [`EvaluationError::Diverged`].
    pub(super) fn step(&mut self) -> Result<(), EvaluationError> {
        self.find_contacts();
        self.solve_contacts();
        if !self.body.is_finite() {
            let step = self.steps_taken;
            return Err(EvaluationError::Diverged { step });
        }
        self.steps_taken += 1;
        Ok(())
    }

    /// Finds the contacts where the object is, and in which order they are solved.
    fn find_contacts(&mut self) {
        let ahead = (PREDICTED_STEPS * self.fastest_speed() * self.settings.step)
            .clamp(LEAST_PREDICTION, MOST_PREDICTION);
        let lengths = [self.travel, ahead, self.settings.step];
        for touch in &mut self.touches {
            touch.update(&self.hand, &self.body, lengths, &mut self.scratch);
        }
        let touches = &self.touches;
        self.order.update(|piece| touches[piece].has_contacts());
        self.order.write(touches, &mut self.solved);
    }

    /// Moves the object by a step under the contacts found.
    fn solve_contacts(&mut self) {
        let (solver, body, settings) = (&mut self.solver, &mut self.body, &self.settings);
        let touches = &mut self.touches;
        let inverse_inertia = body.inverse_inertia_in_world();
        solver.clear();
        for &[piece, patch] in &self.solved {
            solver.add(
                &touches[piece].patches[patch],
                body,
                &inverse_inertia,
                settings,
            );
        }
        let (center, rotation) = (body.center, body.rotation);
        solver.solve(body, self.gravity, settings);
        for &[piece, patch] in &self.solved {
            solver.take_back(&mut touches[piece].patches[patch]);
        }
        let turn = body.rotation * rotation.inverse();
        let turned = 2.0 * Vector::new(turn.x, turn.y, turn.z).length() * self.radius;
        self.travel += (body.center - center).length() + turned;
    }

    /// A bound on the speed of the object's fastest point \[m/s\].
    pub(super) fn fastest_speed(&self) -> f64 {
        let velocity = &self.body.velocity;
        velocity.linear.length() + velocity.angular.length() * self.radius
    }

    /// How the object has moved so far.
    pub(super) fn motion(&self) -> ObjectMotion {
        let moved = self.body.center - self.center;
        ObjectMotion {
            displacement: moved.to_array(),
            rotation: self.body.rotation.to_scaled_axis().length(),
        }
    }
}
