//! Many starts at once: synthesise, judge, rank.

use std::time::Instant;

use graspd_eval::{EvaluationSettings, ObjectUnderTest, evaluate};
use graspd_fit::HandFitter;
use graspd_geom::{GeometryError, SurfaceSampler};
use graspd_hand::{Hand, HandPose};
use graspd_settings::{AT_LEAST_ONE, Ranges, Validate, ranges};
use graspd_sim::Scene;
use rayon::prelude::*;

use crate::GraspError;
use crate::antipodal_start::AntipodalStarts;
use crate::attempt::{Attempt, Job};
use crate::execution::{ExecutionSettings, plan_pre_grasp, plan_squeeze};
use crate::object::GraspObject;
use crate::preset::SynthesisSettings;
use crate::rank::rank_by_displacement;
use crate::record::{
    GraspRecord, OptimizerRecord, PreGrasp, RecordedPose, Seconds, Squeeze, named_joints,
};
use crate::start::{initial_pose, start_rng};
use crate::synthesis::{Losses, Synthesis};

/// Starts that already touch the object are drawn again at most this often.
const MAX_REDRAWS: usize = 100;

/// What a run does besides optimising.
#[derive(Clone, Debug)]
pub struct RunSettings {
    /// Seed of all starts.
    pub seed: u64,
    /// How many starts.
    pub count: usize,
    /// Keep the pose every so many steps; `None` keeps none.
    pub trajectory_every: Option<usize>,
    /// How pre-grasps and squeezes are made.
    pub execution: ExecutionSettings,
    /// How grasps are judged.
    pub evaluation: EvaluationSettings,
}

impl Validate for RunSettings {
    fn ranges(&self) -> Ranges {
        // The judge's, too: now rather than when the first grasp is judged, minutes later.
        ranges! { self => count: AT_LEAST_ONE }
            .nested("evaluation", &self.evaluation)
            .nested("execution", &self.execution)
    }
}

/// One pose along an optimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// The step about to be taken.
    pub step: usize,
    /// The pose then.
    pub pose: HandPose,
    /// The losses then.
    pub losses: Losses,
}

/// One grasp of a run.
#[derive(Clone, Debug)]
pub struct Grasp {
    /// What goes to disk.
    pub record: GraspRecord,
    /// The pose in full.
    pub pose: HandPose,
    /// The optimisation, if it was to be kept.
    pub trajectory: Vec<TrajectoryPoint>,
}

/// What a run tells while it goes on; called from many threads.
pub trait RunObserver: Sync {
    /// Start `index` is about to take step `step`.
    fn step(&self, index: usize, step: usize);
    /// A grasp has been made and judged (its rank is not known yet).
    fn finished(&self, record: &GraspRecord);
    /// Something about the run as a whole that a user should know.
    fn warning(&self, _text: &str) {}
}

/// Says nothing.
impl RunObserver for () {
    fn step(&self, _index: usize, _step: usize) {}
    fn finished(&self, _record: &GraspRecord) {}
}

/// The start of number `index`: a pure function of (seed, object, hand, index).
///
/// A start that already touches the object is drawn again, as the released code does.
///
/// # Errors
/// If the object's mesh has no area.
pub fn draw_start(
    object: &GraspObject,
    hand: &dyn Hand,
    settings: &SynthesisSettings,
    seed: u64,
    index: usize,
) -> Result<HandPose, GraspError> {
    let surface = surface_of(object)?;
    Ok(draw_start_at(&surface, object, hand, settings, seed, index))
}

/// What starts are drawn from.
fn surface_of(object: &GraspObject) -> Result<SurfaceSampler<'_>, GraspError> {
    SurfaceSampler::new(&object.source.mesh).ok_or_else(|| {
        GraspError::from(GeometryError::NoVolume {
            name: object.source.label(),
        })
    })
}

/// [`draw_start`] with the object's surface at hand.
pub(crate) fn draw_start_at(
    surface: &SurfaceSampler<'_>,
    object: &GraspObject,
    hand: &dyn Hand,
    settings: &SynthesisSettings,
    seed: u64,
    index: usize,
) -> HandPose {
    let standoff = settings.real_length(settings.standoff);
    let mut rng = start_rng(seed, &object.source.name, hand.name(), index);
    let simulation = settings.simulation();
    let mut scene = Scene::<f64>::new(hand, &object.simulated, &simulation);
    let mut pose = initial_pose(hand, surface, standoff, &mut rng);
    for _ in 0..MAX_REDRAWS {
        scene.place(&pose);
        if scene.closest_distance() > 0.0 {
            break;
        }
        pose = initial_pose(hand, surface, standoff, &mut rng);
    }
    pose
}

/// Synthesises, judges and ranks `run.count` grasps in parallel, on rayon's current thread pool.
///
/// The result is the same, timings apart, for any number of threads. It is sorted by rank.
///
/// # Errors
/// If a setting is out of range, no start is asked for, or an optimisation diverges.
pub fn synthesize_grasps(
    object: &GraspObject,
    hand: &dyn Hand,
    settings: &SynthesisSettings,
    run: &RunSettings,
    observer: &dyn RunObserver,
) -> Result<Vec<Grasp>, GraspError> {
    let maker = GraspMaker::new(object, hand, settings, run)?;
    if let Some(text) = maker.warning() {
        observer.warning(&text);
    }
    let mut grasps = (0..run.count)
        .into_par_iter()
        .map(|index| maker.grasp(index, observer))
        .collect::<Result<Vec<_>, _>>()?;

    let mut records: Vec<_> = grasps.iter().map(|grasp| grasp.record.clone()).collect();
    rank_by_displacement(&mut records);
    for record in records {
        // Before sorting, grasps stand by index.
        let index = record.index;
        grasps[index].record = record;
    }
    grasps.sort_by_key(|grasp| grasp.record.rank);
    Ok(grasps)
}

