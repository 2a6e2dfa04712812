//! Our simulations are the engine's.

use nalgebra::{Matrix3, Point3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::fall::Scene;
use super::rapier;
use super::{ConvexPiece, DisplacementSettings, DynamicObject, FixedHand, ObjectPieces};
use crate::test_shapes::{box_mesh, sphere_mesh, together};

/// Both round differently: a position after a step may differ by this \[m\].
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

/// Balls pressed into the sides of a box, or held before them. After some steps a contact that is about to appear may do so a
/// step earlier in one of both; that is rare.
#[test]
fn steps_are_those_of_the_engine() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let scenes = 60;
    let mut apart = 0;
    for scene in 0..scenes {
        let mut within = |low: f64, high: f64| random.random_range(low..high);
        let balls = 2 + scene % 4;
        let radius = 0.012;
        let hand: Vec<_> = (0..balls)
            .map(|index| {
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                let x = side * (0.03 + radius + within(-1e-3, 1e-3));
                let center = [x, within(-0.03, 0.03), within(-0.02, 0.02)];
                sphere_mesh(center, radius, 5)
            })
            .collect();
        let direction = [0; 3].map(|_| within(-1.0, 1.0));
        let settings = DisplacementSettings {
            friction: within(0.0, 1.5),
            hand_restitution: within(0.0, 1.0),
            ..DisplacementSettings::default()
        };
        let mut hand = together(&hand);
        // So that no edge is parallel to a side: then each point of it is as deep, and which becomes a contact is rounding.
        let turn = nalgebra::Rotation3::from_euler_angles(0.01, -0.02, 0.015);
        (hand.vertices.iter_mut()).for_each(|vertex| *vertex = turn * *vertex);
        let hand = FixedHand::new(&hand).unwrap();
        let object = cut_box(1 + scene % 5);
        let ours = Scene::new(&object, &hand, &settings);
        let theirs = rapier::Scene::new(&object, &hand, &settings);
        for steps in [1, 8] {
            let ours = ours.simulate(direction, steps).unwrap();
            let theirs = theirs.simulate(direction, steps).unwrap();
            let between = Vector3::from(ours.displacement) - Vector3::from(theirs.displacement);
            let turned = (ours.rotation - theirs.rotation) * 0.05;
            let is_same = between.norm() < ROUNDING && turned.abs() < ROUNDING;
            assert!(is_same || steps > 1, "{scene}: {ours:?} {theirs:?}");
            apart += usize::from(!is_same);
        }
    }
    assert!(apart <= scenes / 10, "{apart}");
}
