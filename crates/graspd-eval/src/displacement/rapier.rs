//! The displacement protocol in the rapier engine.
//!
//! What is chosen here, beyond the protocol:
//! * The hand is one fixed triangle mesh whose contact normals are kept within the cone of the neighbouring faces'
//!   normals, so that neither the edges between its triangles nor the cuts between the object's pieces deflect
//!   the object.
//! * Contacts are soft constraints. Grasps press into the object by up to a millimetre, and opposite contacts
//!   cannot both be freed: stiffness then decides how hard they squeeze. We keep rapier's values for contacts with
//!   a fixed body (60 Hz, ten times critical damping: 142 N per mm of penetration for 1 kg), which let go of a
//!   penetration within about 50 ms and add no energy.
//! * Lengths that rapier tunes for objects of metres are scaled to objects of decimetres.
//! * One friction constraint per contact point (Coulomb), not one per patch.
//! * Contacts are predicted over 3 mm, and an object that falls freely moves 6 mm in its fastest step: nothing thicker
//!   than 3 mm tunnels. There is no continuous collision detection; a thin shell may pass a finger, but only once it
//!   has fallen 2.5 cm and counts as lost.

use std::sync::Arc;

use graspd_geom::TriangleMesh;
use nalgebra::{Matrix3, Point3, Vector3};
use rapier3d_f64::math::{Matrix, Vector};
use rapier3d_f64::prelude::{
    BroadPhaseBvh, CoefficientCombineRule, ColliderBuilder, ColliderSet, ConvexPolyhedron,
    FrictionModel, IntegrationParameters, IslandManager, MassProperties, NarrowPhase, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle, RigidBodySet, SharedShape, TriMesh, TriMeshFlags,
};
use rayon::prelude::*;

use super::climbing::ClimbingPolyhedron;
use super::decomposition::ObjectPieces;
use super::protocol::{DisplacementSettings, ObjectMotion, SIX_DIRECTIONS, SixDisplacements};
use super::separation::{TouchingOnly, triangles_without_back};
use crate::EvaluationError;

/// What rapier takes as one metre \[m\]: scales the fastest push-out of a penetration, to 0.3 m/s.
const LENGTH_UNIT: f64 = 0.1;
/// The protocol's solver iterations are spread over this many substeps of each step. One substep is too few: grasps
/// that press deep are thrown out. 150 substeps of one iteration tell held from lost grasps in the same way and move
/// held objects by at most 0.6 mm less, at twice the time.
const SUBSTEPS: usize = 10;
/// Contacts are sought this far ahead of touch \[m\] while the object moves slowly ...
const LEAST_PREDICTION: f64 = 0.5e-3;
/// ... and over this multiple of the way that its fastest point makes in a step when it moves faster ...
const PREDICTED_STEPS: f64 = 1.5;
/// ... up to this \[m\]: beyond it, what the object hits is found inside it by a few millimetres and pushed out.
const MOST_PREDICTION: f64 = 3e-3;
/// While the object has moved less than this since a contact was computed, the contact follows its motion instead
/// of being computed anew \[m\].
const RECYCLE_DISTANCE: f64 = 0.25e-3;

/// An object ready to be simulated: convex pieces and mass properties. Made once, shared by all of its grasps.
#[derive(Clone)]
pub struct DynamicObject {
    pieces: Vec<SharedShape>,
    center_of_mass: Point3<f64>,
    /// Largest distance of a vertex from the centre of mass \[m\].
    radius: f64,
    /// Inertia about the centre of mass for a mass of 1 kg \[m^2\].
    unit_inertia: Matrix3<f64>,
}

