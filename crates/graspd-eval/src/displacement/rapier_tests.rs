//! Our simulations are the engine's.

use nalgebra::{Matrix3, Point3, Vector3};
use proptest::prelude::*;

use super::rapier;
use super::simulation::Scene;
use super::{ConvexPiece, DisplacementSettings, DynamicObject, FixedHand, ObjectPieces};
use crate::test_shapes::{box_mesh, sphere_mesh, together};

/// Both round differently, and contacts amplify that with each step: a position after a few steps may differ by this \[m\].
const ROUNDING: f64 = 1e-9;

/// A box cut into pieces across its longest side, so that fingers touch several.
fn cut_box(cuts: usize) -> DynamicObject {
    let size = [0.06, 0.08, 0.05];
    let pieces = (0..cuts).map(|cut| {
        let part = [size[0], size[1] / cuts as f64, size[2]];
        let middle = (cut as f64 + 0.5) / cuts as f64 - 0.5;
        let mesh = box_mesh([0.0, middle * size[1], 0.0], part);
        ConvexPiece::hull_of(&mesh.vertices).expect("a box")
    });
    let pieces = ObjectPieces {
        pieces: pieces.collect(),
        volume: size.iter().product(),
        overfill: 0.0,
    };
    let [a, b, c] = size.map(|side| side * side / 12.0);
    let inertia = Matrix3::from_diagonal(&Vector3::new(b + c, a + c, a + b));
    // Not along the axes, so that its spin wanders.
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.2, 0.4);
    let inertia = turn.matrix() * inertia * turn.matrix().transpose();
    DynamicObject::new(&pieces, Point3::new(0.003, -0.002, 0.001), inertia)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Balls pressed into the sides of a box, or held before them.
    #[test]
    fn steps_are_those_of_the_engine(
        cuts in 1usize..6,
        balls in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0, -1e-3f64..1e-3), 2..6),
        friction in 0.0f64..1.5,
        bounce in 0.0f64..1.0,
        direction in prop::array::uniform3(-1.0f64..1.0),
    ) {
        prop_assume!(Vector3::from(direction).norm() > 0.1);
        let radius = 0.012;
        let hand: Vec<_> = (balls.iter().enumerate())
            .map(|(index, (y, z, gap))| {
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                let x = side * (0.03 + radius + gap);
                sphere_mesh([x, 0.03 * y, 0.02 * z], radius, 5)
            })
            .collect();
        let hand = FixedHand::new(&together(&hand)).unwrap();
        let object = cut_box(cuts);
        let settings = DisplacementSettings {
            friction,
            hand_restitution: bounce,
            ..DisplacementSettings::default()
        };
        for steps in [1, 4] {
            let ours = Scene::new(&object, &hand, &settings).simulate(direction, steps).unwrap();
            let theirs = rapier::Scene::new(&object, &hand, &settings);
            let theirs = theirs.simulate(direction, steps).unwrap();
            let between = Vector3::from(ours.displacement) - Vector3::from(theirs.displacement);
            prop_assert!(between.norm() < ROUNDING, "{steps}: {ours:?} {theirs:?}");
            prop_assert!((ours.rotation - theirs.rotation).abs() < ROUNDING / 0.03);
        }
    }
}
