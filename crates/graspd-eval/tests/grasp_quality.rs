//! Epsilon and volume of whole grasps: closed forms, invariances, and values that Qhull computed.

use graspd_eval::{
    Contact, EpsilonSettings, EvaluationError, FRICTION_EDGES, GraspQuality, NotForceClosure,
    VolumeMethod, convex_hull, ferrari_canny, grasp_quality, grasp_wrenches,
};
use nalgebra::{Point3, Rotation3, Vector3};
use proptest::prelude::*;

/// Rounding in the depth and volume of hulls of order 1.
const ROUNDING: f64 = 1e-12;
/// Agreement asked of two implementations of the same arithmetic.
const REFERENCE: f64 = 1e-9;

fn quality_of(contacts: &[Contact], friction: f64) -> GraspQuality {
    let wrenches = grasp_wrenches(contacts, friction, FRICTION_EDGES, Point3::origin(), 1.0);
    grasp_quality(&wrenches).unwrap()
}

fn on_unit_sphere(outward: [f64; 3]) -> Contact {
    let outward = Vector3::from(outward).normalize();
    Contact {
        point: outward.into(),
        normal: -outward,
    }
}

/// `count` contacts spread over the unit sphere along a spiral.
fn spiral(count: usize) -> Vec<Contact> {
    let at = |k: usize| {
        let height = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (sine, cosine) = (2.4 * k as f64).sin_cos();
        let radius = (1.0 - height * height).sqrt();
        on_unit_sphere([radius * cosine, radius * sine, height])
    };
    (0..count).map(at).collect()
}

fn read_wrenches(path: &std::path::Path) -> Vec<[f64; 6]> {
    let text = std::fs::read_to_string(path).expect("a readable file");
    let parse = |line: &str| -> Vec<f64> {
        line.split(',')
            .map(|field| field.trim().parse().expect("a number"))
            .collect()
    };
    text.lines()
        .map(|line| parse(line).try_into().expect("six numbers"))
        .collect()
}

#[test]
fn epsilon_and_volume_agree_with_qhull() {
    let Some(expected) = graspd_geom::shared_file("reference/gws/expected.json") else {
        return;
    };
    let text = std::fs::read_to_string(&expected).expect("a readable file");
    let expected: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for name in ["N4", "N8", "N16", "N32", "N64", "N128"] {
        let Some(path) = graspd_geom::shared_file(&format!("reference/gws/{name}.csv")) else {
            return;
        };
        let wrenches = read_wrenches(&path);
        let hull = convex_hull(&wrenches).unwrap();
        let case = &expected["cases"][name]["with_origin"];
        let reference = |key: &str| case[key].as_f64().expect("a number");
        let close = |value: f64, key: &str| {
            let error = (value / reference(key) - 1.0).abs();
            assert!(error < REFERENCE, "{name}: {key} {value} is off by {error}");
        };
        close(hull.origin_depth().unwrap(), "epsilon");
        close(hull.volume, "volume");
        let bounds = ferrari_canny(&wrenches, &EpsilonSettings::sum()).unwrap();
        close(bounds.lower, "epsilon");
        close(bounds.upper, "epsilon");
        // With few contacts many facets hold a whole friction polygon, and triangulations differ.
        if wrenches.len() <= 64 {
            let quality = grasp_quality(&wrenches).unwrap();
            assert!(quality.epsilon.is_force_closure());
            assert_eq!(quality.volume.method, VolumeMethod::Exact);
            close(quality.volume.value, "volume");
        } else {
            assert_eq!(hull.facets.len() as f64, reference("facets"), "{name}");
        }
    }
}

