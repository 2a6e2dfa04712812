//! One HTML file with the grasps of a run in 3-D, which loads nothing from anywhere.

mod block;
mod field;
mod motion;
mod shape;
mod template;

use graspd_geom::TriangleMesh;
use graspd_hand::{Hand, HandPose};
use nalgebra::Point3;
use rayon::prelude::*;
use serde::Serialize;

use crate::grasp::grasp_directions;
use crate::{ContactForce, ViewError};

use block::{Block, Section};
use field::FieldDescription;
use motion::{Frames, HandDescription};
use shape::MeshDescription;
use template::{escape_html, escape_json, fill};

const TEMPLATE: &str = include_str!("../../viewer/page.html");
const STYLE: &str = include_str!("../../viewer/style.css");
/// Bundled from `viewer/src` and npm packages by `cargo xtask viewer`.
const SCRIPT: &str = include_str!("../../viewer/viewer.js");

/// An object is thinned out beyond this many faces.
const MAX_OBJECT_FACES: usize = 150_000;
/// All optimisations together keep about this many bytes of frames, before compression.
const FRAME_BYTES: usize = 8_000_000;
/// Frames of one optimisation: at least, and at most.
const FRAMES: [usize; 2] = [12, 160];

/// What a page shows.
pub struct GraspPage<'a> {
    /// The object's name, any text.
    pub object_name: String,
    /// Its closed surface.
    pub object: &'a TriangleMesh,
    /// The hand.
    pub hand: &'a dyn Hand,
    /// What there is to say about all grasps: label and value.
    pub facts: Vec<(String, String)>,
    /// What the numbers of [`PageGrasp::metrics`] are.
    pub columns: Vec<MetricColumn>,
    /// What the numbers of [`Optimization::losses`] are.
    pub loss_names: Vec<LossName>,
    /// The grasps; at least one.
    pub grasps: Vec<PageGrasp>,
}

/// A column of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricColumn {
    /// Its heading.
    pub label: String,
    /// Its unit, or nothing.
    pub unit: String,
    /// What it is, in one phrase.
    pub about: String,
    /// Decimals to show.
    pub digits: usize,
}

/// A loss of the optimisation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LossName {
    /// Its name.
    pub label: String,
    /// Its unit, or nothing.
    pub unit: String,
}

/// One grasp of a page.
#[derive(Clone, Debug, Default)]
pub struct PageGrasp {
    /// Its place in the run's order, from 1; `None` if it has none.
    pub rank: Option<usize>,
    /// The number of its start.
    pub index: usize,
    /// One for each column; `None` where it was not measured.
    pub metrics: Vec<Option<f64>>,
    /// What else there is to say: label and value.
    pub details: Vec<(String, String)>,
    /// The way of the hand, in the order of time; the grasp itself, at time 1, must be among them.
    pub motion: Vec<Keyframe>,
    /// Where the grasp presses on the object.
    pub contacts: Vec<ContactForce>,
    /// How it was found, if that is known.
    pub optimization: Option<Optimization>,
}

/// A pose on the way from pre-grasp to squeeze.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframe {
    /// 0 for the pre-grasp, 1 for the grasp, 2 for the squeeze.
    pub time: f64,
    /// The hand then, in the object's frame.
    pub pose: HandPose,
}

/// The poses along an optimisation and the losses there.
#[derive(Clone, Debug, Default)]
pub struct Optimization {
    /// The step of each pose, increasing.
    pub steps: Vec<u64>,
    /// The poses, in the object's frame; as many as steps.
    pub poses: Vec<HandPose>,
    /// A row for each step, with a number for each of [`GraspPage::loss_names`]. Fewer rows belong to the first steps.
    pub losses: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct Description<'a> {
    object_name: &'a str,
    hand_name: &'a str,
    facts: &'a [(String, String)],
    columns: &'a [MetricColumn],
    loss_names: &'a [LossName],
    object: MeshDescription,
    hand: HandDescription,
    field: FieldDescription,
    length_step: f32,
    grasps: Vec<GraspDescription<'a>>,
}

