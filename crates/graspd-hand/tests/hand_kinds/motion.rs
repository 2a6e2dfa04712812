//! Forward kinematics against another library, public files and mirror images.

use std::collections::HashMap;

use graspd_geom::{Vec3, shared_file};
use graspd_hand::{ArticulatedHand, Hand, barrett, leap};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{
    ALLEGRO, BARRETT, LEAP, LEFT, OTHER_AUTHOR, RIGHT, ROUNDED_TURNS, SAME, at_origin, coarse,
    file, within_limits,
};

/// Poses of all links but the root, for joint values by name, by the crate `k`, whose reader of URDF and whose
/// matrices are of other versions than the library's.
fn by_k(chain: &k::Chain<f64>, values: &HashMap<&str, f64>) -> HashMap<String, Isometry3<f64>> {
    let positions: Vec<f64> = (chain.iter_joints())
        .map(|joint| values[joint.name.as_str()])
        .collect();
    chain.set_joint_positions_unchecked(&positions);
    chain.update_transforms();
    let linked = chain.iter().filter_map(|node| {
        let pose = node.world_transform()?;
        // Asking for the link locks the node.
        let name = node.link().as_ref()?.name.clone();
        let (turn, shift) = (pose.rotation.coords, pose.translation.vector);
        let turn = Quaternion::new(turn[3], turn[0], turn[1], turn[2]);
        let pose = Isometry3::from_parts(
            Translation3::new(shift[0], shift[1], shift[2]),
            UnitQuaternion::new_unchecked(turn),
        );
        Some((name, pose))
    });
    linked.collect()
}

#[test]
fn forward_kinematics_of_real_hands_agree_with_another_library() {
    for path in [ALLEGRO, RIGHT, LEFT, LEAP, BARRETT] {
        let Some(hand) = file(path) else { return };
        let chain = k::Chain::<f64>::from_urdf_file(shared_file(path).expect("it was there"))
            .expect("k reads it too");
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let (mut worst, mut compared) = (0.0_f64, 0);
        for _ in 0..1000 {
            let articulation = within_limits(&hand, &mut random);
            let names = hand.articulation_names().iter().map(String::as_str);
            let values: HashMap<&str, f64> = names.zip(articulation.iter().copied()).collect();
            let pose = at_origin(articulation);
            for (name, expected) in by_k(&chain, &values) {
                let found =
                    Isometry3::from(hand.link_pose(&pose, &name).expect("every link has a pose"));
                // 5 cm from the link's origin, so that its rotation counts.
                let probe = nalgebra::Point3::new(0.03, -0.04, 0.02);
                worst = worst.max((found * probe - expected * probe).norm());
                compared += 1;
            }
        }
        println!("{path}: {worst:e} m over {compared} link poses");
        assert_eq!(compared, 1000 * hand.tree().links().len(), "{path}");
        assert!(worst < SAME, "{path}: {worst} m");
    }
}

/// Largest distance between the origins of links that both hands have.
fn apart(
    a: (&ArticulatedHand, &[f64]),
    b: (&ArticulatedHand, &[f64]),
    links: &[String],
    rename: impl Fn(&str) -> String,
) -> f64 {
    let [pose_a, pose_b] = [a.1, b.1].map(|articulation| at_origin(articulation.to_vec()));
    let distance = |link: &String| {
        let found = a.0.link_pose(&pose_a, link).expect("a link of the first");
        let other =
            b.0.link_pose(&pose_b, &rename(link))
                .expect("a link of the second");
        let probe = Vec3::new(0.01, -0.02, 0.03);
        (found.apply(probe) - other.apply(probe)).norm()
    };
    links.iter().map(distance).fold(0.0, f64::max)
}

