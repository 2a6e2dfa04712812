//! A hand with the kinematics of the LEAP hand (right).

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point3, Vector3};

use crate::primitive_hand::{Hinge, LinkRow, Shape, described};
use crate::{ArticulatedHand, HandError, HandOptions, PalmFrame};

/// All joints turn about their frames' -z.
const AXIS: [f64; 3] = [0.0, 0.0, -1.0];
/// Where the bending joints of index, middle and ring finger are across the palm \[m\].
const FINGERS: [f64; 3] = [0.0230, -0.0224, -0.0678];
/// Joint names of the fingers: side swing, first bend, second, third. The order is the maker's motor numbering, in
/// which the bend, though nearer to the palm, comes second.
const JOINTS: [[&str; 4]; 4] = [
    ["0", "1", "2", "3"],
    ["4", "5", "6", "7"],
    ["8", "9", "10", "11"],
    ["12", "13", "14", "15"],
];

/// Returns a hand like the right LEAP hand: three fingers and a thumb of four joints each.
///
/// The base frame stands upright: x out of the palm, z towards the fingers, y towards the index finger. Joints are
/// named by motor number: 0 to 3 the index finger (side swing, then three bends, of which motor 1 is the first), 4 to
/// 7 the middle finger, 8 to 11 the ring finger, 12 to 15 the thumb. Open: all at 0.
///
/// # Errors
/// [`HandError::BadOption`].
///
/// # Source
/// Shaw, Agarwal and Pathak, "LEAP Hand", RSS 2023: joint frames, limits and sizes of motors and brackets as published
/// in the hand's description; links are boxes and capsules of about the real outlines.
pub fn leap(options: &HandOptions) -> Result<ArticulatedHand, HandError> {
    let link = |name: String, parent: String, origin, hinge, shapes| LinkRow {
        name,
        parent,
        origin,
        hinge,
        shapes,
    };
    let mut rows = vec![
        link(
            "base".into(),
            String::new(),
            [[0.0; 3]; 2],
            Hinge::Fixed,
            Vec::new(),
        ),
        link(
            "palm_lower".into(),
            "base".into(),
            [[0.0, 0.038, 0.098], [0.0, -FRAC_PI_2, 0.0]],
            Hinge::Fixed,
            palm_shapes(),
        ),
    ];
    for (finger, y) in FINGERS.into_iter().enumerate() {
        let [swing, bend, second, third] = JOINTS[finger];
        let suffix = ["", "_2", "_3"][finger];
        let [mcp, pip, dip, tip] =
            ["mcp_joint", "pip", "dip", "fingertip"].map(|link| format!("{link}{suffix}"));
        rows.push(link(
            mcp.clone(),
            "palm_lower".into(),
            [[-0.0071, y, -0.0187], [FRAC_PI_2, FRAC_PI_2, 0.0]],
            Hinge::Free(bend, AXIS, [-0.314, 2.23]),
            vec![
                Shape::Box([-0.006, 0.014, 0.0147], [0.032, 0.014, 0.033]),
                Shape::Box([-0.027, 0.040, 0.015], [0.028, 0.042, 0.020]),
            ],
        ));
        rows.push(link(
            pip.clone(),
            mcp,
            [[-0.0122, 0.0381, 0.0145], [-FRAC_PI_2, 0.0, FRAC_PI_2]],
            Hinge::Free(swing, AXIS, [-1.047, 1.047]),
            vec![motor()],
        ));
        rows.push(link(
            dip.clone(),
            pip,
            [[0.015, 0.0143, -0.013], [FRAC_PI_2, -FRAC_PI_2, 0.0]],
            Hinge::Free(second, AXIS, [-0.506, 1.885]),
            vec![
                Shape::Box([0.0, -0.011, 0.015], [0.018, 0.022, 0.034]),
                Shape::Box([0.0075, -0.035, 0.015], [0.034, 0.022, 0.026]),
            ],
        ));
        rows.push(link(
            tip,
            dip,
            [[0.0, -0.0361, 0.0002], [0.0; 3]],
            Hinge::Free(third, AXIS, [-0.366, 2.042]),
            vec![
                Shape::Box([0.0, -0.010, 0.0147], [0.018, 0.020, 0.034]),
                Shape::Capsule([0.0, -0.020, 0.0147], [0.0, -0.037, 0.0147], 0.0125),
            ],
        ));
    }
    let [swing, bend, second, third] = JOINTS[3];
    rows.push(link(
        "thumb_temp_base".into(),
        "palm_lower".into(),
        [[-0.0693, -0.0012, -0.0216], [0.0, FRAC_PI_2, 0.0]],
        Hinge::Free(swing, AXIS, [-0.349, 2.094]),
        vec![motor()],
    ));
    rows.push(link(
        "thumb_pip".into(),
        "thumb_temp_base".into(),
        [[0.0, 0.0143, -0.013], [FRAC_PI_2, -FRAC_PI_2, 0.0]],
        Hinge::Free(bend, AXIS, [-0.47, 2.443]),
        vec![Shape::Box([0.0, 0.0, -0.0115], [0.017, 0.033, 0.023])],
    ));
    rows.push(link(
        "thumb_dip".into(),
        "thumb_pip".into(),
        [[0.0, 0.0145, -0.017], [-FRAC_PI_2, 0.0, 0.0]],
        Hinge::Free(second, AXIS, [-1.20, 1.90]),
        vec![
            Shape::Box([0.0, 0.0105, -0.0140], [0.020, 0.040, 0.024]),
            Shape::Box([-0.0135, 0.0175, -0.0117], [0.010, 0.024, 0.018]),
            Shape::Box([0.0, 0.040, -0.0145], [0.017, 0.022, 0.033]),
        ],
    ));
    rows.push(link(
        "thumb_fingertip".into(),
        "thumb_dip".into(),
        [[0.0, 0.0466, 0.0002], [0.0, 0.0, PI]],
        Hinge::Free(third, AXIS, [-1.34, 1.88]),
        vec![
            Shape::Box([0.0, -0.0125, -0.0147], [0.020, 0.037, 0.027]),
            Shape::Box([0.015, -0.0175, -0.0115], [0.010, 0.024, 0.018]),
            Shape::Capsule([0.0, -0.031, -0.0147], [0.0, -0.049, -0.0147], 0.0125),
        ],
    ));
    let palm = PalmFrame {
        center: Point3::new(0.0345, 0.003, 0.05),
        normal: Vector3::x(),
        fingers: Vector3::z(),
    };
    ArticulatedHand::new(described("leap", &rows, palm)?, options)
}

/// Returns a motor that carries the next joint.
fn motor() -> Shape {
    Shape::Box([0.0075, 0.0, -0.011], [0.034, 0.026, 0.022])
}

/// Returns the palm in its own frame, which lies on its back: -z is out of the palm, x towards the fingers.
fn palm_shapes() -> Vec<Shape> {
    let mut shapes = vec![
        Shape::Box([-0.036, -0.035, -0.0115], [0.038, 0.118, 0.046]),
        Shape::Box([-0.077, -0.052, -0.0115], [0.046, 0.050, 0.046]),
        Shape::Box([-0.077, -0.003, 0.010], [0.046, 0.056, 0.004]),
    ];
    // Each finger's first motor is beside it.
    shapes.extend(FINGERS.map(|y| Shape::Box([-0.010, y - 0.0148, -0.011], [0.024, 0.026, 0.034])));
    shapes
}
