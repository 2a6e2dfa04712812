//! Times Poisson reconstruction of points on a mesh, and measures how far the result is from the mesh:
//! `poisson_time MESH (POINTS.npz | COUNT) DEPTH... [--out MESH]`.
//!
//! The archive holds `points` and `normals` \[n, 3\] in metres; with a count, as many points are drawn in
//! proportion to area. Prints wall-clock and CPU seconds, peak memory, the Chamfer distance (the mean of both
//! directions' mean distance, over 200 000 points each) and the Hausdorff distances from the mesh to the result and
//! back.

#[path = "../../graspd-mesh/examples/process/mod.rs"]
mod process;

use std::error::Error;
use std::fs::File;
use std::path::Path;
use std::time::Instant;

use graspd_geom::{SurfaceSampler, TriangleMesh, TriangleTree, require_closed, topology};
use graspd_mesh::{load_mesh, save_mesh};
use graspd_scan::{PointCloud, PoissonSettings, poisson_surface};
use nalgebra::{Point3, Vector3};
use ndarray::Array2;
use ndarray_npy::NpzReader;
use process::{cpu_seconds, peak_memory_mb};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const PROBES: usize = 200_000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = Vec::new();
    let mut output = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => output = Some(arguments.next().ok_or("--out MESH")?),
            _ => words.push(argument),
        }
    }
    let [mesh, points, depths @ ..] = &words[..] else {
        return Err("usage: poisson_time MESH (POINTS.npz | COUNT) DEPTH... [--out MESH]".into());
    };
    let mesh = load_mesh(mesh)?;
    let cloud = match points.parse::<usize>() {
        Ok(count) => {
            let (points, normals) = sampled(&mesh, count, 1)?;
            PointCloud { points, normals }
        }
        Err(_) => stored(Path::new(points))?,
    };
    let tree = TriangleTree::new(&mesh)?;
    for depth in depths {
        let settings = PoissonSettings {
            depth: depth.parse()?,
            ..PoissonSettings::default()
        };
        let (start, cpu) = (Instant::now(), cpu_seconds());
        let surface = poisson_surface(&cloud, &settings)?.mesh;
        let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let peak = peak_memory_mb();
        let is_closed = require_closed(&surface, "surface").is_ok();
        let to_surface = distances(&mesh, &TriangleTree::new(&surface)?, 3)?;
        let to_mesh = distances(&surface, &tree, 4)?;
        println!(
            "{} points, depth {depth}: wall {wall:.3} s, CPU {cpu:.2} s, peak {peak} MB, {} faces, closed: \
            {is_closed}, Euler number {}, Chamfer {:.4} mm, Hausdorff {:.3}, {:.3} mm",
            cloud.points.len(),
            surface.faces.len(),
            topology(&surface).euler_number,
            500.0 * (to_surface.0 + to_mesh.0),
            1e3 * to_surface.1,
            1e3 * to_mesh.1,
        );
        if let Some(path) = &output {
            save_mesh(&surface, path)?;
        }
    }
    Ok(())
}

type Samples = (Vec<Point3<f64>>, Vec<Vector3<f64>>);

fn sampled(mesh: &TriangleMesh, count: usize, seed: u64) -> Result<Samples, Box<dyn Error>> {
    let sampler = SurfaceSampler::new(mesh).ok_or("the mesh has no area")?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let samples = (0..count).map(|_| sampler.sample(&mut rng));
    Ok(samples.map(|sample| (sample.point, sample.normal)).unzip())
}

/// Points and normals of an archive.
fn stored(path: &Path) -> Result<PointCloud, Box<dyn Error>> {
    let mut archive = NpzReader::new(File::open(path)?)?;
    let points: Array2<f64> = archive.by_name("points")?;
    let normals: Array2<f64> = archive.by_name("normals")?;
    let rows = |array: &Array2<f64>| -> Vec<Vector3<f64>> {
        (array.rows().into_iter())
            .map(|row| Vector3::new(row[0], row[1], row[2]))
            .collect()
    };
    Ok(PointCloud {
        points: rows(&points).into_iter().map(Point3::from).collect(),
        normals: rows(&normals),
    })
}

/// Mean and greatest distance of random points of a mesh from another \[m\].
fn distances(
    from: &TriangleMesh,
    to: &TriangleTree,
    seed: u64,
) -> Result<(f64, f64), Box<dyn Error>> {
    let (points, _) = sampled(from, PROBES, seed)?;
    let distances: Vec<f64> = points.par_iter().map(|p| to.distance(p)).collect();
    let sum: f64 = distances.iter().sum();
    Ok((
        sum / PROBES as f64,
        distances.into_iter().fold(0.0, f64::max),
    ))
}
