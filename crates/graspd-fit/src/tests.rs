//! What is left out or known already when a hand is placed again, against looking everything up anew.

use graspd_geom::{SdfGrid, SdfSampling, SignedDistance, Vec3};
use graspd_hand::{Hand, HandPoint, HandPose, PointForces, PosedHand, builtin_hand};
use graspd_mesh::builtin_object;
use nalgebra::Vector3;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::LazyLock;

use crate::HandFitter;
use crate::distance_field::{Answer, DistanceField, ExactNearSurface, LookUpScratch, Query};
use crate::linearization::{Placement, PoseCost};
use crate::medial_spheres::{HandSolids, MedialSpheres};
use crate::patches::SkinPatches;
use crate::settings::SkinFitSettings;
use crate::skin::SkinSamples;

/// A mug: thin walls, and inside near outside.
static MUG: LazyLock<(SignedDistance, SdfGrid)> = LazyLock::new(|| {
    let mesh = builtin_object("mug").expect("it is built in");
    let distance = SignedDistance::new(&mesh).expect("it is closed");
    let grid = SdfGrid::sample(&distance, &SdfSampling::exact(48, 0.01), &|_| {});
    (distance, grid.expect("the resolution is in range"))
});

fn random_vector(random: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(-size..size))
}

fn look_up(field: &dyn DistanceField, queries: &[Query]) -> Vec<Answer> {
    let mut answers = Vec::new();
    field.look_up(queries, &mut LookUpScratch::default(), &mut answers);
    answers
}

/// Positions are sums of two numbers in single precision; distances and normals are single numbers.
const SINGLE: f64 = 1e-6;
/// The same nearest point, found in another order.
const SAME: f64 = 1e-12;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn eight_at_a_time_the_grid_says_the_same(seed: u64, count in 0..40_usize) {
        let (_, grid) = &*MUG;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let queries: Vec<Query> = (0..count)
            .map(|_| Query { at: random_vector(&mut random, 0.12), seen: None })
            .collect();
        let answers = look_up(grid, &queries);
        prop_assert_eq!(answers.len(), count);
        for (query, answer) in queries.iter().zip(answers) {
            let (distance, gradient) = grid.distance_and_gradient(Vec3::from(query.at));
            prop_assert!((answer.distance - distance).abs() < SINGLE * (1.0 + distance));
            // Outside the box, too, but at a face of a cell, where the gradient jumps.
            let off = answer.normal - Vector3::from(gradient.normalize_or_zero());
            prop_assert!(off.norm() < 1e3 * SINGLE);
        }
    }

    #[test]
    fn what_was_known_of_a_point_changes_nothing(seed: u64) {
        let (mesh, grid) = &*MUG;
        let field = ExactNearSurface { grid, mesh, band: 3e-3 };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let surface = builtin_object("mug").expect("it is built in");
        let first: Vec<Query> = (0..200)
            .map(|_| {
                let vertex = surface.vertices[random.random_range(0..surface.vertices.len())];
                let at = vertex.coords + random_vector(&mut random, 4e-3);
                Query { at, seen: None }
            })
            .collect();
        let before = look_up(&field, &first);
        let (mut known, mut unknown) = (Vec::new(), Vec::new());
        for (query, answer) in first.iter().zip(&before) {
            let size = [1e-6, 1e-4, 2e-3][random.random_range(0..3)];
            let at = query.at + random_vector(&mut random, size);
            known.push(Query { at, seen: Some((query.at, answer.distance)) });
            unknown.push(Query { at, seen: None });
        }
        for (a, b) in look_up(&field, &known).iter().zip(look_up(&field, &unknown)) {
            prop_assert!((a.distance - b.distance).abs() < SAME, "{a:?} {b:?}");
        }
        for (query, answer) in first.iter().zip(&before) {
            let exact = mesh.signed_distance(&query.at.into());
            if exact < 2e-3 {
                prop_assert!((answer.distance - exact).abs() < SAME, "{answer:?} {exact}");
            }
        }
    }
}

