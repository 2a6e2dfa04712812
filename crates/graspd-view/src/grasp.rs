//! Pictures of a hand on an object.

use graspd_geom::TriangleMesh;
use graspd_hand::{Hand, HandPose};
use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::{Camera, Color, Dot, Image, Scene, Surface, ViewError, render, tile};

/// Renders a strip of three pictures of a grasp, each of `panel` = (width, height) pixels: two opposite three-quarter
/// views, then one that faces the palm.
///
/// `pose` and `contacts` (marks drawn over object and hand, such as contact points coloured by [`Color::heat`] of
/// their force) are in the object's frame. The object is slate, the hand sand.
///
/// # Errors
/// [`ViewError::Size`].
pub fn render_hand_pose(
    object: &TriangleMesh,
    hand: &dyn Hand,
    pose: &HandPose,
    contacts: &[Dot],
    panel: (usize, usize),
) -> Result<Image, ViewError> {
    let surface = hand.surface(pose);
    let scene = grasp_scene(object, &surface, contacts);
    let panels = grasp_directions(hand, pose)
        .into_iter()
        .map(|(towards_viewer, up)| {
            let camera = Camera::framing(scene.points(), towards_viewer, up, aspect(panel));
            render(&scene, &camera, panel.0, panel.1)
        })
        .collect::<Result<Vec<_>, _>>()?;
    tile(&panels, 3)
}

/// Width over height.
pub(crate) fn aspect((width, height): (usize, usize)) -> f64 {
    width as f64 / height.max(1) as f64
}

/// Returns the scene of an object in slate and a hand in sand.
pub(crate) fn grasp_scene<'a>(
    object: &'a TriangleMesh,
    hand: &'a TriangleMesh,
    contacts: &[Dot],
) -> Scene<'a> {
    Scene {
        surfaces: vec![
            Surface::new(object, Color::SLATE),
            Surface {
                mesh: hand,
                color: Color::SAND,
                // Skin of few faces turns more from face to face than a scan does; the edges of links turn by 90
                // degrees.
                crease_angle: 65f64.to_radians(),
            },
        ],
        dots: contacts.to_vec(),
        ..Scene::default()
    }
}

/// Returns the direction towards the viewer and what is up, in the object's frame, for each panel.
pub(crate) fn grasp_directions(
    hand: &dyn Hand,
    pose: &HandPose,
) -> [(Vector3<f64>, Vector3<f64>); 3] {
    let rotation = pose.rotation.to_matrix();
    let [normal, fingers]: [Vector3<f64>; 2] =
        [hand.palm().normal, hand.palm().fingers].map(|axis| rotation.apply(axis.into()).into());
    // The palm faces the object: the first two views look across its normal, so that neither hides the other.
    let azimuth = (-normal.y).atan2(-normal.x);
    let elevation = 22f64.to_radians();
    let first = crate::camera::direction(azimuth + 65f64.to_radians(), elevation);
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let third = match Unit::try_new(fingers, 1e-9) {
        // A quarter off the normal: fingers that point at the viewer would hide each other.
        Some(axis) => {
            let tilt = UnitQuaternion::from_axis_angle(&axis, 20f64.to_radians());
            (tilt * normal, fingers)
        }
        None => (normal, Vector3::z()),
    };
    [
        (first, Vector3::z()),
        (half_turn * first, Vector3::z()),
        third,
    ]
}
