//! `graspd synth`: the main job.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use graspd::Validate;
use graspd::{
    Diversity, Grasp, GraspObject, GraspRecord, Machine, MethodPart, ObjectRepair, RunDescription,
    RunObserver, RunSettings, SCHEMA, Summary, SynthesisSettings, diverse, pose_distances,
    pressing_contacts, synthesize_grasps,
};
use graspd_hand::{Hand, HandPose, SkinOptions};
use serde::Serialize;

use super::cache::CacheChoice;
use super::configuration::SettingFlags;
use super::input::{
    HandLoading, RepairChoice, load_hand_to_scale, load_object, on_threads, prepare_object,
};
use super::output::{
    prepare_file, prepare_folder, remove_leftovers, write_meshes, write_results, write_trajectories,
};
use super::view::pictures;
use crate::console::{print, print_json};
use crate::progress::Progress;
use crate::table::grasps_table;

/// Poses are kept every so many steps of first order with `--trajectory`.
const TRAJECTORY_INTERVAL: usize = 20;
/// Steps between two reports to the progress bar.
const PROGRESS_INTERVAL: usize = 50;
/// Width and height of each of the three views of `--png` \[pixels\].
const PICTURE_PANEL: (usize, usize) = (640, 640);

#[derive(Args)]
pub(crate) struct Arguments {
    /// Built-in object (see `graspd objects`) or a mesh: .obj .stl .ply .off .glb .gltf .dae
    #[arg(default_value = "mug", value_parser = NonEmptyStringValueParser::new())]
    object: String,
    /// Built-in hand (see `graspd hands`), a .urdf, or a MANO model (.pkl or .npz)
    #[arg(long, default_value = "allegro", value_parser = NonEmptyStringValueParser::new())]
    hand: String,
    #[command(flatten)]
    loading: HandLoading,
    /// Keep only the K best grasps (all by default)
    #[arg(long, value_name = "K")]
    top_k: Option<usize>,
    /// Keep K grasps that hold and are as different as possible instead: the best, and then those farthest from the
    /// others
    #[arg(long, requires = "top_k")]
    diverse: bool,
    /// Leave out a part of the method, as ablation studies do (may be repeated). Of `default` and `fast`:
    /// coarse-to-fine, leaky-gradient, task, second-order. Of the others: coarse-to-fine, leaky-gradient,
    /// relaxation (the task constraint is on the real contact forces), mdmm (a fixed penalty instead)
    #[arg(long, value_name = "PART")]
    without: Vec<MethodPart>,
    #[command(flatten)]
    settings: SettingFlags,
    /// Multiplies the object's coordinates (0.001 for a mesh in millimetres)
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    /// Worker threads (one for each core by default); results do not depend on it
    #[arg(long)]
    threads: Option<usize>,
    /// Output folder
    #[arg(short, long, default_value = "grasps")]
    output: PathBuf,
    /// Render the best grasp to this PNG file
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Also write the posed hands and the object as OBJ files to DIR/meshes
    #[arg(long)]
    meshes: bool,
    /// Also write the poses along the optimisations to DIR/trajectory.npz: each iteration, or every 20th step
    #[arg(long)]
    trajectory: bool,
    /// Print the summary and the grasps as JSON instead of a table
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
    on_threads(arguments.threads, || synthesize(arguments))?
}

fn synthesize(arguments: &Arguments) -> Result<()> {
    let quiet = arguments.quiet;
    if arguments.top_k == Some(0) {
        bail!("--top-k is 0; it must be at least 1 (leave it out to keep all grasps)");
    }
    let mut configuration = arguments.settings.resolve(quiet)?.configuration;
    for part in &arguments.without {
        configuration.settings = configuration.settings.without(*part)?;
    }
    configuration.settings.validate()?;
    let settings = &configuration.settings;
    let run = RunSettings {
        seed: configuration.seed,
        count: configuration.grasps,
        trajectory_every: (arguments.trajectory).then_some(match settings.skin_fit {
            Some(_) => 1,
            None => TRAJECTORY_INTERVAL,
        }),
        execution: configuration.execution,
        evaluation: configuration.evaluation.clone(),
    };
    let loading = arguments.loading.options()?;
    let hand = load_hand_to_scale(&arguments.hand, &loading)?;
    let source = load_object(&arguments.object, arguments.scale, &arguments.repair, quiet)?;
    prepare_folder(&arguments.output)?;
    if let Some(file) = &arguments.png {
        prepare_file(file, "--png")?;
    }

    let started = Instant::now();
    let cache = arguments.cache.open();
    let sampling = configuration.sdf_sampling();
    let object = prepare_object(source, &sampling, settings.density, cache.clone(), quiet)?;
    let preparation = started.elapsed().as_secs_f64();

    let started = Instant::now();
    let mut grasps = synthesize_with_progress(&object, hand.as_ref(), settings, &run, quiet)?;
    let synthesis = started.elapsed().as_secs_f64();
    CacheChoice::tell_fault(cache.as_ref(), quiet);

    let all: Vec<GraspRecord> = grasps.iter().map(|g| g.record.clone()).collect();
    let mut summary = Summary::of(&all);
    if let Some(count) = arguments.top_k {
        keep(&mut grasps, hand.as_ref(), count, arguments.diverse);
    }
    let poses: Vec<&HandPose> = grasps.iter().map(|grasp| &grasp.pose).collect();
    summary.diversity = Diversity::of(&pose_distances(hand.as_ref(), &poses));
    let records: Vec<GraspRecord> = grasps.iter().map(|g| g.record.clone()).collect();
    let records = &records[..];

    remove_leftovers(&arguments.output)?;
    RunDescription {
        graspd_version: env!("CARGO_PKG_VERSION").into(),
        record_schema: SCHEMA.into(),
        object: arguments.object.clone(),
        object_scale: arguments.scale,
        hand: arguments.hand.clone(),
        hand_mirrored: loading.mirrored,
        package_paths: loading.package_paths,
        top_k: arguments.top_k,
        configuration: Some(configuration),
        machine: Some(Machine::current()),
        hand_skin: Some(loading.skin).filter(|skin| *skin != SkinOptions::default()),
        object_repair: object.source.repair.as_ref().map(ObjectRepair::from),
    }
    .write(&arguments.output)?;
    if arguments.meshes {
        write_meshes(
            &arguments.output,
            &object.source.mesh,
            hand.as_ref(),
            &grasps,
        )?;
    }
    if arguments.trajectory {
        write_trajectories(&arguments.output, &grasps)?;
    }
    write_results(&arguments.output, records, &summary)?;
    if let Some(file) = &arguments.png {
        write_picture(file, &object, hand.as_ref(), &grasps)?;
    }

    if arguments.json {
        return print_json(&Report {
            summary: &summary,
            grasps: records,
            output: arguments.output.to_string_lossy(),
            seconds: PhaseSeconds {
                preparation,
                synthesis_and_evaluation: synthesis,
            },
        });
    }
    let mut text = grasps_table(records, &summary);
    text += &format!(
        "{} grasp{} in {synthesis:.1} s ({:.2} s each) after {preparation:.1} s of preparation; written to {}\n",
        all.len(),
        if all.len() == 1 { "" } else { "s" },
        synthesis / all.len() as f64,
        arguments.output.display()
    );
    if let Some(file) = &arguments.png {
        text += &format!("picture of the best grasp: {}\n", file.display());
    }
    print(&text)
}

