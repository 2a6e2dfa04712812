//! The second-order solver: its contact law by backend, its force step, its stages.
//!
//! `cargo xtask bench` runs this, too; `cargo bench -p graspd-tests --bench solver` runs it alone. All times are
//! processor time of the thread that computes.

#[path = "processor_time/mod.rs"]
mod processor_time;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start};
use graspd_ad::{Dual, Kernel, Lanes, Real, Tape, vectorize};
use graspd_fit::{ContactCost, FittedHand, HandFitter, SkinFitSettings};
use graspd_geom::Vec3;
use graspd_hand::builtin_hand;
use graspd_sim::{ForceStep, Twist};

use processor_time::time;

/// Samples of the mug's distance grid along each axis.
const GRID: usize = 128;
/// Of the force step: stiffness of a contact \[N/m\], time step \[s\], friction and rho.
const STIFFNESS: f64 = 3e4;
const TIME_STEP: f64 = 1e-5;
const FRICTION: f64 = 0.8;
const RELAXATION: f64 = 1e-12;
/// Points of the skin.
const POINTS: usize = 5000;
const COST: ContactCost = ContactCost {
    smoothing: 5e-4,
    target_depth: 8.5e-4,
    depth_limit: 2.55e-3,
    tail: 6.0,
    limit_weight: 0.0,
    medial_weight: 3.0,
};

/// Distances \[m\] of skin near an object.
fn distances() -> Vec<f32> {
    let share = |k: usize| (k as f32 * 0.618_034).fract();
    (0..POINTS).map(|k| 6e-3 * share(k) - 2e-3).collect()
}

/// The sum of all costs and of their derivatives, eight points at a time.
struct InLanes<'a>(&'a [f32]);

impl Kernel for InLanes<'_> {
    type Output = (f64, f64);
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> (f64, f64) {
        let (mut value, mut slope) = (L::zero(), L::zero());
        for first in (0..self.0.len()).step_by(L::LANES) {
            let cost = COST.value(Dual::<L, 1>::variable(L::load(&self.0[first..]), 0));
            value += cost.value;
            slope += cost.derivative[0];
        }
        let sum = |lanes: L| (0..L::LANES).map(|lane| lanes.lane(lane)).sum();
        (sum(value), sum(slope))
    }
}

fn contact_law(criterion: &mut Criterion) {
    let single = distances();
    let double: Vec<f64> = single.iter().map(|distance| f64::from(*distance)).collect();
    let mut group = criterion.benchmark_group(format!("contact law and slope, {POINTS} points"));
    group.throughput(Throughput::Elements(POINTS as u64));
    let mut case = |name: &str, law: &mut dyn FnMut(f64) -> f64| {
        group.bench_function(name, |bencher| {
            let mut sum =
                || _ = black_box(double.iter().map(|distance| law(*distance)).sum::<f64>());
            bencher.iter_custom(|count| time(count, &mut sum));
        });
    };
    let mut tape = Tape::new();
    case("reverse tape in f64", &mut |distance| {
        tape.scope(|recording| {
            let distance = recording.variable(distance);
            let cost = COST.value(distance);
            cost.value() + recording.adjoints(cost).of(distance)
        })
    });
    case("duals in f64", &mut |distance| {
        let cost = COST.value(Dual::<f64, 1>::variable(distance, 0));
        cost.value + cost.derivative[0]
    });
    case("by hand in f64", &mut |distance| {
        COST.value(distance) + COST.slope_and_weight(distance).0
    });
    group.bench_function("duals in lanes", |bencher| {
        bencher.iter_custom(|count| time(count, || _ = black_box(vectorize(InLanes(&single)))));
    });
    group.finish();
    assert_eq!(POINTS % Lanes::LANES, 0, "no lane is left over");
}

fn stages(criterion: &mut Criterion) {
    let settings = SkinFitSettings::default();
    let source = NamedMesh::load("mug", 1.0).expect("a built-in object");
    let object = GraspObject::prepare(source, GRID, 1000.0, &|_| {}).expect("it has a volume");
    let sdf = object.simulated.sdf();
    for name in ["allegro", "human"] {
        let hand = builtin_hand(name).expect("it is built in");
        let fitter = HandFitter::new(&*hand, &settings).expect("its surface is closed");
        let start = draw_start(&object, &*hand, &SynthesisSettings::default(), 0, 0);
        let start = start.expect("it has a surface");
        let near = fitter.approach(sdf, &start, &mut |_, _| {});
        let touching = fitter.contact(sdf, &near.pose, &mut |_, _| {});
        let fine = fitter.refine(sdf, &touching.pose, &mut |_, _| {});
        let mut group = criterion.benchmark_group(format!("stages, {name}"));
        group.sample_size(20);
        let mut stage = |title: &str, run: &dyn Fn() -> FittedHand| {
            group.bench_function(title, |bencher| {
                bencher.iter_custom(|count| time(count, || drop(black_box(run()))));
            });
        };
        stage("approach", &|| fitter.approach(sdf, &start, &mut |_, _| {}));
        stage("contact", &|| {
            fitter.contact(sdf, &near.pose, &mut |_, _| {})
        });
        stage("refine", &|| {
            fitter.refine(sdf, &touching.pose, &mut |_, _| {})
        });
        stage("projection", &|| {
            fitter.project(sdf, &object.distance, &fine.pose)
        });
        group.bench_function("rating", |bencher| {
            let rating = || fitter.rating(&object.simulated, &touching, FRICTION);
            bencher.iter_custom(|count| time(count, || _ = black_box(rating())));
        });
        let contacts = fitter.contacts(&object.simulated, &fine.pose, STIFFNESS);
        let step = ForceStep::new(&object.simulated, TIME_STEP, FRICTION, RELAXATION);
        let twist = Twist {
            linear: Vec3::new(0.01, 0.01, 0.01),
            angular: Vec3::zero(),
        };
        group.bench_function(
            format!("force step, {} contacts", contacts.len()),
            |bencher| {
                let solved = || step.solve(&contacts, &twist);
                bencher.iter_custom(|count| time(count, || drop(black_box(solved()))));
            },
        );
        group.finish();
    }
}

criterion_group!(benches, contact_law, stages);
criterion_main!(benches);
