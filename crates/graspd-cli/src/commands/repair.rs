//! `graspd repair`: one closed surface of any triangles.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use graspd::Validate;
use graspd_geom::{
    FilledHole, RepairReport, RepairSettings, RepairedMesh, TriangleMesh, load_mesh, repair,
    require_mesh_format, save_mesh, signed_volume, topology,
};
use serde::Serialize;

use super::input::on_threads;
use super::output::prepare_file;
use crate::console::{print, print_json};
use crate::progress::Progress;

/// Holes that are listed one by one; `--json` has them all.
const LISTED_HOLES: usize = 10;
const MM_PER_M: f64 = 1e3;
const CM2_PER_M2: f64 = 1e4;
const CM3_PER_M3: f64 = 1e6;

#[derive(Args)]
pub(crate) struct Arguments {
    /// The mesh: .obj .stl .ply .off .glb .gltf .dae
    mesh: PathBuf,
    /// Where the repaired mesh goes: .obj .stl .ply .off
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    /// Multiplies the coordinates (0.001 for a mesh in millimetres)
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    /// Make the whole surface anew even if mending would do
    #[arg(long)]
    resurface: bool,
    /// When a surface is made anew: grid cells along its longest side
    #[arg(long, default_value_t = RepairSettings::default().resolution)]
    resolution: usize,
    /// When a surface is made anew: thickness of open sheets that enclose nothing [m]; at least 1.8 cells
    #[arg(long, value_name = "METRES", default_value_t = RepairSettings::default().sheet_thickness, allow_negative_numbers = true)]
    sheet_thickness: f64,
    /// Worker threads (one for each core by default); results do not depend on it
    #[arg(long)]
    threads: Option<usize>,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// No progress
    #[arg(long, short)]
    quiet: bool,
}

/// What a repair did, as files have it. Lengths in metres, areas in m^2.
#[derive(Serialize)]
pub(crate) struct RepairOutcome {
    /// `untouched`, `mended` or `resurfaced`.
    tier: &'static str,
    summary: String,
    holes_filled: usize,
    largest_hole_m: f64,
    degenerate_faces_dropped: usize,
    repeated_faces_dropped: usize,
    vertices_welded: usize,
    vertices_split: usize,
    faces_flipped: usize,
    slivers_removed: usize,
    small_components_dropped: usize,
    inner_components_dropped: usize,
    flat_components_dropped: usize,
    /// Greatest distance found from the input to the result, and the other way.
    input_to_result_m: f64,
    result_to_input_m: f64,
    /// Of the grid, where the surface was made anew.
    #[serde(skip_serializing_if = "Option::is_none")]
    spacing_m: Option<f64>,
    thickened_fraction: f64,
}

impl RepairOutcome {
    pub(crate) fn of(report: &RepairReport) -> Self {
        let diameters = report.holes.iter().map(|hole| hole.diameter);
        Self {
            tier: report.tier.name(),
            summary: report.summary(),
            holes_filled: report.holes.len(),
            largest_hole_m: diameters.fold(0.0, f64::max),
            degenerate_faces_dropped: report.degenerate_dropped,
            repeated_faces_dropped: report.copies_dropped,
            vertices_welded: report.vertices_welded,
            vertices_split: report.vertices_split,
            faces_flipped: report.faces_flipped,
            slivers_removed: report.slivers_removed,
            small_components_dropped: report.small_components_dropped,
            inner_components_dropped: report.inner_components_dropped,
            flat_components_dropped: report.flat_components_dropped,
            input_to_result_m: report.input_to_result,
            result_to_input_m: report.result_to_input,
            spacing_m: report.spacing,
            thickened_fraction: report.thickened,
        }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    file: String,
    #[serde(flatten)]
    outcome: RepairOutcome,
    holes: Vec<Hole>,
    before: Size,
    after: Size,
    seconds: f64,
}

#[derive(Serialize)]
struct Hole {
    edges: usize,
    length_m: f64,
    diameter_m: f64,
    patch_area_m2: f64,
}

impl From<&FilledHole> for Hole {
    fn from(hole: &FilledHole) -> Self {
        Self {
            edges: hole.edges,
            length_m: hole.length,
            diameter_m: hole.diameter,
            patch_area_m2: hole.area,
        }
    }
}

#[derive(Serialize)]
struct Size {
    vertices: usize,
    faces: usize,
    components: usize,
    euler_number: i64,
    /// Of an open surface, this depends on where the origin is.
    signed_volume_m3: f64,
}

impl Size {
    fn of(mesh: &TriangleMesh) -> Self {
        let topology = topology(mesh);
        Self {
            vertices: mesh.vertices.len(),
            faces: mesh.faces.len(),
            components: topology.components,
            euler_number: topology.euler_number,
            signed_volume_m3: signed_volume(mesh),
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || mend(arguments))?
}

fn mend(arguments: &Arguments) -> Result<()> {
    let scale = arguments.scale;
    if !(scale.is_finite() && scale > 0.0) {
        bail!("--scale is {scale}; it must be a positive number");
    }
    let settings = RepairSettings {
        resurface: arguments.resurface,
        resolution: arguments.resolution,
        sheet_thickness: arguments.sheet_thickness,
        ..RepairSettings::default()
    };
    settings.validate()?;
    require_mesh_format(&arguments.output)?;
    let name = arguments.mesh.display().to_string();
    let mesh = load_mesh(&arguments.mesh)?.scaled(scale);
    prepare_file(&arguments.output, "-o")?;
    let started = Instant::now();
    let progress = Progress::start(&format!("repair of {name}"), 1, arguments.quiet);
    let RepairedMesh {
        mesh: repaired,
        report,
    } = repair(&mesh, &settings, &name)?;
    progress.finish();
    let seconds = started.elapsed().as_secs_f64();
    save_mesh(&repaired, &arguments.output)?;

    let report = Report {
        file: arguments.output.to_string_lossy().into_owned(),
        holes: report.holes.iter().map(Hole::from).collect(),
        outcome: RepairOutcome::of(&report),
        before: Size::of(&mesh),
        after: Size::of(&repaired),
        seconds,
    };
    if arguments.json {
        return print_json(&report);
    }
    print(&text(&report))
}

/// The report for people.
fn text(report: &Report) -> String {
    let (before, after, outcome) = (&report.before, &report.after, &report.outcome);
    let mut text = format!(
        "{}: {} in {:.1} s\n  {}\n  faces {} -> {}, vertices {} -> {}; {} part{}, Euler number {}, volume {:.2} cm3\n",
        report.file,
        outcome.tier,
        report.seconds,
        outcome.summary,
        before.faces,
        after.faces,
        before.vertices,
        after.vertices,
        after.components,
        if after.components == 1 { "" } else { "s" },
        after.euler_number,
        CM3_PER_M3 * after.signed_volume_m3
    );
    if report.holes.is_empty() {
        return text;
    }
    text += "  holes   edges  length mm  across mm  patch cm2\n";
    for (index, hole) in report.holes.iter().take(LISTED_HOLES).enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "  {:>5}  {:>6}  {:>9.1}  {:>9.1}  {:>9.2}",
            index + 1,
            hole.edges,
            MM_PER_M * hole.length_m,
            MM_PER_M * hole.diameter_m,
            CM2_PER_M2 * hole.patch_area_m2
        );
    }
    let rest = report.holes.len().saturating_sub(LISTED_HOLES);
    if rest > 0 {
        let _ = writeln!(text, "  and {rest} smaller ones (--json lists all)");
    }
    text
}
