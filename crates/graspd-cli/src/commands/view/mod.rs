//! `graspd view`: the grasps of a run as a page in 3-D and as pictures.

mod page;
pub(crate) mod pictures;
mod trajectory;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use graspd::{GraspRecord, NamedMesh, read_records, write_atomically};
use graspd_geom::{SignedDistance, TriangleMesh};
use graspd_hand::{Hand, HandPose};

use super::input::{HandLoading, RepairChoice, on_threads};
use super::output::prepare_file;
use super::subject::{hand_of, objects_of, poses_of};
use crate::console::{print, warn};
use trajectory::Trajectories;

/// A page of more grasps is asked for, not made by default: it takes more than 10 MB.
const MAX_IN_PAGE: usize = 200;
/// A sheet of more pictures is asked for, not made by default.
const MAX_IN_SHEET: usize = 60;
/// A page above this size draws a warning \[bytes\].
const LARGE_PAGE: usize = 10_000_000;

/// No hand that grasps an object reaches farther from it \[m\].
const FARTHEST: f64 = 20.0;

#[derive(Args)]
pub(crate) struct Arguments {
    /// A folder that holds grasps.jsonl, or such a file
    grasps: PathBuf,
    /// Write the page to this file (DIR/view.html where neither --png nor --strip is given)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Render the grasps, best first, as one sheet to this PNG file
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Render one grasp's optimisation, or without a trajectory its execution, step by step to this PNG file
    #[arg(long, value_name = "FILE")]
    strip: Option<PathBuf>,
    /// Which grasp --strip shows, by the number of its start (the best by default)
    #[arg(long, value_name = "INDEX", requires = "strip")]
    grasp: Option<usize>,
    /// Show the K best grasps only
    #[arg(short = 'n', long, value_name = "K")]
    #[arg(value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    count: Option<usize>,
    /// Columns of the sheet
    #[arg(long, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=50))]
    columns: Option<usize>,
    /// The object's mesh or built-in name, where the records do not tell it (or tell another place)
    #[arg(long, value_name = "MESH", value_parser = NonEmptyStringValueParser::new())]
    object: Option<String>,
    /// Multiplies the object's coordinates (as recorded by default)
    #[arg(long, allow_negative_numbers = true)]
    scale: Option<f64>,
    /// The hand, where the records do not name a built-in one
    #[arg(long, value_parser = NonEmptyStringValueParser::new())]
    hand: Option<String>,
    #[command(flatten)]
    loading: HandLoading,
    #[command(flatten)]
    repair: RepairChoice,
    /// Worker threads (one for each core by default)
    #[arg(long)]
    threads: Option<usize>,
    /// No warnings
    #[arg(long, short)]
    quiet: bool,
}

/// What there is to see.
pub(super) struct Subject {
    /// Where the records are.
    file: PathBuf,
    /// Best first.
    records: Vec<GraspRecord>,
    /// One for each record.
    poses: Vec<HandPose>,
    hand: Box<dyn Hand>,
    object: NamedMesh,
    distance: SignedDistance,
    trajectories: Trajectories,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || view(arguments))?
}

fn view(arguments: &Arguments) -> Result<()> {
    let quiet = arguments.quiet;
    let subject = Subject::load(arguments)?;
    let outputs = [
        ("-o", page_file(arguments)),
        ("--png", arguments.png.clone()),
        ("--strip", arguments.strip.clone()),
    ];
    for (flag, file) in &outputs {
        if let Some(file) = file {
            prepare_file(file, flag)?;
        }
    }
    let [(_, page), (_, sheet), (_, strip)] = outputs;
    let total = subject.records.len();
    let told_of = || subject.file.display().to_string();
    let mut text = String::new();
    if let Some(file) = page {
        let shown = arguments.count.unwrap_or(MAX_IN_PAGE).min(total);
        let html = page::html(&subject, shown).with_context(told_of)?;
        write_atomically(&file, html.as_bytes())?;
        if html.len() > LARGE_PAGE {
            let size = html.len() as f64 / 1e6;
            let file = file.display();
            warn(
                quiet,
                &format!("{file}: {size:.1} MB is much for a phone; -n shows fewer grasps"),
            );
        }
        text += &told(&file, shown, total, "page");
    }
    if let Some(file) = sheet {
        let shown = arguments.count.unwrap_or(MAX_IN_SHEET).min(total);
        let sheet = pictures::sheet(&subject, shown, arguments.columns);
        sheet.with_context(told_of)?.write_png(&file)?;
        text += &told(&file, shown, total, "picture");
    }
    if let Some(file) = strip {
        let place = subject.place_of(arguments.grasp, &arguments.grasps)?;
        let strip = pictures::strip(&subject, place);
        strip.with_context(told_of)?.write_png(&file)?;
        let index = subject.records[place].index;
        text += &format!(
            "{}: picture of grasp #{index}, step by step\n",
            file.display()
        );
    }
    print(&text)
}