#[test]
fn the_built_in_leap_hand_moves_like_its_makers_file() {
    let Some(real) = file(LEAP) else { return };
    let hand = leap(&coarse()).expect("default dimensions");
    assert_eq!(hand.name(), "leap");
    let links: Vec<String> = hand
        .tree()
        .links()
        .iter()
        .map(|link| link.name.clone())
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..100 {
        let articulation = within_limits(&hand, &mut random);
        // The file has the joints in another order.
        let by_name: Vec<f64> = (real.articulation_names().iter())
            .map(|name| {
                articulation[hand
                    .articulation_names()
                    .iter()
                    .position(|n| n == name)
                    .expect("one of 16")]
            })
            .collect();
        let worst = apart(
            (&hand, &articulation),
            (&real, &by_name),
            &links,
            str::to_owned,
        );
        // The ring finger's base is 10 um, the index finger's 0.1 mm off the regular grid in the file.
        assert!(worst < 3e-4 + ROUNDED_TURNS, "{worst}");
    }
    for (name, limit) in hand
        .articulation_names()
        .iter()
        .zip(hand.limits().expect("limits"))
    {
        let place = real
            .articulation_names()
            .iter()
            .position(|n| n == name)
            .expect("one of 16");
        assert_eq!(real.limits().expect("limits")[place], *limit, "{name}");
    }
}

#[test]
fn the_built_in_barrett_hand_moves_like_the_urdf_with_its_joints_coupled() {
    let Some(real) = file(BARRETT) else { return };
    let hand = barrett(&coarse()).expect("default dimensions");
    assert_eq!(hand.articulation_names().len(), 4);
    assert_eq!(hand.coupled_joints().len(), 4);
    let links: Vec<String> = hand
        .tree()
        .links()
        .iter()
        .map(|link| link.name.clone())
        .collect();
    // Sic, in the file.
    let rename = |link: &str| link.replace("finger_1_med_link", "finger_1_med_liink");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..100 {
        let articulation = within_limits(&hand, &mut random);
        let value = |name: &str| {
            articulation[hand
                .articulation_names()
                .iter()
                .position(|n| n == name)
                .expect("one of 4")]
        };
        let coupled: Vec<f64> = (real.articulation_names().iter())
            .map(|name| match name.split_at("finger_1".len()) {
                ("finger_1", "_prox_joint") => -value("spread"),
                ("finger_2", "_prox_joint") => value("spread"),
                (finger, "_med_joint") => -value(finger),
                (finger, _) => -value(finger) / 3.0,
            })
            .collect();
        let worst = apart((&hand, &articulation), (&real, &coupled), &links, rename);
        assert!(worst < OTHER_AUTHOR, "{worst}");
    }
}

#[test]
fn the_right_allegro_mirrored_is_the_left_one() {
    let (Some(right), Some(left)) = (file(RIGHT), file(LEFT)) else {
        return;
    };
    let mirrored = right.mirrored();
    let links: Vec<String> = left
        .tree()
        .links()
        .iter()
        .map(|link| link.name.clone())
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..100 {
        let articulation = within_limits(&mirrored, &mut random);
        // The maker's left hand has the side swings of its fingers the other way round; their limits are symmetric.
        let mut of_left = articulation.clone();
        for swing in [0, 4, 8] {
            let name = format!("joint_{swing}.0");
            let from = mirrored
                .articulation_names()
                .iter()
                .position(|n| *n == name)
                .expect("one of 16");
            let to = left
                .articulation_names()
                .iter()
                .position(|n| *n == name)
                .expect("one of 16");
            of_left[to] = -articulation[from];
        }
        for (to, name) in left.articulation_names().iter().enumerate() {
            if !["joint_0.0", "joint_4.0", "joint_8.0"].contains(&name.as_str()) {
                let from = mirrored
                    .articulation_names()
                    .iter()
                    .position(|n| n == name)
                    .expect("one of 16");
                of_left[to] = articulation[from];
            }
        }
        // Origins only: link frames of a reflected hand are turned about half of their axes.
        let [a, b] = [(&mirrored, &articulation), (&left, &of_left)]
            .map(|(hand, joints)| (hand, at_origin(joints.clone())));
        for link in &links {
            let [a, b] = [&a, &b].map(|(hand, pose)| {
                hand.link_pose(pose, link)
                    .expect("a common link")
                    .translation
            });
            assert!((a - b).norm() < SAME, "{link}: {a:?} {b:?}");
        }
    }
    assert_eq!(
        mirrored.limits().map(<[_]>::len),
        left.limits().map(<[_]>::len)
    );
    let palms = [mirrored.palm(), left.palm()];
    assert!((palms[0].normal - palms[1].normal).norm() < SAME);
    assert!((palms[0].fingers - palms[1].fingers).norm() < SAME);
    assert!((palms[0].center - palms[1].center).norm() < OTHER_AUTHOR);
}
