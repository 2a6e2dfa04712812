//! Where the presets `paper` and `released` differ from the others by more than numbers.

use graspd::{
    GraspObject, Losses, NamedMesh, Synthesis, SynthesisSettings, draw_start, synthesize,
};
use graspd_hand::{Hand, HandPose, SkinnedHandOptions, human};
use nalgebra::UnitQuaternion;

use crate::fixtures::{CAN, HAND};

fn traced(
    hand: &dyn Hand,
    object: &GraspObject,
    settings: &SynthesisSettings,
) -> (Vec<Losses>, Vec<HandPose>, Synthesis) {
    let start = draw_start(object, hand, settings, 0, 0).expect("it has a surface");
    let (mut losses, mut poses) = (Vec::new(), Vec::new());
    let mut observe = |_: usize, pose: &HandPose, now: &Losses| {
        losses.push(*now);
        poses.push(pose.clone());
    };
    let end = synthesize::<f64>(hand, &object.simulated, start, settings, &mut observe)
        .expect("the settings are valid");
    (losses, poses, end)
}

/// The released code without the warm-up, in which steps are small.
fn released(steps: usize) -> SynthesisSettings {
    SynthesisSettings {
        warmup_steps: 1,
        steps,
        ..SynthesisSettings::released()
    }
}

#[test]
fn files_of_before_have_neither_setting_and_mean_what_they_meant() {
    for name in ["paper", "released", "soft"] {
        let settings = SynthesisSettings::preset(name).expect("it is listed");
        let mut table = toml::Table::try_from(&settings).expect("settings are plain numbers");
        for key in ["soft_hand_losses", "released_code"] {
            table.remove(key).expect("it is written");
        }
        let read: SynthesisSettings = table.try_into().expect("both have defaults");
        let before = SynthesisSettings {
            soft_hand_losses: true,
            released_code: false,
            ..settings
        };
        assert_eq!(read, before);
    }
}

#[test]
fn the_rotation_is_among_the_joints_of_the_released_code() {
    let (_, poses, _) = traced(&*HAND, &CAN, &released(2));
    let turn =
        UnitQuaternion::from(poses[1].rotation) * UnitQuaternion::from(poses[0].rotation).inverse();
    for (axis, angle) in turn.scaled_axis().iter().enumerate() {
        let moved = poses[1].translation - poses[0].translation;
        // In the real world, half of the larger one's.
        assert!((moved.get(axis).abs() - 0.5e-3).abs() < 1e-6);
        assert!((angle.abs() - 3e-3).abs() < 1e-4, "{angle}");
    }
}

/// The first step of an optimiser of its own moves each joint by its rate. One that has seen the gradient before the
/// base moved, too, moves it by rate times mean over root mean square of both, which is less.
#[test]
fn one_optimiser_sees_both_blocks_of_the_released_code() {
    /// Adam's epsilon against gradients of 1 and more.
    const EPSILON: f64 = 1e-8;
    let own = SynthesisSettings {
        released_code: false,
        ..released(2)
    };
    let least_move = |settings: &SynthesisSettings| {
        let (_, poses, _) = traced(&*HAND, &CAN, settings);
        let joints = poses[1].articulation.iter().zip(&poses[0].articulation);
        let shares = joints.map(|(after, before)| (after - before).abs() / 3e-3);
        shares.fold(f64::INFINITY, f64::min)
    };
    assert!((least_move(&own) - 1.0).abs() < 10.0 * EPSILON);
    let shared = least_move(&released(2));
    assert!(shared < 1.0 - 100.0 * EPSILON && shared > 0.5, "{shared}");
}

#[test]
fn every_object_weighs_the_same_in_the_released_code() {
    let heavy = |density: f64| {
        let source = NamedMesh::load("can", 1.0).expect("a built-in object");
        GraspObject::prepare(source, 32, density, &|_| {}).expect("it has a volume")
    };
    let objects = [heavy(500.0), heavy(2000.0)];
    let tasks = |settings: &SynthesisSettings| {
        let [light, heavy] = objects.each_ref().map(|object| {
            let (losses, ..) = traced(&*HAND, object, settings);
            losses.iter().map(|losses| losses.task).collect::<Vec<_>>()
        });
        (light, heavy)
    };
    let (light, heavy) = tasks(&released(50));
    assert_eq!(light, heavy);
    let (light, heavy) = tasks(&SynthesisSettings::paper().with_steps(50));
    assert_ne!(light, heavy);
}

#[test]
fn a_soft_hand_has_no_losses_of_its_own_in_the_paper() {
    let hand = human(&SkinnedHandOptions::default()).expect("these options are in range");
    let limits = hand.limits().expect("its joints have limits");
    let is_within = |pose: &HandPose| {
        let mut joints = pose.articulation.iter().zip(limits);
        joints.all(|(joint, limit)| limit.contains(*joint))
    };
    let run = |settings: &SynthesisSettings| traced(&hand, &CAN, settings);
    for settings in [SynthesisSettings::paper(), SynthesisSettings::released()] {
        let settings = settings.with_steps(300);
        let (losses, poses, end) = run(&settings);
        assert!(losses.iter().all(|l| l.range == 0.0 && l.limit == 0.0));
        assert!(!is_within(&end.pose), "{}", settings.preset);
        // Neither does L_inter move it.
        let other = SynthesisSettings {
            intersection_weight: 100.0,
            ..settings.clone()
        };
        assert_eq!(run(&other).1, poses);
        let whole = SynthesisSettings {
            soft_hand_losses: true,
            ..settings
        };
        let (losses, _, end) = run(&whole);
        assert!(losses.iter().all(|l| l.range > 0.0));
        assert!(is_within(&end.pose));
    }
}

#[test]
fn a_rigid_hand_has_all_losses_in_the_paper() {
    let paper = SynthesisSettings::paper().with_steps(100);
    let whole = SynthesisSettings {
        soft_hand_losses: true,
        ..paper.clone()
    };
    let (losses, poses, _) = traced(&*HAND, &CAN, &paper);
    assert!(losses.iter().all(|l| l.range > 0.0));
    assert_eq!(traced(&*HAND, &CAN, &whole).1, poses);
}
