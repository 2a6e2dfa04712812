//! Pre-grasps and squeezes.

use graspd::Validate;
use graspd::{ClosingOrder, ExecutionSettings, plan_pre_grasp, plan_squeeze};
use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPose, Kinematics, PointBuffer, closed_articulation};
use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};

use crate::fixtures::{CAN, HAND};

/// The distance grid of the fixture is this coarse \[m\].
const GRID: f64 = 2e-3;

/// The hand before the side of the can with its palm `gap` from the plane that touches it there, moved back by 3 cm so
/// that the thumb passes it, its fingers closed by `share`.
fn at_the_can(gap: f64, share: f64) -> HandPose {
    let palm = HAND.palm();
    // The palm faces -x, its fingers reach along y.
    let to = Rotation3::from_basis_unchecked(&[-Vector3::x(), Vector3::y(), -Vector3::z()]);
    let side = palm.normal.cross(&palm.fingers);
    let from = Rotation3::from_basis_unchecked(&[palm.normal, palm.fingers, side]);
    let rotation = to * from.inverse();
    let (low, high) = CAN.source.mesh.bounds().expect("a can");
    let middle = nalgebra::center(&low, &high);
    let center = Point3::new(high.x + gap, middle.y - 0.03, middle.z);
    HandPose {
        translation: Vec3::from(center - rotation * palm.center),
        rotation: UnitQuaternion::from_rotation_matrix(&rotation).into(),
        articulation: closed_articulation(&*HAND, share),
    }
}

fn contacts(pose: &HandPose) -> PointBuffer<f64> {
    let mut points = PointBuffer::zeros(HAND.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(HAND.collision_spheres().radius.len());
    HAND.forward(pose, &mut HAND.new_scratch(), &mut points, &mut spheres);
    points
}

/// Least exact distance of contact points and surface to the can.
fn distance(pose: &HandPose) -> f64 {
    let points = contacts(pose);
    let contacts = (0..points.len()).map(|i| Point3::from(points.get(i)));
    let surface = HAND.surface(pose).vertices;
    contacts
        .chain(surface)
        .map(|p| CAN.distance.signed_distance(&p))
        .fold(f64::INFINITY, f64::min)
}

/// The grasp that a closing hand ends in: the first share at which it is a little into the can.
fn closed_on_the_can() -> HandPose {
    (0..100)
        .map(|i| at_the_can(1e-3, f64::from(i) / 100.0))
        .find(|pose| distance(pose) < -5e-4)
        .expect("it closes on the can")
}

#[test]
fn the_way_from_pre_grasp_to_grasp_is_clear_of_the_object() {
    let grasp = closed_on_the_can();
    let settings = ExecutionSettings::default();
    let plan = plan_pre_grasp(&*HAND, &CAN, &grasp, &settings);
    assert!(plan.is_free, "{plan:?}");
    assert!(distance(&plan.pose) > 0.0 && plan.clearance > 0.0);
    let back = plan.pose.translation - grasp.translation;
    assert!(back.norm() >= settings.retreat - 1e-12);
    assert_eq!(plan.pose.rotation, grasp.rotation);
    let limits = HAND.limits().expect("limits");
    assert!(
        limits
            .iter()
            .zip(&plan.pose.articulation)
            .all(|(l, v)| l.contains(*v))
    );
    // Finer than the plan's own way points, against the exact distance.
    let deepest = distance(&grasp).min(0.0) - GRID;
    for i in 0..=40 {
        let s = f64::from(i) / 40.0;
        let (base, joints) = match plan.order {
            ClosingOrder::Together => (s, s),
            ClosingOrder::ApproachThenClose => ((2.0 * s).min(1.0), (2.0 * s - 1.0).max(0.0)),
        };
        let pose = HandPose {
            translation: plan.pose.translation - back * base,
            rotation: grasp.rotation,
            articulation: (plan.pose.articulation.iter().zip(&grasp.articulation))
                .map(|(a, b)| a + joints * (b - a))
                .collect(),
        };
        assert!(distance(&pose) > deepest, "{s}: {}", distance(&pose));
    }
}

#[test]
fn a_hand_that_cannot_get_away_says_so() {
    let grasp = at_the_can(-0.05, 0.3);
    let nowhere = ExecutionSettings {
        retreat: 0.0,
        ..ExecutionSettings::default()
    };
    let plan = plan_pre_grasp(&*HAND, &CAN, &grasp, &nowhere);
    assert!(!plan.is_free && plan.clearance < 0.0, "{plan:?}");
}

#[test]
fn a_squeeze_presses_the_contacts_into_the_object() {
    let grasp = closed_on_the_can();
    let settings = ExecutionSettings::default();
    let squeeze = plan_squeeze(&*HAND, &CAN, &grasp, &settings);
    let limits = HAND.limits().expect("limits");
    assert!(
        limits
            .iter()
            .zip(&squeeze.articulation)
            .all(|(l, v)| l.contains(*v))
    );
    let squeezed = HandPose {
        articulation: squeeze.articulation.clone(),
        ..grasp.clone()
    };
    assert!(
        distance(&squeezed) < distance(&grasp) - 1e-3,
        "{}",
        distance(&squeezed)
    );

    // Virtual work: torques times a small joint movement = forces times the contacts' movement. The force on each
    // contact is 10 N times its share of the depth below the band.
    let points = contacts(&grasp);
    let sdf = CAN.simulated.sdf();
    let weights = &HAND.contact_points().weight;
    let at: Vec<_> = (0..points.len())
        .map(|i| sdf.distance_and_gradient(points.get(i)))
        .collect();
    let reach = at
        .iter()
        .map(|a| a.0)
        .fold(f64::INFINITY, f64::min)
        .max(0.0)
        + 5e-4;
    let size = |i: usize| (reach - at[i].0).max(0.0) * f64::from(weights[i]);
    let total: f64 = (0..points.len()).map(size).sum();
    for joint in 0..16 {
        let work = |amount: f64| {
            let mut pose = grasp.clone();
            pose.articulation[joint] += amount;
            let moved = contacts(&pose);
            (0..points.len())
                .map(|i| {
                    -at[i].1.normalize_or_zero().dot(moved.get(i)) * size(i) / total
                        * settings.squeeze_force
                })
                .sum::<f64>()
        };
        let expected = (work(1e-5) - work(-1e-5)) / 2e-5;
        assert!((squeeze.torques[joint] - expected).abs() < 1e-7, "{joint}");
    }
    // No force, no torque; no displacement, no movement.
    let none = ExecutionSettings {
        squeeze: 0.0,
        squeeze_force: 0.0,
        ..settings
    };
    let still = plan_squeeze(&*HAND, &CAN, &grasp, &none);
    assert_eq!(still.articulation, grasp.articulation);
    assert!(still.torques.iter().all(|torque| *torque == 0.0));
}

#[test]
fn settings_out_of_range_are_named() {
    let good = ExecutionSettings::default();
    good.validate().expect("the defaults are in range");
    for (bad, field) in [
        (
            ExecutionSettings {
                retreat: -0.1,
                ..good
            },
            "retreat",
        ),
        (
            ExecutionSettings {
                squeeze: f64::NAN,
                ..good
            },
            "squeeze",
        ),
        (
            ExecutionSettings {
                squeeze_force: f64::INFINITY,
                ..good
            },
            "squeeze_force",
        ),
    ] {
        let message = bad.validate().expect_err("out of range").to_string();
        assert!(message.contains(field), "{message}");
    }
}
