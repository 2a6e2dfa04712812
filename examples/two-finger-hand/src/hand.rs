//! A parallel gripper: a palm and two fingers that slide towards each other along x.

use graspd_ad::Real;
use graspd_geom::{Vec3, box_mesh};
use graspd_hand::{
    AutodiffHand, HandError, HandModel, HandModelDescription, HandOptions, Limit, PalmFrame,
};
use nalgebra::{Point3, Translation3, Vector3};

/// The two-finger hand's kinematics: how far each finger has slid is all there is to it.
pub(crate) struct TwoFingers;

impl HandModel for TwoFingers {
    fn forward<T: Real>(&self, articulation: &[T], body: usize, points: &mut [Vec3<T>]) {
        let slide = [T::zero(), articulation[0], -articulation[0]][body];
        for point in points {
            point.x += slide;
        }
    }
}

/// Builds the hand: the fingers stand 11 cm apart when it is open, and close by 5 cm each.
pub(crate) fn two_finger_hand(
    options: &HandOptions,
) -> Result<AutodiffHand<TwoFingers>, HandError> {
    let solid = |sides: [f64; 3], center: [f64; 3]| {
        box_mesh(Vector3::from(sides), 0.01).transformed(&Translation3::from(center).into())
    };
    let description = HandModelDescription {
        name: "two_fingers".into(),
        articulation_names: vec!["slide".into()],
        limits: vec![Limit {
            lower: 0.0,
            upper: 0.05,
        }],
        open: vec![0.0],
        palm: PalmFrame {
            center: Point3::origin(),
            normal: Vector3::z(),
            fingers: Vector3::x(),
        },
        bodies: vec![
            ("palm".into(), solid([0.12, 0.03, 0.02], [0.0, 0.0, -0.01])),
            (
                "left".into(),
                solid([0.01, 0.02, 0.06], [-0.055, 0.0, 0.03]),
            ),
            (
                "right".into(),
                solid([0.01, 0.02, 0.06], [0.055, 0.0, 0.03]),
            ),
        ],
        is_soft: false,
    };
    AutodiffHand::new(TwoFingers, description, options)
}
