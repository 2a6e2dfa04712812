//! Repairs mesh files and tells what was done and how long it took:
//! `cargo run --release -p graspd-mesh --example repair_time -- MESH... [--out FOLDER] [--resurface] [--resolution N]`

mod process;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use process::{cpu_seconds, peak_memory_mb};

use graspd_geom::{signed_volume, topology};
use graspd_mesh::{RepairSettings, load_mesh, repair, save_obj};

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = Vec::new();
    let mut folder = None;
    let mut settings = RepairSettings::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => folder = Some(PathBuf::from(arguments.next().ok_or("--out FOLDER")?)),
            "--resurface" => settings.resurface = true,
            "--resolution" => {
                settings.resolution = arguments.next().ok_or("--resolution N")?.parse()?;
            }
            _ => files.push(PathBuf::from(argument)),
        }
    }
    for file in files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        let mesh = load_mesh(&file)?;
        let (start, cpu) = (Instant::now(), cpu_seconds());
        let repaired = match repair(&mesh, &settings, &name) {
            Ok(repaired) => repaired,
            Err(error) => {
                println!("{error}");
                continue;
            }
        };
        let (seconds, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let peak = peak_memory_mb();
        let after = topology(&repaired.mesh);
        println!(
            "{name}: {:?} in {seconds:.3} s (CPU {cpu:.2} s, peak {peak} MB), {} -> {} faces, {} component(s), \
            Euler number {}, {:.2} cm3: {}",
            repaired.report.tier,
            mesh.faces.len(),
            repaired.mesh.faces.len(),
            after.components,
            after.euler_number,
            1e6 * signed_volume(&repaired.mesh),
            repaired.report.summary()
        );
        if let Some(folder) = &folder {
            save_obj(
                &repaired.mesh,
                Path::new(folder).join(format!("{name}.obj")),
            )?;
        }
    }
    Ok(())
}