fn at(hand: &dyn Hand, distance: f64, random: &mut ChaCha8Rng) -> HandPose {
    let limits = hand.limits().expect("it has limits");
    HandPose {
        translation: (random_vector(random, 0.02) + Vector3::new(0.0, 0.0, distance)).into(),
        rotation: graspd_geom::Quaternion::exp(random_vector(random, 3.0).into()),
        articulation: limits.iter().map(|limit| limit.sample(random)).collect(),
    }
}

fn nearby(pose: &HandPose, size: f64, random: &mut ChaCha8Rng) -> HandPose {
    let mut moved = pose.clone();
    moved.translation += random_vector(random, size).into();
    for value in &mut moved.articulation {
        *value += random.random_range(-size..size);
    }
    moved
}

#[test]
fn points_out_of_reach_cost_the_same_as_if_they_were_looked_up() {
    let settings = SkinFitSettings::default();
    let (mesh, grid) = &*MUG;
    let exact = ExactNearSurface {
        grid,
        mesh,
        band: 3e-4,
    };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for name in ["allegro", "human"] {
        let hand = builtin_hand(name).expect("it is built in");
        let solids = HandSolids::new(&*hand).unwrap();
        let skin = SkinSamples::on(&solids.open, &solids.open_distance, 500);
        let spheres = MedialSpheres::new(&solids, 500);
        for field in [grid as &dyn DistanceField, &exact] {
            let costs = [
                settings.cost(30, true),
                settings.projection_cost(true),
                settings.depenetration_cost(true, 0.0),
            ];
            let farthest = costs[0].farthest();
            let mut cost_of = PoseCost::new(&*hand, field, &skin, &spheres, &settings, farthest);
            let (mut last, mut now) = (Placement::default(), Placement::default());
            let mut pose = at(&*hand, 0.1, &mut random);
            cost_of.place(&pose, None, &mut last);
            for step in 0..20 {
                pose = nearby(&pose, [1e-2, 1e-3, 1e-4][step % 3], &mut random);
                cost_of.place(&pose, Some(&last), &mut now);
                let mut anew = Placement::default();
                cost_of.place(&pose, None, &mut anew);
                for cost in &costs {
                    let (found, all) = [&now, &anew]
                        .map(|placement| cost_of.value(&pose, placement, cost))
                        .into();
                    let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * (1.0 + a.abs());
                    assert!(close(found, all), "{name}: {found} {all}");
                    let [(matrix, gradient), (all_matrix, all_gradient)] =
                        [&now, &anew].map(|at| {
                            let (matrix, gradient) = cost_of.normal_equations(&pose, at, cost);
                            (matrix.clone(), gradient.clone())
                        });
                    assert!((matrix - &all_matrix).amax() < 1e-9 * (1.0 + all_matrix.amax()));
                    assert!((gradient - &all_gradient).amax() < 1e-9 * (1.0 + all_gradient.amax()));
                }
                std::mem::swap(&mut last, &mut now);
            }
        }
    }
}

