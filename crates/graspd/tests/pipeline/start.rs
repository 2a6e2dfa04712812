//! Initial poses.

use std::f64::consts::TAU;

use graspd::{
    GraspObject, NamedMesh, SynthesisSettings, draw_start, initial_pose, start_rng,
    transform_object_hand,
};
use graspd_geom::{SignedDistance, SurfaceSampler, TriangleMesh, box_mesh};
use graspd_hand::{Hand, HandPose};
use graspd_sim::Scene;
use nalgebra::Vector3;
use proptest::prelude::*;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fixtures::{CAN, HAND, object};

/// Rotations are products of three matrices with entries up to 1, distances below 1 m.
const ROUNDING: f64 = 1e-12;
const SIDES: [f64; 3] = [0.05, 0.1, 0.2];

/// A box of 12 faces.
fn whole_box() -> TriangleMesh {
    box_mesh(SIDES.into(), 1.0)
}

/// The palm's centre and axes (normal, fingers) in the object frame.
fn palm(pose: &HandPose) -> (nalgebra::Point3<f64>, Vector3<f64>, Vector3<f64>) {
    let transform = transform_object_hand(pose);
    let palm = HAND.palm();
    (
        transform * palm.center,
        transform * palm.normal,
        transform * palm.fingers,
    )
}

proptest! {
    #[test]
    fn the_palm_faces_the_approach_point_at_the_standoff(seed: u64, standoff in 0.0..0.5f64) {
        let mesh = whole_box();
        let surface = SurfaceSampler::new(&mesh).expect("a box has a surface");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // The approach point is what is drawn first.
        let approach = surface.sample(&mut rng.clone());
        let pose = initial_pose(&*HAND, &surface, standoff, &mut rng);
        let (center, normal, fingers) = palm(&pose);
        prop_assert!((center - (approach.point + approach.normal * standoff)).norm() < ROUNDING);
        prop_assert!((normal + approach.normal).norm() < ROUNDING);
        prop_assert!(fingers.dot(&normal).abs() < ROUNDING);
        prop_assert_eq!(&pose.articulation[..], HAND.open_articulation());
        let q = pose.rotation;
        prop_assert!((q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1.0).abs() < ROUNDING);
    }
}

/// Largest distance of the sample's distribution function from that of the uniform distribution on [0, 1).
fn kolmogorov_smirnov(mut sample: Vec<f64>) -> f64 {
    sample.sort_by(f64::total_cmp);
    let n = sample.len() as f64;
    let gaps = sample.iter().enumerate().map(|(k, &u)| {
        let (below, above) = (k as f64 / n, (k + 1) as f64 / n);
        (u - below).abs().max((above - u).abs())
    });
    gaps.fold(0.0, f64::max)
}

#[test]
fn roll_is_uniform_and_approach_points_are_uniform_by_area() {
    /// Starts looked at.
    const COUNT: usize = 4000;
    /// Quantile 0.999 of the Kolmogorov-Smirnov statistic times the root of the count.
    const CRITICAL: f64 = 1.95;
    let mesh = whole_box();
    let surface = SurfaceSampler::new(&mesh).expect("a box has a surface");
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut rolls, mut on_axis) = (Vec::new(), [0.0; 3]);
    for _ in 0..COUNT {
        let (_, normal, fingers) = palm(&initial_pose(&*HAND, &surface, 0.1, &mut rng));
        // Normals of a box are along axes; the next axis is a reference for the roll about them.
        let axis = normal.iamax();
        let reference = Vector3::ith((axis + 1) % 3, 1.0);
        let side = normal.cross(&reference);
        let roll = fingers.dot(&side).atan2(fingers.dot(&reference));
        rolls.push(roll.rem_euclid(TAU) / TAU);
        on_axis[axis] += 1.0;
    }
    let statistic = kolmogorov_smirnov(rolls) * (COUNT as f64).sqrt();
    assert!(statistic < CRITICAL, "{statistic}");

    let areas = [0, 1, 2].map(|axis| SIDES[(axis + 1) % 3] * SIDES[(axis + 2) % 3]);
    for axis in 0..3 {
        let share = areas[axis] / areas.iter().sum::<f64>();
        let expected = share * COUNT as f64;
        // Four standard deviations of a binomial count.
        let spread = 4.0 * (expected * (1.0 - share)).sqrt();
        assert!((on_axis[axis] - expected).abs() < spread, "{on_axis:?}");
    }
}

