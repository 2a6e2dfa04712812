//! The built-in solver compared with rapier.

use graspd_geom::TriangleMesh;
use nalgebra::{Matrix3, Point3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::engine::PhysicsEngine;
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

/// The difference \[m\] of both engines after some steps; a rotation counts at a distance of 5 cm.
fn difference(
    object: &DynamicObject,
    hand: &TriangleMesh,
    settings: &DisplacementSettings,
    direction: [f64; 3],
    steps: usize,
) -> f64 {
    let hand = FixedHand::new(hand).unwrap();
    let [ours, theirs] = [PhysicsEngine::Graspd, PhysicsEngine::Rapier].map(|engine| {
        let world = engine.world(object, &hand, settings).unwrap();
        world.simulate(direction, steps).unwrap()
    });
    let between = Vector3::from(ours.displacement) - Vector3::from(theirs.displacement);
    between
        .norm()
        .max(0.05 * (ours.rotation - theirs.rotation).abs())
}

fn random_settings(random: &mut ChaCha8Rng) -> (DisplacementSettings, [f64; 3]) {
    let settings = DisplacementSettings {
        friction: random.random_range(0.0..1.5),
        hand_restitution: random.random_range(0.0..1.0),
        ..DisplacementSettings::default()
    };
    (settings, [0; 3].map(|_| random.random_range(-1.0..1.0)))
}

/// So that no edge is parallel to a face: then each of its points is as deep, and which becomes a contact is rounding.
fn turned(mut mesh: TriangleMesh) -> TriangleMesh {
    let turn = nalgebra::Rotation3::from_euler_angles(0.01, -0.02, 0.015);
    (mesh.vertices.iter_mut()).for_each(|vertex| *vertex = turn * *vertex);
    mesh
}

/// A box against one plate has one manifold: its equations are rapier's, whatever the order.
#[test]
fn one_manifold_is_solved_as_by_rapier() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for scene in 0..40 {
        let (settings, direction) = random_settings(&mut random);
        let press = random.random_range(-1e-3..1e-3);
        let plate = turned(box_mesh([0.04 - press, 0.0, 0.0], [0.02, 0.3, 0.3]));
        for steps in [1, 8] {
            let difference = difference(&cut_box(1), &plate, &settings, direction, steps);
            assert!(difference < ROUNDING, "{scene}: {difference} after {steps}");
        }
    }
}

/// Balls pressed into the sides of a box, or held before them, have many manifolds. Both engines
/// solve these in another order, and 15 iterations a substep do not converge.
#[test]
fn many_manifolds_are_solved_nearly_as_by_rapier() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut differences = [vec![], vec![]];
    for scene in 0..60 {
        let radius = 0.012;
        let hand: Vec<_> = (0..2 + scene % 4)
            .map(|index| {
                let mut within = |low: f64, high: f64| random.random_range(low..high);
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                let x = side * (0.03 + radius + within(-1e-3, 1e-3));
                let center = [x, within(-0.03, 0.03), within(-0.02, 0.02)];
                sphere_mesh(center, radius, 5)
            })
            .collect();
        let (settings, direction) = random_settings(&mut random);
        let (object, hand) = (cut_box(1 + scene % 5), turned(together(&hand)));
        for (steps, differences) in [1, 8].into_iter().zip(&mut differences) {
            differences.push(difference(&object, &hand, &settings, direction, steps));
        }
    }
    for (differences, [median, largest]) in differences.iter_mut().zip([[1e-5, 1e-4], [3e-4, 3e-3]])
    {
        differences.sort_by(f64::total_cmp);
        assert!(
            differences[30] < median && differences[59] < largest,
            "{differences:?}"
        );
    }
}
