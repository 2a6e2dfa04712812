//! The judge's verdict does not depend on where hand and object are, or which way they are turned together.

use std::sync::LazyLock;

use graspd::{initial_pose, start_rng};
use graspd_eval::{
    Contact, EpsilonSettings, EvaluationSettings, FingerModel, GraspMetrics, Metrics,
    ObjectUnderTest, VolumeSettings, evaluate, ferrari_canny, hull_volume,
};
use graspd_geom::{MassProperties, SurfaceSampler, TriangleMesh};
use graspd_hand::{Hand, SkinnedHandOptions, human};
use graspd_mesh::builtin_object;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

/// Side of the voxels \[m\].
const VOXEL: f64 = 1e-3;
/// Roughness of the object's surface \[m\], that of a scan.
const ROUGHNESS: f64 = 0.1e-3;
/// Rounding in the depth of the origin, relative to it.
const ROUNDING: f64 = 1e-9;
/// Voxels in and out of the boundary cancel but for this part of the whole: a mug's wall is three voxels thick, and
/// here it lies along them.
const DISCRETISATION: f64 = 0.1;

/// A hand of the size of a man's pressed on a mug with a rough surface, the object first.
static GRASP: LazyLock<(TriangleMesh, TriangleMesh)> = LazyLock::new(|| {
    let mut mug = builtin_object("mug").expect("a built-in object");
    let noise = |index: usize| (12.9898 * (index + 1) as f64).sin() * 43_758.545_3 % 1.0;
    for (index, vertex) in mug.vertices.iter_mut().enumerate() {
        let shift = [0, 1, 2].map(|axis| ROUGHNESS * noise(3 * index + axis));
        *vertex += Vector3::from(shift);
    }
    let hand = human(&SkinnedHandOptions::default()).expect("these options are in range");
    let object = ObjectUnderTest::new(&mug).expect("a closed mesh");
    let surface = SurfaceSampler::new(&mug).expect("a mug has a surface");
    // Nearer and nearer, until as much is inside as of a grasp.
    let skin = (0..40)
        .map(|step| {
            let standoff = 0.04 - 2e-3 * f64::from(step);
            let pose = initial_pose(
                &hand,
                &surface,
                standoff,
                &mut start_rng(0, "mug", "human", 1),
            );
            hand.surface(&pose)
        })
        .find(|skin| judged(&object, skin, 0.0).interpenetration_volume_cm3 > Some(1.0))
        .expect("the palm goes through the surface");
    (mug, skin)
});

/// Contact area with a threshold \[m\], and interpenetration.
fn judged(object: &ObjectUnderTest, hand: &TriangleMesh, contact_threshold: f64) -> GraspMetrics {
    let settings = EvaluationSettings {
        metrics: "ca,iv".parse::<Metrics>().expect("two metrics"),
        contact_threshold,
        ..EvaluationSettings::default()
    };
    evaluate(object, hand, &settings).expect("closed meshes")
}

/// About the centre of mass of the object, wherever it is.
fn wrenches(object: &ObjectUnderTest, contacts: &[Contact]) -> Vec<[f64; 6]> {
    let finger = FingerModel::hard(0.8, 8);
    finger.wrenches(contacts, object.center_of_mass(), object.torque_scale())
}

fn epsilon(wrenches: &[[f64; 6]]) -> f64 {
    let found = ferrari_canny(wrenches, &EpsilonSettings::sum()).expect("finite wrenches");
    found.lower
}

