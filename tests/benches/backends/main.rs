//! Ways of computing a step, side by side: {reverse tape, duals, derivative by hand; in f64 and in lanes} x
//! {Allegro, a skin of MANO's size with and without blendshapes, the built-in human hand} x {contact kernel, whole
//! step, 7000 steps} x {1, 2 threads}.
//!
//! `cargo xtask bench` runs this and prints one table; `cargo bench -p graspd-tests --bench backends` runs it
//! alone. All times are processor time of the thread that computes, so that other programs disturb them less. With
//! two threads, each makes a grasp of its own and the time is the mean of both: half of it is what a grasp costs.

mod by_hand;
#[path = "../processor_time/mod.rs"]
mod processor_time;
#[path = "../setting/mod.rs"]
mod setting;

use std::hint::black_box;
use std::time::Duration;

use by_hand::ByHand;
use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use graspd::{Losses, SynthesisSettings, draw_start, synthesize};
use graspd_ad::{Element, Real, Tape, Var, vectorize};
use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPose, Kinematics, POINT_PADDING, PointBuffer};
use graspd_opt::{AdamSettings, Adamax, AdamaxIteration, Optimizer};
use graspd_sim::{ContactState, ForceWeights, Precision, Scene, TargetRule, TargetWrenches, Twist};

use processor_time::{cpu_time, time};
use setting::{Setting, Subject, fast_backend};

/// Rate and weights of the force step.
const RATE: f64 = 1e-2;
const WEIGHTS: ForceWeights = ForceWeights {
    physics: 1e-2,
    task: 1.0,
};
/// Steps of a whole synthesis.
const SYNTHESIS: usize = 7000;

struct AdamaxRule<'a, E>(AdamaxIteration<'a, E>);

impl<E: Element> TargetRule<E> for AdamaxRule<'_, E> {
    #[inline(always)]
    fn update<T: Real<Element = E>>(&mut self, first: usize, gradient: [T; 6]) -> [T; 6] {
        self.0.update(first, POINT_PADDING, gradient)
    }
    #[inline(always)]
    fn inherit<T: Real<Element = E>>(&mut self, from: usize, to: usize) {
        self.0.inherit::<T, 6>(from, to, POINT_PADDING);
    }
}

/// Force step and L_phys with its derivative by the contact positions, in four passes.
struct FourPasses<'a, E> {
    scene: Scene<'a, E>,
    targets: Vec<E>,
    gradient: Vec<E>,
    optimizer: Adamax<E>,
}

impl<'a, E: Precision> FourPasses<'a, E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn new(setting: &'a Setting) -> Self {
        let scene = setting.scene::<E>();
        let len = scene.wrench_len();
        Self {
            scene,
            targets: vec![E::zero(); len],
            gradient: vec![E::zero(); len],
            optimizer: Adamax::new(len, AdamSettings::default()).expect("they are in range"),
        }
    }

    fn run(&mut self) -> f64 {
        self.scene.contact_wrenches();
        self.scene.task(&self.targets);
        let (physics, task) = (WEIGHTS.physics, WEIGHTS.task);
        self.scene
            .target_gradient(&self.targets, physics, task, &mut self.gradient);
        self.optimizer.step(RATE, &mut self.targets, &self.gradient);
        self.scene.physics_loss(&self.targets)
    }
}

/// The same in one pass.
struct OnePass<'a, E> {
    scene: Scene<'a, E>,
    targets: TargetWrenches<E>,
    optimizer: Adamax<E>,
}

impl<'a, E: Precision> OnePass<'a, E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn new(setting: &'a Setting) -> Self {
        let scene = setting.scene::<E>();
        let targets = scene.new_targets();
        let settings = AdamSettings::default();
        Self {
            scene,
            optimizer: Adamax::new(targets.state_len(), settings).expect("they are in range"),
            targets,
        }
    }

    fn run(&mut self) -> f64 {
        self.scene.task_of_moved_targets(&self.targets);
        let mut rule = AdamaxRule(self.optimizer.begin_iteration(RATE));
        self.scene
            .move_targets(WEIGHTS, &mut rule, &mut self.targets)
    }
}

