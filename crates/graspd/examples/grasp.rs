//! Grasps of an object by a hand, best first: what `graspd synth` does, in a page.
//!
//! `cargo run --release -p graspd --example grasp -- [OBJECT] [HAND] [STARTS]`

use graspd::{Configuration, GraspObject, NamedMesh, RunSettings, synthesize_grasps};
use graspd_hand::load_hand;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mesh = arguments.next().unwrap_or_else(|| "mug".into());
    let hand = arguments.next().unwrap_or_else(|| "allegro".into());
    let count = arguments.next().map_or(Ok(2), |count| count.parse())?;

    let configuration = Configuration::default();
    let hand = load_hand(&hand)?;
    let object = GraspObject::prepare_sampled(
        NamedMesh::load(&mesh, 1.0)?,
        &configuration.sdf_sampling(),
        configuration.settings.density,
        None,
        &|_| {},
    )?;
    let run = RunSettings {
        seed: configuration.seed,
        count,
        trajectory_every: None,
        execution: configuration.execution,
        evaluation: configuration.evaluation,
    };
    for grasp in synthesize_grasps(&object, &*hand, &configuration.settings, &run, &())? {
        let metrics = grasp.record.metrics.unwrap_or_default();
        println!(
            "#{}: moves {:.2} cm, touches {:.1} cm^2, at {:?}",
            grasp.record.index,
            metrics.sim_displacement_cm.unwrap_or(f64::NAN),
            metrics.contact_area_cm2.unwrap_or(f64::NAN),
            grasp.record.pose.translation_m
        );
    }
    Ok(())
}
