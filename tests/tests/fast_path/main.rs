//! The fast path of a step, one pass over the contacts in single precision, against the plain one: four passes in
//! double precision, one contact at a time. Both follow the poses of one recorded optimisation.

mod trajectory;

use graspd_hand::{Hand, HandPose, Kinematics, PointBuffer, PoseGradient};
use graspd_opt::{AdamSettings, Adamax, Optimizer};
use graspd_sim::{ForceWeights, Precision, Scene, SimulationParams, TargetWrenches};

use trajectory::{AdamaxRule, HAND, MUG, TRAJECTORY, WHOLE_TRAJECTORY};

const RATE: f64 = 1e-2;
/// L_phys as in the presets, L_task so that both move the targets.
const WEIGHTS: ForceWeights = ForceWeights {
    physics: 1e-2,
    task: 1e3,
};
/// Steps of the trajectory at which some contact touches, at least.
const FEWEST_TOUCHING: usize = 100;
/// Steps at which some contact touches for the first time, at least.
const FEWEST_SEPARATIONS: usize = 5;

/// The plain way of taking a step, with the state that it carries along.
struct Plain<'a, E> {
    scene: Scene<'a, E>,
    targets: Vec<E>,
    optimizer: Adamax<E>,
}

/// The fast way: one pass.
struct Fused<'a, E> {
    scene: Scene<'a, E>,
    targets: TargetWrenches<E>,
    optimizer: Adamax<E>,
}

/// What a step makes.
struct Outcome {
    task: f64,
    physics: f64,
    gradient: PoseGradient,
}

impl<'a, E: Precision> Plain<'a, E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn new(params: &'a SimulationParams) -> Self {
        let scene = Scene::new(&*HAND, &MUG.simulated, params);
        let len = scene.wrench_len();
        Self {
            scene,
            targets: vec![E::zero(); len],
            optimizer: Adamax::new(len, AdamSettings::default()).expect("they are in range"),
        }
    }

    fn step(&mut self, pose: &HandPose) -> Outcome {
        let Self {
            scene,
            targets,
            optimizer,
        } = self;
        scene.place(pose);
        scene.contact_wrenches();
        let task = scene.task(targets).loss;
        let mut gradient = vec![E::zero(); targets.len()];
        scene.target_gradient(targets, WEIGHTS.physics, WEIGHTS.task, &mut gradient);
        optimizer.step(RATE, targets, &gradient);
        let physics = scene.physics_loss(targets);
        Outcome::new(scene, pose, task, physics)
    }
}

impl<'a, E: Precision> Fused<'a, E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn new(params: &'a SimulationParams) -> Self {
        let scene = Scene::new(&*HAND, &MUG.simulated, params);
        let targets = scene.new_targets();
        let len = targets.state_len();
        Self {
            scene,
            targets,
            optimizer: Adamax::new(len, AdamSettings::default()).expect("they are in range"),
        }
    }

    /// `task`: where the outcome of the simulated step comes from.
    fn step(
        &mut self,
        pose: &HandPose,
        task: fn(&mut Scene<'a, E>, &TargetWrenches<E>) -> f64,
    ) -> Outcome {
        let Self {
            scene,
            targets,
            optimizer,
        } = self;
        scene.place(pose);
        let task = task(scene, targets);
        let mut rule = AdamaxRule(optimizer.begin_iteration(RATE));
        let physics = scene.move_targets(WEIGHTS, &mut rule, targets);
        Outcome::new(scene, pose, task, physics)
    }
}

impl Outcome {
    fn new<E: Precision>(scene: &mut Scene<'_, E>, pose: &HandPose, task: f64, physics: f64) -> Self
    where
        for<'h> dyn Hand + 'h: Kinematics<E>,
    {
        let mut gradient = PoseGradient::zero(pose.articulation.len());
        scene.pull_back(pose, &mut gradient);
        Self {
            task,
            physics,
            gradient,
        }
    }
}

fn from_targets<E: Precision>(scene: &mut Scene<'_, E>, targets: &TargetWrenches<E>) -> f64
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    scene.task(&targets.expand()).loss
}

fn from_sums<E: Precision>(scene: &mut Scene<'_, E>, targets: &TargetWrenches<E>) -> f64
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    scene.task_of_moved_targets(targets).loss
}

/// All components.
fn flat(gradient: &PoseGradient) -> Vec<f64> {
    let (t, r) = (gradient.translation, gradient.rotation);
    let mut flat = vec![t.x, t.y, t.z, r.x, r.y, r.z];
    flat.extend(&gradient.articulation);
    flat
}

/// A quantity along the trajectory, found and expected.
#[derive(Default)]
struct Comparison {
    /// Squared norms of the error and of the expected value, for each step.
    squares: Vec<[f64; 2]>,
}

impl Comparison {
    fn push(&mut self, found: &[f64], expected: &[f64]) -> f64 {
        let errors = found.iter().zip(expected).map(|(a, b)| (a - b) * (a - b));
        let error = errors.sum::<f64>();
        let expected = expected.iter().map(|x| x * x).sum::<f64>();
        self.squares.push([error, expected]);
        (error / expected).sqrt()
    }
    /// Norm of the error over the norm of the expected values, of all steps together.
    fn over_all_steps(&self) -> f64 {
        let sum = |side: usize| self.squares.iter().map(|pair| pair[side]).sum::<f64>();
        (sum(0) / sum(1)).sqrt()
    }
    /// The relative error that a share of the steps stays below.
    fn quantile(&self, share: f64) -> f64 {
        let mut errors: Vec<f64> = self.squares.iter().map(|[e, x]| (e / x).sqrt()).collect();
        errors.sort_by(f64::total_cmp);
        errors[(share * (errors.len() - 1) as f64) as usize]
    }
}

fn touches<E: Precision>(points: &PointBuffer<E>) -> bool {
    (0..points.len()).any(|i| MUG.simulated.sdf().distance(points.get(i)) <= 0.0)
}

/// The targets and L_phys of one pass are those of four to the last bit; its gradient is rounded in another order.
fn one_pass_is_four<E: Precision>(rounding: f64)
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let params = TRAJECTORY.settings.simulation();
    let (mut plain, mut fused) = (Plain::<E>::new(&params), Fused::<E>::new(&params));
    let (mut gradients, mut touching) = (Comparison::default(), 0);
    let mut separations = 0;
    for (step, pose) in TRAJECTORY.poses.iter().enumerate() {
        let own_before = fused.targets.own_count();
        let expected = plain.step(pose);
        let found = fused.step(pose, from_targets);
        let targets = fused.targets.expand();
        assert!(plain.targets == targets, "targets at step {step}");
        assert_eq!(found.physics, expected.physics, "L_phys at step {step}");
        let error = gradients.push(&flat(&found.gradient), &flat(&expected.gradient));
        assert!(error <= rounding, "gradient at step {step}: {error:e}");
        // The sums that the pass kept are those of the targets.
        let task = plain.scene.task(&plain.targets).loss;
        let kept = from_sums(&mut fused.scene, &fused.targets);
        let error = (kept - task).abs() / task;
        assert!(error <= rounding, "L_task at step {step}: {error:e}");
        touching += usize::from(touches(plain.scene.contacts()));
        separations += usize::from(step > 0 && fused.targets.own_count() > own_before);
    }
    assert!(touching >= FEWEST_TOUCHING, "contact at {touching} steps");
    // Contacts left the shared targets at several steps, and some never did.
    assert!(separations >= FEWEST_SEPARATIONS, "{separations} steps");
    let own = fused.targets.own_count();
    assert!(own < HAND.contact_points().count / 2, "{own} contacts");
}