/// Four frictionless contacts on each face of the cube [-1, 1]^3, `arm` from the face's centre along its axes.
///
/// The wrenches are (+-e_i; +-arm e_j), j != i, so the support function of their hull at (f; t) is
/// `max_i (|f_i| + arm max_{j != i} |t_j|)`. Its least value over unit vectors is reached for f alone or t alone,
/// on a diagonal: min(1, arm) / sqrt(3).
#[test]
fn frictionless_contacts_on_a_cube_have_a_known_epsilon() {
    for arm in [0.25, 0.5, 1.0, 1.7] {
        let mut contacts = Vec::new();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                for other in [(axis + 1) % 3, (axis + 2) % 3] {
                    for end in [-arm, arm] {
                        let mut contact = Contact {
                            point: Point3::origin(),
                            normal: Vector3::zeros(),
                        };
                        contact.point[axis] = side;
                        contact.point[other] = end;
                        contact.normal[axis] = -side;
                        contacts.push(contact);
                    }
                }
            }
        }
        let quality = quality_of(&contacts, 0.0);
        let expected = arm.min(1.0) / 3f64.sqrt();
        assert!(
            (quality.epsilon.value - expected).abs() < ROUNDING,
            "{:?} {expected}",
            quality.epsilon
        );
        assert!(quality.epsilon.is_force_closure());
    }
}

#[test]
fn frictionless_contacts_on_a_sphere_resist_no_torque() {
    let quality = quality_of(&spiral(30), 0.0);
    assert_eq!(quality.epsilon.value, 0.0);
    assert_eq!(quality.volume.value, 0.0);
    assert_eq!(
        quality.epsilon.reason,
        Some(NotForceClosure::Flat {
            affine_dimension: 3
        })
    );
}

#[test]
fn two_hard_fingers_resist_no_torque_about_their_line() {
    let contacts = [
        on_unit_sphere([0.3, -0.5, 0.8]),
        on_unit_sphere([-0.3, 0.5, -0.8]),
    ];
    let quality = quality_of(&contacts, 0.8);
    assert!(!quality.epsilon.is_force_closure());
    assert_eq!(
        quality.epsilon.reason,
        Some(NotForceClosure::Flat {
            affine_dimension: 5
        })
    );
}

#[test]
fn contacts_on_one_side_cannot_balance() {
    let contacts: Vec<_> = spiral(24)
        .into_iter()
        .filter(|contact| contact.point.z > 0.5)
        .collect();
    let quality = quality_of(&contacts, 0.3);
    assert_eq!(quality.epsilon.value, 0.0);
    assert!(quality.volume.value > 0.0);
    let Some(NotForceClosure::OriginOutside { separation }) = quality.epsilon.reason else {
        panic!("{quality:?}");
    };
    // A lower bound; the hull is at least 0.5 - 0.3 away, for every force has that component downwards.
    assert!(separation > 0.0);
    let wrenches = grasp_wrenches(&contacts, 0.3, 8, Point3::origin(), 1.0);
    let bounds = ferrari_canny(&wrenches, &EpsilonSettings::sum()).unwrap();
    assert_eq!((bounds.lower, bounds.upper), (0.0, 0.0));
}

#[test]
fn nothing_and_nonsense_have_reasons() {
    let nothing = grasp_quality(&[]).unwrap();
    assert_eq!(nothing.epsilon.reason, Some(NotForceClosure::NoContacts));
    assert_eq!((nothing.epsilon.value, nothing.volume.value), (0.0, 0.0));
    let nonsense = grasp_quality(&[[0.0; 6], [f64::INFINITY; 6]]);
    assert_eq!(nonsense, Err(EvaluationError::NotFinite { index: 1 }));
    assert!(ferrari_canny(&[[f64::NAN; 6]], &EpsilonSettings::each(1)).is_err());
}

