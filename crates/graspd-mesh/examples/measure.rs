//! Loads a mesh, closes it if it is open, and prints its volume and how far its centre of mass is from its surface.
//!
//! `cargo run --release -p graspd-mesh --example measure -- [MESH]`; by default the built-in mug

use graspd_geom::{MassProperties, SignedDistance};
use graspd_mesh::{RepairSettings, builtin_object, load_mesh, repair};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mesh, name) = match std::env::args().nth(1) {
        Some(path) => (load_mesh(&path)?, path),
        None => (builtin_object("mug").ok_or("no such object")?, "mug".into()),
    };
    let repaired = repair(&mesh, &RepairSettings::default(), &name)?;
    let (closed, report) = (repaired.mesh, repaired.report);
    println!(
        "{name}: {} faces, {} holes filled, {} after repair",
        mesh.faces.len(),
        report.holes.len(),
        closed.faces.len()
    );
    let mass = MassProperties::new(&closed, 1000.0, &name)?;
    let center = mass.center_of_mass;
    println!(
        "volume {:.1} cm^3; centre of mass at {:.4}, {:.4}, {:.4} m",
        mass.mass * 1e3,
        center.x,
        center.y,
        center.z
    );
    let surface = SignedDistance::new(&closed)?;
    let depth = surface.signed_distance(&center);
    let side = if depth < 0.0 { "inside" } else { "outside" };
    println!("which is {:.1} mm {side}", 1e3 * depth.abs());
    Ok(())
}
