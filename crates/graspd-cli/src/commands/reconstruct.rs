//! `graspd reconstruct`: an RGB-D capture or a point cloud into a closed mesh.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser};
use graspd_geom::signed_volume;
use graspd_mesh::{require_mesh_format, save_mesh};
use graspd_scan::{
    DepthIntrinsics, FusedView, FusionSettings, Plane, PointCloud, PoissonSettings,
    ReconstructionSettings, Registration, align_to_mesh, fuse, load_point_cloud, read_capture,
    reconstruct,
};
use graspd_settings::Validate;
use nalgebra::{Isometry3, Vector3};
use serde_json::json;

use super::input::{RepairChoice, load_object, on_threads, size_doubt};
use super::output::prepare_file;
use super::scan::spread_views;
use crate::console::{print, print_json, warn};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of a capture: YCB's layout (as `graspd scan` writes it), or depth.png with camera.json; or a point
    /// cloud: .ply
    capture: PathBuf,
    /// Mesh to write: .obj .stl .ply .off
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    /// Depth of the Poisson reconstruction's octree, 2 to 13: cells of the longest side / 2^depth
    #[arg(long, default_value_t = ReconstructionSettings::default().poisson.depth)]
    depth: u32,
    /// How many views of a YCB capture, a multiple of 3 (those that were rendered, or else 15)
    #[arg(long)]
    views: Option<usize>,
    /// Matrix of a YCB calibration that depth pixels are turned into rays with
    #[arg(long, default_value = "ir", value_parser = PossibleValuesParser::new(["ir", "depth"]))]
    intrinsics: String,
    /// Cut the surface away where no point is within so many cells (or 5 mm), and patch the hole; inf: leave it to
    /// Poisson
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

/// What is to be reconstructed.
struct Seen {
    cloud: PointCloud,
    /// Before averaging and without the strays.
    raw_points: usize,
    /// None of a point cloud.
    views: Vec<FusedView>,
    missing: Vec<String>,
    /// What the object stands on, in the cloud's frame, if that is known.
    table: Option<Plane>,
    /// From the cloud's frame to the scanned object's, if that is known.
    object_from_cloud: Option<Isometry3<f64>>,
}

