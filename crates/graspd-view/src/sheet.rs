//! Many grasps in one picture, and one grasp at many times.

use graspd_geom::TriangleMesh;
use graspd_hand::{Hand, HandPose};
use nalgebra::Point3;

use crate::caption::{TextStyle, draw_text};
use crate::grasp::{aspect, grasp_directions, grasp_scene};
use crate::{Camera, Color, Dot, Image, ViewError, render, tile};

/// White around captions \[px\].
const MARGIN: usize = 8;

/// What stands below a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Captioned {
    /// In bold.
    pub title: String,
    /// Below it.
    pub lines: Vec<String>,
}

/// A grasp of a [`contact_sheet`].
#[derive(Clone, Debug)]
pub struct SheetGrasp {
    /// The hand, in the object's frame.
    pub pose: HandPose,
    /// Marks, such as contact points ([`crate::contact_dots`]).
    pub marks: Vec<Dot>,
    /// What to write below it.
    pub caption: Captioned,
}

/// Adds a white band of text below; lines that are too long are cut off.
///
/// # Errors
/// [`ViewError::Size`].
pub fn captioned(image: &Image, caption: &Captioned) -> Result<Image, ViewError> {
    let (title, body) = (TextStyle::TITLE, TextStyle::BODY);
    let band = 2 * MARGIN + title.line_height() + caption.lines.len() * body.line_height();
    let (width, height) = (image.width(), image.height());
    let mut sheet = Image::filled(width, height + band, Color::WHITE)?;
    sheet.paste(image, 0, 0);
    let room = width.saturating_sub(2 * MARGIN);
    let mut y = height + MARGIN;
    draw_text(
        &mut sheet,
        MARGIN,
        y,
        &title.fitted(&caption.title, room),
        title,
    );
    y += title.line_height();
    for line in &caption.lines {
        draw_text(&mut sheet, MARGIN, y, &body.fitted(line, room), body);
        y += body.line_height();
    }
    Ok(sheet)
}

/// Grasps of one object in rows of `columns`, each a picture of `cell` = (width, height) pixels with its caption
/// below, seen across the direction of its palm, so that neither hand nor object hides the other.
///
/// # Errors
/// [`ViewError::Size`], also for no grasps or no columns.
pub fn contact_sheet(
    object: &TriangleMesh,
    hand: &dyn Hand,
    grasps: &[SheetGrasp],
    columns: usize,
    cell: (usize, usize),
) -> Result<Image, ViewError> {
    let pictures = (grasps.iter())
        .map(|grasp| {
            let surface = hand.surface(&grasp.pose);
            let scene = grasp_scene(object, &surface, &grasp.marks);
            let camera = framing(scene.points(), hand, &grasp.pose, cell);
            captioned(&render(&scene, &camera, cell.0, cell.1)?, &grasp.caption)
        })
        .collect::<Result<Vec<_>, _>>()?;
    tile(&pictures, columns)
}

/// Renders a hand on its way, one picture of `panel` = (width, height) pixels a pose, side by side and by one camera:
/// that which suits the last pose, from where all are seen.
///
/// # Errors
/// [`ViewError::Size`], also for no poses.
pub fn trajectory_strip(
    object: &TriangleMesh,
    hand: &dyn Hand,
    frames: &[SheetGrasp],
    panel: (usize, usize),
) -> Result<Image, ViewError> {
    let surfaces: Vec<TriangleMesh> = (frames.iter())
        .map(|frame| hand.surface(&frame.pose))
        .collect();
    let Some(last) = frames.last() else {
        return tile(&[], 1);
    };
    let hands = surfaces.iter().flat_map(|surface| &surface.vertices);
    let points = object.vertices.iter().chain(hands).copied();
    let camera = framing(points, hand, &last.pose, panel);
    let pictures = (frames.iter().zip(&surfaces))
        .map(|(frame, surface)| {
            let scene = grasp_scene(object, surface, &frame.marks);
            captioned(&render(&scene, &camera, panel.0, panel.1)?, &frame.caption)
        })
        .collect::<Result<Vec<_>, _>>()?;
    tile(&pictures, pictures.len())
}

/// Returns the camera of a grasp in a cell or panel of `size` = (width, height) pixels.
fn framing(
    points: impl IntoIterator<Item = Point3<f64>>,
    hand: &dyn Hand,
    pose: &HandPose,
    size: (usize, usize),
) -> Camera {
    let [(towards_viewer, up), ..] = grasp_directions(hand, pose);
    Camera::framing(points, towards_viewer, up, aspect(size))
}
