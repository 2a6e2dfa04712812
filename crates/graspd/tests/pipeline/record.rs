//! Records: what they say, and what they refuse to say.

use graspd::{
    GraspError, GraspRecord, OptimizerRecord, PreGrasp, RecordedPose, SCHEMA, Seconds, Squeeze,
    named_joints,
};
use graspd_eval::GraspMetrics;
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::HandPose;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::fixtures::bare_record;

/// Every field of a record, in the order that the format gives.
const FIELDS: [&str; 17] = [
    "schema",
    "object",
    "object_path",
    "object_scale",
    "object_repair",
    "hand",
    "seed",
    "index",
    "pose",
    "joints_rad",
    "mano",
    "pre_grasp",
    "squeeze",
    "metrics",
    "optimizer",
    "rank",
    "seconds",
];

fn names(count: usize) -> Vec<String> {
    (0..count).map(|k| format!("joint_{k}.0")).collect()
}

fn record_of(pose: &HandPose) -> GraspRecord {
    GraspRecord {
        pose: RecordedPose::from(pose),
        joints_rad: Some(named_joints(
            &names(pose.articulation.len()),
            &pose.articulation,
        )),
        ..bare_record(0)
    }
}

fn complete_record() -> GraspRecord {
    let pose = bare_record(0).pose;
    let joints = named_joints(&names(2), &[0.1, -0.2]);
    GraspRecord {
        object_path: Some("some folder/mug.obj".into()),
        object_repair: Some("mended".into()),
        seed: Some(u64::MAX),
        joints_rad: Some(joints.clone()),
        mano: Some(json!({"pca": [0.5], "shape": []})),
        pre_grasp: Some(PreGrasp {
            pose,
            joints_rad: joints.clone(),
            order: Some("together".into()),
            clearance_m: Some(0.01),
            is_free: Some(true),
        }),
        squeeze: Some(Squeeze {
            torques_nm: Some(joints.clone()),
            joints_rad: joints,
            force_n: Some(10.0),
        }),
        metrics: Some(GraspMetrics {
            contact_area_cm2: Some(42.6),
            ..GraspMetrics::default()
        }),
        optimizer: Some(OptimizerRecord {
            preset: "paper".into(),
            steps: 7000,
            l_phys: 1e-3,
            l_task: 2e-5,
            l_range: 0.5,
            l_limit: 0.0,
            l_inter: 1e-9,
            task_satisfied: true,
        }),
        rank: Some(1),
        seconds: Some(Seconds {
            synthesis: 3.5,
            evaluation: 0.25,
        }),
        ..bare_record(3)
    }
}

/// Bits, for comparisons that tell 0 from -0.
fn bits(pose: &HandPose) -> Vec<u64> {
    let (t, q) = (pose.translation, pose.rotation);
    let base = [t.x, t.y, t.z, q.w, q.x, q.y, q.z];
    let all = base.iter().chain(&pose.articulation);
    all.map(|v| v.to_bits()).collect()
}

fn fault(record: &GraspRecord, joints: usize) -> String {
    let error = record
        .hand_pose(&names(joints))
        .expect_err("it is unusable");
    assert!(matches!(error, GraspError::InvalidRecord { .. }));
    error.to_string()
}

prop_compose! {
    /// Any pose that a hand can have.
    fn poses()(
        translation in prop::array::uniform3(
            prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        ),
        turn in prop::array::uniform3(-4.0..4.0f64),
        articulation in prop::collection::vec(-3.0..3.0f64, 0..17),
    ) -> HandPose {
        HandPose {
            translation: translation.into(),
            rotation: Quaternion::exp(Vec3::from(turn)).normalize(),
            articulation,
        }
    }
}

