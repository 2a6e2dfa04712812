//! The mass properties that every object has in the authors' released code.

use graspd_sim::{SimulatedObject, SimulationError};
use nalgebra::{Matrix3, Point3, Vector3};

/// Two balls of the density of water \[m\]: one for the mesh, about its origin, and one for the distance grid, about
/// its centre. They weigh 4.71 kg together.
const RADII: [f64; 2] = [0.1, 0.05];
const DENSITY: f64 = 1000.0;

/// Returns the object with the mass properties of the two balls: the centre of mass is at a ninth of the way from the
/// mesh's origin to the centre of the grid. `length_scale`: s, by which the balls are larger than the world of
/// `object`, whose masses are s^-3 and inertias s^-5 times those of the larger world.
///
/// # Errors
/// If the grid lies so far from the origin that the inertia is not finite.
pub(crate) fn with_released_mass(
    object: &SimulatedObject,
    length_scale: f64,
) -> Result<SimulatedObject, SimulationError> {
    let (low, high) = object.sdf().bounds();
    let centers = [Vector3::zeros(), (low.coords + high.coords) / 2.0];
    let radii = RADII.map(|radius| radius / length_scale);
    let masses = radii.map(|r| DENSITY * 4.0 / 3.0 * std::f64::consts::PI * r.powi(3));
    let mass = masses[0] + masses[1];
    let center = (centers[0] * masses[0] + centers[1] * masses[1]) / mass;
    let mut inertia = Matrix3::zeros();
    for i in 0..2 {
        let offset = centers[i] - center;
        let own = 0.4 * masses[i] * radii[i].powi(2);
        let shifted =
            Matrix3::from_diagonal_element(offset.norm_squared()) - offset * offset.transpose();
        inertia += Matrix3::from_diagonal_element(own) + shifted * masses[i];
    }
    object.with_mass(mass, Point3::from(center), inertia)
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_geom::{SdfGrid, Vec3};

    /// Sums of a few products.
    const ROUNDING: f64 = 1e-12;

    /// An object whose grid has its centre at `center`, of other mass properties.
    fn object(center: [f64; 3]) -> SimulatedObject {
        let spacing = Vec3::new(0.1, 0.1, 0.1);
        let origin = Vec3::from(center) - spacing * 0.5;
        let sdf = SdfGrid::from_values(origin, spacing, [2; 3], vec![1.0; 8]).unwrap();
        SimulatedObject::new(sdf, 0.3, Point3::new(9.0, 9.0, 9.0), Matrix3::identity()).unwrap()
    }

    #[test]
    fn every_object_weighs_the_same_and_balances_near_the_origin() {
        for center in [[0.0; 3], [0.09, -0.018, 0.45]] {
            let released = with_released_mass(&object(center), 1.0).unwrap();
            assert!((released.mass() - 4.71).abs() < 0.005);
            let offset = released.center_of_mass() * 9.0 - Vec3::from(center);
            assert!(offset.norm() < ROUNDING);
        }
    }

    #[test]
    fn the_inertia_is_that_of_two_balls() {
        use graspd_sim::Wrench;
        // On the x axis, 9 cm apart; real lengths are half of those of the larger world.
        let released = with_released_mass(&object([0.045, 0.0, 0.0]), 2.0).unwrap();
        let [large, small] = [4.0 / 3.0 * std::f64::consts::PI, std::f64::consts::PI / 6.0];
        let own = 0.4 * (large * 0.01 + small * 0.0025);
        let about_x = own;
        let about_y = own + large * 0.01f64.powi(2) + small * 0.08f64.powi(2);
        let torque = Vec3::new(1.0, 1.0, 0.0);
        let wrench = Wrench {
            torque,
            force: Vec3::zero(),
        };
        let turned = released.impulse_response(&wrench, 1.0).angular;
        let expected = Vec3::new(32.0 / about_x, 32.0 / about_y, 0.0);
        assert!((turned - expected).norm() < ROUNDING * expected.norm());
        assert!((released.mass() * 8.0 - (large + small)).abs() < ROUNDING);
    }
}
