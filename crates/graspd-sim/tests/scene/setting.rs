//! What the tests of scenes share: a hand, objects whose distance is known, and poses of the one at the other.

use std::sync::LazyLock;

use graspd_geom::{Quaternion, SdfGrid, Vec3};
use graspd_hand::{
    ArticulatedHand, Hand, HandOptions, HandPose, POINT_PADDING, PoseGradient, allegro,
};
use graspd_sim::{Scene, SimulatedObject, SimulationParams, Twist};
use nalgebra::{Matrix3, Point3, Vector3};

/// Radius of the ball, and half of the box's sides \[m\].
pub(crate) const SIZE: f64 = 0.04;
/// Where ball and box are, off the origin and off their centre of mass \[m\].
pub(crate) const CENTER: Vec3<f64> = Vec3 {
    x: 0.013,
    y: -0.021,
    z: 0.008,
};
/// The centre of mass of every object here \[m\].
pub(crate) const CENTER_OF_MASS: [f64; 3] = [0.01, -0.015, 0.012];
/// Numbers of one velocity's wrenches in a block of contacts.
pub(crate) const BLOCK: usize = 6 * POINT_PADDING;

/// The built-in hand, with fewer contact points than usual.
pub(crate) static HAND: LazyLock<ArticulatedHand> = LazyLock::new(|| {
    let options = HandOptions {
        contact_points: 1000,
        ..HandOptions::default()
    };
    allegro(&options).expect("the built-in hand is sound")
});

/// Three velocities, one of them turning, so that every term of the law counts.
pub(crate) fn params() -> SimulationParams {
    let mut params = SimulationParams::default();
    params.velocities[2] = Twist {
        linear: Vec3::new(-0.01, 0.002, -0.005),
        angular: Vec3::new(0.1, -0.2, 0.3),
    };
    params
}

pub(crate) fn ball(p: Vec3<f64>) -> f64 {
    (p - CENTER).norm() - SIZE
}

pub(crate) fn cube(p: Vec3<f64>) -> f64 {
    let q = p - CENTER;
    let beyond = [q.x, q.y, q.z].map(|v| v.abs() - SIZE);
    let outside = beyond
        .iter()
        .map(|v| v.max(0.0).powi(2))
        .sum::<f64>()
        .sqrt();
    outside
        + beyond
            .iter()
            .fold(f64::NEG_INFINITY, |m, v| m.max(*v))
            .min(0.0)
}

/// An object of given signed distance, sampled over a cube of sides 12 cm about [`CENTER`].
pub(crate) fn object(distance: impl FnMut(Vec3<f64>) -> f64) -> SimulatedObject {
    const HALF: f64 = 0.06;
    const SAMPLES: usize = 41;
    let origin = CENTER - Vec3::new(HALF, HALF, HALF);
    let spacing = 2.0 * HALF / (SAMPLES - 1) as f64;
    let spacing = Vec3::new(spacing, spacing, spacing);
    let sdf = SdfGrid::from_function(origin, spacing, [SAMPLES; 3], distance).unwrap();
    SimulatedObject::new(sdf, 0.3, Point3::from(CENTER_OF_MASS), inertia()).unwrap()
}

/// The inertia of every object here \[kg m^2\].
pub(crate) fn inertia() -> Matrix3<f64> {
    let root = Matrix3::new(1.0, 0.2, -0.1, 0.0, 0.9, 0.3, 0.0, 0.0, 1.2);
    root * root.transpose() * 2e-4
}

/// Number `index` of a fixed sequence without visible order, in (-1, 1).
pub(crate) fn noise(index: usize) -> f64 {
    ((index as f64 + 1.0) * 12.9898).sin() * 43758.5453 % 1.0
}

/// Target wrenches of about 100 N and 5 N m; 0 at padding.
pub(crate) fn targets(len: usize) -> Vec<f64> {
    let weight = &HAND.contact_points().weight;
    let velocities = len / (weight.len() * 6);
    (0..len)
        .map(|index| {
            let (block, rest) = (index / (velocities * BLOCK), index % BLOCK);
            let (component, lane) = (rest / POINT_PADDING, rest % POINT_PADDING);
            let size = if component < 3 { 5.0 } else { 100.0 };
            f64::from(weight[block * POINT_PADDING + lane]) * size * noise(index)
        })
        .collect()
}

/// Half closed fingers, each joint a little different.
pub(crate) fn half_closed(variant: usize) -> Vec<f64> {
    let limits = HAND.limits().unwrap().iter().enumerate();
    limits
        .map(|(i, limit)| limit.middle() + 0.15 * limit.range() * noise(31 * variant + i))
        .collect()
}

/// The half closed hand, palm towards `target`, moved along the palm's normal until its deepest contact is `depth`
/// \[m\] inside the object.
pub(crate) fn pose_at(
    object: &SimulatedObject,
    target: Vec3<f64>,
    variant: usize,
    depth: f64,
) -> HandPose {
    let turn = [0, 1, 2].map(|axis| 3.0 * noise(7 * variant + axis));
    let rotation = Quaternion::exp(Vec3::from(turn));
    let matrix = rotation.to_matrix();
    let palm = HAND.palm();
    let (center, normal) = (Vec3::from(palm.center), Vec3::from(palm.normal));
    let pose = |distance: f64| HandPose {
        translation: target - matrix.apply(normal) * distance - matrix.apply(center),
        rotation,
        articulation: half_closed(variant),
    };
    let params = params();
    let mut scene = Scene::<f64>::new(&*HAND, object, &params);
    let (mut near, mut far) = (0.0, 0.5);
    for _ in 0..50 {
        let middle = 0.5 * (near + far);
        scene.place(&pose(middle));
        if scene.closest_distance() < -depth {
            near = middle;
        } else {
            far = middle;
        }
    }
    pose(far)
}

/// How many contacts are less than `radius` \[m\] from the object, or inside.
pub(crate) fn touching(object: &SimulatedObject, pose: &HandPose, radius: f64) -> usize {
    let params = params();
    let mut scene = Scene::<f64>::new(&*HAND, object, &params);
    scene.place(pose);
    let weight = HAND.contact_points().weight.iter().enumerate();
    weight
        .filter(|&(i, &w)| w > 0.0 && object.sdf().distance(scene.contacts().get(i)) < radius)
        .count()
}

/// `[translation; rotation; articulation]`.
pub(crate) fn flat(gradient: &PoseGradient) -> Vec<f64> {
    let (t, r) = (gradient.translation, gradient.rotation);
    let mut flat = vec![t.x, t.y, t.z, r.x, r.y, r.z];
    flat.extend(&gradient.articulation);
    flat
}

/// The pose moved by `step` along component `index` of [`flat`].
pub(crate) fn moved(pose: &HandPose, index: usize, step: f64) -> HandPose {
    let mut pose = pose.clone();
    let along = |axis: usize| {
        let mut v = Vector3::zeros();
        v[axis] = step;
        Vec3::from(v)
    };
    match index {
        0..3 => pose.translation += along(index),
        3..6 => pose.rotation = Quaternion::exp(along(index - 3)).compose(pose.rotation),
        _ => pose.articulation[index - 6] += step,
    }
    pose
}
