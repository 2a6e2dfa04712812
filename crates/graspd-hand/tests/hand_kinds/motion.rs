//! Forward kinematics against independent chains, public files and mirror images.

use std::collections::HashMap;

use graspd_geom::{Vec3, shared_file};
use graspd_hand::{ArticulatedHand, Hand, barrett, leap};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{
    BARRETT, LEAP, LEFT, OTHER_AUTHOR, RIGHT, ROUNDED_TURNS, SAME, at_origin, coarse, file,
    within_limits,
};

/// A joint as its file has it, read by other means than the library's.
struct PlainJoint {
    name: String,
    parent: String,
    child: String,
    origin: Isometry3<f64>,
    axis: Option<Unit<Vector3<f64>>>,
}

fn plain_joints(text: &str) -> Vec<PlainJoint> {
    let document = roxmltree::Document::parse(text).expect("well-formed");
    let three = |text: Option<&str>| -> Vector3<f64> {
        let numbers = text.unwrap_or("0 0 0").split_whitespace();
        Vector3::from_iterator(numbers.map(|n| n.parse::<f64>().expect("a number")))
    };
    let joints = document
        .root_element()
        .children()
        .filter(|n| n.has_tag_name("joint"));
    joints
        .map(|joint| {
            let child = |name: &str| joint.children().find(|n| n.has_tag_name(name));
            let said = |element: &str, attribute: &str| {
                child(element).and_then(|n| n.attribute(attribute))
            };
            let rpy = three(said("origin", "rpy"));
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rpy.z)
                * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), rpy.y)
                * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), rpy.x);
            let is_fixed = joint.attribute("type") == Some("fixed");
            PlainJoint {
                name: joint.attribute("name").expect("a name").to_owned(),
                parent: said("parent", "link").expect("a parent").to_owned(),
                child: said("child", "link").expect("a child").to_owned(),
                origin: Isometry3::from_parts(
                    Translation3::from(three(said("origin", "xyz"))),
                    turn,
                ),
                axis: (!is_fixed).then(|| Unit::new_normalize(three(said("axis", "xyz")))),
            }
        })
        .collect()
}

/// Poses of all links but the root by composing motions from each up to the root.
fn independent(
    joints: &[PlainJoint],
    values: &HashMap<&str, f64>,
) -> HashMap<String, Isometry3<f64>> {
    let placed = |link: &str| {
        let mut pose = Isometry3::identity();
        let mut link = link;
        while let Some(joint) = joints.iter().find(|joint| joint.child == link) {
            let turn = joint.axis.map_or_else(UnitQuaternion::identity, |axis| {
                UnitQuaternion::from_axis_angle(&axis, values[joint.name.as_str()])
            });
            pose = joint.origin * turn * pose;
            link = &joint.parent;
        }
        pose
    };
    joints
        .iter()
        .map(|joint| (joint.child.clone(), placed(&joint.child)))
        .collect()
}

#[test]
fn forward_kinematics_of_real_hands_agree_with_an_independent_chain() {
    for path in [RIGHT, LEFT, LEAP, BARRETT] {
        let Some(hand) = file(path) else { return };
        let text = std::fs::read_to_string(shared_file(path).expect("it was there")).expect("text");
        let joints = plain_joints(&text);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut worst = 0.0_f64;
        for _ in 0..1000 {
            let articulation = within_limits(&hand, &mut random);
            let names = hand.articulation_names().iter().map(String::as_str);
            let values: HashMap<&str, f64> = names.zip(articulation.iter().copied()).collect();
            let expected = independent(&joints, &values);
            let pose = at_origin(articulation);
            for (name, expected) in expected {
                let found =
                    Isometry3::from(hand.link_pose(&pose, &name).expect("every link has a pose"));
                // 5 cm from the link's origin, so that its rotation counts.
                let probe = nalgebra::Point3::new(0.03, -0.04, 0.02);
                worst = worst.max((found * probe - expected * probe).norm());
            }
        }
        println!("{path}: {worst:e} m");
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
    assert_eq!(hand.followers().len(), 4);
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
