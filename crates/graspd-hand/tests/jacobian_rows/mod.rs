//! Points that follow a hand, and rows of their Jacobian, against the plain way to have them.

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{
    Hand, HandPoint, HandPose, JacobianRow, JacobianRows, Kinematics, PointBuffer, PointForces,
    PosedHand,
};
use nalgebra::Point3;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The same sums in another order \[m\].
const SAME: f64 = 1e-12;
/// Central differences: truncation about 1e-12, cancellation about 1e-10; forces of length 1, arms below 1 m.
const DIFFERENCES: f64 = 1e-8;
/// Half width of central differences by the base \[m or rad\].
const STEP: f64 = 1e-6;

/// Random poses: of the base, and of the joints within their limits.
pub(crate) fn pose_of(hand: &dyn Hand, random: &mut ChaCha8Rng) -> HandPose {
    let mut vector = |size: f64| {
        let mut number = || random.random_range(-size..size);
        Vec3::new(number(), number(), number())
    };
    let (translation, rotation) = (vector(0.3), Quaternion::exp(vector(3.0)));
    let count = hand.open_articulation().len();
    let articulation = match hand.limits() {
        Some(limits) => limits.iter().map(|limit| limit.sample(random)).collect(),
        None => (0..count).map(|_| random.random_range(-1.0..1.0)).collect(),
    };
    HandPose {
        translation,
        rotation,
        articulation,
    }
}

/// Faces, vertices from anywhere (the last among them) and pairs of spheres, pulled at in any direction.
pub(crate) fn forces_of(
    hand: &dyn Hand,
    pose: &HandPose,
    random: &mut ChaCha8Rng,
) -> Vec<PointForces> {
    let surface = hand.surface(pose);
    let last = surface.vertices.len() as u32 - 1;
    let spheres = hand.collision_spheres().radius.len() as u32;
    let pull = |number: usize| {
        let mut force = || {
            let mut number = || random.random_range(-1.0..1.0);
            Vec3::new(number(), number(), number())
        };
        let forces = [force(), force(), force()];
        let points = match number % 3 {
            0 => surface.faces[random.random_range(0..surface.faces.len())].map(HandPoint::Vertex),
            1 if spheres > 0 => [
                HandPoint::Sphere(random.random_range(0..spheres)),
                HandPoint::Sphere(random.random_range(0..spheres)),
                HandPoint::Vertex(0),
            ],
            _ => [
                HandPoint::Vertex(last),
                HandPoint::Vertex(random.random_range(0..=last)),
                HandPoint::Vertex(random.random_range(0..=last)),
            ],
        };
        PointForces {
            points: [0, 1, 2].map(|k| (points[k], forces[k])),
        }
    };
    (0..30).map(pull).collect()
}

fn placed(hand: &dyn Hand, pose: &HandPose) -> PosedHand {
    let mut posed = PosedHand::default();
    hand.pose(pose, &mut posed);
    posed
}

/// Rows by base and articulation.
pub(crate) fn expanded(hand: &dyn Hand, rows: &JacobianRows) -> Vec<Vec<f64>> {
    let joints = hand.open_articulation().len();
    let basis = hand.jacobian_basis();
    let expand = |row: JacobianRow<'_>| {
        let mut all = row.base.to_vec();
        all.resize(6 + joints, 0.0);
        for &(column, value) in row.entries {
            match &basis {
                None => all[6 + column as usize] += value,
                Some(basis) => {
                    for joint in 0..joints {
                        all[6 + joint] += value * basis[(column as usize, joint)];
                    }
                }
            }
        }
        all
    };
    rows.iter().map(expand).collect()
}

/// The spheres' centres as the optimiser has them.
fn spheres_by_forward(hand: &dyn Hand, pose: &HandPose) -> Vec<Point3<f64>> {
    let mut contacts = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    Kinematics::<f64>::forward(
        hand,
        pose,
        &mut hand.new_scratch(),
        &mut contacts,
        &mut spheres,
    );
    (0..spheres.len()).map(|s| spheres.get(s).into()).collect()
}