/// L_phys with targets 0 and its derivative by the contact positions, each contact recorded on a tape.
fn by_tape(setting: &Setting, tape: &mut Tape, points: &[Vec3<f64>]) -> (f64, Vec3<f64>) {
    let (object, params) = (&setting.object.simulated, &setting.simulation);
    let (mut total, mut sum) = (0.0, Vec3::zero());
    for point in points {
        tape.scope(|recording| {
            let [x, y, z] = [point.x, point.y, point.z].map(|x| recording.variable(x));
            let point = Vec3::new(x, y, z);
            let (distance, gradient) = object.sdf().distance_and_gradient(point);
            let lever = point - Vec3::constant(object.center_of_mass());
            let state = ContactState::new(distance, gradient, lever, params.contact.leak);
            let mut loss = Var::constant(0.0);
            for twist in &params.velocities {
                let twist = Twist {
                    linear: Vec3::constant(twist.linear),
                    angular: Vec3::constant(twist.angular),
                };
                let wrench = state.wrench(&twist, &params.contact);
                loss += wrench.torque.norm_squared() + wrench.force.norm_squared();
            }
            let adjoints = recording.adjoints(loss);
            total += loss.value();
            sum += Vec3::new(adjoints.of(x), adjoints.of(y), adjoints.of(z));
        });
    }
    (total, sum)
}

/// The hands that are measured.
const SUBJECTS: [Subject; 4] = [
    Subject::Builtin("allegro"),
    Subject::Skinned {
        has_blendshapes: true,
    },
    Subject::Skinned {
        has_blendshapes: false,
    },
    Subject::Builtin("human"),
];

fn contact_kernel(criterion: &mut Criterion) {
    for subject in SUBJECTS {
        kernel_of(criterion, &Setting::of(subject));
    }
}

fn kernel_of(criterion: &mut Criterion, setting: &Setting) {
    let mut group = criterion.benchmark_group(format!("contact kernel, {}", setting.size()));
    group.throughput(Throughput::Elements(
        setting.hand.contact_points().count as u64,
    ));
    let lanes = fast_backend();
    let contacts = setting.scene::<f64>();
    let contacts = contacts.contacts();
    let points: Vec<Vec3<f64>> = (0..contacts.len()).map(|i| contacts.get(i)).collect();
    let mut tape = Tape::new();
    group.bench_function("tape f64, L_phys alone", |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(by_tape(setting, &mut tape, black_box(&points)));
            })
        });
    });
    loss_alone::<f64>(&mut group, setting, "f64", |kernel| kernel.over::<f64>());
    loss_alone::<f32>(&mut group, setting, &lanes, |kernel| vectorize(kernel));
    let mut four = FourPasses::<f64>::new(setting);
    group.bench_function("dual f64, four passes", |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(four.run());
            })
        });
    });
    let mut one = OnePass::<f64>::new(setting);
    group.bench_function("dual f64, one pass", |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(one.run());
            })
        });
    });
    let mut four = FourPasses::<f32>::new(setting);
    group.bench_function(format!("dual {lanes}, four passes"), |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(four.run());
            })
        });
    });
    let mut one = OnePass::<f32>::new(setting);
    group.bench_function(format!("dual {lanes}, one pass"), |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(one.run());
            })
        });
    });
    group.finish();
}

/// L_phys and its derivative by the contact positions, every contact with all its derivatives: by duals and by hand.
fn loss_alone<E: Precision>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    setting: &Setting,
    backend: &str,
    run: fn(ByHand<'_, E>) -> f64,
) where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let mut scene = setting.scene::<E>();
    let targets = vec![E::constant(0.5); scene.wrench_len()];
    group.bench_function(format!("dual {backend}, L_phys alone"), |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(scene.physics_loss(black_box(&targets)));
            })
        });
    });
    let weight = &setting.hand.contact_points().weight;
    let weight: Vec<E> = weight.iter().map(|&w| E::constant(f64::from(w))).collect();
    let mut gradient = PointBuffer::zeros(weight.len());
    group.bench_function(format!("by hand {backend}, L_phys alone"), |b| {
        b.iter_custom(|n| {
            time(n, || {
                black_box(run(ByHand {
                    object: &setting.object.simulated,
                    velocities: &setting.simulation.velocities,
                    contact: &setting.simulation.contact,
                    points: scene.contacts(),
                    weight: &weight,
                    targets: black_box(&targets),
                    gradient: &mut gradient,
                }));
            })
        });
    });
}