#[test]
fn one_pass_is_four_in_double_precision() {
    one_pass_is_four::<f64>(1e-12);
}

#[test]
fn one_pass_is_four_in_single_precision() {
    // Sums over hundreds of contacts.
    one_pass_is_four::<f32>(1e-5);
}

/// Both paths side by side, each with its own targets, so that what they differ by at one step goes on to the next.
#[test]
fn the_fast_path_follows_the_reference() {
    let params = TRAJECTORY.settings.simulation();
    let (mut reference, mut fast) = (Plain::<f64>::new(&params), Fused::<f32>::new(&params));
    let mut found = Comparisons::default();
    for pose in &TRAJECTORY.poses {
        let expected = reference.step(pose);
        found.push(&fast.step(pose, from_sums), &expected);
    }
    found.check();
}

/// At the poses and targets of a whole optimisation, losses and gradient of the fast path are those of the reference.
///
/// The targets are those that the fast path moves, given to both. (Moved by each for itself they would part in the
/// end: Adamax divides each gradient by its size, so that where a gradient is nearly 0, its rounding counts in
/// full.)
#[test]
fn the_fast_path_is_the_reference_over_a_whole_optimisation() {
    /// Steps from one comparison to the next.
    const EVERY: usize = 5;
    let params = WHOLE_TRAJECTORY.settings.simulation();
    let mut fast = Fused::<f32>::new(&params);
    let mut scene = Scene::<f64>::new(&*HAND, &MUG.simulated, &params);
    let double = |targets: &TargetWrenches<f32>| -> Vec<f64> {
        targets.expand().into_iter().map(f64::from).collect()
    };
    let mut found = Comparisons::default();
    for (step, pose) in WHOLE_TRAJECTORY.poses.iter().enumerate() {
        if !step.is_multiple_of(EVERY) {
            fast.step(pose, from_sums);
            continue;
        }
        scene.place(pose);
        let task = scene.task(&double(&fast.targets)).loss;
        let outcome = fast.step(pose, from_sums);
        let physics = scene.physics_loss(&double(&fast.targets));
        let expected = Outcome::new(&mut scene, pose, task, physics);
        found.push(&outcome, &expected);
    }
    found.check();
}

/// Losses and gradient along a trajectory.
#[derive(Default)]
struct Comparisons {
    task: Comparison,
    physics: Comparison,
    gradient: Comparison,
}

impl Comparisons {
    fn push(&mut self, found: &Outcome, expected: &Outcome) {
        self.task.push(&[found.task], &[expected.task]);
        self.physics.push(&[found.physics], &[expected.physics]);
        let (found, expected) = (flat(&found.gradient), flat(&expected.gradient));
        self.gradient.push(&found, &expected);
    }

    fn check(&self) {
        /// Asked for.
        const AGREEMENT: f64 = 1e-4;
        /// Of all steps together.
        const TOGETHER: f64 = 1e-5;
        for (what, comparison) in [
            ("L_task", &self.task),
            ("L_phys", &self.physics),
            ("gradient", &self.gradient),
        ] {
            let (all, most) = (comparison.over_all_steps(), comparison.quantile(0.9));
            println!(
                "{what}: {all:.1e} over all steps; median {:.1e}, 90 % {most:.1e}, 99 % {:.1e}, worst {:.1e}",
                comparison.quantile(0.5),
                comparison.quantile(0.99),
                comparison.quantile(1.0)
            );
            assert!(all <= TOGETHER, "{what}: {all:e} over all steps");
            assert!(most <= AGREEMENT, "{what}: {most:e} at one step in ten");
        }
        for losses in [&self.task, &self.physics] {
            let worst = losses.quantile(1.0);
            assert!(worst <= AGREEMENT, "a loss is off by {worst:e}");
        }
    }
}
