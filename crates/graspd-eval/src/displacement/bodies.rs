//! What is simulated: the object as convex pieces, and the fixed hand.

use std::sync::Arc;

use graspd_geom::TriangleMesh;
use nalgebra::{Matrix3, Point3};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{ConvexPolyhedron, TriMesh, TriMeshFlags};

use super::decomposition::ObjectPieces;
use super::hill_climbing::HillClimbingPolyhedron;
use super::narrow_phase::HandSurface;
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
