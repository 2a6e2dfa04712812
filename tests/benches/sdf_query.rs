//! Lookups in a 256^3 distance grid at realistic motion, in several memory layouts side by side.
//!
//! `cargo bench -p graspd-tests --bench sdf_query`. The contacts are those of an Allegro hand that has reached a mug
//! (a scan where there is one), and 778 of them, as many as a MANO hand has vertices; their pose moves a little each
//! step, to and fro. Each time is that of one step: all contacts' distances and gradients. "Cold" reads 32 MiB of
//! other memory before each step, outside the time.

#[path = "sdf_query/layouts.rs"]
mod layouts;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_ad::{Kernel, Real, vectorize};
use graspd_geom::{Quaternion, SdfGrid, Vec3, shared_file};
use graspd_hand::{Kinematics, PointBuffer, builtin_hand};

use layouts::{Bricks, CellCache, Corners, Gathered, Geometry, Interleaved, Plain, Tiles};

/// Samples along each axis.
const RESOLUTION: usize = 256;
/// Density of the mug \[kg/m^3\].
const DENSITY: f64 = 1000.0;
/// Steps after which the hand is at the object.
const APPROACH_STEPS: usize = 700;
/// Poses along the motion, one way.
const POSES: usize = 50;
/// Bytes read between cold steps.
const OTHER_MEMORY: usize = 32 << 20;
/// Lanes of the fast scalar: points are padded to a multiple.
const LANES: usize = 8;

/// The x, y and z of all contacts.
type Points = [Vec<f32>; 3];

/// A mug and the contacts of a hand at it.
fn scene() -> (SdfGrid, Vec<Vec3<f64>>) {
    let scan = shared_file("data/ycb/025_mug.obj");
    let name = scan.map_or_else(|| "mug".into(), |file| file.to_string_lossy().into_owned());
    let hand = builtin_hand("allegro").expect("it is built in");
    let source = NamedMesh::load(&name, 1.0).expect("it is a closed mesh");
    let object = GraspObject::prepare(source, RESOLUTION, DENSITY, &|_| {}).expect("a volume");
    let settings = SynthesisSettings::paper().with_steps(APPROACH_STEPS);
    let start = draw_start(&object, &*hand, &settings, 0, 0).expect("it has a surface");
    let simulated = &object.simulated;
    let reached = synthesize::<f32>(&*hand, simulated, start, &settings, &mut |_, _, _| {});
    let pose = reached.expect("the preset is valid").pose;
    let mut contacts = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    Kinematics::forward(
        &*hand,
        &pose,
        &mut hand.new_scratch(),
        &mut contacts,
        &mut spheres,
    );
    let points = (0..hand.contact_points().count)
        .map(|at| Vec3::new(contacts.x[at], contacts.y[at], contacts.z[at]))
        .collect();
    (object.simulated.sdf().clone(), points)
}

/// The points along a motion of `step` metres at a time: along a line, and turning as fast about the object's middle.
fn motion(points: &[Vec3<f64>], step: f64) -> Vec<Points> {
    // A hand is some 5 cm from the middle.
    let (direction, turn) = (Vec3::new(0.48, 0.6, 0.64), Vec3::new(0.64, -0.48, 0.6));
    let at = |number: usize| -> Points {
        let way = step * number as f64 * std::f64::consts::FRAC_1_SQRT_2;
        let rotation = Quaternion::exp(turn * (way / 0.05)).to_matrix();
        let moved = points.iter().map(|p| rotation.apply(*p) + direction * way);
        let mut moved: Vec<Vec3<f64>> = moved.collect();
        let last = moved[moved.len() - 1];
        moved.resize(moved.len().next_multiple_of(LANES), last);
        [0, 1, 2].map(|axis| moved.iter().map(|p| p.get(axis) as f32).collect())
    };
    (0..POSES).chain((1..POSES - 1).rev()).map(at).collect()
}

/// All lookups of one step in some layout.
struct Step<'a, C> {
    geometry: &'a Geometry,
    points: &'a Points,
    corners: &'a mut C,
}

impl<C: Corners> Kernel for Step<'_, C> {
    type Output = f64;
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> f64 {
        let [x, y, z] = self.points;
        let mut sum = L::zero();
        for first in (0..x.len()).step_by(L::LANES) {
            let p = [
                L::load(&x[first..]),
                L::load(&y[first..]),
                L::load(&z[first..]),
            ];
            let (cell, at) = self.geometry.cell(p);
            let corners = self.corners.corners::<L>(&cell, first / L::LANES);
            let (distance, gradient) = self.geometry.interpolate(corners, at);
            sum = sum + distance + gradient[0] + gradient[1] + gradient[2];
        }
        let mut total = 0.0;
        for lane in 0..L::LANES {
            total += sum.lane(lane);
        }
        total
    }
}

/// All lookups of one step as the library does them.
struct LibraryStep<'a> {
    grid: &'a SdfGrid,
    points: &'a Points,
}

