//! Epsilon under both limits of the contacts' forces, with hard and soft fingers.

use graspd_eval::{
    Contact, Epsilon, EpsilonSettings, EvaluationError, FingerModel, ForceLimit, NotForceClosure,
    OriginDepth, ferrari_canny, largest_radius, origin_depth,
};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

/// Rounding in depths of order 1.
const ROUNDING: f64 = 1e-12;
/// What the search leaves between its bounds, relative to epsilon, and rounding.
const GAP: f64 = 1.1e-6;

const BOTH: [ForceLimit; 2] = [ForceLimit::Sum, ForceLimit::Each];

fn epsilon(contacts: &[Contact], finger: &FingerModel, limit: ForceLimit) -> Epsilon {
    scaled_epsilon(contacts, finger, limit, Point3::origin(), 1.0)
}

fn scaled_epsilon(
    contacts: &[Contact],
    finger: &FingerModel,
    limit: ForceLimit,
    center: Point3<f64>,
    torque_scale: f64,
) -> Epsilon {
    let wrenches = finger.wrenches(contacts, center, torque_scale);
    let settings = match limit {
        ForceLimit::Sum => EpsilonSettings::sum(),
        ForceLimit::Each => EpsilonSettings::each(finger.wrenches_per_contact()),
    };
    ferrari_canny(&wrenches, &settings).unwrap()
}

fn on_unit_sphere(outward: [f64; 3]) -> Contact {
    let outward = Vector3::from(outward).normalize();
    Contact {
        point: outward.into(),
        normal: -outward,
    }
}

/// The six ends of the axes.
fn axes() -> Vec<Contact> {
    let end = |i: usize| {
        let mut end = [0.0; 3];
        end[i / 2] = [1.0, -1.0][i % 2];
        on_unit_sphere(end)
    };
    (0..6).map(end).collect()
}

fn random_contacts() -> impl Strategy<Value = Vec<Contact>> {
    let outward = prop::array::uniform3(-1.0f64..1.0);
    prop::collection::vec(outward, 4..8).prop_map(|raw| {
        raw.into_iter()
            .filter(|v| Vector3::from(*v).norm() > 0.1)
            .map(on_unit_sphere)
            .collect()
    })
}

/// Two soft fingers that face each other resist torque about their line by torsional friction alone: the L1 measure
/// allows gamma, and the L-infinity measure 2 gamma.
///
/// The weakest wrench has a little tangential force too, because pyramids lie within the ellipsoid: by the angle a at
/// which the ring at 45 degrees, seen between two edges, takes over from the pole,
/// `tan a = (sqrt(2) - 1) gamma / (mu cos(pi / 8))`.
#[test]
fn soft_fingers_hold_with_two_where_hard_ones_cannot() {
    let pair = [
        on_unit_sphere([0.0, 0.0, 1.0]),
        on_unit_sphere([0.0, 0.0, -1.0]),
    ];
    let hard = FingerModel::hard(0.8, 8);
    for limit in BOTH {
        let epsilon = epsilon(&pair, &hard, limit);
        let flat = NotForceClosure::Flat {
            affine_dimension: 5,
        };
        assert_eq!((epsilon.value, epsilon.reason), (0.0, Some(flat)));
    }
    for gamma in [0.02, 0.1] {
        let soft = FingerModel {
            torsional_friction: gamma,
            ..hard
        };
        let tangent = (2f64.sqrt() - 1.0) * gamma / (0.8 * std::f64::consts::FRAC_PI_8.cos());
        let expected = gamma * tangent.atan().cos();
        let sum = epsilon(&pair, &soft, ForceLimit::Sum);
        assert!(
            (sum.value - expected).abs() < ROUNDING,
            "{sum:?} {expected}"
        );
        let each = epsilon(&pair, &soft, ForceLimit::Each);
        // Together they resist twice gamma about their line, and somewhat less with a tangential force beside it.
        assert!(
            each.upper <= 2.0 * gamma && each.lower > 1.95 * gamma,
            "{each:?}"
        );
    }
}

