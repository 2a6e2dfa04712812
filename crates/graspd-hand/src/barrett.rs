//! A three-finger hand with the dimensions of the BarrettHand BH8-282.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point3, Vector3};

use crate::primitive_hand::{Hinge, LinkRow, Shape, described};
use crate::{ArticulatedHand, HandError, HandOptions, PalmFrame};

/// Largest angle of a finger's inner link: 140 degrees.
const INNER_LIMIT: f64 = 140.0 * PI / 180.0;
/// The outer link turns by a third of the inner one's angle, driven by the same motor.
const OUTER_SHARE: f64 = 1.0 / 3.0;
/// Height of the spreading fingers' base above the mounting flange \[m\].
const KNUCKLE_HEIGHT: f64 = 0.0415;
/// Height of the inner joints above that \[m\].
const INNER_HEIGHT: f64 = 0.0339;

/// Returns a hand like the BarrettHand BH8-282: three fingers of two links, of which two spread around the palm.
///
/// The base frame is at the mounting flange, z out of the palm; finger 3 is on the side of -y, the others, unspread,
/// on that of y. Four motors, four joints: `spread` turns fingers 1 and 2 in opposite senses about their bases,
/// `finger_1`, `finger_2` and `finger_3` bend the inner links, with the outer links following at a third of the angle,
/// as they do until the TorqueSwitch decouples them, which is not modelled. Open: all at 0.
///
/// # Errors
/// [`HandError::BadOption`].
///
/// # Source
/// The maker's published kinematics (Barrett Technology, BH8-series user manual: A1 = 50 mm, A2 = 70 mm, A3 = 58 mm at
/// 42 degrees, base offset 25 mm; spread 180, inner 140 degrees, outer 1/3 of it); heights of the joints as in the
/// public URDF of the hand. Links are plain boxes, cylinders and capsules of about the real outlines.
pub fn barrett(options: &HandOptions) -> Result<ArticulatedHand, HandError> {
    let mut rows = vec![LinkRow {
        name: "base_link".into(),
        parent: String::new(),
        origin: [[0.0; 3]; 2],
        hinge: Hinge::Fixed,
        shapes: vec![
            Shape::Cylinder([0.0; 3], [0.0, 0.0, KNUCKLE_HEIGHT], 0.0445),
            Shape::Box([0.0, -0.004, 0.058], [0.026, 0.086, 0.036]),
            Shape::Box([0.0, 0.0, 0.071], [0.078, 0.046, 0.014]),
            Shape::Cylinder([-0.012, -0.05, 0.0754], [0.012, -0.05, 0.0754], 0.013),
        ],
    }];
    for (finger, x, side) in [(1, 0.025, -1.0), (2, -0.025, 1.0)] {
        let name = format!("finger_{finger}_prox_link");
        rows.push(LinkRow {
            name: name.clone(),
            parent: "base_link".into(),
            origin: [[x, 0.0, KNUCKLE_HEIGHT], [0.0, 0.0, -FRAC_PI_2]],
            hinge: match finger {
                1 => Hinge::Follows([0.0, 0.0, side], "spread", 1.0),
                _ => Hinge::Free("spread", [0.0, 0.0, side], [0.0, PI]),
            },
            shapes: vec![
                Shape::Box([-0.026, 0.0, 0.016], [0.062, 0.026, 0.032]),
                Shape::Cylinder(
                    [-0.05, -0.012, INNER_HEIGHT],
                    [-0.05, 0.012, INNER_HEIGHT],
                    0.013,
                ),
            ],
        });
        let origin = [[-0.05, 0.0, INNER_HEIGHT], [FRAC_PI_2, 0.0, 0.0]];
        push_finger(&mut rows, finger, name, origin);
    }
    let origin = [
        [0.0, -0.05, KNUCKLE_HEIGHT + INNER_HEIGHT],
        [FRAC_PI_2, 0.0, FRAC_PI_2],
    ];
    push_finger(&mut rows, 3, "base_link".into(), origin);
    let palm = PalmFrame {
        center: Point3::new(0.0, 0.0, 0.078),
        normal: Vector3::z(),
        fingers: Vector3::y(),
    };
    ArticulatedHand::new(described("barrett", &rows, palm)?, options)
}

/// Returns the inner and the outer link; in both frames the finger points to -x and bends towards y, about -z.
fn push_finger(rows: &mut Vec<LinkRow>, finger: usize, parent: String, origin: [[f64; 3]; 2]) {
    let joint = ["finger_1", "finger_2", "finger_3"][finger - 1];
    let inner = format!("finger_{finger}_med_link");
    rows.push(LinkRow {
        name: inner.clone(),
        parent,
        origin,
        hinge: Hinge::Free(joint, [0.0, 0.0, -1.0], [0.0, INNER_LIMIT]),
        shapes: vec![
            Shape::Box([-0.034, 0.002, 0.0], [0.062, 0.018, 0.022]),
            Shape::Cylinder([-0.07, 0.003, -0.011], [-0.07, 0.003, 0.011], 0.009),
        ],
    });
    rows.push(LinkRow {
        name: format!("finger_{finger}_dist_link"),
        parent: inner,
        origin: [[-0.07, 0.003, 0.0], [0.0; 3]],
        hinge: Hinge::Follows([0.0, 0.0, -1.0], joint, OUTER_SHARE),
        // The tip's axis leans by 42 degrees from the inner link's; both ends lie inside the solids.
        shapes: vec![
            Shape::Capsule([-0.004, 0.004, 0.004], [-0.036, 0.033, 0.004], 0.0085),
            Shape::Capsule([-0.004, 0.004, -0.004], [-0.036, 0.033, -0.004], 0.0085),
        ],
    });
}
