//! Whether grasps made in single precision are as good as those made in double precision from the same starts.
//!
//! `cargo run --release -p graspd-tests --example precision -- [HAND] [OBJECT] [STARTS]`; by default `allegro mug
//! 5`. For each start 7000 steps of the preset `soft` in either precision, then the metrics of both grasps
//! against the true mesh.

use std::error::Error;

use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_eval::{EvaluationSettings, GraspMetrics, ObjectUnderTest, evaluate};
use graspd_hand::{Hand, HandPose, Kinematics, builtin_hand};
use graspd_sim::Precision;

/// Samples of the object's distance grid along each axis.
const RESOLUTION: usize = 128;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let hand =
        builtin_hand(arguments.next().as_deref().unwrap_or("allegro")).ok_or("no such hand")?;
    let object = arguments.next().unwrap_or_else(|| "mug".into());
    let starts = arguments.next().map_or(Ok(5), |count| count.parse())?;

    let settings = SynthesisSettings::soft();
    let source = NamedMesh::load(&object, 1.0)?;
    let object = GraspObject::prepare(source, RESOLUTION, settings.density, &|_| {})?;
    let judge = ObjectUnderTest::new(&object.source.mesh)?;
    println!("start  in   SD [cm]  CA [cm2]  IV [cm3]  epsilon  deepest [mm]");
    for index in 0..starts {
        let start = draw_start(&object, &*hand, &settings, 0, index)?;
        let single = grasp::<f32>(&*hand, &object, &start, &settings)?;
        let double = grasp::<f64>(&*hand, &object, &start, &settings)?;
        for (precision, pose) in [("f32", single), ("f64", double)] {
            let surface = hand.surface(&pose);
            let found = evaluate(&judge, &surface, &EvaluationSettings::default())?;
            println!("{index:>5}  {precision}  {}", line(&found));
        }
    }
    Ok(())
}

fn grasp<E: Precision>(
    hand: &dyn Hand,
    object: &GraspObject,
    start: &HandPose,
    settings: &SynthesisSettings,
) -> Result<HandPose, Box<dyn Error>>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let (object, start) = (&object.simulated, start.clone());
    let made = synthesize::<E>(hand, object, start, settings, &mut |_, _, _| {})?;
    Ok(made.pose)
}

fn line(metrics: &GraspMetrics) -> String {
    let column = |value: Option<f64>, width: usize, digits: usize| match value {
        Some(value) => format!("{value:width$.digits$}"),
        None => format!("{:>width$}", "-"),
    };
    [
        column(metrics.sim_displacement_cm, 8, 2),
        column(metrics.contact_area_cm2, 10, 1),
        column(metrics.interpenetration_volume_cm3, 10, 2),
        column(metrics.epsilon, 9, 2),
        column(metrics.max_penetration_mm, 14, 1),
    ]
    .concat()
}
