//! The gradient of the whole pipeline, from a mesh to the pose of a hand, against central differences: L_phys of the
//! built-in hand in contact with a scanned bottle and with a ball, by the base's position and rotation and all joints.

mod grasp;

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{Hand, HandPose, POINT_PADDING, PoseGradient};
use graspd_sim::{Scene, SimulatedObject};

use grasp::{HAND, ball, bottle, grasp, noise, without_leak};

/// Half width of central differences \[m and rad\]: a millionth of a cell of the grid and of the depth of contacts, so
/// that few contacts meet a kink in between. Cancellation leaves 1e-6 of the derivatives.
const STEP: f64 = 1e-9;
/// Agreement with central differences, relative to the derivative.
const AGREEMENT: f64 = 1e-5;
/// Derivatives smaller than this part of the largest one of their block (position, rotation, joints) are compared
/// with that part: their own digits are lost in the sum over the contacts.
const FLOOR: f64 = 1e-3;
/// Where the differences ahead and behind disagree by more than this, there is a kink between them: a contact meets a
/// face of the grid's cells, the surface, or the corner between sticking and sliding. Half of it goes into the central
/// difference. Where the loss is smooth, they disagree by about STEP over the depth.
const KINK: f64 = 1.5e-5;
/// The share of derivatives that must be free of kinks.
const SMOOTH_SHARE: f64 = 0.8;
/// Touching contacts that a grasp must have.
const FEWEST_CONTACTS: usize = 24;

/// Target wrenches of about 100 N and 5 N m.
fn targets(len: usize) -> Vec<f64> {
    (0..len)
        .map(|index| {
            let component = index / POINT_PADDING % 6;
            noise(index) * if component < 3 { 5.0 } else { 100.0 }
        })
        .collect()
}

/// The pose moved by `step` along one component of `[translation; rotation; articulation]`.
fn moved(pose: &HandPose, component: usize, step: f64) -> HandPose {
    let mut pose = pose.clone();
    let mut along = [0.0; 3];
    along[component % 3] = step;
    match component {
        0..3 => pose.translation += along.into(),
        3..6 => pose.rotation = Quaternion::exp(along.into()).compose(pose.rotation),
        _ => pose.articulation[component - 6] += step,
    }
    pose
}

/// The gradient in the order of [`moved`].
fn flat(gradient: &PoseGradient) -> Vec<f64> {
    let (t, r) = (gradient.translation, gradient.rotation);
    let mut flat = vec![t.x, t.y, t.z, r.x, r.y, r.z];
    flat.extend(&gradient.articulation);
    flat
}

/// L_phys and its gradient.
fn evaluate(scene: &mut Scene<'_, f64>, pose: &HandPose, targets: &[f64]) -> (f64, Vec<f64>) {
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    scene.place(pose);
    let loss = scene.physics_loss(targets);
    scene.pull_back(pose, &mut gradient);
    (loss, flat(&gradient))
}

/// Index, distance to the dilated object \[m\] and its gradient for each contact that is not padding.
fn contacts(
    scene: &Scene<'_, f64>,
    object: &SimulatedObject,
    smoothing: f64,
) -> Vec<(usize, f64, Vec3<f64>)> {
    let weight = HAND.contact_points().weight.iter().enumerate();
    weight
        .filter(|&(_, &weight)| weight > 0.0)
        .map(|(i, _)| {
            let (distance, gradient) = object.sdf().distance_and_gradient(scene.contacts().get(i));
            (i, distance - smoothing, gradient)
        })
        .collect()
}

/// How many derivatives that are not 0 were compared, and how many were not because of a kink.
#[derive(Debug, Default)]
struct Count {
    checked: usize,
    kinked: usize,
}

impl Count {
    /// All derivatives by one pose: those that are not beside a kink must agree with differences.
    fn compare(&mut self, object: &SimulatedObject, pose: &HandPose, smoothing: f64) {
        let params = without_leak();
        let mut scene = Scene::<f64>::new(&*HAND, object, &params);
        scene.set_smoothing(smoothing);
        let targets = targets(scene.wrench_len());
        let (here, claimed) = evaluate(&mut scene, pose, &targets);
        let contacts = contacts(&scene, object, smoothing);
        let touching = contacts.iter().filter(|contact| contact.1 < 0.0).count();
        assert!(
            touching >= FEWEST_CONTACTS,
            "only {touching} contacts touch"
        );
        for block in [0..3, 3..6, 6..claimed.len()] {
            let sizes = claimed[block.clone()].iter().map(|v| v.abs());
            let floor = FLOOR * sizes.fold(0.0, f64::max);
            assert!(floor > 0.0);
            for component in block {
                let mut slope = |step: f64| {
                    scene.place(&moved(pose, component, step));
                    (scene.physics_loss(&targets) - here) / step
                };
                let (ahead, behind) = (slope(STEP), slope(-STEP));
                let (claimed, numeric) = (claimed[component], 0.5 * (ahead + behind));
                let scale = numeric.abs().max(claimed.abs()).max(floor);
                if (ahead - behind).abs() > KINK * scale {
                    self.kinked += 1;
                    continue;
                }
                // Joints that move no contact have derivative 0: right, but no feat.
                self.checked += usize::from(claimed != 0.0);
                assert!(
                    (claimed - numeric).abs() <= AGREEMENT * scale,
                    "component {component}: claimed {claimed:e}, numeric {numeric:e}"
                );
            }
        }
    }

