//! Pictures of a hand alone, with what was found about it.

use graspd_hand::{Hand, HandPose, PointBuffer};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::grasp::aspect;
use crate::{Camera, Color, Dot, Image, Scene, Surface, ViewError, render, tile};

/// Radius of a contact point's mark \[m\].
const DOT_RADIUS: f64 = 6e-4;
/// Colour of contact points.
const DOT_COLOR: Color = Color::new(34, 90, 140);
/// Length of the palm frame's axes as a share of the hand's size.
const AXIS_SHARE: f64 = 0.3;

/// Renders a strip of three pictures, each of `panel` = (width, height) pixels: the open hand from the side that its
/// palm faces, the same turned half sideways, and the hand at the articulation `closed` from there. Contact points
/// are dots; the palm frame's axes are red for the normal, green for the fingers, blue for their cross product.
///
/// # Errors
/// [`ViewError::Size`].
pub fn render_hand(
    hand: &dyn Hand,
    closed: &[f64],
    panel: (usize, usize),
) -> Result<Image, ViewError> {
    let palm = hand.palm();
    let side = palm.normal.cross(&palm.fingers);
    let front = palm.normal + 0.25 * palm.fingers + 0.2 * side;
    let slanted = 0.5 * palm.normal + 0.25 * palm.fingers - side;
    let panels = [
        (hand.open_articulation(), front),
        (hand.open_articulation(), slanted),
        (closed, slanted),
    ]
    .map(|(articulation, towards_viewer)| picture(hand, articulation, towards_viewer, panel))
    .into_iter()
    .collect::<Result<Vec<_>, _>>()?;
    tile(&panels, 3)
}

fn picture(
    hand: &dyn Hand,
    articulation: &[f64],
    towards_viewer: Vector3<f64>,
    (width, height): (usize, usize),
) -> Result<Image, ViewError> {
    let pose = HandPose::at_origin(articulation);
    let surface = hand.surface(&pose);
    let mut points = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    hand.forward(&pose, &mut hand.new_scratch(), &mut points, &mut spheres);
    let dots = (0..points.len()).map(|i| Dot {
        position: points.get(i).into(),
        radius: DOT_RADIUS,
        color: DOT_COLOR,
    });
    let mut scene = Scene {
        surfaces: vec![Surface::new(&surface, Color::SAND)],
        dots: dots.collect(),
        ..Scene::default()
    };
    let palm = hand.palm();
    let axes = [palm.normal, palm.fingers, palm.normal.cross(&palm.fingers)];
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
    let frame = Isometry3::from_parts(
        Translation3::from(palm.center),
        UnitQuaternion::from_rotation_matrix(&rotation),
    );
    let size = surface
        .bounds()
        .map_or(0.1, |(low, high)| (high - low).max());
    scene.push_axes(&frame, AXIS_SHARE * size);
    let panel = (width, height);
    let camera = Camera::framing(scene.points(), towards_viewer, palm.fingers, aspect(panel));
    render(&scene, &camera, width, height)
}