#[derive(Serialize)]
struct GraspDescription<'a> {
    rank: Option<usize>,
    index: usize,
    metrics: &'a [Option<f64>],
    details: &'a [(String, String)],
    times: Vec<f64>,
    motion: Section,
    /// Position \[m\] and force \[N\], six numbers a contact.
    contacts: Vec<[f64; 6]>,
    optimization: Option<OptimizationDescription>,
    /// The box around object and hand.
    low: [f64; 3],
    high: [f64; 3],
    /// From where to look at first: towards the viewer.
    look: [f64; 3],
}

#[derive(Serialize)]
struct OptimizationDescription {
    steps: Vec<u64>,
    motion: Section,
    losses: LossCurves,
}

#[derive(Serialize)]
struct LossCurves {
    steps: Vec<u64>,
    /// A row for each loss.
    values: Vec<Vec<Option<f32>>>,
}

/// The frames of one grasp, evaluated.
struct GraspFrames {
    motion: Frames,
    optimization: Option<(Vec<u64>, Frames)>,
    low: Point3<f64>,
    high: Point3<f64>,
    look: [f64; 3],
}

/// Makes the page as the text of one HTML file.
///
/// It holds everything that it shows: scripts (three.js among them), styles, meshes and poses. A hand of rigid links
/// is stored once with the poses of its links at each frame; a skin with its vertices at each frame, to 16 bits. Of
/// long optimisations, frames are left out (losses are not) so that the page stays small; objects of more than 150
/// 000 faces are thinned out for the eye. Text from outside cannot end the elements that it stands in.
///
/// # Errors
/// [`ViewError::Page`] without a grasp or with one that has no pose at time 1; [`ViewError::Object`] for an object
/// that is not closed.
pub fn page_html(page: &GraspPage<'_>) -> Result<String, ViewError> {
    if page.grasps.is_empty() {
        return Err(ViewError::Page("there are no grasps to show".into()));
    }
    let mut block = Block::default();
    let object = MeshDescription::store(page.object, MAX_OBJECT_FACES, &mut block);
    let field = FieldDescription::store(page.object, &mut block).map_err(ViewError::Object)?;
    let hand = HandDescription::store(page.hand, &mut block);
    let frame_bytes = page.grasps.len() * 2 * hand.channels();
    let max_frames = (FRAME_BYTES / frame_bytes.max(1)).clamp(FRAMES[0], FRAMES[1]);
    let frames = (page.grasps.par_iter())
        .map(|grasp| GraspFrames::of(page, &hand, grasp, max_frames))
        .collect::<Result<Vec<_>, _>>()?;
    let longest = frames.iter().map(GraspFrames::longest).fold(0.0, f32::max);
    let length_step = (longest / f32::from(i16::MAX)).max(1e-9);
    let grasps = page.grasps.iter().zip(&frames);
    let description = Description {
        object_name: &page.object_name,
        hand_name: page.hand.name(),
        facts: &page.facts,
        columns: &page.columns,
        loss_names: &page.loss_names,
        grasps: grasps
            .map(|(grasp, frames)| frames.store(grasp, length_step, &mut block))
            .collect(),
        object,
        hand,
        field,
        length_step,
    };
    let unwritten = |error: &dyn std::fmt::Display| ViewError::Page(error.to_string());
    let json = serde_json::to_string(&description).map_err(|error| unwritten(&error))?;
    let block = block.to_text().map_err(|error| unwritten(&error))?;
    let title = format!("{} grasped by {}", page.object_name, page.hand.name());
    Ok(fill(
        TEMPLATE,
        &[
            ("title", &escape_html(&title)),
            ("style", STYLE),
            ("description", &escape_json(&json)),
            ("block", &block),
            ("script", SCRIPT),
        ],
    ))
}