impl Kernel for LibraryStep<'_> {
    type Output = f64;
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> f64 {
        let [x, y, z] = self.points;
        let mut sum = L::zero();
        for first in (0..x.len()).step_by(L::LANES) {
            let p = Vec3::new(
                L::load(&x[first..]),
                L::load(&y[first..]),
                L::load(&z[first..]),
            );
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

/// The time of `count` steps along a motion.
fn time(
    count: u64,
    motion: &[Points],
    other: Option<&[u64]>,
    work: &mut dyn FnMut(&Points) -> f64,
) -> Duration {
    let mut total = Duration::ZERO;
    for number in 0..count as usize {
        if let Some(other) = other {
            black_box(
                other
                    .iter()
                    .step_by(8)
                    .fold(0, |sum: u64, x| sum.wrapping_add(*x)),
            );
        }
        let started = Instant::now();
        black_box(work(&motion[number % motion.len()]));
        total += started.elapsed();
    }
    total
}

/// The share of contacts that are in another cell one step later.
fn changes(geometry: &Geometry, motion: &[Points]) -> f64 {
    let cells = |points: &Points| -> Vec<[u32; 3]> {
        let cell = |at: usize| {
            geometry
                .cell([points[0][at], points[1][at], points[2][at]])
                .0
        };
        (0..points[0].len())
            .map(|at| cell(at).map(|lanes| lanes[0]))
            .collect()
    };
    let (mut changed, mut all) = (0, 0);
    for pair in motion[..POSES].windows(2) {
        let (one, other) = (cells(&pair[0]), cells(&pair[1]));
        changed += one.iter().zip(&other).filter(|(a, b)| a != b).count();
        all += one.len();
    }
    changed as f64 / all as f64
}

fn lookups(criterion: &mut Criterion) {
    let (grid, points) = scene();
    let values = grid.to_values();
    let geometry = Geometry::new(&grid);
    let other = vec![1; OTHER_MEMORY / size_of::<u64>()];

    for count in [778, points.len()] {
        let stride = points.len() as f64 / count as f64;
        let some: Vec<_> = (0..count)
            .map(|at| points[(at as f64 * stride) as usize])
            .collect();
        for step in [1e-4, 1e-3] {
            let motion = motion(&some, step);
            for memory in [None, Some(&other[..])] {
                let title = format!(
                    "{count} lookups, {} mm a step ({:.0} % change cells), {}",
                    1e3 * step,
                    100.0 * changes(&geometry, &motion),
                    if memory.is_some() { "cold" } else { "warm" }
                );
                let mut group = criterion.benchmark_group(title);
                group.sample_size(20);
                group.warm_up_time(Duration::from_millis(300));
                group.measurement_time(Duration::from_millis(700));
                let expected = vectorize(LibraryStep {
                    grid: &grid,
                    points: &motion[0],
                });
                group.bench_function("library", |bencher| {
                    bencher.iter_custom(|steps| {
                        let mut work = |points: &Points| {
                            vectorize(LibraryStep {
                                grid: &grid,
                                points,
                            })
                        };
                        time(steps, &motion, memory, &mut work)
                    });
                });
                let mut bench = |name: &str, mut look: Box<dyn FnMut(&Points) -> f64 + '_>| {
                    let sum = look(&motion[0]);
                    assert!(
                        (sum - expected).abs() < 1e-3 * expected.abs(),
                        "{sum} {expected}"
                    );
                    group.bench_function(name, |bencher| {
                        bencher.iter_custom(|steps| time(steps, &motion, memory, &mut look));
                    });
                };
                bench(
                    "plain, 67 MB",
                    looking(&geometry, Gathered::<Plain>::new(&values)),
                );
                bench(
                    "4^3 bricks, 67 MB",
                    looking(&geometry, Gathered::<Bricks<2>>::new(&values)),
                );
                bench(
                    "8^3 bricks, 67 MB",
                    looking(&geometry, Gathered::<Bricks<3>>::new(&values)),
                );
                bench(
                    "4x2x2 tiles in pages, 67 MB",
                    looking(&geometry, Gathered::<Tiles>::new(&values)),
                );
                bench(
                    "z pairs, 134 MB",
                    looking(&geometry, Interleaved::<2>::new(&values)),
                );
                bench(
                    "yz quads, 268 MB",
                    looking(&geometry, Interleaved::<4>::new(&values)),
                );
                bench(
                    "cell cache over plain",
                    looking(&geometry, CellCache::<Plain>::new(&values, count)),
                );
                bench(
                    "cell cache over tiles",
                    looking(&geometry, CellCache::<Tiles>::new(&values, count)),
                );
                group.finish();
            }
        }
    }
}

/// A step with one layout, which it owns.
fn looking<'a>(
    geometry: &'a Geometry,
    mut corners: impl Corners + 'a,
) -> Box<dyn FnMut(&Points) -> f64 + 'a> {
    Box::new(move |points| {
        vectorize(Step {
            geometry,
            points,
            corners: &mut corners,
        })
    })
}

criterion_group!(benches, lookups);
criterion_main!(benches);