/// The stream of random numbers is part of what "same seed, same grasps" promises. The 64-bit FNV-1a hash of
/// 7u64, "mug", 0u8, "allegro", 0u8, 3u64 (integers little endian) was computed apart from this program.
#[test]
fn the_random_numbers_of_a_start_are_pinned() {
    const FNV_HASH: u64 = 0x0f12_954f_ae23_cb58;
    let mut expected = ChaCha8Rng::seed_from_u64(FNV_HASH);
    let mut rng = start_rng(7, "mug", "allegro", 3);
    for _ in 0..4 {
        assert_eq!(rng.next_u64(), expected.next_u64());
    }
}

#[test]
fn everything_that_names_a_start_changes_its_random_numbers() {
    let first = |seed, object, hand, index| start_rng(seed, object, hand, index).next_u64();
    let mut drawn = vec![
        first(0, "mug", "allegro", 0),
        first(1, "mug", "allegro", 0),
        first(0, "can", "allegro", 0),
        first(0, "mug", "human", 0),
        first(0, "mug", "allegro", 1),
        first(0, "muga", "llegro", 0),
        first(1 << 32, "mug", "allegro", 0),
    ];
    assert_eq!(first(0, "mug", "allegro", 0), drawn[0]);
    drawn.sort_unstable();
    drawn.dedup();
    assert_eq!(drawn.len(), 7);
}

fn start(object: &GraspObject, seed: u64, index: usize) -> HandPose {
    let settings = SynthesisSettings::default();
    draw_start(object, &*HAND, &settings, seed, index).expect("it has a surface")
}

#[test]
fn a_start_depends_on_seed_object_hand_and_index_alone() {
    let starts: Vec<_> = (0..4).map(|index| start(&CAN, 0, index)).collect();
    for index in (0..4).rev() {
        assert_eq!(start(&CAN, 0, index), starts[index]);
        assert!(starts[..index].iter().all(|other| *other != starts[index]));
    }
    assert_ne!(start(&CAN, 1, 0), starts[0]);
    // The same shape by another name is another object.
    let renamed = GraspObject::prepare(
        NamedMesh {
            name: "tin".into(),
            ..CAN.source.clone()
        },
        32,
        1000.0,
        &|_| {},
    );
    assert_ne!(start(&renamed.expect("as good as a can"), 0, 0), starts[0]);
}

#[test]
fn starts_face_the_surface_and_do_not_touch_it() {
    let standoff = SynthesisSettings::default().standoff;
    for name in ["mug", "banana"] {
        let object = object(name);
        let distance = SignedDistance::new(&object.source.mesh).expect("a closed mesh");
        for index in 0..8 {
            let pose = start(&object, 0, index);
            // However often it was drawn, the palm faces a point of the surface.
            let (center, normal, _) = palm(&pose);
            let faced = distance.signed_distance(&(center + normal * standoff));
            assert!(faced.abs() < ROUNDING, "{name} {index}: {faced}");
            let surface = HAND.surface(&pose);
            let distances = surface.vertices.iter().map(|v| distance.signed_distance(v));
            let closest = distances.fold(f64::INFINITY, f64::min);
            assert!(closest > 0.0, "{name} {index}: {closest}");
        }
    }
}

#[test]
fn a_start_that_touches_is_drawn_again() {
    // So near that fingers and thumb of some starts reach into the can.
    let settings = SynthesisSettings {
        standoff: 0.02,
        ..SynthesisSettings::default()
    };
    let simulation = settings.simulation();
    let mut scene = Scene::<f64>::new(&*HAND, &CAN.simulated, &simulation);
    let surface = SurfaceSampler::new(&CAN.source.mesh).expect("a can has a surface");
    let mut touching = 0;
    for index in 0..16 {
        let mut touches = |pose: &HandPose| {
            scene.place(pose);
            scene.closest_distance() <= 0.0
        };
        let mut rng = start_rng(0, "can", HAND.name(), index);
        let first = initial_pose(&*HAND, &surface, settings.standoff, &mut rng);
        let pose = draw_start(&CAN, &*HAND, &settings, 0, index).expect("it has a surface");
        assert!(!touches(&pose));
        assert_eq!(pose == first, !touches(&first));
        touching += usize::from(touches(&first));
    }
    assert!((1..16).contains(&touching), "{touching}");
}