impl GraspFrames {
    fn of(
        page: &GraspPage<'_>,
        hand: &HandDescription,
        grasp: &PageGrasp,
        max_frames: usize,
    ) -> Result<Self, ViewError> {
        let poses: Vec<HandPose> = (grasp.motion.iter())
            .map(|keyframe| keyframe.pose.clone())
            .collect();
        let at_grasp = grasp.motion.iter().find(|keyframe| keyframe.time == 1.0);
        let Some(at_grasp) = at_grasp else {
            let fault = format!("grasp {} has no pose at time 1", grasp.index);
            return Err(ViewError::Page(fault));
        };
        let optimization = grasp.optimization.as_ref().map(|optimization| {
            let kept = spread(optimization.poses.len(), max_frames);
            let steps = kept.iter().map(|at| optimization.steps[*at]).collect();
            let poses: Vec<HandPose> = (kept.iter())
                .map(|at| optimization.poses[*at].clone())
                .collect();
            (steps, Frames::of(page.hand, hand, &poses))
        });
        let surface = page.hand.surface(&at_grasp.pose);
        let [(look, _), ..] = grasp_directions(page.hand, &at_grasp.pose);
        // The whole way is in view: it begins farthest away.
        let before = page.hand.surface(&poses[0]);
        let hands = surface.vertices.iter().chain(&before.vertices);
        let mut points = page.object.vertices.iter().chain(hands);
        let first = points.next().copied().unwrap_or(Point3::origin());
        let (low, high) = points.fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        Ok(Self {
            motion: Frames::of(page.hand, hand, &poses),
            optimization,
            low,
            high,
            look: look.into(),
        })
    }

    fn longest(&self) -> f32 {
        let motion = self.motion.longest();
        let optimization = self.optimization.as_ref();
        let optimization = optimization.map_or(0.0, |(_, frames)| frames.longest());
        // An optimisation that has run away is cut off rather than all others made coarse.
        motion.max(optimization.min(3.0 * motion))
    }

    fn store<'a>(
        &self,
        grasp: &'a PageGrasp,
        length_step: f32,
        block: &mut Block,
    ) -> GraspDescription<'a> {
        let optimization = grasp.optimization.as_ref().zip(self.optimization.as_ref());
        GraspDescription {
            rank: grasp.rank,
            index: grasp.index,
            metrics: &grasp.metrics,
            details: &grasp.details,
            times: grasp.motion.iter().map(|keyframe| keyframe.time).collect(),
            motion: self.motion.store(length_step, block),
            contacts: (grasp.contacts.iter())
                .map(|contact| {
                    let (p, f) = (contact.position, contact.force);
                    // A micrometre and a millinewton are enough.
                    let [x, y, z] = [p.x, p.y, p.z].map(|c| (c * 1e6).round() / 1e6);
                    let [u, v, w] = [f.x, f.y, f.z].map(|c| (c * 1e3).round() / 1e3);
                    [x, y, z, u, v, w]
                })
                .collect(),
            optimization: optimization.map(|(given, (steps, frames))| OptimizationDescription {
                steps: steps.clone(),
                motion: frames.store(length_step, block),
                losses: LossCurves::of(given),
            }),
            low: self.low.coords.into(),
            high: self.high.coords.into(),
            look: self.look,
        }
    }
}

impl LossCurves {
    fn of(optimization: &Optimization) -> Self {
        let rows = &optimization.losses;
        let count = rows.first().map_or(0, Vec::len);
        let row = |loss: usize| {
            let values = rows.iter().map(|row| row.get(loss));
            values
                .map(|value| value.map(|v| *v as f32).filter(|v| v.is_finite()))
                .collect()
        };
        Self {
            steps: optimization.steps[..rows.len().min(optimization.steps.len())].to_vec(),
            values: (0..count).map(row).collect(),
        }
    }
}

/// Returns at most `most` of `count` places, evenly spread, the first and the last among them.
fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    let last = (count - 1) as f64;
    (0..most)
        .map(|i| (i as f64 * last / (most - 1) as f64).round() as usize)
        .collect()
}