    fn assert_most_were_checked(&self, at_least: usize) {
        let all = self.checked + self.kinked;
        assert!(
            all >= at_least,
            "too few derivatives differ from 0: {self:?}"
        );
        assert!(
            self.checked as f64 >= SMOOTH_SHARE * all as f64,
            "too many kinks: {self:?}"
        );
    }
}

#[test]
fn pose_gradient_is_that_of_differences_at_a_scanned_bottle() {
    let Some(object) = bottle() else { return };
    let mut count = Count::default();
    for variant in 0..5 {
        count.compare(&object, &grasp(&object, variant), 0.0);
    }
    // Half as deep again by coarse-to-fine smoothing.
    count.compare(&object, &grasp(&object, 0), 5e-4);
    count.assert_most_were_checked(70);
}

#[test]
fn pose_gradient_is_that_of_differences_at_a_ball() {
    let object = ball();
    let mut count = Count::default();
    for variant in 5..7 {
        count.compare(&object, &grasp(&object, variant), 0.0);
    }
    count.assert_most_were_checked(20);
}

/// What the contact law gives per metre of depth, written out: `(torque; force)`.
fn wrench_per_depth(normal: Vec3<f64>, lever: Vec3<f64>, velocity: Vec3<f64>) -> [f64; 6] {
    let slip = -velocity;
    let tangential = slip - normal * slip.dot(normal);
    let speed = tangential.norm();
    let friction = if speed > 0.0 {
        1e8_f64.min(0.8 * 1e6 / speed)
    } else {
        0.0
    };
    let force = tangential * friction - normal * 1e6;
    let torque = lever.cross(force);
    [torque.x, torque.y, torque.z, force.x, force.y, force.z]
}

/// Points that do not touch feel the leaked share of the derivative that they would have at depth 0: with f = |c| g,
/// where g is the wrench per depth, it is d/dp ||f - target||^2 = 2 target . g grad phi.
#[test]
fn leak_adds_its_share_for_points_that_do_not_touch() {
    const LEAK: f64 = 0.1;
    /// Of the points' positions, which are smooth.
    const POSITION_STEP: f64 = 1e-5;
    let object = ball();
    let pose = grasp(&object, 5);
    let (plain, mut leaky) = (without_leak(), without_leak());
    leaky.contact.leak = LEAK;
    let mut scene = Scene::<f64>::new(&*HAND, &object, &plain);
    let targets = targets(scene.wrench_len());
    let (loss, without) = evaluate(&mut scene, &pose, &targets);
    scene.set_contact(leaky.contact);
    let (leaky_loss, with) = evaluate(&mut scene, &pose, &targets);
    assert_eq!(leaky_loss, loss);

    let velocities = &plain.velocities;
    let leaked: Vec<(usize, Vec3<f64>)> = contacts(&scene, &object, 0.0)
        .into_iter()
        .filter(|&(_, distance, _)| distance > 0.0)
        .map(|(i, _, gradient)| {
            let lever = scene.contacts().get(i) - object.center_of_mass();
            let mut share = 0.0;
            for (j, twist) in velocities.iter().enumerate() {
                let block = (i / POINT_PADDING * velocities.len() + j) * 6 * POINT_PADDING;
                let normal = gradient.normalize_or_zero();
                let velocity = twist.linear + twist.angular.cross(lever);
                let wrench = wrench_per_depth(normal, lever, velocity);
                for (k, component) in wrench.into_iter().enumerate() {
                    let target = targets[block + k * POINT_PADDING + i % POINT_PADDING];
                    share += LEAK * 2.0 * target * component;
                }
            }
            (i, gradient * share)
        })
        .collect();
    let mut positions = |component: usize, step: f64| {
        scene.place(&moved(&pose, component, step));
        let points = leaked.iter().map(|&(i, _)| scene.contacts().get(i));
        points.collect::<Vec<_>>()
    };
    for component in 0..with.len() {
        let ahead = positions(component, POSITION_STEP);
        let behind = positions(component, -POSITION_STEP);
        let expected: f64 = (0..leaked.len())
            .map(|c| leaked[c].1.dot(ahead[c] - behind[c]) / (2.0 * POSITION_STEP))
            .sum();
        let found = with[component] - without[component];
        assert!(
            expected != 0.0,
            "points that do not touch move with every joint"
        );
        // What is left of 1e11, the part of the contacts that touch, cancels to 1e-5.
        assert!((found - expected).abs() <= 1e-8 * expected.abs());
    }
}
