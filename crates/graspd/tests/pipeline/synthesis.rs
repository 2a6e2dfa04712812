//! The optimisation of one grasp.

use std::ops::Range;

use graspd::{Losses, Synthesis, SynthesisSettings, draw_start, synthesize};
use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPose, Kinematics};
use graspd_sim::{Precision, Scene};
use nalgebra::UnitQuaternion;

use crate::fixtures::{CAN, HAND};

struct Traced {
    outcome: Synthesis,
    steps: Vec<usize>,
    poses: Vec<HandPose>,
    losses: Vec<Losses>,
}

fn traced<E: Precision>(settings: &SynthesisSettings) -> Traced
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let start = draw_start(&CAN, &*HAND, settings, 0, 0).expect("it has a surface");
    let (mut steps, mut poses, mut losses) = (Vec::new(), Vec::new(), Vec::new());
    let mut observe = |step: usize, pose: &HandPose, now: &Losses| {
        steps.push(step);
        poses.push(pose.clone());
        losses.push(*now);
    };
    let outcome = synthesize::<E>(&*HAND, &CAN.simulated, start, settings, &mut observe)
        .expect("the settings are valid");
    Traced {
        outcome,
        steps,
        poses,
        losses,
    }
}

/// One step from the start: by how much each number of the pose moved.
fn first_move(settings: &SynthesisSettings) -> (Vec3<f64>, Vec3<f64>, Vec<f64>) {
    let traced = traced::<f64>(&settings.clone().with_steps(2));
    let [before, after] = [&traced.poses[0], &traced.poses[1]];
    let turn =
        UnitQuaternion::from(after.rotation) * UnitQuaternion::from(before.rotation).inverse();
    let joints = after.articulation.iter().zip(&before.articulation);
    (
        after.translation - before.translation,
        Vec3::from(turn.scaled_axis()),
        joints.map(|(after, before)| after - before).collect(),
    )
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn the_shortest_runs_are_runs() {
    for steps in 1..=8 {
        for settings in [SynthesisSettings::default(), SynthesisSettings::paper()] {
            let traced = traced::<f32>(&settings.with_steps(steps));
            assert_eq!(traced.steps.len(), steps);
            assert!(traced.losses.iter().all(|l| l.physics.is_finite()));
        }
    }
}

#[test]
fn single_precision_follows_double_precision_at_the_start() {
    /// Contact positions are rounded to some 1e-8 m; the first contacts are 1e-3 m deep.
    const LOSSES: f64 = 1e-4;
    /// Steps of 3e-3 whose direction depends on losses.
    const POSES: f64 = 1e-6;
    /// Later the two drift apart, for contacts come and go at different steps.
    const COMPARED: usize = 20;
    let settings = SynthesisSettings::paper().with_steps(300);
    let (single, double) = (traced::<f32>(&settings), traced::<f64>(&settings));
    let close = |a: f64, b: f64| (a - b).abs() <= LOSSES * b.abs();
    let mut touched = false;
    for step in 0..COMPARED {
        let (a, b) = (&single.losses[step], &double.losses[step]);
        assert!(close(a.physics, b.physics), "step {step}: {a:?} {b:?}");
        assert!(close(a.task, b.task), "step {step}: {a:?} {b:?}");
        assert!(close(a.range, b.range), "step {step}: {a:?} {b:?}");
        touched |= b.physics > 1e3;

        let (a, b) = (&single.poses[step], &double.poses[step]);
        assert!(
            (a.translation - b.translation).norm() < POSES,
            "step {step}"
        );
        let joints = a.articulation.iter().zip(&b.articulation);
        assert!(
            joints.clone().all(|(a, b)| (a - b).abs() < POSES),
            "step {step}"
        );
    }
    assert!(touched, "no contact was compared");
}

/// The first step of Adam and Adamax moves every parameter by its rate, whatever the gradient.
#[test]
fn each_block_moves_at_its_own_rate() {
    /// The optimisers' small constant in the denominator, against gradients of 1e-3 at least.
    const TOLERANCE: f64 = 1e-4;
    for pose_uses_adam in [false, true] {
        let settings = SynthesisSettings {
            translation_rate: 1e-3,
            rotation_rate: 2e-3,
            articulation_rate: 4e-3,
            pose_uses_adam,
            ..SynthesisSettings::paper()
        };
        let (translation, rotation, joints) = first_move(&settings);
        let expect = |moved: f64, rate: f64| {
            assert!(
                (moved.abs() - rate).abs() < TOLERANCE * rate,
                "{moved} {rate}"
            );
        };
        for axis in 0..3 {
            expect(translation.get(axis), 1e-3);
            expect(rotation.get(axis), 2e-3);
        }
        assert!(joints.len() == 16);
        joints.iter().for_each(|&joint| expect(joint, 4e-3));

        // Of a warm-up over ten steps, the first takes a tenth.
        let warming = SynthesisSettings {
            warmup_steps: 10 * settings.steps / 2,
            ..settings
        };
        let (translation, ..) = first_move(&warming);
        expect(translation.get(0), 1e-4);
    }
}

#[test]
fn rates_decay_to_their_last_fraction() {
    let settings = SynthesisSettings {
        steps: 100,
        decay_start: 50,
        decay_factor: 1e-4,
        ..SynthesisSettings::paper()
    };
    let poses = traced::<f64>(&settings).poses;
    let moved = |step: usize| {
        let change = poses[step + 1].translation - poses[step].translation;
        (0..3)
            .map(|axis| change.get(axis).abs())
            .fold(0.0, f64::max)
    };
    // No update of Adamax is much larger than its rate.
    assert!(moved(98) < 1.1 * 3e-3 * 1.3e-4, "{}", moved(98));
    assert!(moved(0) > 0.99 * 3e-3, "{}", moved(0));
}

#[test]
fn the_paper_preset_brings_the_losses_down() {
    let settings = SynthesisSettings::paper();
    let Traced {
        outcome, losses, ..
    } = traced::<f32>(&settings);
    let (first, last) = (losses[0], outcome.losses);
    assert_eq!(last, losses[6999]);
    // The object moves with 0.01 (1, 1, 1) m/s in two of three simulations until something holds it.
    assert!((first.task - 6e-4).abs() < 1e-9, "{first:?}");
    assert_eq!(outcome.task_satisfied, last.task < settings.task_limit);
    assert!(last.range < 0.7 * first.range, "{first:?} {last:?}");

    // At constant rates single steps jitter; most of the last ones satisfy the task.
    let typical =
        |steps: Range<usize>, loss: fn(&Losses) -> f64| median(losses[steps].iter().map(loss));
    assert!(typical(6000..7000, |l| l.task) < settings.task_limit);
    // Once targets satisfy the task, L_phys falls from its peak.
    let [peak, late] = [800..1200, 6000..7000].map(|steps| typical(steps, |l| l.physics));
    assert!(late < 0.9 * peak, "{peak} {late}");

    // The hand has come from 10 cm away to the surface.
    let simulation = settings.simulation();
    let mut scene = Scene::<f64>::new(&*HAND, &CAN.simulated, &simulation);
    scene.place(&outcome.pose);
    let closest = scene.closest_distance();
    assert!((-5e-3..1e-3).contains(&closest), "{closest}");
}

#[test]
fn poses_stay_poses() {
    /// Quaternions are normalised after every step.
    const ROUNDING: f64 = 1e-14;
    let clamped = SynthesisSettings {
        clamp_joints: true,
        ..SynthesisSettings::soft().with_steps(400)
    };
    let unclamped = SynthesisSettings {
        clamp_joints: false,
        ..clamped.clone()
    };
    let limits = HAND.limits().expect("an Allegro hand has limits");
    let within = |pose: &HandPose| {
        let mut joints = pose.articulation.iter().zip(limits);
        joints.all(|(joint, limit)| limit.contains(*joint))
    };
    for settings in [clamped, unclamped] {
        let traced = traced::<f32>(&settings);
        for pose in traced.poses.iter().chain([&traced.outcome.pose]) {
            let q = pose.rotation;
            let norm = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
            assert!((norm - 1.0).abs() < ROUNDING, "{norm}");
        }
        // Unclamped, the constraint lets joints out of their limits on the way.
        assert_eq!(traced.poses.iter().all(within), settings.clamp_joints);
        assert!(within(&traced.outcome.pose));
    }
}

#[test]
fn every_step_is_observed_before_it_is_taken() {
    let settings = SynthesisSettings::default().with_steps(25);
    let start = draw_start(&CAN, &*HAND, &settings, 0, 0).expect("it has a surface");
    let (once, again) = (traced::<f32>(&settings), traced::<f32>(&settings));
    assert_eq!(once.steps, (0..25).collect::<Vec<_>>());
    assert_eq!(once.poses[0], start);
    assert_eq!(once.outcome.steps, 25);
    assert_eq!(once.outcome.losses, once.losses[24]);
    assert_ne!(once.outcome.pose, once.poses[24]);
    // The same start, the same way.
    assert_eq!(once.poses, again.poses);
    assert_eq!(once.outcome.pose, again.outcome.pose);
}

#[test]
fn a_dilated_object_is_touched_sooner() {
    let dilated = SynthesisSettings::paper().with_steps(200);
    let exact = SynthesisSettings {
        smoothing_steps: 0,
        ..dilated.clone()
    };
    // Contact shows as a jump of L_phys above what targets alone amount to.
    let first_contact = |settings: &SynthesisSettings| {
        let losses = traced::<f32>(settings).losses;
        let jump = losses
            .windows(2)
            .position(|pair| pair[1].physics > 3.0 * pair[0].physics + 10.0);
        jump.unwrap_or(losses.len())
    };
    let (early, late) = (first_contact(&dilated), first_contact(&exact));
    assert!(early < late && late < exact.steps, "{early} {late}");
}

#[test]
fn settings_out_of_range_are_refused_before_the_first_step() {
    let start = draw_start(&CAN, &*HAND, &SynthesisSettings::default(), 0, 0);
    let start = start.expect("it has a surface");
    let nothing = SynthesisSettings {
        steps: 0,
        ..SynthesisSettings::default()
    };
    let mut observe = |step: usize, _: &HandPose, _: &Losses| panic!("step {step}");
    let error = synthesize::<f32>(&*HAND, &CAN.simulated, start, &nothing, &mut observe)
        .expect_err("no steps");
    assert!(error.to_string().contains("`steps`"), "{error}");
}
