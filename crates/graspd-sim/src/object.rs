//! The grasped object, as the simulation sees it.

use graspd_ad::Real;
use graspd_geom::{SdfGrid, Vec3};
use nalgebra::{Matrix3, Point3};

use crate::SimulationError;
use crate::params::{Twist, Wrench};

/// A rigid object: its shape as a distance grid, and its inertia. It stays at the identity pose.
#[derive(Clone, Debug)]
pub struct SimulatedObject {
    sdf: SdfGrid,
    mass: f64,
    center_of_mass: Vec3<f64>,
    inverse_inertia: [Vec3<f64>; 3],
}

impl SimulatedObject {
    /// From the signed distance grid, the mass \[kg\], the centre of mass \[m\] and the inertia about it \[kg m^2\].
    ///
    /// # Errors
    /// If mass or inertia are not those of a body with a volume.
    pub fn new(
        sdf: SdfGrid,
        mass: f64,
        center_of_mass: Point3<f64>,
        inertia: Matrix3<f64>,
    ) -> Result<Self, SimulationError> {
        if !(mass.is_finite() && mass > 0.0) {
            return Err(SimulationError::InvalidMass {
                what: "mass",
                value: mass,
            });
        }
        let inverse = inertia
            .cholesky()
            .map(|factor| factor.inverse())
            .filter(|inverse| inverse.iter().all(|v| v.is_finite()))
            .ok_or_else(|| SimulationError::InvalidMass {
                what: "smallest moment of inertia",
                value: inertia.symmetric_eigenvalues().min(),
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

    /// The change of twist that a wrench causes in `time_step` seconds: dt M^-1 w.
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