/// The rows' derivatives by the articulation, by central differences.
fn by_differences(hand: &dyn Hand, pose: &HandPose, forces: &[PointForces]) -> Vec<Vec<f64>> {
    let mut rows = vec![vec![0.0; pose.articulation.len()]; forces.len()];
    let mut moved = pose.clone();
    for joint in 0..pose.articulation.len() {
        let [before, after] = [-STEP, STEP].map(|step| {
            moved.articulation[joint] = pose.articulation[joint] + step;
            placed(hand, &moved)
        });
        moved.articulation[joint] = pose.articulation[joint];
        for (row, forces) in rows.iter_mut().zip(forces) {
            let change = |&(point, force): &(HandPoint, Vec3<f64>)| {
                (after.position(point) - before.position(point)).dot(force)
            };
            row[joint] = forces.points.iter().map(change).sum::<f64>() / (2.0 * STEP);
        }
    }
    rows
}

/// Everything that is claimed of one hand in one pose.
pub(crate) fn assert_jacobian_rows(hand: &dyn Hand, seed: u64) -> Result<(), TestCaseError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let name = hand.name();
    // What is in the buffers from another pose must not count.
    let other = pose_of(hand, &mut random);
    let mut posed = placed(hand, &other);
    let mut rows = JacobianRows::default();
    hand.jacobian_rows(
        &other,
        &posed,
        &forces_of(hand, &other, &mut random),
        &mut rows,
    );

    let pose = pose_of(hand, &mut random);
    hand.pose(&pose, &mut posed);
    for (a, b) in [
        (&posed.vertices, &hand.surface(&pose).vertices),
        (&posed.spheres, &spheres_by_forward(hand, &pose)),
    ] {
        prop_assert_eq!(a.len(), b.len());
        let worst = a
            .iter()
            .zip(b)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        prop_assert!(worst < SAME, "{name}: {worst}");
    }

    let forces = forces_of(hand, &pose, &mut random);
    hand.jacobian_rows(&pose, &posed, &forces, &mut rows);
    prop_assert_eq!(rows.len(), forces.len());
    let exact = expanded(hand, &rows);
    let numeric = by_differences(hand, &pose, &forces);
    for (row, (exact, numeric)) in exact.iter().zip(&numeric).enumerate() {
        for (column, (a, b)) in exact[6..].iter().zip(numeric).enumerate() {
            let error = (a - b).abs();
            prop_assert!(
                error < DIFFERENCES,
                "{name}, row {row}, column {column}: {a} {b}"
            );
        }
    }

    // The base, which both have from the same formula.
    for axis in 0..6 {
        let moved = |amount: f64| {
            let mut unit = [0.0; 3];
            unit[axis % 3] = amount;
            let mut moved = pose.clone();
            if axis < 3 {
                moved.translation += Vec3::from(unit);
            } else {
                moved.rotation = Quaternion::exp(Vec3::from(unit)).compose(pose.rotation);
            }
            placed(hand, &moved)
        };
        let (before, after) = (moved(-STEP), moved(STEP));
        for (row, pull) in exact.iter().zip(&forces) {
            let change = |&(point, force): &(HandPoint, Vec3<f64>)| {
                (after.position(point) - before.position(point)).dot(force)
            };
            let numeric = pull.points.iter().map(change).sum::<f64>() / (2.0 * STEP);
            prop_assert!(
                (row[axis] - numeric).abs() < DIFFERENCES,
                "{name}, base {axis}"
            );
        }
    }

    // No column is mentioned twice.
    for row in rows.iter() {
        let mut columns: Vec<u32> = row.entries.iter().map(|entry| entry.0).collect();
        columns.sort_unstable();
        columns.dedup();
        prop_assert_eq!(columns.len(), row.entries.len());
    }
    Ok(())
}
