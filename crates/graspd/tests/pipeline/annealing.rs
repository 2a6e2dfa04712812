//! The annealing planner.

use graspd::Validate;
use graspd::{AnnealingSettings, SynthesisSettings, anneal, draw_start, start_rng};
use graspd_hand::HandPose;
use graspd_sim::Scene;

use crate::fixtures::{CAN, HAND};

fn planned(steps: usize, index: usize) -> (HandPose, HandPose, usize) {
    let settings = SynthesisSettings::annealing();
    let start = draw_start(&CAN, &*HAND, &settings, 0, index).expect("it has a surface");
    let mut rng = start_rng(0, "can", "annealing", index);
    let mut seen = 0;
    let mut observe = |_: usize| seen += 1;
    let annealing = AnnealingSettings::default();
    let pose = anneal(
        &*HAND,
        &CAN,
        &start,
        &annealing,
        steps,
        &mut rng,
        &mut observe,
    )
    .expect("the settings are valid");
    (start, pose, seen)
}

#[test]
fn plans_touch_and_hardly_enter() {
    let settings = SynthesisSettings::annealing();
    let simulation = settings.simulation();
    let mut scene = Scene::<f64>::new(&*HAND, &CAN.simulated, &simulation);
    for index in 0..3 {
        let (start, pose, seen) = planned(1500, index);
        assert_eq!(seen, 1500);
        assert_ne!(start, pose);
        scene.place(&pose);
        let closest = scene.closest_distance();
        // The approach and each joint stop at half a millimetre, from steps of half a millimetre and up to a degree.
        assert!((-1.1e-3..0.0).contains(&closest), "{closest}");
    }
}

#[test]
fn plans_are_repeatable_and_differ_by_start() {
    let (_, first, _) = planned(300, 0);
    assert_eq!(planned(300, 0).1, first);
    assert_ne!(planned(300, 1).1, first);
}

#[test]
fn settings_out_of_range_are_named() {
    let fault = |change: fn(&mut AnnealingSettings)| {
        let mut annealing = AnnealingSettings::default();
        change(&mut annealing);
        annealing.validate().unwrap_err().to_string()
    };
    assert!(fault(|s| s.amplitudes = 3).contains("`amplitudes`"));
    assert!(fault(|s| s.kept = 0).contains("`kept`"));
    assert!(fault(|s| s.alignment = f64::NAN).contains("`alignment`"));
    assert!(fault(|s| s.reach = -1.0).contains("`reach`"));
}
