//! What several commands do with their input.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use graspd::{GraspError, GraspObject, NamedMesh};
use graspd_geom::{DiskCache, SdfSampling};
use graspd_hand::{Hand, HandPose, LoadOptions, SkinOptions, load_hand_from};
use graspd_mesh::RepairSettings;

use graspd_settings::{Range, between};

use crate::console::warn;
use crate::progress::Progress;

/// Largest sides between these are taken without a word \[m\].
const USUAL_SIZE: RangeInclusive<f64> = 0.005..=1.0;
/// Sides beyond these cannot be meant \[m\]: no hand takes a house or a grain of sand.
const POSSIBLE_SIZE: RangeInclusive<f64> = 0.0005..=10.0;
/// No open hand is larger \[m\]; the judge refuses such grasps, too, but only when they are made.
const MAX_HAND_SIZE: f64 = 5.0;
/// More threads than any machine has cores cost memory and gain nothing.
const THREADS: Range = between(1.0, 1024.0);

/// How hands are loaded.
#[derive(Args)]
pub(crate) struct HandLoading {
    /// Where meshes of a URDF are looked for besides its folder and those above it (may be repeated)
    #[arg(long = "package-path", value_name = "DIR")]
    package_paths: Vec<PathBuf>,
    /// Take the hand's mirror image: left for right
    #[arg(long)]
    mirror: bool,
    /// Shape of a skinned hand (`human`, MANO files): parameters in standard deviations, such as 1,-0.5; 0 where not
    /// given
    #[arg(
        long,
        value_name = "B1,B2,...",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    hand_shape: Vec<f64>,
    /// Pose a skinned hand by its first N principal components (of natural postures); 1 to 45
    #[arg(long, value_name = "N")]
    pose_components: Option<usize>,
    /// Count a skinned hand's pose components from the flat hand instead of from its mean pose
    #[arg(long)]
    flat_mean: bool,
}

impl HandLoading {
    /// Returns the options for the loader.
    ///
    /// # Errors
    /// If a folder is none.
    pub(crate) fn options(&self) -> Result<LoadOptions> {
        if let Some(path) = self.package_paths.iter().find(|path| !path.is_dir()) {
            bail!(
                "{}: no such folder; give --package-path the folder that holds the package",
                path.display()
            );
        }
        Ok(LoadOptions {
            package_paths: self.package_paths.clone(),
            mirrored: self.mirror,
            skin: SkinOptions {
                shape: self.hand_shape.clone(),
                pose_components: self.pose_components,
                flat_mean: self.flat_mean,
            },
            ..LoadOptions::default()
        })
    }
}

/// What becomes of an object whose surface is not closed.
#[derive(Args)]
pub(crate) struct RepairChoice {
    /// Refuse an object whose surface is open or not consistently oriented instead of repairing it
    #[arg(long)]
    no_repair: bool,
}

impl RepairChoice {
    /// Returns the choice of a command without the flag.
    pub(crate) fn of(is_repaired: bool) -> Self {
        Self {
            no_repair: !is_repaired,
        }
    }

    fn load(&self, name_or_path: &str, scale: f64) -> Result<NamedMesh, GraspError> {
        if self.no_repair {
            NamedMesh::load(name_or_path, scale)
        } else {
            NamedMesh::load_repaired(name_or_path, scale, &RepairSettings::default())
        }
    }
}

/// Loads an object, and warns where its unit is likely not the metre and where it had to be repaired.
pub(crate) fn load_object(
    name_or_path: &str,
    scale: f64,
    repair: &RepairChoice,
    quiet: bool,
) -> Result<NamedMesh> {
    let object = repair.load(name_or_path, scale)?;
    let size = object.largest_side();
    let hint = if size > 1.0 {
        "if its unit is the millimetre, set --scale 0.001"
    } else {
        "if its unit is not the metre, set --scale"
    };
    if let Some(doubt) = size_doubt(name_or_path, size, hint)? {
        warn(quiet, &doubt);
    }
    if let Some(report) = &object.repair {
        let what = report.summary();
        let text = format!(
            "{name_or_path}: the surface is not closed, and was repaired: {what}; only the repaired surface is seen \
             from here on (graspd repair writes it, --no-repair refuses)"
        );
        warn(quiet, &text);
    }
    Ok(object)
}

/// Returns what is doubtful about an object's largest side \[m\], if anything; `hint` says what may be wrong.
///
/// # Errors
/// A size that no hand could grasp.
pub(crate) fn size_doubt(name: &str, size: f64, hint: &str) -> Result<Option<String>> {
    let side = format!("{name}: its largest side is {}", length(size));
    if !POSSIBLE_SIZE.contains(&size) {
        bail!("{side}, which no hand can grasp; {hint}");
    }
    Ok((!USUAL_SIZE.contains(&size)).then(|| format!("{side}; {hint}")))
}

/// Returns a length in the unit that a reader expects, to about three digits.
fn length(metres: f64) -> String {
    if metres >= 1e5 {
        format!("{metres:.2e} m")
    } else if metres >= 1.0 {
        format!("{metres:.2} m")
    } else {
        format!("{:.3} mm", 1000.0 * metres)
    }
}

/// Loads a hand, and refuses one whose unit cannot be the metre.
pub(crate) fn load_hand_to_scale(
    name_or_path: &str,
    options: &LoadOptions,
) -> Result<Box<dyn Hand>> {
    let hand = load_hand_from(name_or_path, options)?;
    let open = HandPose::at_origin(hand.open_articulation());
    let bounds = hand.surface(&open).bounds();
    let size = bounds.map_or(0.0, |(low, high)| (high - low).max());
    if size > MAX_HAND_SIZE {
        bail!(
            "{name_or_path}: the hand is {} across; a URDF's lengths are metres: correct them, or its meshes' scale",
            length(size)
        );
    }
    Ok(hand)
}

/// Builds the distance grid with progress.
pub(crate) fn prepare_object(
    source: NamedMesh,
    sampling: &SdfSampling,
    density: f64,
    cache: Option<DiskCache>,
    quiet: bool,
) -> Result<GraspObject> {
    let title = format!("signed distance, {}^3", sampling.resolution);
    let progress = Progress::start(&title, 1000, quiet);
    let object = GraspObject::prepare_sampled(source, sampling, density, cache, &|fraction| {
        progress.set((1000.0 * fraction) as u64);
    })?;
    progress.finish();
    Ok(object)
}

/// Starts a pool of `threads` threads (by default, one for each core).
pub(crate) fn thread_pool(threads: Option<usize>) -> Result<rayon::ThreadPool> {
    THREADS.check("--threads", &threads)?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .context("cannot start the worker threads; try fewer with --threads")
}

/// Runs `work` on a pool of `threads` threads (by default, one for each core).
pub(crate) fn on_threads<R: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> R + Send,
) -> Result<R> {
    Ok(thread_pool(threads)?.install(work))
}
