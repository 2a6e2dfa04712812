//! Volume, mass, centre of mass and inertia of the solid inside a closed mesh.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::{GeometryError, TriangleMesh};

/// What rigid-body dynamics needs to know of a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct MassProperties {
    /// \[m^3\]
    pub volume: f64,
    /// \[kg\]
    pub mass: f64,
    /// \[m\], in the mesh's frame.
    pub center_of_mass: Point3<f64>,
    /// Inertia about the centre of mass, along the axes of the mesh's frame \[kg m^2\].
    pub inertia: Matrix3<f64>,
}

impl MassProperties {
    /// Of the solid inside a closed mesh, at a density in kg/m^3.
    ///
    /// Exact for the polyhedron: by the divergence theorem, the integrals of 1, x and x x^T over it are the sums over
    /// the signed tetrahedra that the faces (a, b, c) span with a fixed point o,
    ///
    /// V = a . (b x c) / 6,   int x = V (a + b + c) / 4,   int x x^T = V (a a^T + b b^T + c c^T + s s^T) / 20
    ///
    /// with a, b, c relative to o and s = a + b + c.
    ///
    /// `name`: the mesh's file or name, for errors.
    ///
    /// # Errors
    /// [`GeometryError::NoVolume`] unless the volume is positive. That the mesh is closed is not checked here; see
    /// [`closed_surface`](crate::closed_surface).
    pub fn new(mesh: &TriangleMesh, density: f64, name: &str) -> Result<Self, GeometryError> {
        let origin = reference_point(mesh);
        let mut volume = 0.0;
        let mut first_moment = Vector3::zeros();
        let mut second_moment = Matrix3::zeros();
        for face in 0..mesh.faces.len() {
            let [a, b, c] = mesh.corners(face).map(|p| p - origin);
            let tetrahedron = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            volume += tetrahedron;
            first_moment += sum * (tetrahedron / 4.0);
            for v in [a, b, c, sum] {
                second_moment += v * v.transpose() * (tetrahedron / 20.0);
            }
        }
        if !encloses_volume(volume, mesh) {
            return Err(GeometryError::NoVolume { name: name.into() });
        }
        let center = first_moment / volume;
        // About the centre of mass; then the inertia is tr(S) 1 - S.
        let second_moment = second_moment - center * center.transpose() * volume;
        let inertia = Matrix3::from_diagonal_element(second_moment.trace()) - second_moment;
        Ok(Self {
            volume,
            mass: density * volume,
            center_of_mass: origin + center,
            inertia: inertia * density,
        })
    }
}

/// The volume inside a closed mesh \[m^3\]; negative if the mesh is inside-out.
pub fn signed_volume(mesh: &TriangleMesh) -> f64 {
    let origin = reference_point(mesh);
    (0..mesh.faces.len())
        .map(|face| {
            let [a, b, c] = mesh.corners(face).map(|p| p - origin);
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum()
}

/// Whether a volume is positive and more than rounding: 1e-9 of the cube of the surface's own size.
pub(crate) fn encloses_volume(volume: f64, mesh: &TriangleMesh) -> bool {
    let area = mesh.area();
    volume > 1e-9 * area * area.sqrt()
}

/// The middle of the bounding box: near the mesh, so that large offsets do not eat the digits of the result.
fn reference_point(mesh: &TriangleMesh) -> Point3<f64> {
    mesh.bounds()
        .map_or_else(Point3::origin, |(low, high)| nalgebra::center(&low, &high))
}