/// Keeps `count` of the ranked grasps: the best, or a spread of those that hold.
fn keep(grasps: &mut Vec<Grasp>, hand: &dyn Hand, count: usize, is_spread: bool) {
    if !is_spread {
        grasps.truncate(count);
        return;
    }
    let poses: Vec<&HandPose> = grasps.iter().map(|grasp| &grasp.pose).collect();
    let distances = pose_distances(hand, &poses);
    let records: Vec<GraspRecord> = grasps.iter().map(|grasp| grasp.record.clone()).collect();
    let chosen = diverse(&records, &distances, count);
    let mut number = 0..;
    grasps.retain(|_| number.next().is_some_and(|number| chosen.contains(&number)));
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    summary: &'a Summary,
    grasps: &'a [GraspRecord],
    output: Cow<'a, str>,
    seconds: PhaseSeconds,
}

/// Wall-clock seconds of the whole run.
#[derive(Serialize)]
struct PhaseSeconds {
    preparation: f64,
    synthesis_and_evaluation: f64,
}

/// Counts steps of all starts together.
struct Reporter {
    progress: Progress,
    finished: Mutex<usize>,
    count: usize,
}

impl RunObserver for Reporter {
    fn warning(&self, text: &str) {
        self.progress.note(&format!("warning: {text}"));
    }
    fn step(&self, _index: usize, step: usize) {
        if step > 0 && step.is_multiple_of(PROGRESS_INTERVAL) {
            self.progress.advance(PROGRESS_INTERVAL as u64);
        }
    }
    fn finished(&self, record: &GraspRecord) {
        let mut finished = self
            .finished
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner());
        *finished += 1;
        let metrics = record.metrics.as_ref();
        let value = |pick: Option<f64>| pick.map_or_else(|| "-".into(), |v| format!("{v:.2}"));
        self.progress.note(&format!(
            "grasp #{} ({} of {}): SD {} cm, contact {} cm2, interpenetration {} cm3",
            record.index,
            *finished,
            self.count,
            value(metrics.and_then(|m| m.sim_displacement_cm)),
            value(metrics.and_then(|m| m.contact_area_cm2)),
            value(metrics.and_then(|m| m.interpenetration_volume_cm3)),
        ));
    }
}

fn synthesize_with_progress(
    object: &GraspObject,
    hand: &dyn Hand,
    settings: &SynthesisSettings,
    run: &RunSettings,
    quiet: bool,
) -> Result<Vec<Grasp>> {
    let title = format!("{} grasps, {} steps", run.count, settings.steps);
    let reporter = Reporter {
        progress: Progress::start(
            &title,
            run.count.saturating_mul(settings.steps) as u64,
            quiet,
        ),
        finished: Mutex::new(0),
        count: run.count,
    };
    let grasps = synthesize_grasps(object, hand, settings, run, &reporter)?;
    reporter.progress.finish();
    Ok(grasps)
}

fn write_picture(
    file: &Path,
    object: &GraspObject,
    hand: &dyn Hand,
    grasps: &[Grasp],
) -> Result<()> {
    if let Some(best) = grasps.first() {
        let squeeze_force = best.record.squeeze.as_ref().and_then(|s| s.force_n);
        let contacts = pressing_contacts(
            hand,
            &object.distance,
            &best.pose,
            squeeze_force.unwrap_or_default(),
        );
        let mesh = &object.source.mesh;
        let marks = pictures::marks(&contacts);
        let views = graspd_view::render_hand_pose(mesh, hand, &best.pose, &marks, PICTURE_PANEL)?;
        graspd_view::captioned(&views, &pictures::caption(&best.record))?.write_png(file)?;
    }
    Ok(())
}
