//! The constants of the contact law and of the one-step simulation.

use graspd_geom::Vec3;
use graspd_settings::{
    ANY, AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Ranges, Validate, ranges,
};

/// Stiffness and friction of the contact between hand and object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// k_n, normal stiffness \[N/m\]; paper: 1e6.
    pub normal_stiffness: f64,
    /// k_f, friction stiffness \[N s/m^2\]; paper: 1e8.
    pub friction_stiffness: f64,
    /// mu, Coulomb friction coefficient; paper: 0.8. Contacts slide from a speed of mu k_n / k_f on (paper: 8 mm/s).
    pub friction_coefficient: f64,
    /// alpha, the fraction of the gradient that reaches points which do not touch; paper: 0.1. With 0 a point
    /// that does not touch feels nothing.
    pub leak: f64,
    /// At depth 0, leaks the gradient of sliding friction at every speed; paper: of sticking below mu k_n / k_f. The
    /// force itself is 0 there either way.
    pub slides_at_zero_depth: bool,
}

impl Default for ContactParams {
    fn default() -> Self {
        Self {
            normal_stiffness: 1e6,
            friction_stiffness: 1e8,
            friction_coefficient: 0.8,
            leak: 0.1,
            slides_at_zero_depth: false,
        }
    }
}

/// A rigid body's velocity: of its centre of mass, and angular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist<T> {
    /// Velocity of the centre of mass \[m/s\], object frame.
    pub linear: Vec3<T>,
    /// Angular velocity \[rad/s\], object frame.
    pub angular: Vec3<T>,
}

/// A torque about the object's centre of mass and a force, object frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<T> {
    /// Torque about the centre of mass \[N m\].
    pub torque: Vec3<T>,
    /// Force \[N\].
    pub force: Vec3<T>,
}

/// Everything that the simulated loss depends on besides hand and object.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationParams {
    /// The contact law.
    pub contact: ContactParams,
    /// Length of the single time step \[s\]; paper: 1e-5.
    pub time_step: f64,
    /// The object's velocities before the step, `[J]`; the grasp has to stop it from each of them.
    pub velocities: Vec<Twist<f64>>,
    /// s, by which object and hand are larger in the simulation than they are; paper: 1, released code: 2. Torques
    /// grow by s, the mass by s^3 and the inertia by s^5. Depths stay real ones: the stiffnesses of `contact` have
    /// to be s times those of the larger world, where depths are s times as large.
    pub length_scale: f64,
    /// Outside the distance grid, takes the nearest sample plus the distance to the grid's box, see
    /// [`SdfGrid::distance_and_gradient_by_nearest_sample`](graspd_geom::SdfGrid).
    pub nearest_sample_outside: bool,
}

impl Default for SimulationParams {
    /// At rest, and 0.01 (1, 1, 1) m/s back and forth.
    fn default() -> Self {
        let moving = |speed: f64| Twist {
            linear: Vec3::new(speed, speed, speed),
            angular: Vec3::new(0.0, 0.0, 0.0),
        };
        Self {
            contact: ContactParams::default(),
            time_step: 1e-5,
            velocities: vec![moving(0.0), moving(0.01), moving(-0.01)],
            length_scale: 1.0,
            nearest_sample_outside: false,
        }
    }
}

impl Validate for ContactParams {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            normal_stiffness: POSITIVE,
            friction_stiffness: POSITIVE,
            friction_coefficient: NOT_NEGATIVE,
            leak: FRACTION,
            slides_at_zero_depth: ANY,
        }
    }
}

impl Validate for SimulationParams {
    fn ranges(&self) -> Ranges {
        let twists = self.velocities.iter();
        let components = twists.map(|Twist { linear, angular }| {
            [
                linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
            ]
        });
        ranges! { self => time_step: POSITIVE, length_scale: POSITIVE, nearest_sample_outside: ANY }
            .with(
                "velocities (their number)",
                &self.velocities.len(),
                AT_LEAST_ONE,
            )
            .with("velocities", &components.collect::<Vec<_>>(), FINITE)
            .nested("contact", &self.contact)
    }
}

#[cfg(test)]
mod tests {
    use graspd_settings::OutOfRange;

    use super::*;

    fn fault(change: impl FnOnce(&mut SimulationParams)) -> OutOfRange {
        let mut params = SimulationParams::default();
        change(&mut params);
        params.validate().unwrap_err()
    }

    #[test]
    fn the_defaults_are_the_papers_and_valid() {
        let params = SimulationParams::default();
        assert_eq!(params.validate(), Ok(()));
        assert_eq!(
            (params.contact.normal_stiffness, params.time_step),
            (1e6, 1e-5)
        );
        let speeds = params.velocities.iter().map(|twist| twist.linear.norm());
        let expected = [0.0, 0.01 * 3f64.sqrt(), 0.01 * 3f64.sqrt()];
        assert!(speeds.zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
    }

    #[test]
    fn each_fault_is_named() {
        type Change = fn(&mut SimulationParams, f64);
        let fields: [(&str, Change, &[f64]); 6] = [
            (
                "contact.normal_stiffness",
                |p, v| p.contact.normal_stiffness = v,
                &[0.0, -1.0],
            ),
            (
                "contact.friction_stiffness",
                |p, v| p.contact.friction_stiffness = v,
                &[0.0, -1.0],
            ),
            (
                "contact.friction_coefficient",
                |p, v| p.contact.friction_coefficient = v,
                &[-0.1],
            ),
            ("contact.leak", |p, v| p.contact.leak = v, &[-0.1, 1.1]),
            ("time_step", |p, v| p.time_step = v, &[0.0, -1e-5]),
            ("length_scale", |p, v| p.length_scale = v, &[0.0, -2.0]),
        ];
        for (name, change, values) in fields {
            for &wrong in values.iter().chain(&[f64::NAN, f64::INFINITY]) {
                let OutOfRange { setting, value, .. } = fault(|params| change(params, wrong));
                assert_eq!(setting, name);
                assert!(value == wrong || value.is_nan());
            }
        }
        assert!(
            fault(|params| params.velocities.clear())
                .to_string()
                .contains("velocities")
        );
        for wrong in [f64::NAN, f64::INFINITY] {
            let error = fault(|params| params.velocities[1].angular.y = wrong);
            assert!(error.to_string().contains("velocities"), "{error}");
        }
    }

    #[test]
    fn extremes_that_make_sense_are_valid() {
        let mut params = SimulationParams::default();
        params.contact.friction_coefficient = 0.0;
        for leak in [0.0, 1.0] {
            params.contact.leak = leak;
            assert_eq!(params.validate(), Ok(()));
        }
    }
}
