//! The largest box that fits into a ball, by the differential method of multipliers.
//!
//! `cargo run --release -p graspd-opt --example constrained`

use graspd_opt::{Constraint, Mdmm, MdmmSettings};

fn main() -> Result<(), graspd_opt::OptimizationError> {
    // Half sides x, y, z: maximise the volume 8 x y z while the corner stays on the unit sphere.
    let outcome = Mdmm::new(MdmmSettings::default())?
        .subject_to(
            Constraint::equal_to(1.0),
            |x: &[f64], gradient: &mut [f64]| {
                for (slot, value) in gradient.iter_mut().zip(x) {
                    *slot = 2.0 * value;
                }
                x.iter().map(|value| value * value).sum()
            },
        )?
        .minimize(&[0.9, 0.3, 0.5], |x: &[f64], gradient: &mut [f64]| {
            gradient.copy_from_slice(&[-8.0 * x[1] * x[2], -8.0 * x[0] * x[2], -8.0 * x[0] * x[1]]);
            -8.0 * x[0] * x[1] * x[2]
        })?;
    println!("{:?}: half sides {:?}", outcome.status, outcome.x);
    // A cube: every half side is 1/sqrt(3).
    let expected = 1.0 / 3f64.sqrt();
    assert!(outcome.x.iter().all(|side| (side - expected).abs() < 1e-4));
    Ok(())
}
