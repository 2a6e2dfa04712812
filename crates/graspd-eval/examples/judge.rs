//! Judges a grasp that needs no hand model: two capsules pressed ever deeper into the sides of a carton.
//!
//! `cargo run --release -p graspd-eval --example judge`

use graspd_eval::{EvaluationSettings, ObjectUnderTest, evaluate};
use graspd_geom::{TriangleMesh, box_mesh, capsule_mesh};
use nalgebra::{Isometry3, Vector3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 6 x 8 x 5 cm.
    let carton = box_mesh(Vector3::new(0.06, 0.08, 0.05), 0.08);
    let object = ObjectUnderTest::new(&carton)?;
    let finger = capsule_mesh(0.01, 0.03, 0.002);
    println!("depth [mm]   CA [cm^2]   IV [cm^3]   epsilon   SD [cm]");
    for depth in [-0.001, 0.0002, 0.0005, 0.001, 0.002] {
        let mut hand = TriangleMesh::default();
        for side in [-1.0, 1.0] {
            let place = Isometry3::translation(side * (0.04 - depth), 0.0, 0.0);
            hand.append(&finger.transformed(&place));
        }
        let metrics = evaluate(&object, &hand, &EvaluationSettings::default())?;
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        println!(
            "{:10.1}   {:9.2}   {:9.3}   {:7.3}   {:7.2}",
            1e3 * depth,
            number(metrics.contact_area_cm2),
            number(metrics.interpenetration_volume_cm3),
            number(metrics.epsilon),
            number(metrics.sim_displacement_cm)
        );
    }
    Ok(())
}