#[test]
fn pulls_are_what_points_of_skin_and_balls_move_along() {
    /// Half width of central differences \[rad\], and what they leave, of distances below 1 m.
    const STEP: f64 = 1e-6;
    const DIFFERENCES: f64 = 1e-8;
    let mut random = ChaCha8Rng::seed_from_u64(6);
    for name in ["allegro", "human"] {
        let hand = builtin_hand(name).expect("it is built in");
        let solids = HandSolids::new(&*hand).unwrap();
        let skin = SkinSamples::on(&hand.surface_at_rest(), &solids.open_distance, 100);
        let spheres = MedialSpheres::new(&solids, 100);
        let pose = at(&*hand, 0.0, &mut random);
        let placed = |pose: &HandPose| {
            let mut posed = PosedHand::default();
            hand.pose(pose, &mut posed);
            posed
        };
        let (here, joint) = (
            placed(&pose),
            random.random_range(0..pose.articulation.len()),
        );
        let moved = [-STEP, STEP].map(|step| {
            let mut moved = pose.clone();
            moved.articulation[joint] += step;
            placed(&moved)
        });
        let by_pull = |pull: &PointForces| {
            let change = |&(point, force): &(HandPoint, Vec3<f64>)| {
                (moved[1].position(point) - moved[0].position(point)).dot(force)
            };
            pull.points.iter().map(change).sum::<f64>() / (2.0 * STEP)
        };
        let direction = random_vector(&mut random, 1.0);
        for point in 0..skin.len() {
            let [a, b] = [0, 1].map(|end| skin.position(&moved[end].vertices, point));
            let change = (b - a).dot(&direction) / (2.0 * STEP);
            let claimed = by_pull(&skin.pull(point, &direction));
            assert!(
                (claimed - change).abs() < DIFFERENCES,
                "{name}: {claimed} {change}"
            );
        }
        for ball in 0..spheres.len() {
            let [a, b] = [0, 1].map(|end| spheres.center(&moved[end].vertices, ball));
            let change = (b - a).dot(&direction) / (2.0 * STEP);
            let claimed = by_pull(&spheres.pull(&here.vertices, ball, &direction));
            assert!(
                (claimed - change).abs() < DIFFERENCES,
                "{name}: {claimed} {change}"
            );
        }
    }
}

#[test]
fn patches_leave_out_no_point_that_is_near() {
    // The mesh itself: what a grid adds to a distance is the grid's.
    let (mesh, grid) = &*MUG;
    let exact = ExactNearSurface {
        grid,
        mesh,
        band: 1.0,
    };
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for name in ["allegro", "human"] {
        let hand = builtin_hand(name).expect("it is built in");
        let surface = hand.surface_at_rest();
        let patches = SkinPatches::on(&surface, 4000);
        for distance in [2e-3, 1e-4, -1e-3] {
            let vertices = hand.surface(&at(&*hand, 0.06, &mut random)).vertices;
            let (everything, distances) = patches.nearer_than(1.0, (&exact, 0.0), &vertices);
            assert!(distances.len() >= 4000);
            let expected = distances.iter().filter(|d| **d < distance).count();
            let (near, found) = patches.nearer_than(distance, (&exact, 0.0), &vertices);
            assert_eq!((near.len(), found.len()), (expected, expected), "{name}");
            assert!(found.iter().all(|d| *d < distance));
            // Every point of the surface is there once.
            let mut places: Vec<_> = (0..everything.len())
                .map(|point| everything.position(&vertices, point))
                .collect();
            places.sort_by(|a, b| a.x.total_cmp(&b.x));
            assert!(places.windows(2).filter(|pair| pair[0] == pair[1]).count() < 10);
        }
    }
}

#[test]
fn rows_and_gradient_are_those_of_differences_of_the_cost() {
    /// Half width of central differences \[m, rad\].
    const STEP: f64 = 1e-6;
    let settings = SkinFitSettings::default();
    // Its distance has a gradient of length 1 but at the middle.
    let grid = ball(0.04, Vector3::zeros());
    let mut random = ChaCha8Rng::seed_from_u64(8);
    for name in ["allegro", "human"] {
        let hand = builtin_hand(name).expect("it is built in");
        let solids = HandSolids::new(&*hand).unwrap();
        let skin = SkinSamples::on(&solids.open, &solids.open_distance, 300);
        let spheres = MedialSpheres::new(&solids, 300);
        // Far-reaching: few points lie at the end of the tail, where the cost jumps in its slope.
        let cost = settings.cost(0, hand.is_soft());
        let mut cost_of = PoseCost::new(&*hand, &grid, &skin, &spheres, &settings, cost.farthest());
        let mut placement = Placement::default();
        let mut pose = at(&*hand, 0.08, &mut random);
        cost_of.place(&pose, None, &mut placement);
        while placement.distances().any(|distance| distance < -0.02) {
            pose = at(&*hand, 0.08, &mut random);
            cost_of.place(&pose, None, &mut placement);
        }
        let gradient = cost_of.normal_equations(&pose, &placement, &cost).1.clone();
        let direction: Vec<f64> = (0..gradient.len())
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        let mut value = |share: f64| {
            let step: Vec<f64> = direction.iter().map(|x| x * share).collect();
            let mut moved = pose.clone();
            crate::fit::move_along(&*hand, &pose, &step, &mut moved);
            let mut placement = Placement::default();
            cost_of.place(&moved, None, &mut placement);
            cost_of.value(&moved, &placement, &cost)
        };
        let numeric = (value(STEP) - value(-STEP)) / (2.0 * STEP);
        let claimed: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        // Distances are single numbers, of 1e-8 m; so many of them make up the cost.
        assert!(
            (claimed - numeric).abs() < 0.02 * (1.0 + claimed.abs()),
            "{name}: {claimed} {numeric}"
        );
    }
}

