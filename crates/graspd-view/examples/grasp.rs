//! Renders an open hand before an object, with the hand's contact points:
//! `cargo run -p graspd-view --example grasp -- HAND OBJECT [-o out.png]`

use std::error::Error;

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{HandPose, Kinematics, PointBuffer, load_hand};
use graspd_mesh::load_mesh;
use graspd_view::{Color, Dot, render_hand_pose};
use nalgebra::Point3;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (hand, object, output) = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..]
    {
        [hand, object] => (hand, object, "grasp.png"),
        [hand, object, "-o", output] => (hand, object, output),
        _ => return Err("usage: grasp HAND OBJECT [-o out.png]".into()),
    };
    let hand = load_hand(hand)?;
    let object = load_mesh(object)?;
    let (low, high) = object.bounds().ok_or("the object has no vertices")?;
    // The palm 3 cm from the object's box, on the side that it faces away from.
    let normal = hand.palm().normal;
    let middle = nalgebra::center(&low, &high);
    let gap = 0.03 + 0.5 * (high - low).abs().dot(&normal.abs());
    let place = middle - normal * gap - hand.palm().center.coords;
    let pose = HandPose {
        translation: place.into(),
        rotation: Quaternion::identity(),
        articulation: hand.open_articulation().to_vec(),
    };
    let contact_points = hand.contact_points();
    let count = contact_points.weight.len();
    let mut positions = PointBuffer::<f64>::zeros(count);
    let mut spheres = PointBuffer::<f64>::zeros(hand.collision_spheres().radius.len());
    let kinematics: &dyn Kinematics<f64> = &*hand;
    kinematics.forward(&pose, &mut hand.new_scratch(), &mut positions, &mut spheres);
    let dots: Vec<Dot> = (0..count)
        .filter(|index| contact_points.weight[*index] > 0.0)
        .map(|index| {
            let Vec3 { x, y, z } = positions.get(index);
            let distance = (Point3::new(x, y, z) - middle).norm() - gap;
            Dot {
                position: Point3::new(x, y, z),
                radius: 5e-4,
                color: Color::heat(1.0 - distance / 0.1),
            }
        })
        .collect();
    render_hand_pose(&object, &*hand, &pose, &dots, (640, 560))?.write_png(output)?;
    Ok(())
}
