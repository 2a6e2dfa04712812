//! One step of a synthesis and its parts, in the reference precision and in the fast one side by side.
//!
//! `cargo bench -p graspd-tests --bench step`, with `-- --quick` for a first look. Every name states the backend:
//! `f64 scalar` evaluates one contact at a time, `f32 avx2` (or what the processor has) eight.

mod setting;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use graspd::{Losses, SynthesisSettings, synthesize};
use graspd_geom::SdfGrid;
use graspd_hand::{Hand, HandPose, HandScratch, Kinematics, PointBuffer, PoseGradient};
use graspd_sim::Precision;

use setting::{Setting, fast_backend, object};

/// Samples of the grids whose making is measured.
const BUILT_GRID: usize = 64;
/// Padding of the grids \[m\].
const PADDING: f64 = 0.01;
/// The time of `count` steps, force step and pose step each, between the first observation and the last.
fn time_steps<E: Precision>(bench: &Setting, count: u64) -> Duration
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let settings = SynthesisSettings {
        steps: count as usize + 1,
        ..bench.settings.clone()
    };
    let (mut first, mut last) = (None, None);
    let mut observe = |_: usize, _: &HandPose, _: &Losses| {
        let now = Instant::now();
        first.get_or_insert(now);
        last = Some(now);
    };
    let (object, start) = (&bench.object.simulated, bench.pose.clone());
    let made = synthesize::<E>(&*bench.hand, object, start, &settings, &mut observe);
    black_box(made.expect("the settings are valid"));
    let between = last.zip(first).map(|(last, first)| last - first);
    between.unwrap_or_default()
}

const REFERENCE_BACKEND: &str = "f64 scalar";

fn synthesis_step(criterion: &mut Criterion) {
    let bench = Setting::new();
    let mut group = criterion.benchmark_group(format!("synthesis step, {}", bench.size()));
    group.bench_function(REFERENCE_BACKEND, |b| {
        b.iter_custom(|count| time_steps::<f64>(&bench, count));
    });
    group.bench_function(fast_backend(), |b| {
        b.iter_custom(|count| time_steps::<f32>(&bench, count));
    });
    group.finish();
}

fn contact_kernels(criterion: &mut Criterion) {
    fn wrenches<E: Precision>(group: &mut BenchmarkGroup<'_, WallTime>, bench: &Setting, name: &str)
    where
        for<'h> dyn Hand + 'h: Kinematics<E>,
    {
        let mut scene = bench.scene::<E>();
        group.bench_function(name, |b| b.iter(|| scene.contact_wrenches()));
    }
    fn physics_loss<E: Precision>(
        group: &mut BenchmarkGroup<'_, WallTime>,
        bench: &Setting,
        name: &str,
    ) where
        for<'h> dyn Hand + 'h: Kinematics<E>,
    {
        let mut scene = bench.scene::<E>();
        let targets = vec![E::constant(0.5); scene.wrench_len()];
        group.bench_function(name, |b| b.iter(|| scene.physics_loss(black_box(&targets))));
    }
    let bench = Setting::new();
    let contacts = bench.hand.contact_points().count as u64;

    let mut group = criterion.benchmark_group(format!("contact wrenches, {}", bench.size()));
    group.throughput(Throughput::Elements(contacts));
    wrenches::<f64>(&mut group, &bench, REFERENCE_BACKEND);
    wrenches::<f32>(&mut group, &bench, &fast_backend());
    group.finish();

    let mut group = criterion.benchmark_group(format!("L_phys and gradient, {}", bench.size()));
    group.throughput(Throughput::Elements(contacts));
    physics_loss::<f64>(&mut group, &bench, REFERENCE_BACKEND);
    physics_loss::<f32>(&mut group, &bench, &fast_backend());
    group.finish();
}

/// Buffers of a hand's points and spheres.
struct Placed<E> {
    scratch: HandScratch,
    contacts: PointBuffer<E>,
    spheres: PointBuffer<E>,
}

impl<E: Precision> Placed<E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn new(bench: &Setting) -> Self {
        let hand = &bench.hand;
        let mut placed = Self {
            scratch: hand.new_scratch(),
            contacts: PointBuffer::zeros(hand.contact_points().weight.len()),
            spheres: PointBuffer::zeros(hand.collision_spheres().radius.len()),
        };
        placed.forward(bench);
        placed
    }

    fn forward(&mut self, bench: &Setting) {
        let (scratch, contacts, spheres) =
            (&mut self.scratch, &mut self.contacts, &mut self.spheres);
        let pose = black_box(&bench.pose);
        bench.hand.forward(pose, scratch, contacts, spheres);
    }
}

fn kinematics(criterion: &mut Criterion) {
    fn forward<E: Precision>(group: &mut BenchmarkGroup<'_, WallTime>, bench: &Setting, name: &str)
    where
        for<'h> dyn Hand + 'h: Kinematics<E>,
    {
        let mut placed = Placed::<E>::new(bench);
        group.bench_function(name, |b| b.iter(|| placed.forward(bench)));
    }
    fn pullback<E: Precision>(group: &mut BenchmarkGroup<'_, WallTime>, bench: &Setting, name: &str)
    where
        for<'h> dyn Hand + 'h: Kinematics<E>,
    {
        let Placed {
            mut scratch,
            contacts,
            spheres,
        } = Placed::<E>::new(bench);
        let mut forces = PointBuffer::zeros(contacts.len());
        forces.y.fill(E::constant(1.0));
        let no_forces = PointBuffer::zeros(spheres.len());
        let mut gradient = PoseGradient::zero(bench.pose.articulation.len());
        group.bench_function(name, |b| {
            b.iter(|| {
                bench.hand.pullback(
                    &bench.pose,
                    &mut scratch,
                    &contacts,
                    black_box(&forces),
                    &spheres,
                    &no_forces,
                    &mut gradient,
                );
            });
        });
    }
    let bench = Setting::new();
    let size = format!("allegro {} contacts", bench.hand.contact_points().count);

    let mut group = criterion.benchmark_group(format!("kinematics forward, {size}"));
    forward::<f64>(&mut group, &bench, REFERENCE_BACKEND);
    forward::<f32>(&mut group, &bench, &fast_backend());
    group.finish();

    let mut group = criterion.benchmark_group(format!("kinematics pullback, {size}"));
    pullback::<f64>(&mut group, &bench, REFERENCE_BACKEND);
    pullback::<f32>(&mut group, &bench, &fast_backend());
    group.finish();
}

fn distance_grid(criterion: &mut Criterion) {
    let threads = rayon::current_num_threads();
    let mut group = criterion.benchmark_group(format!("distance grid {BUILT_GRID}^3"));
    group.sample_size(10);
    group.throughput(Throughput::Elements(BUILT_GRID.pow(3) as u64));
    for name in ["mug", "box"] {
        let object = object(name, 2);
        let faces = object.source.mesh.faces.len();
        let id = format!("{name}, {faces} faces, {threads} threads");
        group.bench_function(id, |b| {
            b.iter(|| SdfGrid::build(&object.distance, BUILT_GRID, PADDING, &|_| {}));
        });
    }
    group.finish();
}

criterion_group!(
    benches,
    synthesis_step,
    contact_kernels,
    kinematics,
    distance_grid
);
criterion_main!(benches);
