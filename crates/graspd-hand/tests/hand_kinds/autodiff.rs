//! The pullback and the rows that follow from a formula by duals, against those written by hand.

use graspd_ad::Real;
use graspd_geom::{Rigid, TriangleMesh, Vec3};
use graspd_hand::{
    ArticulatedHand, AutodiffHand, Hand, HandDescription, HandModel, HandModelDescription,
    HandOptions, KinematicTree, Part, PosedHand, allegro, barrett,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::coarse;
use crate::jacobian_rows::{assert_jacobian_rows, expanded, forces_of, pose_of};
use crate::kinds::{rigid, turning_gripper};
use crate::pullback::{Over, evaluated, flat};

/// The same sums in another order, relative to the largest component.
const SAME: f64 = 1e-12;

/// A tree as nothing but a formula.
struct TreeModel(KinematicTree);

impl HandModel for TreeModel {
    fn forward<T: Real>(&self, articulation: &[T], body: usize, points: &mut [Vec3<T>]) {
        let mut poses = vec![Rigid::identity(); self.0.body_count()];
        self.0.forward(&Rigid::identity(), articulation, &mut poses);
        for point in points {
            *point = poses[body].apply(*point);
        }
    }
}

/// The hand with one solid for each body, as it is and as a formula.
fn twins(hand: &ArticulatedHand) -> (ArticulatedHand, AutodiffHand<TreeModel>) {
    let mut meshes = vec![TriangleMesh::default(); hand.body_names().len()];
    for part in hand.parts() {
        meshes[part.body].append(&part.mesh);
    }
    let options = HandOptions {
        collision_spheres: 0,
        ..coarse()
    };
    let part = |(body, mesh): (usize, &TriangleMesh)| Part {
        body,
        mesh: mesh.clone(),
    };
    let by_hand = HandDescription {
        name: hand.name().into(),
        tree: hand.tree().clone(),
        parts: meshes.iter().enumerate().map(part).collect(),
        open: hand.open_articulation().into(),
        palm: *hand.palm(),
        notes: Vec::new(),
    };
    let by_duals = HandModelDescription {
        name: hand.name().into(),
        articulation_names: hand.articulation_names().to_vec(),
        limits: hand.limits().expect("rigid links have limits").to_vec(),
        open: hand.open_articulation().into(),
        palm: *hand.palm(),
        bodies: hand.body_names().iter().cloned().zip(meshes).collect(),
        is_soft: false,
    };
    (
        ArticulatedHand::new(by_hand, &options).expect("its parts are closed"),
        AutodiffHand::new(TreeModel(hand.tree().clone()), by_duals, &options)
            .expect("its parts are closed"),
    )
}

fn assert_same(what: &str, found: &[f64], expected: &[f64]) {
    let size = expected.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
    assert_eq!(found.len(), expected.len(), "{what}");
    for (component, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() <= SAME * size, "{what} {component}: {a} {b}");
    }
}

#[test]
fn what_is_written_by_hand_is_what_duals_give() {
    for hand in [rigid(allegro), rigid(barrett), turning_gripper()] {
        let (by_hand, by_duals) = twins(&hand);
        let name = hand.name();
        assert_eq!(
            by_hand.contact_points().body,
            by_duals.contact_points().body,
            "{name}"
        );
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..3 {
            let pose = pose_of(&hand, &mut random);
            let (_, written) = evaluated(&by_hand, &pose, Over::Contacts);
            let (_, derived) = evaluated(&by_duals, &pose, Over::Contacts);
            assert_same(name, &flat(&derived.gradient), &flat(&written.gradient));

            let forces = forces_of(&by_hand, &pose, &mut random);
            let rows = |hand: &dyn Hand| {
                let (mut posed, mut rows) = (PosedHand::default(), Default::default());
                hand.pose(&pose, &mut posed);
                hand.jacobian_rows(&pose, &posed, &forces, &mut rows);
                expanded(hand, &rows)
            };
            for (derived, written) in rows(&by_duals).iter().zip(&rows(&by_hand)) {
                assert_same(name, derived, written);
            }
        }
    }
}

#[test]
fn rows_by_duals_are_what_differences_say() {
    let (_, by_duals) = twins(&turning_gripper());
    assert_jacobian_rows(&by_duals, 5).expect("it holds for every hand");
}