/// Contacts enough for force closure: those of the grasp, and the same from the other side of the object.
fn closing_contacts(object: &ObjectUnderTest, hand: &TriangleMesh) -> Vec<Contact> {
    let settings = EvaluationSettings::default();
    let mut contacts = object.contacts(hand, &settings).expect("closed meshes");
    let center = object.center_of_mass();
    let opposite: Vec<_> = (contacts.iter())
        .map(|contact| Contact {
            point: center - (contact.point - center),
            normal: -contact.normal,
        })
        .collect();
    contacts.extend(opposite);
    contacts
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    /// The wrench space turns with the grasp; the ball in it does not change.
    #[test]
    fn epsilon_about_the_centre_of_mass_is_invariant(
        shift in prop::array::uniform3(-0.5f64..0.5), turn in prop::array::uniform3(-3.0f64..3.0),
    ) {
        let (mug, hand) = &*GRASP;
        let object = ObjectUnderTest::new(mug).unwrap();
        let contacts = closing_contacts(&object, hand);
        let before = wrenches(&object, &contacts);
        let expected = epsilon(&before);
        prop_assert!(expected > 0.01, "{}", expected);

        let motion = Isometry3::new(Vector3::from(shift), Vector3::from(turn));
        let moved = ObjectUnderTest::new(&mug.transformed(&motion)).unwrap();
        let center = motion * object.center_of_mass();
        prop_assert!((moved.center_of_mass() - center).norm() < ROUNDING);
        prop_assert!((moved.torque_scale() / object.torque_scale() - 1.0).abs() < ROUNDING);
        // The edges of the friction pyramids begin somewhere in the plane of contact; here they turn along.
        let rotation = motion.rotation;
        let turned: Vec<[f64; 6]> = (before.iter())
            .map(|w| {
                let force = rotation * Vector3::new(w[0], w[1], w[2]);
                let torque = rotation * Vector3::new(w[3], w[4], w[5]);
                [force.x, force.y, force.z, torque.x, torque.y, torque.z]
            })
            .collect();
        prop_assert!((epsilon(&turned) / expected - 1.0).abs() < ROUNDING);

        // Shifted alone, the edges are where they were: the wrenches themselves are the same.
        let motion = Isometry3::new(Vector3::from(shift), Vector3::zeros());
        let moved = ObjectUnderTest::new(&mug.transformed(&motion)).unwrap();
        let shifted: Vec<_> = (contacts.iter())
            .map(|contact| Contact { point: motion * contact.point, ..*contact })
            .collect();
        let after = wrenches(&moved, &shifted);
        for (one, other) in before.iter().zip(&after) {
            for (a, b) in one.iter().zip(other) {
                prop_assert!((a - b).abs() < ROUNDING);
            }
        }
        prop_assert!((epsilon(&after) / expected - 1.0).abs() < 1e-6);
        let volume = |wrenches| hull_volume(wrenches, &VolumeSettings::default()).unwrap();
        let (one, other) = (volume(&before), volume(&after));
        prop_assert!(one.lower < other.upper && other.lower < one.upper, "{:?} {:?}", one, other);
    }

    /// Voxels lie along the axes, whichever way the grasp is turned: what they count changes by those on the
    /// boundary alone.
    #[test]
    fn contact_and_penetration_are_invariant_within_a_voxel(
        shift in prop::array::uniform3(-0.2f64..0.2), turn in prop::array::uniform3(-3.0f64..3.0),
    ) {
        let (mug, hand) = &*GRASP;
        let object = ObjectUnderTest::new(mug).unwrap();
        let motion = Isometry3::new(Vector3::from(shift), Vector3::from(turn));
        let moved_object = ObjectUnderTest::new(&mug.transformed(&motion)).unwrap();
        let moved = judged(&moved_object, &hand.transformed(&motion), 0.0);
        let here = judged(&object, hand, 0.0);

        // A voxel's centre is within half a diagonal of all of the surface in it, here and there.
        let diagonal = 3.0_f64.sqrt() * VOXEL;
        let area = |metrics: &GraspMetrics| metrics.contact_area_cm2.unwrap();
        let (least, most) = (
            area(&judged(&object, hand, -diagonal)),
            area(&judged(&object, hand, diagonal)),
        );
        prop_assert!((least..=most).contains(&area(&moved)), "{} {:?}", area(&moved), (least, most));
        let change = area(&moved) / area(&here) - 1.0;
        prop_assert!(change.abs() < DISCRETISATION, "{}", change);

        let volume = |metrics: &GraspMetrics| metrics.interpenetration_volume_cm3.unwrap();
        let change = volume(&moved) - volume(&here);
        // Half a voxel all over the boundary: the skin in the object and as much of the object in the hand.
        let boundary = 2.0 * area(&here) * 0.5 * VOXEL * 100.0;
        prop_assert!(change.abs() < boundary, "{} {}", change, boundary);
        prop_assert!(change.abs() < DISCRETISATION * volume(&here), "{} of {}", change, volume(&here));
    }
}

#[test]
fn the_grasp_is_one() {
    let (mug, hand) = &*GRASP;
    let size = |mesh: &TriangleMesh| {
        let (low, high) = mesh.bounds().expect("vertices");
        (high - low).max()
    };
    assert!((0.15..0.25).contains(&size(hand)) && hand.faces.len() > 1000);
    assert!(MassProperties::new(mug, 1.0, "mug").is_ok() && mug.faces.len() > 1000);
    let judged = judged(&ObjectUnderTest::new(mug).unwrap(), hand, 0.0);
    let volume = judged.interpenetration_volume_cm3.unwrap();
    assert!((1.0..10.0).contains(&volume), "{volume}");
    assert!(judged.contact_area_cm2.unwrap() > 2.0);
}
