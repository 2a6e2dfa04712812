//! How deep the hands of recorded grasps intersect themselves, by their meshes and not by the spheres that the optimiser sees.
//!
//! `cargo run --release -p graspd --example self_penetration -- hand.urdf out/grasps.jsonl`
//!
//! Each surface point of a link is looked for inside the closed parts of all links but its own and its neighbours in the
//! kinematic tree; links that overlap in the open hand are left out, too, as they do so by construction.

use graspd::read_records;
use graspd_geom::{Quaternion, SignedDistance, Vec3};
use graspd_hand::{
    ArticulatedHand, Hand, HandPose, Kinematics, PointBuffer, UrdfOptions, load_urdf,
};
use nalgebra::{Isometry3, Point3};

/// The deepest point inside a part of another body, for each pair of bodies \[m\].
fn depths(hand: &ArticulatedHand, solids: &[SignedDistance], articulation: &[f64]) -> Vec<f64> {
    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: articulation.to_vec(),
    };
    let mut points = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    hand.forward(&pose, &mut hand.new_scratch(), &mut points, &mut spheres);
    let tree = hand.tree();
    let bodies = tree.body_count();
    let mut deepest = vec![0.0_f64; bodies * bodies];
    for (part, solid) in hand.parts().iter().zip(solids) {
        let frame = hand.link_pose(&pose, &hand.body_names()[part.body]);
        let into_part = Isometry3::from(frame.expect("every body is named after a link")).inverse();
        let (low, high) = solid.bounds();
        for index in 0..points.len() {
            let body = hand.contact_points().body[index] as usize;
            let is_neighbour =
                tree.parent(body) == Some(part.body) || tree.parent(part.body) == Some(body);
            let point = into_part * Point3::from(points.get(index));
            let is_outside = (low - point).sup(&(point - high)).max() > 0.0;
            if body == part.body || is_neighbour || is_outside {
                continue;
            }
            let entry = &mut deepest[body.min(part.body) * bodies + body.max(part.body)];
            *entry = entry.max(-solid.signed_distance(&point));
        }
    }
    deepest
}

/// How far two spheres overlap at most that must not \[m\].
fn overlap_of_spheres(hand: &ArticulatedHand, pose: &HandPose) -> f64 {
    let mut points = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut centers = PointBuffer::zeros(hand.collision_spheres().radius.len());
    hand.forward(pose, &mut hand.new_scratch(), &mut points, &mut centers);
    let spheres = hand.collision_spheres();
    let overlap = |&[a, b]: &[u32; 2]| {
        let (a, b) = (a as usize, b as usize);
        spheres.radius[a] + spheres.radius[b] - (centers.get(a) - centers.get(b)).norm()
    };
    spheres.pairs.iter().map(overlap).fold(0.0, f64::max)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(hand), Some(records)) = (arguments.next(), arguments.next()) else {
        return Err("give a .urdf file and a grasps.jsonl".into());
    };
    let hand = load_urdf(hand, &UrdfOptions::default())?;
    let solids = (hand.parts().iter())
        .map(|part| SignedDistance::new(&part.mesh))
        .collect::<Result<Vec<_>, _>>()?;
    let bodies = hand.tree().body_count();
    let at_rest = depths(&hand, &solids, hand.open_articulation());
    for record in read_records(records.as_ref())? {
        let pose = record.hand_pose(hand.articulation_names())?;
        let found = depths(&hand, &solids, &pose.articulation);
        let worst = (0..found.len())
            .filter(|&pair| at_rest[pair] <= 0.0)
            .max_by(|&a, &b| found[a].total_cmp(&found[b]))
            .ok_or("a hand of one body cannot meet itself")?;
        println!(
            "grasp {}: {:.2} mm ({} in {}); spheres overlap by {:.2} mm",
            record.index,
            1e3 * found[worst],
            hand.body_names()[worst % bodies],
            hand.body_names()[worst / bodies],
            1e3 * overlap_of_spheres(&hand, &pose)
        );
    }
    Ok(())
}
