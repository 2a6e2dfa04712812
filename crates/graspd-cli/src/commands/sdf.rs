//! `graspd sdf`: the signed distance grid as an `.npz` file.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use graspd::{PAPER_PADDING, PAPER_RESOLUTION, write_atomically};
use graspd_geom::{SdfGrid, SdfSampling, SignedDistance};
use graspd_settings::{NOT_NEGATIVE, between};

use super::cache::CacheChoice;
use super::input::{RepairChoice, load_object, on_threads};
use super::output::prepare_file;
use crate::console::{print, print_json};
use crate::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Built-in object (see `graspd objects`) or a mesh: .obj .stl .ply .off .glb .gltf .dae
    #[arg(value_parser = NonEmptyStringValueParser::new())]
    object: String,
    /// Samples along each axis
    #[arg(long, default_value_t = PAPER_RESOLUTION)]
    resolution: usize,
    /// Distance by which the grid reaches beyond the mesh's bounding box [m]
    #[arg(long, default_value_t = PAPER_PADDING, allow_negative_numbers = true)]
    padding: f64,
    /// Exact only up to this distance from the surface [m], 0.02 for example; beyond, never larger than the distance
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    band: Option<f64>,
    /// Multiplies the object's coordinates
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    /// Output file (OBJECT.npz by default): sdf [n, n, n] in metres, origin [3], spacing [3]
    #[arg(short, long, value_name = "FILE.npz")]
    output: Option<PathBuf>,
    /// Worker threads (one for each core by default)
    #[arg(long)]
    threads: Option<usize>,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    repair: RepairChoice,
    #[command(flatten)]
    cache: CacheChoice,
    /// No progress and no warnings
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || build(arguments))?
}

fn build(arguments: &Arguments) -> Result<()> {
    between(2.0, 1024.0).check("--resolution", &arguments.resolution)?;
    NOT_NEGATIVE.check("--padding", &arguments.padding)?;
    NOT_NEGATIVE.check("--band", &arguments.band)?;
    let object = load_object(
        &arguments.object,
        arguments.scale,
        &arguments.repair,
        arguments.quiet,
    )?;
    let output = arguments
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.npz", object.name)));
    prepare_file(&output, "-o")?;
    let started = Instant::now();
    let title = format!("signed distance, {}^3", arguments.resolution);
    let progress = Progress::start(&title, 1000, arguments.quiet);
    let distance = SignedDistance::new(&object.mesh).with_context(|| arguments.object.clone())?;
    let sampling = SdfSampling {
        resolution: arguments.resolution,
        padding: arguments.padding,
        band: arguments.band,
    };
    let advance = |fraction: f64| progress.set((1000.0 * fraction) as u64);
    let cache = arguments.cache.open();
    let grid = match &cache {
        Some(cache) => SdfGrid::sample_cached(&distance, &sampling, cache, &advance)?,
        None => SdfGrid::sample(&distance, &sampling, &advance)?,
    };
    progress.finish();
    CacheChoice::tell_fault(cache.as_ref(), arguments.quiet);
    let seconds = started.elapsed().as_secs_f64();
    write_atomically(&output, &npz(&grid)?)?;

    let (origin, spacing) = (grid.origin(), grid.spacing());
    if arguments.json {
        let value = serde_json::json!({
            "file": output.to_string_lossy(),
            "resolution": grid.dims(),
            "origin_m": [origin.x, origin.y, origin.z],
            "spacing_m": [spacing.x, spacing.y, spacing.z],
            "object_repair": object.repair_name(),
            "seconds": seconds,
        });
        return print_json(&value);
    }
    print(&format!(
        "{}: {}^3 samples in {seconds:.1} s, spacing {:.3} x {:.3} x {:.3} mm\n",
        output.display(),
        arguments.resolution,
        1000.0 * spacing.x,
        1000.0 * spacing.y,
        1000.0 * spacing.z
    ))
}

/// Arrays `sdf` (float32, index [i, j, k] at origin + (i, j, k) * spacing), `origin` and `spacing` (float64).
fn npz(grid: &SdfGrid) -> Result<Vec<u8>> {
    use ndarray::ShapeBuilder;
    let [nx, ny, nz] = grid.dims();
    let values = grid.to_values();
    let view =
        ndarray::ArrayView3::from_shape((nx, ny, nz).f(), &values).context("the grid's shape")?;
    let (origin, spacing) = (grid.origin(), grid.spacing());
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut npz = ndarray_npy::NpzWriter::new_compressed(&mut bytes);
    npz.add_array("sdf", &view)?;
    npz.add_array("origin", &ndarray::arr1(&[origin.x, origin.y, origin.z]))?;
    npz.add_array(
        "spacing",
        &ndarray::arr1(&[spacing.x, spacing.y, spacing.z]),
    )?;
    npz.finish()?;
    Ok(bytes.into_inner())
}
