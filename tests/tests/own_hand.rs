//! The hand of `examples/two-finger-hand`, which tells graspd nothing but a formula: its derivatives, and its grasps.

#[path = "../../examples/two-finger-hand/src/hand.rs"]
mod hand;

use graspd::{
    Configuration, ExecutionSettings, GraspObject, NamedMesh, RunSettings, synthesize_grasps,
};
use graspd_eval::EvaluationSettings;
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{
    Hand, HandOptions, HandPoint, HandPose, JacobianRows, Kinematics, PointBuffer, PointForces,
    PoseGradient, PosedHand,
};

/// Half width of central differences \[m or rad\].
const STEP: f64 = 1e-6;
/// Cancellation of the differences, for a scalar of size 1.
const DIFFERENCES: f64 = 1e-8;

fn two_fingers() -> impl Hand {
    let options = HandOptions {
        contact_points: 300,
        collision_spheres: 20,
        ..HandOptions::default()
    };
    hand::two_finger_hand(&options).expect("its boxes are closed")
}

fn tilted(slide: f64) -> HandPose {
    HandPose {
        translation: Vec3::new(0.1, -0.2, 0.3),
        rotation: Quaternion::exp(Vec3::new(0.4, -1.1, 0.7)),
        articulation: vec![slide],
    }
}

/// Moves along component 0 to 2: position, 3 to 5: rotation, 6: articulation.
fn moved(pose: &HandPose, component: usize, amount: f64) -> HandPose {
    let mut pose = pose.clone();
    let mut vector = [0.0; 3];
    vector[component % 3] = amount;
    match component {
        0..3 => pose.translation += Vec3::from(vector),
        3..6 => pose.rotation = Quaternion::exp(Vec3::from(vector)).compose(pose.rotation),
        _ => pose.articulation[0] += amount,
    }
    pose
}

#[test]
fn the_pullback_by_duals_is_what_differences_say() {
    let hand = two_fingers();
    let (count, spheres) = (
        hand.contact_points().weight.len(),
        hand.collision_spheres().radius.len(),
    );
    let mut scratch = hand.new_scratch();
    let mut contacts = PointBuffer::<f64>::zeros(count);
    let mut centers = PointBuffer::<f64>::zeros(spheres);
    // A force on each point that differs from its neighbours'.
    let forces = |count: usize| {
        let mut forces = PointBuffer::<f64>::zeros(count);
        for index in 0..count {
            let i = index as f64;
            forces.set(
                index,
                Vec3::new((1.3 * i).sin(), (0.7 * i).cos(), (2.1 * i).sin()) * (1.0 / count as f64),
            );
        }
        forces
    };
    let (on_contacts, on_spheres) = (forces(count), forces(spheres));
    let mut work = |pose: &HandPose, gradient: Option<&mut PoseGradient>| {
        Kinematics::<f64>::forward(&hand, pose, &mut scratch, &mut contacts, &mut centers);
        if let Some(gradient) = gradient {
            hand.pullback(
                pose,
                &mut scratch,
                &contacts,
                &on_contacts,
                &centers,
                &on_spheres,
                gradient,
            );
        }
        let dot = |a: &PointBuffer<f64>, b: &PointBuffer<f64>| {
            (0..a.len()).map(|i| a.get(i).dot(b.get(i))).sum::<f64>()
        };
        dot(&contacts, &on_contacts) + dot(&centers, &on_spheres)
    };
    let pose = tilted(0.02);
    let mut gradient = PoseGradient::zero(1);
    work(&pose, Some(&mut gradient));
    let (t, r) = (gradient.translation, gradient.rotation);
    let exact = [t.x, t.y, t.z, r.x, r.y, r.z, gradient.articulation[0]];
    for (component, exact) in exact.into_iter().enumerate() {
        let [before, after] = [-STEP, STEP].map(|step| work(&moved(&pose, component, step), None));
        let numeric = (after - before) / (2.0 * STEP);
        assert!(
            (exact - numeric).abs() < DIFFERENCES,
            "component {component}: {exact} {numeric}"
        );
    }
}

#[test]
fn its_rows_are_what_differences_say() {
    let hand = two_fingers();
    let posed = |pose: &HandPose| {
        let mut posed = PosedHand::default();
        hand.pose(pose, &mut posed);
        posed
    };
    let pose = tilted(0.03);
    let at_pose = posed(&pose);
    let last = at_pose.vertices.len() as u32 - 1;
    let forces = PointForces {
        points: [
            (HandPoint::Vertex(last), Vec3::new(0.3, -0.5, 0.8)),
            (HandPoint::Vertex(0), Vec3::new(-1.0, 0.2, 0.1)),
            (HandPoint::Sphere(0), Vec3::new(0.6, 0.4, -0.7)),
        ],
    };
    let mut rows = JacobianRows::default();
    hand.jacobian_rows(&pose, &at_pose, &[forces], &mut rows);
    let row = rows.iter().next().expect("one row");
    let exact = row
        .base
        .iter()
        .copied()
        .chain(row.entries.iter().map(|entry| entry.1));
    for (component, exact) in exact.enumerate() {
        let [before, after] = [-STEP, STEP].map(|step| {
            let posed = posed(&moved(&pose, component, step));
            (forces.points.iter())
                .map(|&(point, force)| posed.position(point).dot(force))
                .sum::<f64>()
        });
        let numeric = (after - before) / (2.0 * STEP);
        assert!(
            (exact - numeric).abs() < DIFFERENCES,
            "component {component}: {exact} {numeric}"
        );
    }
}

#[test]
fn it_grasps_the_mug() -> Result<(), Box<dyn std::error::Error>> {
    let configuration = Configuration::default();
    let object = GraspObject::prepare(NamedMesh::load("mug", 1.0)?, 48, 1000.0, &|_| {})?;
    let run = RunSettings {
        seed: 0,
        count: 2,
        trajectory_every: None,
        execution: ExecutionSettings::default(),
        evaluation: EvaluationSettings {
            metrics: "ca,pd".parse()?,
            ..EvaluationSettings::default()
        },
    };
    let grasps = synthesize_grasps(&object, &two_fingers(), &configuration.settings, &run, &())?;
    assert_eq!(grasps.len(), 2);
    for grasp in grasps {
        let metrics = grasp.record.metrics.ok_or("it was judged")?;
        let (area, depth) = (metrics.contact_area_cm2, metrics.max_penetration_mm);
        println!("{area:?} {depth:?} {:?}", grasp.record.joints_rad);
        assert!(
            area.is_some_and(|area| area > 0.0),
            "grasp {} touches nothing",
            grasp.record.index
        );
    }
    Ok(())
}
