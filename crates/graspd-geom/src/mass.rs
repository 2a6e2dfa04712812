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
pub fn encloses_volume(volume: f64, mesh: &TriangleMesh) -> bool {
    let area = mesh.area();
    volume > 1e-9 * area * area.sqrt()
}

/// The middle of the bounding box: near the mesh, so that large offsets do not eat the digits of the result.
fn reference_point(mesh: &TriangleMesh) -> Point3<f64> {
    mesh.bounds()
        .map_or_else(Point3::origin, |(low, high)| nalgebra::center(&low, &high))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::{Isometry3, UnitQuaternion};
    use proptest::prelude::*;

    use super::*;
    use crate::{box_mesh, capsule_mesh, flipped, sphere_mesh};

    /// Sums over a few thousand faces of a unit-sized mesh.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn a_box_has_the_textbook_inertia() {
        let sides = Vector3::new(0.1, 0.2, 0.3);
        let mass = MassProperties::new(&box_mesh(sides, 0.05), 500.0, "box").unwrap();
        assert!((mass.volume - 0.006).abs() < ROUNDING);
        assert!((mass.mass - 3.0).abs() < ROUNDING);
        assert!(mass.center_of_mass.coords.norm() < ROUNDING);
        let squares = sides.component_mul(&sides);
        let expected = Matrix3::from_diagonal(&(squares.sum() * Vector3::repeat(1.0) - squares))
            * (3.0 / 12.0);
        assert!(
            (mass.inertia - expected).norm() < ROUNDING,
            "{}",
            mass.inertia
        );
    }

    #[test]
    fn finer_spheres_converge_quadratically() {
        let radius: f64 = 0.5;
        let volume = 4.0 / 3.0 * PI * radius.powi(3);
        let inertia = 0.4 * volume * radius * radius;
        let errors: Vec<[f64; 2]> = [0.1, 0.05, 0.025]
            .map(|edge| {
                let mass = MassProperties::new(&sphere_mesh(radius, edge), 1.0, "sphere").unwrap();
                let isotropic = Matrix3::from_diagonal_element(inertia);
                [
                    (mass.volume - volume).abs() / volume,
                    (mass.inertia - isotropic).norm() / inertia,
                ]
            })
            .into();
        for pair in errors.windows(2) {
            for kind in 0..2 {
                let ratio = pair[0][kind] / pair[1][kind];
                assert!((3.0..5.5).contains(&ratio), "{errors:?}");
            }
        }
        assert!(errors[2].iter().all(|&error| error < 3e-3), "{errors:?}");
    }

    #[test]
    fn surfaces_that_are_inside_out_or_flat_have_no_mass() {
        let mesh = box_mesh(Vector3::repeat(0.1), 0.1);
        assert!((signed_volume(&flipped(&mesh)) + 1e-3).abs() < ROUNDING);
        for mesh in [
            flipped(&mesh),
            TriangleMesh::default(),
            box_mesh(Vector3::new(0.1, 0.1, 0.0), 0.1),
        ] {
            let error = MassProperties::new(&mesh, 1.0, "x").unwrap_err();
            assert!(matches!(error, GeometryError::NoVolume { .. }));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

        /// Moved by (R, t): the same volume, R c + t, and R I R^T. The tolerance allows for digits lost to the offset.
        #[test]
        fn mass_moves_with_the_mesh(
            rotation in prop::array::uniform3(-3.0_f64..3.0),
            translation in prop::array::uniform3(-10.0_f64..10.0),
        ) {
            let mut mesh = capsule_mesh(0.02, 0.1, 0.005);
            mesh.append(&box_mesh(Vector3::new(0.1, 0.05, 0.03), 0.01));
            let motion = Isometry3::from_parts(
                Vector3::from(translation).into(),
                UnitQuaternion::from_scaled_axis(Vector3::from(rotation)),
            );
            let before = MassProperties::new(&mesh, 1000.0, "drill").unwrap();
            let after = MassProperties::new(&mesh.transformed(&motion), 1000.0, "drill").unwrap();
            let turn = motion.rotation.to_rotation_matrix();
            prop_assert!((after.volume / before.volume - 1.0).abs() < 1e-10);
            prop_assert!((after.center_of_mass - motion * before.center_of_mass).norm() < 1e-12);
            let expected = turn.matrix() * before.inertia * turn.matrix().transpose();
            prop_assert!((after.inertia - expected).norm() < 1e-10 * expected.norm());
        }
    }
}