/// Processor time of `count` steps of a synthesis, between the first observation and the last.
fn time_steps<E: Precision>(setting: &Setting, count: u64) -> Duration
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let settings = SynthesisSettings {
        steps: count as usize + 1,
        ..setting.settings.clone()
    };
    let (mut first, mut last) = (None, None);
    let mut observe = |_: usize, _: &HandPose, _: &Losses| {
        let now = cpu_time();
        first.get_or_insert(now);
        last = Some(now);
    };
    let (object, start) = (&setting.object.simulated, setting.pose.clone());
    let made = synthesize::<E>(&*setting.hand, object, start, &settings, &mut observe);
    black_box(made.expect("the settings are valid"));
    let between = last.zip(first).map(|(last, first)| last - first);
    between.unwrap_or_default()
}

/// The mean over two threads that each do this at the same time.
fn on_two_threads(work: impl Fn() -> Duration + Sync) -> Duration {
    let (first, second) = rayon::join(&work, &work);
    (first + second) / 2
}

fn whole_step(criterion: &mut Criterion) {
    let lanes = fast_backend();
    for subject in SUBJECTS {
        let setting = Setting::of(subject);
        let mut group = criterion.benchmark_group(format!("synthesis step, {}", setting.size()));
        group.bench_function("f64, 1 thread", |b| {
            b.iter_custom(|n| time_steps::<f64>(&setting, n));
        });
        group.bench_function("f64, 2 threads", |b| {
            b.iter_custom(|n| on_two_threads(|| time_steps::<f64>(&setting, n)));
        });
        group.bench_function(format!("{lanes}, 1 thread"), |b| {
            b.iter_custom(|n| time_steps::<f32>(&setting, n));
        });
        group.bench_function(format!("{lanes}, 2 threads"), |b| {
            b.iter_custom(|n| on_two_threads(|| time_steps::<f32>(&setting, n)));
        });
        group.finish();
    }
}

/// From a start to a grasp, as `graspd synth` does it, with both presets.
fn whole_synthesis(criterion: &mut Criterion) {
    let lanes = fast_backend();
    for subject in SUBJECTS {
        let mut setting = Setting::of(subject);
        for settings in [SynthesisSettings::paper(), SynthesisSettings::soft()] {
            let hand = &*setting.hand;
            let start = draw_start(&setting.object, hand, &settings, 0, 0);
            setting.pose = start.expect("it has a surface");
            let name = format!("{SYNTHESIS} steps, {}, {}", setting.name, settings.preset);
            setting.settings = settings;
            let mut group = criterion.benchmark_group(name);
            group.sampling_mode(SamplingMode::Flat);
            group.sample_size(10);
            // All steps of one synthesis, for each sample's iterations.
            let whole = |n: u64, make: &dyn Fn() -> Duration| (0..n).map(|_| make()).sum();
            let steps = SYNTHESIS as u64 - 1;
            let single = || time_steps::<f32>(&setting, steps);
            let double = || time_steps::<f64>(&setting, steps);
            group.bench_function(format!("{lanes}, 1 thread"), |b| {
                b.iter_custom(|n| whole(n, &single));
            });
            group.bench_function(format!("{lanes}, 2 threads"), |b| {
                b.iter_custom(|n| whole(n, &|| on_two_threads(single)));
            });
            if setting.settings.preset == "paper" {
                group.bench_function("f64, 1 thread", |b| {
                    b.iter_custom(|n| whole(n, &double));
                });
            }
            group.finish();
        }
    }
}

/// Few and short samples: the table gives their minimum and median.
fn short() -> Criterion {
    Criterion::default()
        .sample_size(15)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1))
        .without_plots()
}

criterion_group! {
    name = benches;
    config = short();
    targets = contact_kernel, whole_step, whole_synthesis
}
criterion_main!(benches);