fn build(arguments: &Arguments) -> Result<()> {
    let quiet = arguments.quiet;
    let label = arguments.capture.display().to_string();
    let poisson = PoissonSettings {
        depth: arguments.depth,
        ..PoissonSettings::default()
    };
    poisson.validate()?;
    require_mesh_format(&arguments.output)?;
    prepare_file(&arguments.output, "-o")?;
    let started = Instant::now();
    let seen = if arguments.capture.is_file() {
        stored_cloud(arguments, &arguments.capture)?
    } else {
        captured(arguments, &label)?
    };
    let settings = ReconstructionSettings {
        poisson,
        trim: arguments.trim,
        ..ReconstructionSettings::default()
    };
    let result = reconstruct(&seen.cloud, seen.table.as_ref(), &settings, &label)
        .with_context(|| label.clone())?;
    let aligned = align(arguments, &seen)?;
    let (motion, frame) = frame_of(&seen, aligned.as_ref());
    let mesh = result.mesh.transformed(&motion);
    let (low, high) = mesh.bounds().context("the mesh has no vertices")?;
    let sides = high - low;
    let hint = "check the depth image's unit (depth_scale_m, or the calibration's depth scale) and the poses";
    if let Some(doubt) = size_doubt(&label, sides.max(), hint)? {
        warn(quiet, &doubt);
    }
    save_mesh(&mesh, &arguments.output)?;

    let seconds = started.elapsed().as_secs_f64();
    let volume_cm3 = 1e6 * signed_volume(&mesh);
    if arguments.json {
        let views: Vec<_> = (seen.views.iter())
            .map(|view| json!({"name": view.name, "points": view.points}))
            .collect();
        return print_json(&json!({
            "file": arguments.output.to_string_lossy(),
            "views": views,
            "missing": seen.missing,
            "points": seen.raw_points,
            "points_fused": seen.cloud.points.len(),
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
    let source = match (seen.views.len(), seen.missing.len()) {
        (0, _) => String::new(),
        (used, 0) => format!("{used} views and "),
        (used, missing) => format!("{used} views ({missing} missing) and "),
    };
    let alignment = aligned.map_or_else(String::new, |a| {
        format!(", {:.2} mm RMS from it", 1000.0 * a.rms)
    });
    print(&format!(
        "{}: {} faces from {source}{} points in {seconds:.1} s\n\
         {:.1} x {:.1} x {:.1} mm, {volume_cm3:.1} cm3, in the frame of {frame}{alignment}\n\
         {:.0} % of the surface was not seen and closed: {}\n",
        arguments.output.display(),
        mesh.faces.len(),
        seen.raw_points,
        1000.0 * sides.x,
        1000.0 * sides.y,
        1000.0 * sides.z,
        100.0 * result.trimmed,
        result.repair.summary(),
    ))
}

/// Returns the cloud of a capture.
fn captured(arguments: &Arguments, label: &str) -> Result<Seen> {
    let views = arguments.views.map(spread_views).transpose()?;
    let intrinsics = match arguments.intrinsics.as_str() {
        "depth" => DepthIntrinsics::Depth,
        _ => DepthIntrinsics::Infrared,
    };
    let capture = read_capture(&arguments.capture, views.as_ref(), intrinsics)?;
    if !capture.missing.is_empty() {
        let (missing, used) = (capture.missing.len(), capture.views.len());
        let list = capture.missing.join(", ");
        let text = format!(
            "{label}: {missing} of {} views are missing and left out: {list}",
            missing + used
        );
        warn(arguments.quiet, &text);
    }
    let fused = fuse(&capture, &FusionSettings::default()).with_context(|| label.to_owned())?;
    Ok(Seen {
        cloud: fused.cloud,
        raw_points: fused.raw_points,
        views: fused.views,
        missing: capture.missing,
        table: fused.table,
        object_from_cloud: capture.object_from_world,
    })
}

/// Returns a cloud from a file, as it is if it has normals; else thinned and without strays, as one that was captured.
fn stored_cloud(arguments: &Arguments, path: &Path) -> Result<Seen> {
    let label = path.display().to_string();
    let is_ply = (path.extension()).is_some_and(|extension| extension.eq_ignore_ascii_case("ply"));
    if !is_ply {
        bail!(
            "{label}: this is a file, but no point cloud; give a .ply, or the folder of a capture"
        );
    }
    if arguments.views.is_some() {
        bail!("{label}: a point cloud has no views; leave out --views");
    }
    let mut cloud = load_point_cloud(path)?;
    cloud.require_points().with_context(|| label.clone())?;
    let raw_points = cloud.points.len();
    if cloud.normals.is_empty() {
        let fusion = FusionSettings::default();
        let prepared = |cloud: PointCloud| -> Result<PointCloud> {
            let thinned = cloud.thinned(fusion.cell)?;
            let mut kept = thinned.without_outliers(16, fusion.outlier_deviations);
            kept.estimate_normals(fusion.neighbours)?;
            Ok(kept)
        };
        cloud = prepared(cloud).with_context(|| label.clone())?;
    }
    Ok(Seen {
        cloud,
        raw_points,
        views: Vec::new(),
        missing: Vec::new(),
        table: None,
        object_from_cloud: None,
    })
}

/// Returns the registration that `--align-to` asks for.
fn align(arguments: &Arguments, seen: &Seen) -> Result<Option<Registration>> {
    let Some(name) = &arguments.align_to else {
        return Ok(None);
    };
    let target = load_object(name, 1.0, &arguments.repair, arguments.quiet)?;
    let up = seen.table.map_or(Vector3::z(), |table| table.normal);
    let found = align_to_mesh(&seen.cloud, &up, &target.mesh).with_context(|| name.clone())?;
    Ok(Some(found))
}

/// Returns the motion from the cloud's frame to the result's, and what that frame is called.
fn frame_of(seen: &Seen, aligned: Option<&Registration>) -> (Isometry3<f64>, &'static str) {
    match (aligned, seen.object_from_cloud) {
        (Some(found), _) => (found.motion, "the mesh aligned to"),
        (None, Some(motion)) => (motion, "the scanned mesh"),
        (None, None) => (Isometry3::identity(), "the capture"),
    }
}
