//! Renders captures of meshes, reconstructs them, and measures how far the results are from the meshes:
//! `rgbd_error MESH... [--depths 5,6,7] [--noise 1] [--views 15] [--seed 0] [--trim CELLS] [--neighbours N]
//! [--samples-per-cell N] [--out FOLDER]`.
//!
//! For each mesh one line about the fused points and one for each depth, in millimetres: the mean and the 95th
//! percentile of the magnitude of the points' signed distance to the mesh (above 0: outside it), the same of 100
//! 000 random points of the result, the 95th percentile and the greatest distance from random points of the mesh to
//! the result (of all, and of those more than 5 mm above the table), the ratio of volumes, and the seconds of CPU
//! time.

#[path = "../../graspd-mesh/examples/process/mod.rs"]
mod process;

use std::error::Error;
use std::path::{Path, PathBuf};

use graspd_geom::{SignedDistance, SurfaceSampler, TriangleMesh, signed_volume};
use graspd_mesh::{load_mesh, save_obj};
use graspd_scan::{
    DepthIntrinsics, DepthNoise, FusionSettings, PoissonSettings, ReconstructionSettings,
    ScanSettings, TurntableViews, fuse, read_capture, reconstruct, scan_on_turntable,
};
use nalgebra::Point3;
use process::cpu_seconds;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const PROBES: usize = 100_000;
/// What is nearer to the table than this is left out of the second \[m\].
const FOOT: f64 = 0.005;

struct Options {
    meshes: Vec<PathBuf>,
    depths: Vec<u32>,
    noise: DepthNoise,
    views: usize,
    trim: f64,
    neighbours: usize,
    samples_per_cell: f64,
    out: Option<PathBuf>,
}

fn options() -> Result<Options, Box<dyn Error>> {
    let mut options = Options {
        meshes: Vec::new(),
        depths: vec![5, 6, 7, 8],
        noise: DepthNoise {
            scale: 1.0,
            seed: 0,
        },
        views: 15,
        trim: ReconstructionSettings::default().trim,
        neighbours: FusionSettings::default().neighbours,
        samples_per_cell: PoissonSettings::default().samples_per_cell,
        out: None,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--depths" => {
                let depths: Result<Vec<u32>, _> = value()?.split(',').map(str::parse).collect();
                options.depths = depths?;
            }
            "--noise" => options.noise.scale = value()?.parse()?,
            "--seed" => options.noise.seed = value()?.parse()?,
            "--views" => options.views = value()?.parse()?,
            "--trim" => options.trim = value()?.parse()?,
            "--neighbours" => options.neighbours = value()?.parse()?,
            "--samples-per-cell" => options.samples_per_cell = value()?.parse()?,
            "--out" => options.out = Some(value()?.into()),
            _ => options.meshes.push(word.into()),
        }
    }
    if options.meshes.is_empty() {
        return Err("usage: rgbd_error MESH... [--depths 5,6,7] [--noise 1] [--views 15]".into());
    }
    Ok(options)
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = options()?;
    for mesh in &options.meshes {
        measure(mesh, &options)?;
    }
    Ok(())
}

fn measure(path: &Path, options: &Options) -> Result<(), Box<dyn Error>> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mesh = load_mesh(path)?;
    let folder = std::env::temp_dir().join(format!("rgbd_error-{}", std::process::id()));
    let settings = ScanSettings {
        views: TurntableViews::spread(options.views).ok_or("views: a multiple of 3")?,
        noise: options.noise,
    };
    scan_on_turntable(&mesh, &name, &settings, &folder, &|_| ())?;
    let start = cpu_seconds();
    let capture = read_capture(&folder, None, DepthIntrinsics::default())?;
    std::fs::remove_dir_all(&folder)?;
    let fusion = FusionSettings {
        neighbours: options.neighbours,
        ..FusionSettings::default()
    };
    let fused = fuse(&capture, &fusion)?;
    let motion = capture.object_from_world.ok_or("not a rendered capture")?;
    let truth = SignedDistance::new(&mesh)?;
    let points: Vec<Point3<f64>> = fused.cloud.points.iter().map(|p| motion * p).collect();
    let (mean, most, _) = summary(&points, &truth);
    println!(
        "{name}: {} points, {mean:+.2}, 95 % within {most:.2}; fused in {:.1} s",
        points.len(),
        cpu_seconds() - start
    );
    let lowest = mesh.bounds().ok_or("an empty mesh")?.0.z;
    let probes = sampled(&mesh, 1)?;
    let higher: Vec<Point3<f64>> = (probes.iter().copied())
        .filter(|p| p.z > lowest + FOOT)
        .collect();
    for &depth in &options.depths {
        let start = cpu_seconds();
        let settings = ReconstructionSettings {
            poisson: PoissonSettings {
                depth,
                samples_per_cell: options.samples_per_cell,
                ..PoissonSettings::default()
            },
            trim: options.trim,
            ..ReconstructionSettings::default()
        };
        let result = match reconstruct(&fused.cloud, fused.table.as_ref(), &settings, &name) {
            Ok(result) => result.mesh.transformed(&motion),
            Err(error) => {
                println!("  depth {depth}: {error}");
                continue;
            }
        };
        let seconds = cpu_seconds() - start;
        let (mean, most, greatest) = summary(&sampled(&result, 2)?, &truth);
        let back = SignedDistance::new(&result)?;
        let (_, all, all_greatest) = summary(&probes, &back);
        let (inward, near, near_greatest) = summary(&higher, &back);
        println!(
            "  depth {depth}: {mean:+.2}, {most:.2}, {greatest:.1}; back {all:.2}, {all_greatest:.1}; higher \
            {:+.2}, {near:.2}, {near_greatest:.1}; volume {:.3}; foot {:+.1}; {} faces, {seconds:.1} s",
            -inward,
            signed_volume(&result) / signed_volume(&mesh),
            1e3 * (result.bounds().ok_or("an empty result")?.0.z - lowest),
            result.faces.len(),
        );
        if let Some(folder) = &options.out {
            save_obj(&result, folder.join(format!("{name}-depth{depth}.obj")))?;
        }
    }
    Ok(())
}

fn sampled(mesh: &TriangleMesh, seed: u64) -> Result<Vec<Point3<f64>>, Box<dyn Error>> {
    let sampler = SurfaceSampler::new(mesh).ok_or("the mesh has no area")?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Ok((0..PROBES)
        .map(|_| sampler.sample(&mut rng).point)
        .collect())
}

/// Mean of the signed distances, and the 95th percentile and the greatest of their magnitudes \[mm\].
fn summary(points: &[Point3<f64>], surface: &SignedDistance) -> (f64, f64, f64) {
    let distances: Vec<f64> = (points.par_iter())
        .map(|p| 1e3 * surface.signed_distance(p))
        .collect();
    let mut magnitudes: Vec<f64> = distances.iter().map(|d| d.abs()).collect();
    magnitudes.sort_unstable_by(f64::total_cmp);
    let count = magnitudes.len().max(1);
    let at = |rank: usize| magnitudes.get(rank).copied().unwrap_or(0.0);
    (
        distances.iter().sum::<f64>() / count as f64,
        at(count * 95 / 100),
        at(count - 1),
    )
}
