//! `graspd scan`: a rendered RGB-D capture of a mesh.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use graspd_scan::{DepthNoise, ScanSettings, TurntableViews, scan_on_turntable};
use graspd_settings::NOT_NEGATIVE;

use super::input::{RepairChoice, load_object, on_threads};
use super::output::prepare_folder;
use crate::console::{print, print_json};
use crate::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Built-in object (see `graspd objects`) or a mesh: .obj .stl .ply .off .glb .gltf .dae; it stands with z up
    #[arg(value_parser = NonEmptyStringValueParser::new())]
    object: String,
    /// Output folder, in the layout of the YCB captures
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// How many views, a multiple of 3: a third by each of the cameras 1, 3 and 5
    #[arg(long, default_value_t = 15)]
    views: usize,
    /// Noise of the depth camera: 1 for one of the first generation, 0 for none
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    noise: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Multiplies the object's coordinates
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    #[command(flatten)]
    repair: RepairChoice,
    /// Worker threads (one for each core by default); results do not depend on it
    #[arg(long)]
    threads: Option<usize>,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
    /// No progress and no warnings
    #[arg(long, short)]
    quiet: bool,
}

/// Returns the views that `--views` asks for.
pub(crate) fn spread_views(count: usize) -> Result<TurntableViews> {
    TurntableViews::spread(count).with_context(|| {
        format!("--views is {count}; it must be a multiple of 3 from 3 to 360: a third by each of three cameras")
    })
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || scan(arguments))?
}

fn scan(arguments: &Arguments) -> Result<()> {
    let views = spread_views(arguments.views)?;
    NOT_NEGATIVE.check("--noise", &arguments.noise)?;
    let object = load_object(
        &arguments.object,
        arguments.scale,
        &arguments.repair,
        arguments.quiet,
    )?;
    prepare_folder(&arguments.output)?;
    let started = Instant::now();
    let title = format!("{} views", arguments.views);
    let progress = Progress::start(&title, 1000, arguments.quiet);
    let settings = ScanSettings {
        views,
        noise: DepthNoise {
            scale: arguments.noise,
            seed: arguments.seed,
        },
    };
    let advance = |fraction: f64| progress.set((1000.0 * fraction) as u64);
    scan_on_turntable(
        &object.mesh,
        &object.name,
        &settings,
        &arguments.output,
        &advance,
    )
    .with_context(|| arguments.object.clone())?;
    progress.finish();
    let seconds = started.elapsed().as_secs_f64();
    if arguments.json {
        return print_json(&serde_json::json!({
            "folder": arguments.output.to_string_lossy(),
            "object": object.name,
            "views": arguments.views,
            "cameras": settings.views.cameras,
            "angles_deg": settings.views.angles,
            "noise": arguments.noise,
            "seed": arguments.seed,
            "seconds": seconds,
        }));
    }
    print(&format!(
        "{}: {} views of {} in {seconds:.1} s, noise {}\n",
        arguments.output.display(),
        arguments.views,
        object.name,
        arguments.noise
    ))
}
