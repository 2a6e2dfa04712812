//! Objects, and grasps of them that press tens of contacts in by up to a millimetre.

use std::sync::LazyLock;

use graspd_geom::{
    MassProperties, Quaternion, SdfGrid, SignedDistance, Vec3, closed_surface, shared_file,
};
use graspd_hand::{ArticulatedHand, Hand, HandOptions, HandPose, allegro};
use graspd_mesh::load_mesh;
use graspd_sim::{Scene, SimulatedObject, SimulationParams, Twist};
use nalgebra::{Matrix3, Point3};

/// How deep the palm is pushed in first, and then the deepest contact \[m\].
const PALM_DEPTH: f64 = 5e-4;
const DEPTH: f64 = 1e-3;
/// Where the hand starts from \[m\].
const FAR: f64 = 0.4;

pub(crate) static HAND: LazyLock<ArticulatedHand> = LazyLock::new(|| {
    let options = HandOptions {
        contact_points: 10_000,
        collision_spheres: 0,
        ..HandOptions::default()
    };
    allegro(&options).expect("the built-in hand is sound")
});

/// Number `index` of a fixed sequence without visible order, in (-1, 1).
pub(crate) fn noise(index: usize) -> f64 {
    ((index as f64 + 1.0) * 12.9898).sin() * 43758.5453 % 1.0
}

/// The scanned bottle, sampled 96^3 times.
pub(crate) fn bottle() -> Option<SimulatedObject> {
    let path = shared_file("data/ycb/006_mustard_bottle.obj")?;
    let mesh = closed_surface(&load_mesh(&path).unwrap(), "bottle").unwrap();
    let mass = MassProperties::new(&mesh, 1000.0, "bottle").unwrap();
    let sdf = SdfGrid::build(&SignedDistance::new(&mesh).unwrap(), 96, 0.01, &|_| ()).unwrap();
    Some(SimulatedObject::new(sdf, mass.mass, mass.center_of_mass, mass.inertia).unwrap())
}

/// A ball of 4 cm about a point that is not its centre of mass.
pub(crate) fn ball() -> SimulatedObject {
    let (center, radius) = (Vec3::new(0.01, -0.02, 0.015), 0.04);
    let origin = center - Vec3::new(0.05, 0.05, 0.05);
    let spacing = Vec3::new(0.0025, 0.002, 0.00125);
    let distance = |p: Vec3<f64>| (p - center).norm() - radius;
    let sdf = SdfGrid::from_function(origin, spacing, [41, 51, 81], distance).unwrap();
    let inertia = Matrix3::new(2.0, 0.1, 0.0, 0.1, 1.5, 0.2, 0.0, 0.2, 1.0) * 1e-4;
    SimulatedObject::new(sdf, 0.3, Point3::new(0.008, -0.018, 0.016), inertia).unwrap()
}

/// The law without leak: then the gradient is that of the loss wherever there is one. Of four velocities one turns.
pub(crate) fn without_leak() -> SimulationParams {
    let mut params = SimulationParams::default();
    params.contact.leak = 0.0;
    params.velocities.push(Twist {
        linear: Vec3::new(0.003, -0.006, 0.002),
        angular: Vec3::new(-0.1, 0.2, 0.15),
    });
    params
}

/// A grasp: the open hand in a random orientation, its palm towards the object's centre, is moved along the palm's
/// normal until it is [`PALM_DEPTH`] inside; then each joint closes until something is [`DEPTH`] inside.
pub(crate) fn grasp(object: &SimulatedObject, variant: usize) -> HandPose {
    let turn = [0, 1, 2].map(|axis| 3.0 * noise(7 * variant + axis));
    let rotation = Quaternion::exp(Vec3::from(turn));
    let (matrix, palm) = (rotation.to_matrix(), HAND.palm());
    let (center, normal) = (
        matrix.apply(palm.center.into()),
        matrix.apply(palm.normal.into()),
    );
    let mut pose = HandPose {
        translation: object.center_of_mass() - normal * FAR - center,
        rotation,
        articulation: HAND.open_articulation().to_vec(),
    };
    let params = without_leak();
    let mut scene = Scene::<f64>::new(&*HAND, object, &params);
    advance(&mut scene, &mut pose, PALM_DEPTH, FAR, |pose, distance| {
        pose.translation += normal * distance;
    });
    for (joint, limit) in HAND.limits().unwrap().iter().enumerate() {
        let way =
            (limit.upper - pose.articulation[joint]) * (0.8 + 0.15 * noise(31 * variant + joint));
        advance(&mut scene, &mut pose, DEPTH, way, |pose, angle| {
            pose.articulation[joint] += angle;
        });
    }
    pose
}

/// Moves the hand by `motion`, at most to the end of its `way`, until its deepest contact is `depth` \[m\] inside.
fn advance(
    scene: &mut Scene<'_, f64>,
    pose: &mut HandPose,
    depth: f64,
    way: f64,
    motion: impl Fn(&mut HandPose, f64),
) {
    let start = pose.clone();
    let mut is_free = |done: f64, pose: &mut HandPose| {
        *pose = start.clone();
        motion(pose, done);
        scene.place(pose);
        scene.closest_distance() > -depth
    };
    const STEPS: usize = 50;
    let Some(blocked) = (1..=STEPS).find(|&i| !is_free(way * i as f64 / STEPS as f64, pose)) else {
        return;
    };
    let (mut low, mut high) = ((blocked - 1) as f64, blocked as f64);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if is_free(way * middle / STEPS as f64, pose) {
            low = middle;
        } else {
            high = middle;
        }
    }
    is_free(way * low / STEPS as f64, pose);
}
