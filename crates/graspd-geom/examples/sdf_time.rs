//! Times the construction of a signed distance grid: `sdf_time MESH.obj [RESOLUTION]`.
//!
//! Prints wall-clock seconds, CPU seconds and peak memory (the last two where /proc tells them).

use std::time::Instant;

use graspd_geom::{SdfGrid, SignedDistance, TriangleMesh};
use nalgebra::Point3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .ok_or("usage: sdf_time MESH.obj [RESOLUTION]")?;
    let resolution = arguments.next().map_or(Ok(256), |word| word.parse())?;

    let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default())?;
    let shape = &models.first().ok_or("no shape in the file")?.mesh;
    let mesh = TriangleMesh {
        vertices: shape
            .positions
            .chunks(3)
            .map(|x| Point3::new(x[0], x[1], x[2]))
            .collect(),
        faces: shape
            .indices
            .chunks(3)
            .map(|i| [i[0], i[1], i[2]])
            .collect(),
    };

    let (start, cpu) = (Instant::now(), cpu_seconds());
    let surface = SignedDistance::new(&mesh)?;
    let prepared = start.elapsed();
    let grid = SdfGrid::build(&surface, resolution, 0.01, &|_| {})?;
    let wall = start.elapsed();
    let checksum: f64 = grid.values().iter().map(|&value| f64::from(value)).sum();
    println!(
        "{path}: {} faces, {resolution}^3: wall {:.2} s (tree {:.3} s), CPU {:.2} s, peak {} MB, sum {checksum:.9}",
        mesh.faces.len(),
        wall.as_secs_f64(),
        prepared.as_secs_f64(),
        cpu_seconds() - cpu,
        peak_memory_mb(),
    );
    Ok(())
}

/// User and system time of this process, in ticks of 1/100 s.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = |field| {
        after_name
            .split_whitespace()
            .nth(field)
            .and_then(|word| word.parse().ok())
    };
    ticks(11).unwrap_or(0.0) / 100.0 + ticks(12).unwrap_or(0.0) / 100.0
}

fn peak_memory_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) / 1024
}