/// A ball of this radius \[m\] at a place.
fn ball(radius: f64, center: Vector3<f64>) -> SdfGrid {
    let corner = Vec3::new(-0.3, -0.3, -0.3);
    let spacing = Vec3::new(4e-3, 4e-3, 4e-3);
    let distance = |p: Vec3<f64>| (Vector3::from(p) - center).norm() - radius;
    SdfGrid::from_function(corner, spacing, [151; 3], distance).expect("it is finite")
}

#[test]
fn a_fit_follows_an_object_that_moves_and_one_that_grows() {
    let settings = SkinFitSettings::default();
    let hand = builtin_hand("allegro").expect("it is built in");
    let fitter = HandFitter::new(&*hand, &settings).unwrap();
    let palm = Vector3::from(Vec3::from(hand.palm().center));
    let from = |distance: f64| HandPose {
        translation: (-palm - Vector3::new(distance, 0.0, 0.0)).into(),
        rotation: graspd_geom::Quaternion::identity(),
        articulation: hand.open_articulation().to_vec(),
    };
    // The whole hand goes along, wherever the object goes; a mug is no body of revolution.
    let (_, mug) = &*MUG;
    let fitted = fitter.fit(mug, &from(0.1), &mut |_, _| {});
    assert!(fitted.contact_area > 1e-4, "{}", fitted.contact_area);
    let along = Vector3::new(0.3, -0.5, 0.8);
    let normal = |p: nalgebra::Point3<f64>| {
        Vector3::from(
            mug.distance_and_gradient(Vec3::from(p.coords))
                .1
                .normalize_or_zero(),
        )
    };
    let follow = fitter.sensitivity(mug, &fitted.pose, &|p| -normal(p).dot(&along));
    let expected = along.iter().copied().chain(std::iter::repeat(0.0));
    for (found, expected) in follow.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-2, "{follow:?}");
    }
    let fitted = fitter.fit(&ball(0.035, Vector3::zeros()), &from(0.06), &mut |_, _| {});
    let here = ball(0.035, Vector3::zeros());
    // Where it grows, a hand that gives way as told is better off than one that stays.
    let grown = fitter.sensitivity(&here, &fitted.pose, &|_| -1.0);
    let growth = 1e-3;
    let larger = ball(0.035 + growth, Vector3::zeros());
    let mut moved = fitted.pose.clone();
    let step: Vec<f64> = grown.iter().map(|x| x * growth).collect();
    crate::fit::move_along(&*hand, &fitted.pose, &step, &mut moved);
    let cost = |pose: &HandPose| {
        let cost = settings.cost(settings.iterations, false);
        let samples = (&fitter.fine.skin, &fitter.fine.spheres);
        let mut cost_of = PoseCost::new(
            &*hand,
            &larger,
            samples.0,
            samples.1,
            &settings,
            cost.farthest(),
        );
        let mut placement = Placement::default();
        cost_of.place(pose, None, &mut placement);
        cost_of.value(pose, &placement, &cost)
    };
    let (stays, gives_way) = (cost(&fitted.pose), cost(&moved));
    assert!(gives_way < stays, "{gives_way} {stays}");
}