proptest! {
    #[test]
    fn poses_pass_through_text_bit_for_bit(pose in poses()) {
        let text = serde_json::to_string(&record_of(&pose)).expect("plain numbers");
        let read: GraspRecord = serde_json::from_str(&text).expect("what was just written");
        let again = read.hand_pose(&names(pose.articulation.len())).expect("a proper pose");
        prop_assert_eq!(bits(&again), bits(&pose));
    }

    /// What is not unit was written by others, perhaps in single precision.
    #[test]
    fn rotations_are_made_unit(pose in poses(), factor in 0.01..100.0f64) {
        let mut record = record_of(&pose);
        record.pose.rotation_wxyz = record.pose.rotation_wxyz.map(|v| v * factor);
        let q = record.hand_pose(&names(pose.articulation.len())).expect("a proper pose").rotation;
        let p = pose.rotation;
        for (a, b) in [(q.w, p.w), (q.x, p.x), (q.y, p.y), (q.z, p.z)] {
            // Within 1e-9 of unit counts as unit.
            prop_assert!((a - b).abs() < 2e-9);
        }
    }
}

#[test]
fn records_hold_the_whole_format_with_null_for_what_is_absent() {
    let text = serde_json::to_string(&bare_record(3)).expect("plain numbers");
    let positions = FIELDS.map(|field| text.find(&format!("\"{field}\":")).expect(field));
    assert!(positions.is_sorted(), "{text}");

    let value: Value = serde_json::from_str(&text).expect("what was just written");
    assert_eq!(
        value.as_object().map(serde_json::Map::len),
        Some(FIELDS.len())
    );
    let absent = [
        "object_path",
        "object_repair",
        "seed",
        "joints_rad",
        "mano",
        "pre_grasp",
        "squeeze",
        "metrics",
        "optimizer",
        "rank",
        "seconds",
    ];
    for field in FIELDS {
        assert_eq!(value[field].is_null(), absent.contains(&field), "{field}");
    }
    assert_eq!(value["schema"], SCHEMA);
    assert_eq!(value["index"], 3);
    assert_eq!(value["pose"]["rotation_wxyz"], json!([1.0, 0.0, 0.0, 0.0]));

    let complete = serde_json::to_value(complete_record()).expect("plain numbers");
    for field in FIELDS {
        assert!(!complete[field].is_null(), "{field}");
    }
    let metrics = complete["metrics"].as_object().expect("metrics");
    assert_eq!(metrics["contact_area_cm2"], 42.6);
    assert!(metrics["epsilon"].is_null());
    for field in [
        "interpenetration_volume_cm3",
        "ca_over_iv",
        "gws_volume",
        "sim_displacement_cm",
        "max_penetration_mm",
    ] {
        assert!(metrics.contains_key(field), "{field}");
    }
}

#[test]
fn records_survive_their_text() {
    for record in [bare_record(0), complete_record()] {
        let text = serde_json::to_string(&record).expect("plain numbers");
        assert!(!text.contains('\n'));
        let read: GraspRecord = serde_json::from_str(&text).expect("what was just written");
        assert_eq!(read, record);
    }
}

#[test]
fn a_missing_joint_is_named_and_others_are_ignored() {
    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: vec![0.5, 0.25, 0.125],
    };
    let record = record_of(&pose);
    let swapped = ["joint_2.0", "joint_0.0"].map(String::from);
    let read = record.hand_pose(&swapped).expect("both are there");
    assert_eq!(read.articulation, [0.125, 0.5]);

    let text = fault(&record, 4);
    assert!(text.contains("joint_3.0"), "{text}");
    let text = fault(&bare_record(7), 1);
    assert!(text.contains("joints_rad") && text.contains('7'), "{text}");
}

#[test]
fn numbers_that_are_no_pose_are_refused() {
    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: vec![0.5],
    };
    let damage: [fn(&mut GraspRecord, f64); 3] = [
        |record, bad| record.pose.translation_m[1] = bad,
        |record, bad| record.pose.rotation_wxyz[2] = bad,
        |record, bad| {
            let joints = record.joints_rad.get_or_insert_default();
            joints.insert("joint_0.0".into(), bad);
        },
    ];
    for damage in damage {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut record = record_of(&pose);
            damage(&mut record, bad);
            assert!(fault(&record, 1).contains("not finite"));
        }
    }
    let mut record = record_of(&pose);
    record.pose.rotation_wxyz = [0.0; 4];
    assert!(fault(&record, 1).contains("zero quaternion"));
}
