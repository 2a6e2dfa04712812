//! `graspd reconstruct`: an RGB-D capture into a closed mesh.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser};
use graspd_geom::{
    DepthIntrinsics, FusionSettings, PoissonSettings, ReconstructionSettings, Registration,
    RgbdCapture, align_to_mesh, fuse, read_capture, reconstruct, save_mesh, signed_volume,
};
use nalgebra::{Isometry3, Vector3};

use super::input::{RepairChoice, load_object, on_threads, unit_doubt};
use super::output::prepare_file;
use super::scan::spread_views;
use crate::console::{print, print_json, warn};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of a capture: YCB's layout (as `graspd scan` writes it), or depth.png with camera.json
    capture: PathBuf,
    /// Mesh to write: .obj .stl .off
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    /// Depth of the Poisson reconstruction's octree, 2 to 13: cells of the longest side / 2^depth
    #[arg(long, default_value_t = 5)]
    depth: u32,
    /// How many views of a YCB capture, a multiple of 3 (those that were rendered, or else 15)
    #[arg(long)]
    views: Option<usize>,
    /// Matrix of a YCB calibration that depth pixels are turned into rays with
    #[arg(long, default_value = "ir", value_parser = PossibleValuesParser::new(["ir", "depth"]))]
    intrinsics: String,
    /// Cut the surface away where no point is within so many cells (or 5 mm), and patch the hole; inf: leave it to Poisson
    #[arg(long, default_value_t = ReconstructionSettings::default().trim, allow_negative_numbers = true)]
    trim: f64,
    /// Express the result in the frame of this mesh of the same object, found by registration
    #[arg(long, value_name = "MESH", value_parser = NonEmptyStringValueParser::new())]
    align_to: Option<String>,
    #[command(flatten)]
    repair: RepairChoice,
    /// Worker threads (one for each core by default); results do not depend on it
    #[arg(long)]
    threads: Option<usize>,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
    /// No progress and no warnings
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || build(arguments))?
}

fn build(arguments: &Arguments) -> Result<()> {
    let quiet = arguments.quiet;
    let label = arguments.capture.display().to_string();
    let views = arguments.views.map(spread_views).transpose()?;
    let poisson = PoissonSettings {
        depth: arguments.depth,
        ..PoissonSettings::default()
    };
    poisson.validate()?;
    prepare_file(&arguments.output, "-o")?;
    let started = Instant::now();
    let intrinsics = match arguments.intrinsics.as_str() {
        "depth" => DepthIntrinsics::Depth,
        _ => DepthIntrinsics::Infrared,
    };
    let capture = read_capture(&arguments.capture, views.as_ref(), intrinsics)?;
    if !capture.missing.is_empty() {
        let (missing, used) = (capture.missing.len(), capture.views.len());
        warn(
            quiet,
            &format!(
                "{label}: {missing} of {} views are missing and left out: {}",
                missing + used,
                capture.missing.join(", ")
            ),
        );
    }
    let fused = fuse(&capture, &FusionSettings::default()).with_context(|| label.clone())?;
    let settings = ReconstructionSettings {
        poisson,
        trim: arguments.trim,
        ..ReconstructionSettings::default()
    };
    let result = reconstruct(&fused.cloud, &settings, &label).with_context(|| label.clone())?;
    let aligned = align(arguments, &capture, &fused.cloud)?;
    let (motion, frame) = frame_of(&capture, aligned.as_ref());
    let mesh = result.mesh.transformed(&motion);
    let (low, high) = mesh.bounds().context("the mesh has no vertices")?;
    let sides = high - low;
    if let Some(doubt) = unit_doubt(&label, sides.max())? {
        warn(quiet, &doubt);
    }
    save_mesh(&mesh, &arguments.output)?;

    let seconds = started.elapsed().as_secs_f64();
    let volume_cm3 = 1e6 * signed_volume(&mesh);
    if arguments.json {
        let views: Vec<_> = (fused.views.iter())
            .map(|view| {
                serde_json::json!({
                    "name": view.name,
                    "points": view.points,
                })
            })
            .collect();
        return print_json(&serde_json::json!({
            "file": arguments.output.to_string_lossy(),
            "views": views,
            "missing": capture.missing,
            "points": fused.raw_points,
            "points_fused": fused.cloud.points.len(),
            "depth": arguments.depth,
            "trimmed_area_fraction": result.trimmed,
            "repair": result.repair.summary(),
            "faces": mesh.faces.len(),
            "size_mm": [1000.0 * sides.x, 1000.0 * sides.y, 1000.0 * sides.z],
            "volume_cm3": volume_cm3,
            "frame": frame,
            "alignment_rms_mm": aligned.map(|a| 1000.0 * a.rms),
            "seconds": seconds,
        }));
    }
    let missing = match capture.missing.len() {
        0 => String::new(),
        missing => format!(" ({missing} missing)"),
    };
    let alignment = aligned.map_or_else(String::new, |a| {
        format!(", {:.2} mm RMS from it", 1000.0 * a.rms)
    });
    print(&format!(
        "{}: {} faces from {} views{missing} and {} points in {seconds:.1} s\n\
         {:.1} x {:.1} x {:.1} mm, {volume_cm3:.1} cm3, in the frame of {frame}{alignment}\n\
         {:.0} % of the surface was not seen and closed: {}\n",
        arguments.output.display(),
        mesh.faces.len(),
        capture.views.len(),
        fused.raw_points,
        1000.0 * sides.x,
        1000.0 * sides.y,
        1000.0 * sides.z,
        100.0 * result.trimmed,
        result.repair.summary(),
    ))
}

/// The registration that `--align-to` asks for.
fn align(
    arguments: &Arguments,
    capture: &RgbdCapture,
    cloud: &graspd_geom::PointCloud,
) -> Result<Option<Registration>> {
    let Some(name) = &arguments.align_to else {
        return Ok(None);
    };
    let target = load_object(name, 1.0, &arguments.repair, arguments.quiet)?;
    let up = capture.table.map_or(Vector3::z(), |table| table.normal);
    let found = align_to_mesh(cloud, &up, &target.mesh).with_context(|| name.clone())?;
    Ok(Some(found))
}

/// From the capture's frame to the result's, and what that is called.
fn frame_of(
    capture: &RgbdCapture,
    aligned: Option<&Registration>,
) -> (Isometry3<f64>, &'static str) {
    match (aligned, capture.object_from_world) {
        (Some(found), _) => (found.motion, "the mesh aligned to"),
        (None, Some(motion)) => (motion, "the scanned mesh"),
        (None, None) => (Isometry3::identity(), "the capture"),
    }
}
