//! Times the construction of a signed distance grid, in a narrow band, too, its storing and loading, exact queries,
//! winding numbers and lookups: `sdf_time MESH.obj [RESOLUTION]`.
//!
//! Prints wall-clock seconds, CPU seconds and peak memory (the last two where /proc tells them), and nanoseconds
//! per query at points around the mesh.

mod process;

use std::time::Instant;

use graspd_ad::{Dual, Kernel, Real, vectorize};
use graspd_geom::{DiskCache, SdfGrid, SdfSampling, SignedDistance, Vec3, WindingField};
use graspd_mesh::load_mesh;
use nalgebra::Point3;
use process::{cpu_seconds, peak_memory_mb};
use rand::{Rng, SeedableRng};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .ok_or("usage: sdf_time MESH.obj [RESOLUTION]")?;
    let resolution = arguments.next().map_or(Ok(256), |word| word.parse())?;

    let mesh = load_mesh(&path)?;
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let surface = SignedDistance::new(&mesh)?;
    let prepared = start.elapsed();
    let grid = SdfGrid::build(&surface, resolution, 0.01, &|_| {})?;
    let wall = start.elapsed();
    let (cpu, peak) = (cpu_seconds() - cpu, peak_memory_mb());
    let checksum: f64 = grid.to_values().into_iter().map(f64::from).sum();
    println!(
        "{path}: {} faces, {resolution}^3: wall {:.2} s (tree {:.3} s), CPU {:.2} s, peak {} MB, sum {checksum:.9}",
        mesh.faces.len(),
        wall.as_secs_f64(),
        prepared.as_secs_f64(),
        cpu,
        peak,
    );
    for band in [0.02, 0.01, 0.005] {
        let sampling = SdfSampling {
            band: Some(band),
            ..SdfSampling::exact(resolution, 0.01)
        };
        let (start, cpu) = (Instant::now(), cpu_seconds());
        let banded = SdfGrid::sample(&surface, &sampling, &|_| {})?;
        let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let values = banded.to_values();
        let pairs = || values.iter().zip(grid.to_values());
        let equal = pairs().filter(|(bound, exact)| **bound == *exact).count();
        let short = pairs().map(|(bound, exact)| f64::from(exact.abs() - bound.abs()));
        println!(
            "band of {} mm: wall {wall:.2} s, CPU {cpu:.2} s, {:.1} % exact, others short by {:.3} mm on average \
            and {:.3} at most",
            1e3 * band,
            100.0 * equal as f64 / values.len() as f64,
            1e3 * short.clone().sum::<f64>() / (values.len() - equal).max(1) as f64,
            1e3 * short.fold(0.0, f64::max),
        );
    }
    let folder = std::env::temp_dir().join(format!("sdf_time-{}", std::process::id()));
    let cache = DiskCache::new(&folder, DiskCache::USUAL_CAPACITY);
    for what in ["made and stored", "loaded"] {
        let (start, cpu) = (Instant::now(), cpu_seconds());
        let sampling = SdfSampling::exact(resolution, 0.01);
        SdfGrid::sample_cached(&surface, &sampling, &cache, &|_| {})?;
        let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        println!("{what}: wall {wall:.2} s, CPU {cpu:.2} s");
    }
    std::fs::remove_dir_all(folder)?;
    time_queries(&surface, &grid);
    Ok(())
}

/// As many points as an Allegro hand has contacts, at random within the grid.
fn time_queries(surface: &SignedDistance, grid: &SdfGrid) {
    const POINTS: usize = 3000;
    let (low, high) = grid.bounds();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let points: Vec<Point3<f64>> = (0..POINTS)
        .map(|_| low + (high - low).map(|extent| extent * random.random::<f64>()))
        .collect();
    let single = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis] as f32).collect::<Vec<f32>>());

    let time = |what: &str, repeats: usize, work: &dyn Fn() -> f64| {
        let mut best = f64::INFINITY;
        let mut sum = 0.0;
        for _ in 0..repeats {
            let start = Instant::now();
            sum = work();
            best = best.min(start.elapsed().as_secs_f64());
        }
        println!(
            "{what}: {:.1} ns (best of {repeats}; sum {sum:.6})",
            best * 1e9 / POINTS as f64
        );
    };
    time("signed distance", 20, &|| {
        points.iter().map(|p| surface.signed_distance(p)).sum()
    });
    time("closest point", 20, &|| {
        points.iter().map(|p| surface.closest(p).distance).sum()
    });
    time("winding number", 20, &|| {
        points
            .iter()
            .map(|p| f64::from(surface.winding_number(p)))
            .sum()
    });
    let field = WindingField::new(surface.tree().clone());
    for accuracy in [1e-1, 1e-2, 1e-3, 1e-6] {
        let what = format!("generalised winding number to {accuracy:e}");
        time(&what, 3, &|| {
            let winding = |p| field.winding_number(p, accuracy);
            points.iter().map(winding).sum()
        });
    }
    let many: Vec<Point3<f64>> = (0..64 * POINTS)
        .map(|_| low + (high - low).map(|extent| extent * random.random::<f64>()))
        .collect();
    let start = cpu_seconds();
    let sum: f64 = surface.signed_distances(&many).iter().sum();
    let each = (cpu_seconds() - start) * 1e9 / many.len() as f64;
    println!(
        "signed distance, {} at once: {each:.0} ns of CPU time each (sum {sum:.6})",
        many.len()
    );
    time("lookup with gradient, double", 500, &|| {
        let sum = |(d, g): (f64, Vec3<f64>)| d + g.x + g.y + g.z;
        points
            .iter()
            .map(|&p| sum(grid.distance_and_gradient(p.into())))
            .sum()
    });
    time("lookup with gradient, lanes", 500, &|| {
        vectorize(Lookup {
            grid,
            points: &single,
        })
    });
    time("lookup with second derivatives, lanes", 500, &|| {
        vectorize(DualLookup(Lookup {
            grid,
            points: &single,
        }))
    });
}

/// Lookups as duals: with derivatives of the gradient.
struct DualLookup<'a>(Lookup<'a>);

impl Kernel for DualLookup<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> f64 {
        let [x, y, z] = self.0.points;
        let mut sum = Dual::<L, 3>::constant(L::zero());
        for at in (0..x.len()).step_by(L::LANES) {
            let p = Vec3::new(
                Dual::variable(L::load(&x[at..]), 0),
                Dual::variable(L::load(&y[at..]), 1),
                Dual::variable(L::load(&z[at..]), 2),
            );
            let (distance, gradient) = self.0.grid.distance_and_gradient(p);
            sum = sum + distance + gradient.x + gradient.y + gradient.z;
        }
        let mut total = 0.0;
        for lane in 0..L::LANES {
            total += sum.value.lane(lane)
                + sum.derivative[0].lane(lane)
                + sum.derivative[1].lane(lane)
                + sum.derivative[2].lane(lane);
        }
        total
    }
}

struct Lookup<'a> {
    grid: &'a SdfGrid,
    points: &'a [Vec<f32>; 3],
}

impl Kernel for Lookup<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> f64 {
        let [x, y, z] = self.points;
        let mut sum = L::zero();
        for at in (0..x.len()).step_by(L::LANES) {
            let p = Vec3::new(L::load(&x[at..]), L::load(&y[at..]), L::load(&z[at..]));
            let (distance, gradient) = self.grid.distance_and_gradient(p);
            sum = sum + distance + gradient.x + gradient.y + gradient.z;
        }
        let mut total = 0.0;
        for lane in 0..L::LANES {
            total += sum.lane(lane);
        }
        total
    }
}