/// Six frictional contacts on the axes, pure torque about a diagonal: each contributes mu sqrt(2/3) (L1), all six
/// together six times that; no direction is weaker.
#[test]
fn six_contacts_with_a_limit_each_resist_torque_together() {
    for friction in [0.2, 0.5] {
        let finger = FingerModel::hard(friction, 8);
        let sum = epsilon(&axes(), &finger, ForceLimit::Sum);
        assert!((sum.value - friction * (2.0 / 3.0f64).sqrt()).abs() < ROUNDING);
        let each = epsilon(&axes(), &finger, ForceLimit::Each);
        assert!(each.lower <= each.upper && each.upper - each.lower <= GAP * each.upper);
        // Torque about an axis: four contacts, each with mu.
        assert!(each.upper <= 4.0 * friction + ROUNDING, "{each:?}");
        assert!(each.lower >= sum.value, "{each:?}");
    }
}

/// Frictionless contacts with 0 are one segment each, and the sum of segments is a zonotope that can be listed.
#[test]
fn the_limit_on_each_is_that_of_all_listed_sums() {
    let mut contacts = Vec::new();
    for (i, axis_end) in axes().into_iter().enumerate() {
        let mut offset = Vector3::zeros();
        offset[(i / 2 + 1) % 3] = 0.4 + 0.1 * i as f64;
        for sign in [1.0, -1.0] {
            contacts.push(Contact {
                point: axis_end.point + offset * sign,
                ..axis_end
            });
        }
    }
    let finger = FingerModel::hard(0.0, 8);
    let wrenches = finger.wrenches(&contacts, Point3::origin(), 1.0);
    assert_eq!(wrenches.len(), 12);
    let mut sums = vec![[0.0; 6]];
    for wrench in &wrenches {
        let with: Vec<[f64; 6]> = sums
            .iter()
            .map(|sum| std::array::from_fn(|k| sum[k] + wrench[k]))
            .collect();
        sums.extend(with);
    }
    let settings = EpsilonSettings::each(1);
    let OriginDepth::Between(listed) = origin_depth(&sums, &settings.search).unwrap() else {
        panic!("the contacts span all wrenches");
    };
    let each = ferrari_canny(&wrenches, &settings).unwrap();
    assert!(each.value > 0.1);
    assert!(
        (each.value - listed.lower).abs() < GAP * each.value,
        "{each:?} {listed:?}"
    );
}

