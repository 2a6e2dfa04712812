//! The free right hand in MANO's layout, where it is there.

use graspd_geom::{Quaternion, Vec3, shared_file, topology};
use graspd_hand::{Hand, HandPose, SkinnedHand, SkinnedHandOptions, load_skinned_hand};
use nalgebra::Vector3;

fn hand() -> Option<SkinnedHand> {
    let path = shared_file("data/human_hand/mpfb_right_hand/mpfb_right_hand.npz")?;
    Some(load_skinned_hand(&path, &SkinnedHandOptions::default()).unwrap())
}

fn pose(hand: &SkinnedHand, articulation: Vec<f64>) -> HandPose {
    assert_eq!(articulation.len(), hand.articulation_names().len());
    HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation,
    }
}

/// Where the finger tips are: the vertices farthest from the wrist along each finger's last bone.
fn tips(hand: &SkinnedHand, pose: &HandPose) -> Vec<Vector3<f64>> {
    let rest = hand.rest_vertices();
    let joints = hand.rest_joints();
    let surface = hand.surface(pose);
    [3, 6, 9, 12, 15]
        .map(|last| {
            let bone = Vector3::from(joints[last] - joints[last - 1]);
            let along = |v: &usize| bone.dot(&Vector3::from(rest[*v] - joints[last]));
            let own = (0..rest.len()).filter(|&v| hand.model().weights[v][last] > 0.5);
            let tip = own.max_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
            surface.vertices[tip].coords
        })
        .to_vec()
}

#[test]
fn it_is_a_right_hand_with_straight_fingers() {
    let Some(hand) = hand() else { return };
    assert_eq!(hand.contact_points().count, 1608);
    assert_eq!(hand.articulation_names().len(), 21);
    assert!(topology(&hand.surface(&pose(&hand, hand.open_articulation().to_vec()))).is_closed());
    let palm = hand.palm();
    let joints = hand.rest_joints().map(Vector3::from);
    // Of a right hand with fingers up and the palm towards the viewer, the thumb is on the viewer's right.
    let thumb = joints[13] - joints[7];
    assert!(palm.fingers.cross(&palm.normal).dot(&thumb) > 0.02);
    assert!(
        (palm.normal.norm() - 1.0).abs() < 1e-12 && palm.normal.dot(&palm.fingers).abs() < 1e-12
    );
    // Index to ring are straight: as long as their bones.
    let open = tips(&hand, &pose(&hand, hand.open_articulation().to_vec()));
    for (finger, first) in [(0, 1), (1, 4), (2, 7), (3, 10)] {
        let bones = (joints[first + 1] - joints[first]).norm()
            + (joints[first + 2] - joints[first + 1]).norm();
        let reach = (open[finger] - joints[first]).norm();
        assert!(
            reach > 1.2 * bones,
            "finger {finger} reaches {reach} of {bones}"
        );
    }
}

#[test]
fn flexion_takes_the_tips_out_of_the_palm() {
    let Some(hand) = hand() else { return };
    let open = pose(&hand, hand.open_articulation().to_vec());
    let mut bent = open.clone();
    let limits = hand.limits().unwrap();
    for (k, name) in hand.articulation_names().iter().enumerate() {
        if name.ends_with("knuckle_flexion") && !name.starts_with("thumb") {
            bent.articulation[k] += 0.8;
        }
        assert!(limits[k].contains(hand.open_articulation()[k]), "{name}");
    }
    let (open, bent) = (tips(&hand, &open), tips(&hand, &bent));
    for finger in 0..4 {
        let moved = bent[finger] - open[finger];
        assert!(
            moved.dot(&hand.palm().normal) > 0.03,
            "finger {finger} moves by {moved:?}"
        );
    }
}
