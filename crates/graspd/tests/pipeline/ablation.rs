//! The method without one of its parts, and the released code's variant.

use graspd::Validate;
use graspd::{ConstraintMethod, Losses, MethodPart, SynthesisSettings, draw_start, synthesize};
use graspd_hand::HandPose;

use crate::fixtures::{CAN, HAND};

/// Losses and poses along an optimisation, and the pose at its end.
fn traced(settings: &SynthesisSettings) -> (Vec<Losses>, Vec<HandPose>, HandPose) {
    let start = draw_start(&CAN, &*HAND, settings, 0, 0).expect("it has a surface");
    let (mut losses, mut poses) = (Vec::new(), Vec::new());
    let mut observe = |_: usize, pose: &HandPose, now: &Losses| {
        losses.push(*now);
        poses.push(pose.clone());
    };
    let end = synthesize::<f32>(&*HAND, &CAN.simulated, start, settings, &mut observe)
        .expect("the settings are valid");
    (losses, poses, end.pose)
}

#[test]
fn parts_are_found_by_name() {
    for part in [&MethodPart::FIRST_ORDER[..], &MethodPart::SOLVER].concat() {
        assert_eq!(part.name().parse(), Ok(part));
    }
    let fault = "mdm".parse::<MethodPart>().unwrap_err();
    assert!(fault.contains("mdmm"), "{fault}");
}

#[test]
fn each_part_left_out_is_in_the_settings_and_changes_the_grasp() {
    let whole = SynthesisSettings::soft().with_steps(400);
    let (_, _, usual) = traced(&whole);
    for part in MethodPart::FIRST_ORDER {
        let settings = whole.clone().without(part).expect("it has this part");
        assert_eq!(settings.preset, format!("soft-without-{}", part.name()));
        let text = toml::to_string(&settings).expect("settings are plain");
        let back: SynthesisSettings = toml::from_str(&text).expect("as written");
        assert_eq!(back, settings);
        let (losses, _, pose) = traced(&settings);
        assert_ne!(pose, usual, "{part:?}");
        // Without relaxation there are no targets for L_phys to compare with.
        let has_targets = losses.iter().any(|l| l.physics > 0.0);
        assert_eq!(has_targets, part != MethodPart::Relaxation, "{part:?}");
    }
}

#[test]
fn each_part_of_the_solver_is_left_out_by_one_setting() {
    let whole = SynthesisSettings::default();
    for part in MethodPart::SOLVER {
        let settings = whole.clone().without(part).expect("it has this part");
        settings.validate().expect("as valid as before");
        let [before, after] = [&whole, &settings].map(|settings| {
            let text = toml::to_string(settings.skin_fit.as_ref().expect("it has one"));
            text.expect("settings are plain")
        });
        let differing = before.lines().zip(after.lines()).filter(|(a, b)| a != b);
        assert_eq!(differing.count(), 1, "{part:?}");
    }
    for (settings, part) in [
        (whole, MethodPart::Mdmm),
        (SynthesisSettings::soft(), MethodPart::Task),
        (SynthesisSettings::annealing(), MethodPart::CoarseToFine),
    ] {
        let fault = settings.without(part).unwrap_err().to_string();
        assert!(
            fault.contains(part.name()) && fault.contains("preset"),
            "{fault}"
        );
    }
}

#[test]
fn without_relaxation_the_constraint_is_on_the_contacts() {
    let settings = SynthesisSettings::soft()
        .with_steps(300)
        .without(MethodPart::Relaxation)
        .expect("it has this part");
    let (losses, ..) = traced(&settings);
    // Nothing touches at the start, so nothing slows the object down.
    let expected: f64 = (settings.object_velocities.iter().flatten())
        .map(|v| v * v)
        .sum();
    let speed = losses[0].task;
    assert!((speed - expected).abs() < 1e-9, "{speed} {expected}");
    // Targets, in contrast, slow it down before anything touches.
    let (with_targets, ..) = traced(&SynthesisSettings::soft().with_steps(300));
    let least = (with_targets.iter()).fold(f64::INFINITY, |least, l| least.min(l.task));
    assert!(least < 0.5 * expected, "{least}");
}

#[test]
fn a_penalty_needs_a_weight() {
    for weight in [0.0, -1.0, f64::NAN] {
        let settings = SynthesisSettings {
            constraint_method: ConstraintMethod::Penalty { weight },
            ..SynthesisSettings::soft()
        };
        let fault = settings.validate().unwrap_err().to_string();
        assert!(fault.contains("penalty"), "{fault}");
    }
}

#[test]
fn the_released_variant_moves_the_base_first_at_its_own_rate() {
    let released = SynthesisSettings::released();
    assert_eq!((released.steps, released.warmup_steps), (10_000, 200));
    assert_eq!(released.standoff, 0.1);
    assert!(released.pose_uses_adam && released.block_coordinate);
    // Twice the size: starts and steps of the base are half as long in the real world.
    let simulation = released.simulation();
    assert_eq!(simulation.length_scale, 2.0);
    assert_eq!(simulation.contact.normal_stiffness, 2e6);
    assert!(simulation.nearest_sample_outside && simulation.contact.slides_at_zero_depth);
    let paper = SynthesisSettings::paper().simulation();
    assert!(!paper.nearest_sample_outside && !paper.contact.slides_at_zero_depth);
    let settings = SynthesisSettings {
        warmup_steps: 1,
        steps: 2,
        ..released
    };
    let (_, poses, _) = traced(&settings);
    let step = poses[1].translation - poses[0].translation;
    let joints = poses[1].articulation.iter().zip(&poses[0].articulation);
    for axis in 0..3 {
        assert!((step.get(axis).abs() - 0.5e-3).abs() < 1e-6, "{step:?}");
    }
    for (after, before) in joints {
        assert!(((after - before).abs() - 3e-3).abs() < 1e-5);
    }
}

/// With targets held, a block-coordinate step evaluates L_phys at the moved base.
#[test]
fn block_coordinate_steps_see_the_moved_base() {
    let whole = SynthesisSettings::soft().with_steps(600);
    let blocks = SynthesisSettings {
        block_coordinate: true,
        ..whole.clone()
    };
    let ((_, one, _), (losses, two, end)) = (traced(&whole), traced(&blocks));
    assert_eq!(one[1].translation, two[1].translation);
    assert_ne!(one[300], two[300]);
    assert!(losses.iter().all(|l| l.physics.is_finite()));
    assert!(end.articulation.iter().all(|value| value.is_finite()));
}
