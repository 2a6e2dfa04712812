//! The picture of the built-in human hand in `docs/human-hand.md`: open, relaxed, pinching and as a fist, from the
//! palm and from the thumb's side.
//!
//! `cargo run --release -p graspd-tests --example human_hand_picture -- docs/pictures/human-hand.png`

use std::error::Error;

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{Hand, HandPose, SkinnedHand, SkinnedHandOptions, human};
use graspd_view::{Camera, Color, Image, Scene, Surface, ViewError, render, tile};
use nalgebra::Vector3;

/// Width and height of each panel \[pixels\].
const PANEL: (usize, usize) = (300, 300);

/// Joints by the end of their names, and their angles from the relaxed hand \[degrees\]; the others stay relaxed.
type Posture = &'static [(&'static str, f64)];

const PINCH: Posture = &[
    ("index_mcp_flexion", 28.0),
    ("index_pip_flexion", 22.0),
    ("thumb_cmc_flexion", 8.0),
    ("thumb_cmc_abduction", 22.0),
    ("thumb_cmc_twist", 25.0),
    ("thumb_mcp_flexion", 18.0),
    ("thumb_ip_flexion", 20.0),
];
const FIST: Posture = &[
    ("index_mcp_flexion", 52.0),
    ("middle_mcp_flexion", 55.0),
    ("ring_mcp_flexion", 58.0),
    ("pinky_mcp_flexion", 58.0),
    ("pip_flexion", 75.0),
    ("thumb_cmc_flexion", 22.0),
    ("thumb_cmc_abduction", 25.0),
    ("thumb_cmc_twist", 25.0),
    ("thumb_mcp_flexion", 25.0),
    ("thumb_ip_flexion", 40.0),
];

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("give the picture's file")?;
    let hand = human(&SkinnedHandOptions::default())?;
    let relaxed = vec![0.0; hand.articulation_names().len()];
    let postures = [
        hand.open_articulation().to_vec(),
        relaxed,
        bent(&hand, PINCH),
        bent(&hand, FIST),
    ];
    let palm = hand.palm();
    // Towards the thumb of a right hand.
    let side = palm.fingers.cross(&palm.normal);
    let mut panels = Vec::new();
    for (towards_viewer, up) in [(palm.normal, palm.fingers), (side, -palm.normal)] {
        for articulation in &postures {
            panels.push(picture(&hand, articulation, towards_viewer, up)?);
        }
    }
    tile(&panels, postures.len())?.write_png(file)?;
    Ok(())
}

fn bent(hand: &SkinnedHand, posture: Posture) -> Vec<f64> {
    let angle = |name: &String| {
        let of_name = posture.iter().find(|(end, _)| name.ends_with(end));
        of_name.map_or(0.0, |(_, degrees)| degrees.to_radians())
    };
    hand.articulation_names().iter().map(angle).collect()
}

fn picture(
    hand: &SkinnedHand,
    articulation: &[f64],
    towards_viewer: Vector3<f64>,
    up: Vector3<f64>,
) -> Result<Image, ViewError> {
    let surface = hand.surface(&HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: articulation.to_vec(),
    });
    let scene = Scene {
        surfaces: vec![Surface {
            mesh: &surface,
            color: Color::SAND,
            crease_angle: 80f64.to_radians(),
        }],
        ..Scene::default()
    };
    let (width, height) = PANEL;
    let aspect = width as f64 / height as f64;
    let camera = Camera::framing(scene.points(), towards_viewer, up, aspect);
    render(&scene, &camera, width, height)
}