/// Makes the grasps of one hand on one object, one start at a time and in any order.
///
/// [`synthesize_grasps`] makes all of a run's; this is for who wants some of them, or each as soon as it is done.
pub(crate) struct GraspMaker<'a> {
    object: &'a GraspObject,
    surface: SurfaceSampler<'a>,
    judged: ObjectUnderTest,
    hand: &'a dyn Hand,
    fitter: Option<HandFitter<'a>>,
    antipodal: Option<AntipodalStarts<'a>>,
    settings: &'a SynthesisSettings,
    run: &'a RunSettings,
}

impl<'a> GraspMaker<'a> {
    /// Prepares the judge; what takes long about it is done when the first grasp is judged.
    ///
    /// # Errors
    /// If a setting is out of range, or the object or the hand is not closed.
    pub(crate) fn new(
        object: &'a GraspObject,
        hand: &'a dyn Hand,
        settings: &'a SynthesisSettings,
        run: &'a RunSettings,
    ) -> Result<Self, GraspError> {
        settings.validate()?;
        run.validate()?;
        let mut judged =
            ObjectUnderTest::new(&object.source.mesh)?.with_cache(object.cache.clone());
        if run.evaluation.metrics.self_penetration {
            judged = judged.grasped_by(&hand.surface_at_rest())?;
        }
        let fitter = (settings.skin_fit.as_ref())
            .map(|skin_fit| HandFitter::new(hand, skin_fit))
            .transpose()?;
        let surface = surface_of(object)?;
        let antipodal = (fitter.is_some())
            .then(|| AntipodalStarts::new(object, hand, &surface))
            .transpose()?;
        Ok(Self {
            object,
            surface,
            antipodal,
            judged,
            hand,
            fitter,
            settings,
            run,
        })
    }

    /// Says so if the hand cannot close around any part of the object; only presets with `skin_fit` look.
    pub(crate) fn warning(&self) -> Option<String> {
        self.antipodal.as_ref().and_then(AntipodalStarts::warning)
    }

    /// The grasp of start `index`, judged but not ranked: the same, timings apart, whatever was made before.
    ///
    /// # Errors
    /// If the optimisation diverges.
    pub(crate) fn grasp(
        &self,
        index: usize,
        observer: &dyn RunObserver,
    ) -> Result<Grasp, GraspError> {
        let Self {
            object,
            hand,
            settings,
            run,
            ..
        } = *self;
        let (fitter, judged) = (self.fitter.as_ref(), &self.judged);
        let job = Job {
            object,
            surface: &self.surface,
            antipodal: self.antipodal.as_ref(),
            hand,
            settings,
            seed: run.seed,
            index,
            trajectory_every: run.trajectory_every,
            observer,
        };
        let Attempt {
            pose,
            synthesis,
            trajectory,
            seconds,
        } = match (fitter, &settings.annealing) {
            (_, Some(annealing)) => job.anneal(annealing)?,
            (Some(fitter), None) => job.fit(fitter)?,
            (None, None) => job.simulate_from_start()?,
        };

        let started = Instant::now();
        let metrics = evaluate(judged, &hand.surface(&pose), &run.evaluation)?;
        let seconds = Seconds {
            synthesis: seconds,
            evaluation: started.elapsed().as_secs_f64(),
        };
        let mut record = record_of(object, hand, &pose, &run.execution, index);
        record.optimizer = synthesis.map(|synthesis| optimizer_record(settings, &synthesis));
        record.seed = Some(run.seed);
        record.metrics = Some(metrics);
        record.seconds = Some(seconds);
        observer.finished(&record);
        Ok(Grasp {
            record,
            pose,
            trajectory,
        })
    }
}

fn optimizer_record(settings: &SynthesisSettings, synthesis: &Synthesis) -> OptimizerRecord {
    let losses = &synthesis.losses;
    OptimizerRecord {
        preset: settings.preset.clone(),
        steps: synthesis.steps,
        l_phys: losses.physics,
        l_task: losses.task,
        l_range: losses.range,
        l_limit: losses.limit,
        l_inter: losses.intersection,
        task_satisfied: synthesis.task_satisfied,
    }
}

fn record_of(
    object: &GraspObject,
    hand: &dyn Hand,
    pose: &HandPose,
    execution: &ExecutionSettings,
    index: usize,
) -> GraspRecord {
    let names = hand.articulation_names();
    let before = plan_pre_grasp(hand, object, pose, execution);
    let after = plan_squeeze(hand, object, pose, execution);
    GraspRecord {
        schema: crate::SCHEMA.into(),
        object: object.source.name.clone(),
        object_path: object.source.path_text(),
        object_scale: object.source.scale,
        object_repair: object.source.repair_name(),
        hand: hand.name().into(),
        seed: None,
        index,
        pose: RecordedPose::from(pose),
        joints_rad: Some(named_joints(names, &pose.articulation)),
        mano: hand
            .shape_parameters()
            .map(|shape| serde_json::json!({"pca": pose.articulation, "shape": shape})),
        pre_grasp: Some(PreGrasp {
            pose: RecordedPose::from(&before.pose),
            joints_rad: named_joints(names, &before.pose.articulation),
            order: Some(before.order.name().into()),
            clearance_m: Some(before.clearance),
            is_free: Some(before.is_free),
        }),
        squeeze: Some(Squeeze {
            joints_rad: named_joints(names, &after.articulation),
            torques_nm: Some(named_joints(names, &after.torques)),
            force_n: Some(execution.squeeze_force),
        }),
        metrics: None,
        optimizer: None,
        rank: None,
        seconds: None,
    }
}