#[test]
fn reasons_are_the_same_under_both_limits() {
    let one_sided = [[0.5, 0.0, 1.0], [-0.4, 0.4, 1.0], [-0.4, -0.5, 1.0]].map(on_unit_sphere);
    let finger = FingerModel::hard(0.3, 6);
    for limit in BOTH {
        assert_eq!(
            epsilon(&[], &finger, limit).reason,
            Some(NotForceClosure::NoContacts)
        );
        let outside = epsilon(&one_sided, &finger, limit);
        assert!(
            matches!(outside.reason, Some(NotForceClosure::OriginOutside { .. })),
            "{outside:?}"
        );
        assert_eq!(
            (outside.value, outside.lower, outside.upper),
            (0.0, 0.0, 0.0)
        );
    }
    let bad = ferrari_canny(&[[1.0; 6], [f64::NAN; 6]], &EpsilonSettings::each(1));
    assert_eq!(bad, Err(EvaluationError::NotFinite { index: 1 }));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    /// Another contact adds wrenches to the space and takes none away.
    #[test]
    fn adding_a_contact_never_lowers_epsilon(
        contacts in random_contacts(), friction in 0.2f64..0.9, extra in prop::array::uniform3(0.1f64..1.0),
    ) {
        let finger = FingerModel::hard(friction, 5);
        let mut more = contacts.clone();
        more.push(on_unit_sphere(extra));
        for limit in BOTH {
            let (before, after) = (epsilon(&contacts, &finger, limit), epsilon(&more, &finger, limit));
            prop_assert!(after.upper >= before.lower * (1.0 - GAP), "{limit:?} {before:?} {after:?}");
        }
    }

    /// Epsilon about the centre of mass is the same wherever the object with its contacts is carried, and in
    /// whatever order the contacts come.
    #[test]
    fn rigid_motions_and_the_order_of_contacts_change_nothing(
        contacts in random_contacts(),
        shift in prop::array::uniform3(-1.0f64..1.0), turn in prop::array::uniform3(-3.0f64..3.0),
    ) {
        // Frictionless but soft: the wrench set has no tangents whose choice depends on the frame.
        let finger = FingerModel { friction: 0.0, edges: 8, torsional_friction: 0.3 };
        let off: Vec<_> = contacts
            .iter()
            .enumerate()
            .map(|(i, contact)| {
                let point = contact.point * (1.0 + 0.1 * i as f64) + Vector3::x() * 0.2;
                Contact { point, ..*contact }
            })
            .chain(axes())
            .collect();
        let motion = Isometry3::new(Vector3::from(shift), Vector3::from(turn));
        let mut moved: Vec<_> = off
            .iter()
            .map(|contact| Contact { point: motion * contact.point, normal: motion * contact.normal })
            .collect();
        moved.reverse();
        let center = motion * Point3::origin();
        for limit in BOTH {
            let before = epsilon(&off, &finger, limit);
            let after = scaled_epsilon(&moved, &finger, limit, center, 1.0);
            let scale = before.value.max(1e-3);
            let tolerance = if limit == ForceLimit::Sum { ROUNDING } else { GAP * scale };
            prop_assert!((before.value - after.value).abs() <= tolerance, "{limit:?} {before:?} {after:?}");
        }
    }

    /// A torque scale s divides torques by s, so for s >= 1 epsilon lies between its value at 1 over s and that
    /// value; an object, its contacts and the scale may grow together without effect.
    #[test]
    fn the_torque_scale_bounds_epsilon_and_follows_the_object(
        contacts in random_contacts(), scale in 1.0f64..5.0, size in 0.01f64..10.0,
    ) {
        let finger = FingerModel { friction: 0.5, edges: 6, torsional_friction: 0.1 };
        for limit in BOTH {
            let unit = epsilon(&contacts, &finger, limit);
            let larger = scaled_epsilon(&contacts, &finger, limit, Point3::origin(), scale);
            prop_assert!(larger.lower <= unit.upper * (1.0 + GAP));
            prop_assert!(larger.upper >= unit.lower / scale * (1.0 - GAP));
            let grown: Vec<_> = contacts
                .iter()
                .map(|contact| Contact { point: contact.point * size, ..*contact })
                .collect();
            let points: Vec<_> = grown.iter().map(|contact| contact.point).collect();
            let radius = largest_radius(&points, Point3::origin());
            let soft = FingerModel { torsional_friction: 0.1 * size, ..finger };
            let same = scaled_epsilon(&grown, &soft, limit, Point3::origin(), radius);
            prop_assert!((same.value - unit.value).abs() <= GAP * unit.value + ROUNDING);
        }
    }

    /// The limit on the sum is the stricter one, and soft fingers can do all that hard ones can.
    #[test]
    fn limits_and_fingers_are_nested(contacts in random_contacts(), friction in 0.2f64..0.9) {
        let hard = FingerModel::hard(friction, 5);
        let soft = FingerModel { torsional_friction: 0.05, ..hard };
        for limit in BOTH {
            let (hard, soft) = (epsilon(&contacts, &hard, limit), epsilon(&contacts, &soft, limit));
            prop_assert!(soft.upper >= hard.lower * (1.0 - GAP));
        }
        let (sum, each) = (epsilon(&contacts, &hard, ForceLimit::Sum), epsilon(&contacts, &hard, ForceLimit::Each));
        prop_assert!(each.upper >= sum.lower * (1.0 - GAP));
        // Forces of at most 1 each sum to at most their number.
        prop_assert!(each.lower <= sum.upper * contacts.len() as f64 * (1.0 + GAP));
    }
}
