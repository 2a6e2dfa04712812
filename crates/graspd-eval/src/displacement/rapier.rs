//! The displacement by the general-purpose engine rapier.
//!
//! The world is the same: one dynamic body of convex pieces against a fixed triangle mesh, with the
//! constants of the built-in solver.

use nalgebra::{Point3, Vector3};
use rapier3d_f64::math::{Matrix, Vector};
use rapier3d_f64::prelude::{
    BroadPhaseBvh, CoefficientCombineRule, ColliderBuilder, ColliderSet, FrictionModel,
    IntegrationParameters, IslandManager, MassProperties, NarrowPhase, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle, RigidBodySet, SharedShape,
};

use super::bodies::{DynamicObject, FixedHand};
use super::narrow_phase::RECYCLE_DISTANCE;
use super::protocol::{DisplacementSettings, ObjectMotion, Simulation, World};
use super::world::{MAX_PREDICTION, MIN_PREDICTION, PREDICTED_STEPS, SUBSTEPS};
use crate::EvaluationError;

/// What rapier takes as one metre \[m\]: scales the fastest row-out of a penetration, to 0.3 m/s.
const LENGTH_UNIT: f64 = 0.1;

/// The state from which all simulations under one protocol begin, with the contacts of that pose found.
pub(super) struct RapierWorld {
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

impl RapierWorld {
    /// Places the object at the identity and finds its contacts; `settings` are valid.
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
                ColliderBuilder::new(SharedShape::new(piece.polyhedron().clone()))
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
}

impl World for RapierWorld {
    fn release(&self, direction: [f64; 3]) -> Box<dyn Simulation> {
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
        Box::new(RapierSimulation {
            world,
            body: self.body,
            center: self.center,
            radius: self.radius,
            steps_taken: 0,
        })
    }
}

/// An object released beside a fixed hand.
struct RapierSimulation {
    world: PhysicsWorld,
    body: RigidBodyHandle,
    /// The object's centre of mass at first.
    center: Point3<f64>,
    /// Largest distance of a vertex from it \[m\].
    radius: f64,
    steps_taken: usize,
}

impl Simulation for RapierSimulation {
    fn step(&mut self) -> Result<(), EvaluationError> {
        let parameters = &self.world.integration_parameters;
        let ahead = (PREDICTED_STEPS * self.max_speed() * parameters.dt)
            .clamp(MIN_PREDICTION, MAX_PREDICTION);
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

    fn max_speed(&self) -> f64 {
        let body = &self.world.bodies[self.body];
        body.linvel().length() + body.angvel().length() * self.radius
    }

    fn motion(&self) -> ObjectMotion {
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
        normalized_prediction_distance: MIN_PREDICTION / LENGTH_UNIT,
        normalized_contact_recycle_distance: RECYCLE_DISTANCE / LENGTH_UNIT,
        friction_model: FrictionModel::Coulomb,
        ..IntegrationParameters::default()
    }
}
