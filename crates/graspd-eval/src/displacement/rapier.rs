//! The same in the engine rapier, whole: what the tests compare with.

use nalgebra::{Point3, Vector3};
use rapier3d_f64::math::{Matrix, Vector};
use rapier3d_f64::prelude::{
    BroadPhaseBvh, CoefficientCombineRule, ColliderBuilder, ColliderSet, FrictionModel,
    IntegrationParameters, IslandManager, MassProperties, NarrowPhase, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle, RigidBodySet, SharedShape,
};

use super::climbing::ClimbingPolyhedron;
use super::fall::{LEAST_PREDICTION, MOST_PREDICTION, PREDICTED_STEPS, SUBSTEPS};
use super::protocol::{DisplacementSettings, ObjectMotion};
use super::search::RECYCLE_DISTANCE;
use super::simulation::{DynamicObject, FixedHand};
use crate::EvaluationError;

/// What rapier takes as one metre \[m\]: scales the fastest push-out of a penetration, to 0.3 m/s.
const LENGTH_UNIT: f64 = 0.1;

/// An object at its pose beside a fixed hand, with the contacts of that pose found: what all simulations under one protocol
/// begin with, whichever way gravity pulls.
///
/// The first search for contacts is the largest; where the hand holds the object, hardly any pair is looked at again.
pub(super) struct Scene {
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    narrow_phase: NarrowPhase,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    parameters: IntegrationParameters,
    gravity: f64,
    body: RigidBodyHandle,
    /// The object's centre of mass.
    center: Point3<f64>,
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
        let mut world = PhysicsWorld::new();
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::new(SharedShape::new(hand.surface.mesh.clone()))
                // With the rule `Max` on both sides the pair's friction is this one value.
                .friction(settings.friction)
                .friction_combine_rule(CoefficientCombineRule::Max)
                .restitution(settings.hand_restitution)
                .restitution_combine_rule(CoefficientCombineRule::Multiply),
        );
        let center = object.center_of_mass;
        let inertia = object.unit_inertia * settings.mass;
        let body = world.insert_body(
            RigidBodyBuilder::dynamic()
                .additional_mass_properties(MassProperties::with_inertia_matrix(
                    Vector::new(center.x, center.y, center.z),
                    settings.mass,
                    Matrix::from_cols_array(&inertia.as_slice().try_into().unwrap_or_default()),
                ))
                .can_sleep(false),
        );
        for piece in &object.pieces {
            world.insert_collider(
                ColliderBuilder::new(SharedShape::new(ClimbingPolyhedron::clone(piece)))
                    .density(0.0)
                    .friction(settings.friction)
                    .friction_combine_rule(CoefficientCombineRule::Max)
                    .restitution(settings.object_restitution)
                    .restitution_combine_rule(CoefficientCombineRule::Multiply),
                Some(body),
            );
        }
        let parameters = integration_parameters(settings);
        // A step without length finds the contacts, and nothing moves.
        world.integration_parameters = IntegrationParameters {
            dt: 0.0,
            ..parameters
        };
        world.step();
        Self {
            islands: world.islands,
            broad_phase: world.broad_phase,
            narrow_phase: world.narrow_phase,
            bodies: world.bodies,
            colliders: world.colliders,
            parameters,
            gravity: settings.gravity,
            body,
            center,
            radius: object.radius,
        }
    }

    /// Lets the object go under gravity in a direction of any length.
    pub(super) fn let_go(&self, direction: [f64; 3]) -> Fall {
        let direction = Vector3::from(direction).normalize();
        let world = PhysicsWorld {
            gravity: Vector::from(<[f64; 3]>::from(direction * self.gravity)),
            integration_parameters: self.parameters,
            islands: self.islands.clone(),
            broad_phase: self.broad_phase.clone(),
            narrow_phase: self.narrow_phase.clone(),
            bodies: self.bodies.clone(),
            colliders: self.colliders.clone(),
            ..PhysicsWorld::new()
        };
        Fall {
            world,
            body: self.body,
            center: self.center,
            radius: self.radius,
            steps_taken: 0,
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
    world: PhysicsWorld,
    body: RigidBodyHandle,
    /// The object's centre of mass at first.
    center: Point3<f64>,
    /// Largest distance of a vertex from it \[m\].
    radius: f64,
    steps_taken: usize,
}

impl Fall {
    /// Advances by one time step.
    ///
    /// # Errors
    /// [`EvaluationError::Diverged`].
    pub(super) fn step(&mut self) -> Result<(), EvaluationError> {
        let parameters = &self.world.integration_parameters;
        let ahead = (PREDICTED_STEPS * self.fastest_speed() * parameters.dt)
            .clamp(LEAST_PREDICTION, MOST_PREDICTION);
        self.world
            .integration_parameters
            .normalized_prediction_distance = ahead / LENGTH_UNIT;
        self.world.step();
        let position = self.world.bodies[self.body].position();
        if !self.world.quarantine().is_empty() || !position.is_finite() {
            let step = self.steps_taken;
            return Err(EvaluationError::Diverged { step });
        }
        self.steps_taken += 1;
        Ok(())
    }

    /// A bound on the speed of the object's fastest point \[m/s\].
    pub(super) fn fastest_speed(&self) -> f64 {
        let body = &self.world.bodies[self.body];
        body.linvel().length() + body.angvel().length() * self.radius
    }

    /// How the object has moved so far.
    pub(super) fn motion(&self) -> ObjectMotion {
        let body = &self.world.bodies[self.body];
        let (before, after) = (self.center, body.center_of_mass());
        ObjectMotion {
            displacement: [after.x - before.x, after.y - before.y, after.z - before.z],
            rotation: body.rotation().to_scaled_axis().length(),
        }
    }
}

fn integration_parameters(settings: &DisplacementSettings) -> IntegrationParameters {
    let substeps = SUBSTEPS.min(settings.solver_iterations);
    IntegrationParameters {
        dt: settings.time_step,
        num_solver_iterations: substeps,
        num_internal_pgs_iterations: settings.solver_iterations.div_ceil(substeps),
        max_ccd_substeps: 0,
        length_unit: LENGTH_UNIT,
        normalized_prediction_distance: LEAST_PREDICTION / LENGTH_UNIT,
        normalized_contact_recycle_distance: RECYCLE_DISTANCE / LENGTH_UNIT,
        friction_model: FrictionModel::Coulomb,
        ..IntegrationParameters::default()
    }
}
