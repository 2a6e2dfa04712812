//! `graspd repair`: one closed surface of any triangles.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use clap::Args;
use graspd::ObjectRepair;
use graspd_geom::{TriangleMesh, signed_volume, topology};
use graspd_mesh::{
    RepairSettings, RepairedMesh, load_mesh, repair, require_mesh_format, save_mesh,
};
use graspd_settings::{POSITIVE, Validate};
use serde_json::json;

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
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    #[arg(default_value_t = RepairSettings::default().sheet_thickness)]
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

/// Counts and measures of a mesh, as `--json` has them. The signed volume of an open surface depends on where the
/// origin is.
fn described(mesh: &TriangleMesh) -> serde_json::Value {
    let topology = topology(mesh);
    json!({
        "vertices": mesh.vertices.len(),
        "faces": mesh.faces.len(),
        "components": topology.components,
        "euler_number": topology.euler_number,
        "signed_volume_m3": signed_volume(mesh),
    })
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || mend(arguments))?
}

fn mend(arguments: &Arguments) -> Result<()> {
    let scale = arguments.scale;
    POSITIVE.check("--scale", &scale)?;
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
    let repaired = repair(&mesh, &settings, &name)?;
    progress.finish();
    let seconds = started.elapsed().as_secs_f64();
    save_mesh(&repaired.mesh, &arguments.output)?;

    if arguments.json {
        let holes = repaired.report.holes.iter().map(|hole| {
            json!({
                "edges": hole.edges,
                "length_m": hole.length,
                "diameter_m": hole.diameter,
                "patch_area_m2": hole.area,
            })
        });
        let mut value = serde_json::to_value(ObjectRepair::from(&repaired.report))?;
        value["file"] = arguments.output.to_string_lossy().into();
        value["holes"] = holes.collect();
        value["before"] = described(&mesh);
        value["after"] = described(&repaired.mesh);
        value["seconds"] = seconds.into();
        return print_json(&value);
    }
    print(&format!(
        "{}: {} in {seconds:.1} s\n{}",
        arguments.output.display(),
        repaired.report.tier.name(),
        text(&mesh, &repaired)
    ))
}

/// Returns the report for people.
fn text(before: &TriangleMesh, RepairedMesh { mesh, report }: &RepairedMesh) -> String {
    let parts = topology(mesh);
    let mut text = format!(
        "  {}\n  faces {} -> {}, vertices {} -> {}; {} part{}, Euler number {}, volume {:.2} cm3\n",
        report.summary(),
        before.faces.len(),
        mesh.faces.len(),
        before.vertices.len(),
        mesh.vertices.len(),
        parts.components,
        if parts.components == 1 { "" } else { "s" },
        parts.euler_number,
        CM3_PER_M3 * signed_volume(mesh)
    );
    if report.holes.is_empty() {
        return text;
    }
    text += "  holes   edges  length mm  across mm  patch cm2\n";
    for (index, hole) in report.holes.iter().take(LISTED_HOLES).enumerate() {
        text += &format!(
            "  {:>5}  {:>6}  {:>9.1}  {:>9.1}  {:>9.2}\n",
            index + 1,
            hole.edges,
            MM_PER_M * hole.length,
            MM_PER_M * hole.diameter,
            CM2_PER_M2 * hole.area
        );
    }
    let rest = report.holes.len().saturating_sub(LISTED_HOLES);
    if rest > 0 {
        text += &format!("  and {rest} smaller ones (--json lists all)\n");
    }
    text
}
