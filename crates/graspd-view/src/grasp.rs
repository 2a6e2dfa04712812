//! Pictures of a hand on an object.

use graspd_geom::{Rigid, TriangleMesh};
use graspd_hand::{Hand, HandPose, PalmFrame};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use crate::{Camera, Color, Dot, Image, Lens, Scene, Shading, Surface, ViewError, render, tile};

/// A strip of three pictures of a grasp, each of `panel` = (width, height) pixels: two opposite three-quarter
/// views, then one that faces the palm (where the palm is not known: from above).
///
/// Meshes, palm and `contacts` (marks drawn over both, such as contact points coloured by [`Color::heat`] of their
/// force) are in one frame. The object is slate, the hand sand.
///
/// # Errors
/// [`ViewError::Size`].
pub fn render_grasp(
    object: &TriangleMesh,
    hand: &TriangleMesh,
    palm: Option<&PalmFrame>,
    contacts: &[Dot],
    panel: (usize, usize),
) -> Result<Image, ViewError> {
    let scene = grasp_scene(object, hand, contacts);
    let (width, height) = panel;
    let aspect = width as f64 / height.max(1) as f64;
    let panels = grasp_directions(object, hand, palm)
        .into_iter()
        .map(|(towards_viewer, up)| {
            let camera =
                Camera::framing(scene.points(), towards_viewer, up, Lens::default(), aspect);
            render(&scene, &camera, width, height)
        })
        .collect::<Result<Vec<_>, _>>()?;
    tile(&panels, 3)
}

/// The object in slate, the hand in sand.
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
                shading: Shading::Smooth {
                    crease_angle: 65f64.to_radians(),
                },
            },
        ],
        dots: contacts.to_vec(),
        ..Scene::default()
    }
}

/// As [`render_grasp`], for a hand and its pose in the object's frame.
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
    let palm = palm_in_object_frame(hand.palm(), pose);
    render_grasp(object, &hand.surface(pose), Some(&palm), contacts, panel)
}

/// A palm given in the hand-base frame, in the object frame of this pose.
pub fn palm_in_object_frame(palm: &PalmFrame, pose: &HandPose) -> PalmFrame {
    let motion = Rigid {
        rotation: pose.rotation.to_matrix(),
        translation: pose.translation,
    };
    PalmFrame {
        center: motion.apply(palm.center.into()).into(),
        normal: motion.rotation.apply(palm.normal.into()).into(),
        fingers: motion.rotation.apply(palm.fingers.into()).into(),
    }
}

/// For each panel, the direction towards the viewer and what is up.
pub(crate) fn grasp_directions(
    object: &TriangleMesh,
    hand: &TriangleMesh,
    palm: Option<&PalmFrame>,
) -> [(Vector3<f64>, Vector3<f64>); 3] {
    let middle = |mesh: &TriangleMesh| {
        let (low, high) = mesh
            .bounds()
            .unwrap_or((Point3::origin(), Point3::origin()));
        nalgebra::center(&low, &high)
    };
    // Where the hand is, as seen from the object: the views look across this direction, so that neither hides
    // the other.
    let to_hand = palm.map_or_else(|| middle(hand) - middle(object), |palm| -palm.normal);
    let azimuth = to_hand.y.atan2(to_hand.x);
    let elevation = 22f64.to_radians();
    let first = crate::camera::direction(azimuth + 65f64.to_radians(), elevation);
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let third = match palm {
        // A quarter off the normal: fingers that point at the viewer would hide each other.
        Some(palm) => match Unit::try_new(palm.fingers, 1e-9) {
            Some(fingers) => {
                let tilt = UnitQuaternion::from_axis_angle(&fingers, 20f64.to_radians());
                (tilt * palm.normal, palm.fingers)
            }
            None => (palm.normal, Vector3::z()),
        },
        None => (Vector3::z() + 0.2 * first, Vector3::z()),
    };
    [
        (first, Vector3::z()),
        (half_turn * first, Vector3::z()),
        third,
    ]
}