/// Pure torque about a diagonal is resisted by friction alone, at each contact by two components of 1/sqrt(3)
/// that an edge at 45 degrees serves best: epsilon is at most mu sqrt(2/3), and that is what it is.
#[test]
fn six_contacts_on_the_axes_resist_torque_about_a_diagonal_least() {
    let axes = [
        [1, 0, 0],
        [-1, 0, 0],
        [0, 1, 0],
        [0, -1, 0],
        [0, 0, 1],
        [0, 0, -1],
    ];
    let contacts = axes.map(|axis| on_unit_sphere(axis.map(f64::from)));
    for friction in [0.2, 0.5, 0.8] {
        let epsilon = quality_of(&contacts, friction).epsilon.value;
        assert!((epsilon - friction * (2.0 / 3.0f64).sqrt()).abs() < ROUNDING);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    /// A rotation of the object rotates the wrench space; its epsilon and volume stay.
    #[test]
    fn rotated_wrenches_have_the_same_quality(
        count in 4usize..9, axis in prop::array::uniform3(-2.0f64..2.0), friction in 0.2f64..1.0,
    ) {
        let wrenches = grasp_wrenches(&spiral(count), friction, 6, Point3::new(0.1, 0.0, 0.2), 1.1);
        let rotation = Rotation3::from_scaled_axis(Vector3::from(axis));
        let rotate = |w: &[f64; 6]| {
            let force = rotation * Vector3::new(w[0], w[1], w[2]);
            let torque = rotation * Vector3::new(w[3], w[4], w[5]);
            [force.x, force.y, force.z, torque.x, torque.y, torque.z]
        };
        let rotated: Vec<_> = wrenches.iter().map(rotate).collect();
        let (before, after) = (grasp_quality(&wrenches).unwrap(), grasp_quality(&rotated).unwrap());
        prop_assert!((before.epsilon.value - after.epsilon.value).abs() < ROUNDING);
        prop_assert!((before.volume.value - after.volume.value).abs() < ROUNDING);
    }

    /// Sizes and positions of the object do not matter, for torques are scaled by its radius.
    #[test]
    fn larger_objects_elsewhere_have_the_same_quality(
        size in 0.01f64..100.0, shift in prop::array::uniform3(-1.0f64..1.0),
    ) {
        let contacts = spiral(6);
        let shift = Vector3::from(shift) * size;
        let moved: Vec<_> = contacts
            .iter()
            .map(|contact| Contact { point: contact.point * size + shift, ..*contact })
            .collect();
        let before = quality_of(&contacts, 0.7);
        let wrenches = grasp_wrenches(&moved, 0.7, FRICTION_EDGES, Point3::from(shift), size);
        let after = grasp_quality(&wrenches).unwrap();
        prop_assert!((before.epsilon.value - after.epsilon.value).abs() < ROUNDING);
        prop_assert!((before.volume.value - after.volume.value).abs() < ROUNDING);
    }

    /// Whatever torques are divided by, the volume is divided by its cube.
    #[test]
    fn volume_scales_with_the_cube_of_the_torque_scale(scale in 0.1f64..10.0) {
        let contacts = spiral(6);
        let at = |scale| {
            grasp_quality(&grasp_wrenches(&contacts, 0.7, 8, Point3::origin(), scale)).unwrap()
        };
        let ratio = at(1.0).volume.value / at(scale).volume.value;
        prop_assert!((ratio / scale.powi(3) - 1.0).abs() < REFERENCE);
    }

    /// Dividing torques by t times as much squeezes the space along them by 1/t: the ball in it
    /// shrinks by no more than that, and never grows.
    #[test]
    fn epsilon_falls_with_the_torque_scale_but_no_faster(scale in 0.2f64..2.0, ratio in 1.0f64..5.0) {
        let contacts = spiral(6);
        let at = |scale| {
            let wrenches = grasp_wrenches(&contacts, 0.7, 8, Point3::origin(), scale);
            grasp_quality(&wrenches).unwrap().epsilon.value
        };
        let (small, large) = (at(scale), at(scale * ratio));
        prop_assert!(large <= small + ROUNDING);
        prop_assert!(large >= small / ratio - ROUNDING);
    }

    #[test]
    fn more_friction_and_more_contacts_never_hurt(count in 4usize..8, friction in 0.1f64..0.9) {
        let contacts = spiral(count);
        let base = quality_of(&contacts, friction);
        let rougher = quality_of(&contacts, friction + 0.1);
        let mut more = contacts.clone();
        more.push(on_unit_sphere([0.2, 0.9, -0.1]));
        prop_assert!(quality_of(&more, friction).epsilon.value >= base.epsilon.value - ROUNDING);
        prop_assert!(rougher.volume.value >= base.volume.value);
        prop_assert!(rougher.epsilon.value >= base.epsilon.value - ROUNDING);
    }
}
