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

use std::sync::Arc;

use graspd_geom::TriangleMesh;
use graspd_settings::Validate;
use nalgebra::{Matrix3, Point3};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{ConvexPolyhedron, TriMesh, TriMeshFlags};
use rayon::prelude::*;

use super::decomposition::ObjectPieces;
use super::engine::PhysicsEngine;
use super::hill_climbing::HillClimbingPolyhedron;
use super::narrow_phase::HandSurface;
use super::protocol::{DisplacementSettings, ObjectMotion, SIX_DIRECTIONS, SixDisplacements};
use crate::EvaluationError;

/// An object ready to be simulated: convex pieces and mass properties. Made once, shared by all of its grasps.
#[derive(Clone)]
pub struct DynamicObject {
    pub(super) pieces: Vec<Arc<HillClimbingPolyhedron>>,
    pub(super) center_of_mass: Point3<f64>,
    /// Largest distance of a vertex from the centre of mass \[m\].
    pub(super) radius: f64,
    /// Inertia about the centre of mass for a mass of 1 kg \[m^2\].
    pub(super) unit_inertia: Matrix3<f64>,
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
            Some(Arc::new(HillClimbingPolyhedron::new(polyhedron)))
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
    pub(super) surface: Arc<HandSurface>,
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
            surface: Arc::new(HandSurface::new(mesh)),
        })
    }
}

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
