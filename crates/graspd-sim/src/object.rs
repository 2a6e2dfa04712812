//! The grasped object, as the simulation sees it.

use std::sync::Arc;

use graspd_ad::Real;
use graspd_geom::{SdfGrid, Vec3};
use nalgebra::{Matrix3, Point3};

use crate::SimulationError;
use crate::params::{Twist, Wrench};

/// A rigid object: its shape as a distance grid, and its inertia. It stays at the identity pose.
#[derive(Clone, Debug)]
pub struct SimulatedObject {
    sdf: Arc<SdfGrid>,
    mass: f64,
    center_of_mass: Vec3<f64>,
    inverse_inertia: [Vec3<f64>; 3],
}

impl SimulatedObject {
    /// From the signed distance grid, the mass \[kg\], the centre of mass \[m\] and the inertia about it \[kg m^2\], a
    /// symmetric matrix along the axes of the object frame.
    ///
    /// # Errors
    /// [`SimulationError::InvalidMass`] if mass or inertia are not those of a body with a volume, or anything is not
    /// finite.
    pub fn new(
        sdf: SdfGrid,
        mass: f64,
        center_of_mass: Point3<f64>,
        inertia: Matrix3<f64>,
    ) -> Result<Self, SimulationError> {
        Self::of_shape(Arc::new(sdf), mass, center_of_mass, inertia)
    }

    /// An object of this one's shape, with other mass properties, see [`SimulatedObject::new`].
    ///
    /// # Errors
    /// As [`SimulatedObject::new`].
    pub fn with_mass(
        &self,
        mass: f64,
        center_of_mass: Point3<f64>,
        inertia: Matrix3<f64>,
    ) -> Result<Self, SimulationError> {
        Self::of_shape(Arc::clone(&self.sdf), mass, center_of_mass, inertia)
    }

    fn of_shape(
        sdf: Arc<SdfGrid>,
        mass: f64,
        center_of_mass: Point3<f64>,
        inertia: Matrix3<f64>,
    ) -> Result<Self, SimulationError> {
        let invalid = |what, value| SimulationError::InvalidMass { what, value };
        if !(mass.is_finite() && mass > 0.0) {
            return Err(invalid("mass", mass));
        }
        if let Some(&value) = center_of_mass.iter().find(|v| !v.is_finite()) {
            return Err(invalid("centre of mass", value));
        }
        if let Some(&value) = inertia.iter().find(|v| !v.is_finite()) {
            return Err(invalid("moment of inertia", value));
        }
        let inverse = inertia
            .cholesky()
            .map(|factor| factor.inverse())
            .filter(|inverse| inverse.iter().all(|v| v.is_finite()))
            .ok_or_else(|| {
                let smallest = inertia.symmetric_eigenvalues().min();
                invalid("smallest moment of inertia", smallest)
            })?;
        let row = |i: usize| Vec3::new(inverse[(i, 0)], inverse[(i, 1)], inverse[(i, 2)]);
        Ok(Self {
            sdf,
            mass,
            center_of_mass: center_of_mass.into(),
            inverse_inertia: [row(0), row(1), row(2)],
        })
    }

    /// The signed distance grid.
    pub fn sdf(&self) -> &SdfGrid {
        &self.sdf
    }
    /// Mass \[kg\].
    pub fn mass(&self) -> f64 {
        self.mass
    }
    /// Centre of mass \[m\], object frame.
    pub fn center_of_mass(&self) -> Vec3<f64> {
        self.center_of_mass
    }

    /// The rows of I^-1 \[1/(kg m^2)\].
    pub(crate) fn inverse_inertia(&self) -> [Vec3<f64>; 3] {
        self.inverse_inertia
    }

