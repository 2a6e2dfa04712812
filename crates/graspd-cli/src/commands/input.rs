//! What several commands do with their input.

use anyhow::{Context, Result, bail};
use graspd::{GraspObject, NamedMesh};

use crate::progress::{Progress, warn};

/// Largest sides between these are taken without a word \[m\].
const USUAL_SIZE: std::ops::RangeInclusive<f64> = 0.005..=1.0;
/// Sides beyond these cannot be meant \[m\]: no hand takes a house or a grain of sand.
const POSSIBLE_SIZE: std::ops::RangeInclusive<f64> = 0.0005..=10.0;

/// Loads an object and warns where its unit is likely not the metre.
pub(crate) fn load_object(name_or_path: &str, scale: f64, quiet: bool) -> Result<NamedMesh> {
    let object = NamedMesh::load(name_or_path, scale)?;
    let size = object.largest_side();
    let unit_hint = if size > 1.0 {
        "if its unit is the millimetre, add --scale 0.001"
    } else {
        "if its unit is not the metre, set --scale"
    };
    if !POSSIBLE_SIZE.contains(&size) {
        bail!("{name_or_path}: its largest side is {size} m, which no hand can grasp; {unit_hint}");
    }
    if !USUAL_SIZE.contains(&size) {
        warn(
            quiet,
            &format!("{name_or_path}: its largest side is {size} m; {unit_hint}"),
        );
    }
    Ok(object)
}

/// Builds the distance grid with progress.
pub(crate) fn prepare_object(
    source: NamedMesh,
    resolution: usize,
    density: f64,
    quiet: bool,
) -> Result<GraspObject> {
    let title = format!("signed distance, {resolution}^3");
    let progress = Progress::start(&title, 1000, quiet);
    let object = GraspObject::prepare(source, resolution, density, &|fraction| {
        progress.set((1000.0 * fraction) as u64);
    })?;
    progress.finish();
    Ok(object)
}

/// Runs `work` on a pool of `threads` threads (by default, one for each core).
pub(crate) fn on_threads<R: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> R + Send,
) -> Result<R> {
    if threads == Some(0) {
        bail!("--threads is 0; it must be at least 1 (leave it out for one on each core)");
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .context("cannot start the worker threads; try fewer with --threads")?;
    Ok(pool.install(work))
}
