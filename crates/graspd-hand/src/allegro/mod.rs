//! The Allegro hand (right): four fingers of four joints each.
//!
//! # Source
//! Joint frames, axes, limits and the outlines of the links: the dimensions that the maker, Wonik Robotics, publishes
//! in its description of the hand (version 3, `simlab_allegro_hand_ros`).

mod shape;

use graspd_geom::{Quaternion, Rigid, Vec3};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::HandOptions;
use crate::articulated::HandDescription;

use crate::{ArticulatedHand, HandError, Joint, JointKind, KinematicTree, Limit, PalmFrame, Part};

/// Returns the right Allegro hand.
///
/// The base frame is that of the maker's `base_link`: x out of the palm, z towards the fingers, y towards the
/// index finger and the thumb. `joint_0.0` ... `joint_3.0` move the index finger (abduction, then three bends),
/// `joint_4.0` ... the middle finger, `joint_8.0` ... the little finger, `joint_12.0` ... the thumb.
///
/// Fully open: all joints at 0 (fingers straight), but the thumb's base joint (`joint_12.0`), which cannot reach 0, in
/// the middle of its range: the straight thumb then points forwards beside the space before the palm, and bending it
/// brings its tip opposite to the fingers'.
///
/// # Errors
/// [`HandError::BadOption`].
pub fn allegro(options: &HandOptions) -> Result<ArticulatedHand, HandError> {
    let (mut links, mut joints) = (vec!["base_link".to_owned()], Vec::new());
    for (finger, (y, z, tilt)) in FINGERS.into_iter().enumerate() {
        let first = 4 * finger;
        let knuckle = placed([0.0, y, z], [tilt, 0.0, 0.0]);
        add_joint(
            &mut links,
            &mut joints,
            first,
            "base_link",
            knuckle,
            Z,
            [-0.47, 0.47],
        );
        for (bend, (height, limits)) in FINGER_BENDS.into_iter().enumerate() {
            let parent = format!("link_{}.0", first + bend);
            let origin = placed([0.0, 0.0, height], [0.0; 3]);
            add_joint(
                &mut links,
                &mut joints,
                first + 1 + bend,
                &parent,
                origin,
                Y,
                limits,
            );
        }
        add_tip(&mut links, &mut joints, first + 3, 0.0267);
    }
    for (index, joint) in THUMB.iter().enumerate() {
        let parent = match index {
            0 => "base_link".to_owned(),
            _ => format!("link_{}.0", 11 + index),
        };
        let origin = placed(joint.position, joint.roll_pitch_yaw);
        let number = 12 + index;
        add_joint(
            &mut links,
            &mut joints,
            number,
            &parent,
            origin,
            joint.axis,
            joint.limits,
        );
    }
    add_tip(&mut links, &mut joints, 15, 0.0423);

    let tree = KinematicTree::new(&links, &joints)?;
    let body_of = |name: &str| {
        tree.body_names()
            .iter()
            .position(|b| b == name)
            .unwrap_or(0)
    };
    let mut parts: Vec<Part> = shape::base_meshes()
        .map(|mesh| Part { body: 0, mesh })
        .into();
    for joint in 0..16 {
        let body = body_of(&format!("link_{joint}.0"));
        parts.extend(
            shape::link_meshes(joint)
                .into_iter()
                .map(|mesh| Part { body, mesh }),
        );
    }
    let mut open = vec![0.0; 16];
    open[12] = tree.limits()[12].middle();
    let description = HandDescription {
        name: "allegro".to_owned(),
        tree,
        parts,
        open,
        palm: PalmFrame {
            center: Point3::new(shape::PALM_X[1], 0.0, -0.0215),
            normal: Vector3::x(),
            fingers: Vector3::z(),
        },
        notes: Vec::new(),
    };
    ArticulatedHand::new(description, options)
}

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Position along y and z of the abduction joints, and their tilt about x: 5 degrees for the outer ones.
const FINGERS: [(f64, f64, f64); 3] = [
    (0.0435, -0.001542, -0.08726646255),
    (0.0, 0.0007, 0.0),
    (-0.0435, -0.001542, 0.08726646255),
];

/// Height above the previous joint, and limits, of the three bending joints of a finger.
const FINGER_BENDS: [(f64, [f64; 2]); 3] = [
    (0.0164, [-0.196, 1.61]),
    (0.054, [-0.174, 1.709]),
    (0.0384, [-0.227, 1.618]),
];

/// A joint of the thumb.
struct ThumbJoint {
    position: [f64; 3],
    roll_pitch_yaw: [f64; 3],
    axis: [f64; 3],
    limits: [f64; 2],
}

const THUMB: [ThumbJoint; 4] = [
    ThumbJoint {
        position: [-0.0182, 0.019333, -0.045987],
        roll_pitch_yaw: [0.0, -1.65806278845, -1.5707963259],
        axis: [-1.0, 0.0, 0.0],
        limits: [0.263, 1.396],
    },
    ThumbJoint {
        position: [-0.027, 0.005, 0.0399],
        roll_pitch_yaw: [0.0; 3],
        axis: Z,
        limits: [-0.105, 1.163],
    },
    ThumbJoint {
        position: [0.0, 0.0, 0.0177],
        roll_pitch_yaw: [0.0; 3],
        axis: Y,
        limits: [-0.189, 1.644],
    },
    ThumbJoint {
        position: [0.0, 0.0, 0.0514],
        roll_pitch_yaw: [0.0; 3],
        axis: Y,
        limits: [-0.162, 1.719],
    },
];

fn placed(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Rigid<f64> {
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Rigid {
        rotation: Quaternion::from(rotation).to_matrix(),
        translation: position.into(),
    }
}

fn add_joint(
    links: &mut Vec<String>,
    joints: &mut Vec<Joint>,
    number: usize,
    parent: &str,
    origin: Rigid<f64>,
    axis: [f64; 3],
    [lower, upper]: [f64; 2],
) {
    let child = format!("link_{number}.0");
    joints.push(Joint {
        name: format!("joint_{number}.0"),
        kind: JointKind::Revolute,
        parent: parent.to_owned(),
        child: child.clone(),
        origin,
        axis: axis.into(),
        limit: Limit { lower, upper },
        mimic: None,
    });
    links.push(child);
}

fn add_tip(links: &mut Vec<String>, joints: &mut Vec<Joint>, number: usize, height: f64) {
    let child = format!("link_{number}.0_tip");
    joints.push(Joint {
        name: format!("joint_{number}.0_tip"),
        kind: JointKind::Fixed,
        parent: format!("link_{number}.0"),
        child: child.clone(),
        origin: placed([0.0, 0.0, height], [0.0; 3]),
        axis: Vec3::zero(),
        limit: Limit::UNLIMITED,
        mimic: None,
    });
    links.push(child);
}