    /// The change of twist that a wrench causes in `time_step` seconds: dt M^-1 w, that is dt / m times the force
    /// \[m/s\] and dt I^-1 times the torque \[rad/s\].
    ///
    /// Linear in the wrench, and symmetric: M^-1 is its own transpose.
    #[inline(always)]
    pub fn impulse_response<T: Real>(&self, wrench: &Wrench<T>, time_step: f64) -> Twist<T> {
        let [a, b, c] = self.inverse_inertia.map(Vec3::<T>::constant);
        let step = T::constant(time_step);
        Twist {
            linear: wrench.force * T::constant(time_step / self.mass),
            angular: Vec3::new(
                a.dot(wrench.torque),
                b.dot(wrench.torque),
                c.dot(wrench.torque),
            ) * step,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn grid() -> SdfGrid {
        let unit = Vec3::new(1.0, 1.0, 1.0);
        SdfGrid::from_values(Vec3::zero(), unit, [2; 3], vec![1.0; 8]).unwrap()
    }

    fn with_inertia(inertia: Matrix3<f64>) -> Result<SimulatedObject, SimulationError> {
        SimulatedObject::new(grid(), 1.0, Point3::origin(), inertia)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn response_is_the_inverse_mass_matrix(
            mass in 0.01..10.0f64,
            center in prop::array::uniform3(-1.0..1.0f64),
            size in prop::array::uniform3(0.01..1.0f64),
            turn in prop::array::uniform3(-3.0..3.0f64),
            wrench in prop::array::uniform6(-10.0..10.0f64),
        ) {
            // A turned cuboid.
            let [x, y, z] = size.map(|side| side * side);
            let moments = Vector3::new(y + z, x + z, x + y) * (mass / 12.0);
            let turn = nalgebra::Rotation3::from_scaled_axis(Vector3::from(turn)).into_inner();
            let inertia = turn * Matrix3::from_diagonal(&moments) * turn.transpose();
            let object = SimulatedObject::new(grid(), mass, Point3::from(center), inertia).unwrap();
            prop_assert_eq!(object.mass(), mass);
            prop_assert_eq!(object.center_of_mass(), Vec3::from(center));

            let [tx, ty, tz, fx, fy, fz] = wrench;
            let (torque, force) = (Vector3::new(tx, ty, tz), Vector3::new(fx, fy, fz));
            let wrench = Wrench { torque: torque.into(), force: force.into() };
            let change = object.impulse_response(&wrench, 0.5);
            let angular = inertia.lu().solve(&torque).unwrap() * 0.5;
            let linear = force * (0.5 / mass);
            // The moments of the flattest cuboid differ by a factor of 1e4: that many digits of 1e-16 are lost.
            prop_assert!((Vector3::from(change.angular) - angular).norm() <= 1e-11 * angular.norm());
            prop_assert!((Vector3::from(change.linear) - linear).norm() <= 1e-14 * linear.norm());
        }
    }

    #[test]
    fn impossible_masses_are_refused() {
        for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = SimulatedObject::new(grid(), mass, Point3::origin(), Matrix3::identity());
            let Err(SimulationError::InvalidMass {
                what: "mass",
                value,
            }) = error
            else {
                panic!("{mass} kg passed: {error:?}");
            };
            assert!(value == mass || value.is_nan());
        }
    }

    #[test]
    fn impossible_inertias_are_refused() {
        let diagonal = |x, y, z| Matrix3::from_diagonal(&Vector3::new(x, y, z));
        let mut one_nan = Matrix3::identity();
        one_nan[(1, 0)] = f64::NAN;
        for inertia in [
            diagonal(1.0, 1.0, 0.0),
            diagonal(1.0, -1.0, 1.0),
            Matrix3::zeros(),
            one_nan,
            diagonal(f64::NAN, 1.0, 1.0),
            diagonal(1.0, 1.0, f64::INFINITY),
            Matrix3::from_element(f64::NAN),
        ] {
            let error = with_inertia(inertia).unwrap_err();
            assert!(error.to_string().contains("moment of inertia"), "{error}");
        }
    }

    #[test]
    fn the_smallest_moment_is_named() {
        let error = with_inertia(Matrix3::from_diagonal(&Vector3::new(1.0, -2.0, 3.0)));
        let what = "smallest moment of inertia";
        assert_eq!(
            error.unwrap_err(),
            SimulationError::InvalidMass { what, value: -2.0 }
        );
    }

    #[test]
    fn centers_that_are_nowhere_are_refused() {
        let center = Point3::new(0.0, f64::NAN, 0.0);
        let error = SimulatedObject::new(grid(), 1.0, center, Matrix3::identity()).unwrap_err();
        assert!(error.to_string().contains("centre of mass"), "{error}");
    }
}