impl DynamicObject {
    /// An object made of `pieces`, with the centre of mass \[m\] and the inertia of the true solid.
    ///
    /// `unit_inertia`: about the centre of mass, along the object's axes, divided by the mass \[m^2\].
    pub fn new(
        pieces: &ObjectPieces,
        center_of_mass: Point3<f64>,
        unit_inertia: Matrix3<f64>,
    ) -> Self {
        let vertices = pieces.pieces.iter().flat_map(|piece| &piece.vertices);
        let radius = vertices
            .map(|p| (Point3::from(*p) - center_of_mass).norm())
            .fold(0.0, f64::max);
        let pieces = pieces.pieces.iter().filter_map(|piece| {
            let vertices: Vec<_> = piece.vertices.iter().map(|p| Vector::from(*p)).collect();
            let polyhedron = ConvexPolyhedron::from_convex_mesh(vertices.clone(), &piece.faces)
                .or_else(|| ConvexPolyhedron::from_convex_hull(&vertices))?;
            Some(SharedShape::new(ClimbingPolyhedron::new(polyhedron)))
        });
        Self {
            pieces: pieces.collect(),
            center_of_mass,
            radius,
            unit_inertia,
        }
    }
}

/// A hand ready to be simulated, at one pose.
#[derive(Clone)]
pub struct FixedHand {
    shape: SharedShape,
    /// Of each triangle; see [`triangles_without_back`].
    has_no_back: Arc<[bool]>,
}

impl FixedHand {
    /// From the posed surface in the object's frame: closed, outward-oriented parts.
    ///
    /// # Errors
    /// [`EvaluationError::BadMesh`] if the mesh has no faces, an index beyond its vertices, or a coordinate that is
    /// not finite.
    pub fn new(hand: &TriangleMesh) -> Result<Self, EvaluationError> {
        let bad = |fault: String| EvaluationError::BadMesh {
            mesh: "hand",
            fault,
        };
        if hand.vertices.iter().any(|p| !p.coords.sum().is_finite()) {
            return Err(bad("a coordinate is not a finite number".into()));
        }
        let count = hand.vertices.len();
        if (hand.faces.iter().flatten()).any(|&index| index as usize >= count) {
            return Err(bad("a face refers to a vertex that does not exist".into()));
        }
        let vertices = hand
            .vertices
            .iter()
            .map(|p| Vector::new(p.x, p.y, p.z))
            .collect();
        let flags = TriMeshFlags::FIX_INTERNAL_EDGES | TriMeshFlags::DELETE_DEGENERATE_TRIANGLES;
        let mesh = TriMesh::with_flags(vertices, hand.faces.clone(), flags)
            .map_err(|error| bad(error.to_string()))?;
        Ok(Self {
            has_no_back: triangles_without_back(&mesh),
            shape: SharedShape::new(mesh),
        })
    }
}

/// Lets the object go at its pose (the identity) under gravity, the hand fixed.
///
/// The same input gives the same bits: the engine runs on the calling thread alone.
///
/// # Errors
/// A setting out of range, or [`EvaluationError::Diverged`].
pub fn simulate(
    object: &DynamicObject,
    hand: &FixedHand,
    settings: &DisplacementSettings,
) -> Result<ObjectMotion, EvaluationError> {
    settings.validate()?;
    Scene::new(object, hand, settings).simulate(settings.gravity_direction, settings.steps)
}

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
        world
            .narrow_phase
            .set_query_dispatcher(TouchingOnly::new(hand.has_no_back.clone()));
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::new(hand.shape.clone())
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
                ColliderBuilder::new(piece.clone())
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
    fn simulate(&self, direction: [f64; 3], steps: usize) -> Result<ObjectMotion, EvaluationError> {
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
) -> Result<SixDisplacements, EvaluationError> {
    let settings = DisplacementSettings {
        gravity_direction: SIX_DIRECTIONS[0],
        ..settings.clone()
    };
    settings.validate()?;
    let scene = Scene::new(object, hand, &settings);
    let results: Vec<_> = SIX_DIRECTIONS
        .into_par_iter()
        .map(|direction| {
            let motion = scene.simulate(direction, settings.steps);
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