fn told(file: &Path, shown: usize, total: usize, what: &str) -> String {
    let which = match (shown, total) {
        (1, 1) => "1 grasp".to_owned(),
        _ if shown == total => format!("{total} grasps"),
        _ => format!("the best {shown} of {total} grasps (-n shows more)"),
    };
    format!("{}: {what} of {which}\n", file.display())
}

fn page_file(arguments: &Arguments) -> Option<PathBuf> {
    if arguments.output.is_some() || arguments.png.is_some() || arguments.strip.is_some() {
        return arguments.output.clone();
    }
    Some(if arguments.grasps.is_dir() {
        arguments.grasps.join("view.html")
    } else {
        arguments.grasps.with_extension("html")
    })
}

/// Refuses a hand so far from the object that one of them cannot be seen.
fn check_distance(
    file: &Path,
    record: &GraspRecord,
    hand: &TriangleMesh,
    object: &NamedMesh,
) -> Result<()> {
    let Some((low, high)) = object.mesh.bounds() else {
        return Ok(());
    };
    let center = nalgebra::center(&low, &high);
    let distance = (hand.vertices.iter())
        .map(|vertex| (vertex - center).norm())
        .fold(0.0, f64::max);
    if distance > FARTHEST {
        bail!(
            "{}: grasp {}: the hand reaches {distance:.3e} m away from the object; lengths are metres, angles radians",
            file.display(),
            record.index
        );
    }
    Ok(())
}

impl Subject {
    fn load(arguments: &Arguments) -> Result<Self> {
        let quiet = arguments.quiet;
        let folder = &arguments.grasps;
        if !folder.exists() {
            bail!(
                "{}: no such folder or file; give the output folder of graspd synth, or a grasps.jsonl",
                folder.display()
            );
        }
        let file = if folder.is_dir() {
            folder.join("grasps.jsonl")
        } else {
            folder.clone()
        };
        let mut records = read_records(&file)?;
        // Best first; what has no rank comes last, in its order.
        records.sort_by_key(|record| record.rank.unwrap_or(usize::MAX));
        let hand = hand_of(
            &records,
            &file,
            arguments.hand.as_deref(),
            &arguments.loading.options()?,
            quiet,
        )?;
        let poses = poses_of(&records, &file, hand.as_ref(), quiet)?;
        let objects = objects_of(
            &records,
            &file,
            arguments.object.as_deref(),
            arguments.scale,
            &arguments.repair,
            quiet,
        )?;
        let scales = objects.len();
        let mut objects = objects.into_iter();
        let (Some(object), None) = (objects.next(), objects.next()) else {
            bail!(
                "{}: the grasps are for {scales} scales of the object, and one object is shown: set --scale",
                file.display()
            );
        };
        for (record, pose) in records.iter().zip(&poses) {
            check_distance(&file, record, &hand.surface(pose), &object)?;
        }
        let distance = SignedDistance::new(&object.mesh).with_context(|| object.label())?;
        let trajectories = Trajectories::beside(&file, hand.articulation_names().len())?;
        Ok(Self {
            file,
            records,
            poses,
            hand,
            object,
            distance,
            trajectories,
        })
    }

    /// The place of the grasp of that index, by default of the best.
    fn place_of(&self, index: Option<usize>, file: &Path) -> Result<usize> {
        let Some(index) = index else {
            return Ok(0);
        };
        let place = self.records.iter().position(|record| record.index == index);
        place.with_context(|| {
            let known: Vec<String> = (self.records.iter().take(10))
                .map(|record| record.index.to_string())
                .collect();
            format!(
                "{}: no grasp has the index {index}; --grasp takes one of {}{}",
                file.display(),
                known.join(", "),
                if self.records.len() > 10 { ", .." } else { "" }
            )
        })
    }
}
