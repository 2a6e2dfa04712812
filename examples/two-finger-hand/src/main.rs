//! Grasps of the mug by a hand that no crate of graspd knows: `cargo run --release` in this folder.

mod hand;

use graspd::{Configuration, GraspObject, NamedMesh, RunSettings, synthesize_grasps};
use graspd_hand::HandOptions;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let hand = hand::two_finger_hand(&HandOptions::default())?;
    let configuration = Configuration::default();
    let object = GraspObject::prepare_sampled(
        NamedMesh::load("mug", 1.0)?,
        &configuration.sdf_sampling(),
        configuration.settings.density,
        None,
        &|_| {},
    )?;
    let run = RunSettings {
        seed: 0,
        count: 4,
        trajectory_every: None,
        execution: configuration.execution,
        evaluation: configuration.evaluation,
    };
    for grasp in synthesize_grasps(&object, &hand, &configuration.settings, &run, &())? {
        let metrics = grasp.record.metrics.unwrap_or_default();
        println!(
            "#{}: moves {:.2} cm, touches {:.2} cm^2, is {:.2} mm deep, slides {:?}",
            grasp.record.index,
            metrics.sim_displacement_cm.unwrap_or(f64::NAN),
            metrics.contact_area_cm2.unwrap_or(f64::NAN),
            metrics.max_penetration_mm.unwrap_or(f64::NAN),
            grasp.record.joints_rad
        );
    }
    Ok(())
}
