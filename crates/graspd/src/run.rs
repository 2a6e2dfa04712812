//! Many starts at once: synthesise, judge, rank.

use std::time::Instant;

use graspd_eval::{EvaluationSettings, ObjectUnderTest, evaluate};
use graspd_geom::{GeometryError, SurfaceSampler};
use graspd_hand::{Hand, HandPose};
use graspd_sim::Scene;
use rayon::prelude::*;

use crate::GraspError;
use crate::conformity::HandFitter;
use crate::execution::{ExecutionSettings, plan_pre_grasp, plan_squeeze};
use crate::object::GraspObject;
use crate::preset::SynthesisSettings;
use crate::rank::rank_by_displacement;
use crate::record::{
    GraspRecord, OptimizerRecord, PreGrasp, RecordedPose, SCHEMA, Seconds, Squeeze, named_joints,
};
use crate::start::{initial_pose, start_rng};
use crate::synthesis::{Losses, Synthesis, synthesize};

/// Starts that already touch the object are drawn again at most this often.
const MOST_REDRAWS: usize = 100;

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

impl RunSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// If no grasp is asked for, or the judge's settings are out of range.
    pub fn validate(&self) -> Result<(), GraspError> {
        if self.count == 0 {
            return Err(GraspError::InvalidSetting {
                field: "n (the number of grasps)",
                value: 0.0,
                wanted: "at least 1",
            });
        }
        // Now rather than when the first grasp is judged, minutes later.
        self.evaluation.validate()?;
        self.execution.validate()?;
        Ok(())
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
    let surface =
        SurfaceSampler::new(&object.source.mesh).ok_or_else(|| GeometryError::NoVolume {
            name: object.source.label(),
        })?;
    let mut rng = start_rng(seed, &object.source.name, hand.name(), index);
    let simulation = settings.simulation();
    let mut scene = Scene::<f64>::new(hand, &object.simulated, &simulation);
    let mut pose = initial_pose(hand, &surface, settings.standoff, &mut rng);
    for _ in 0..MOST_REDRAWS {
        scene.place(&pose);
        if scene.closest_distance() > 0.0 {
            break;
        }
        pose = initial_pose(hand, &surface, settings.standoff, &mut rng);
    }
    Ok(pose)
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

/// The best of the fitted starts that belong to a grasp: of those whose numbers are `candidates` times `index` and the
/// next, that of the best rating (`FittedHand::rating`).
fn best_fitted_start(
    object: &GraspObject,
    hand: &dyn Hand,
    fitter: &HandFitter<'_>,
    settings: &SynthesisSettings,
    seed: u64,
    index: usize,
) -> Result<HandPose, GraspError> {
    let sdf = object.simulated.sdf();
    let mut best = None;
    for candidate in 0..fitter.candidates() {
        let number = index.saturating_mul(fitter.candidates()) + candidate;
        let start = draw_start(object, hand, settings, seed, number)?;
        let fitted = fitter.coarse(sdf, &start);
        let rating = fitted.rating();
        if best.as_ref().is_none_or(|(least, _)| rating < *least) {
            best = Some((rating, fitted.pose));
        }
    }
    match best {
        Some((_, pose)) => Ok(pose),
        None => draw_start(object, hand, settings, seed, index),
    }
}

/// Makes the grasps of one hand on one object, one start at a time and in any order.
///
/// [`synthesize_grasps`] makes all of a run's; this is for who wants some of them, or each as soon as it is done.
pub struct GraspMaker<'a> {
    object: &'a GraspObject,
    judged: ObjectUnderTest,
    hand: &'a dyn Hand,
    fitter: Option<HandFitter<'a>>,
    settings: &'a SynthesisSettings,
    run: &'a RunSettings,
}

impl<'a> GraspMaker<'a> {
    /// Prepares the judge; what takes long about it is done when the first grasp is judged.
    ///
    /// # Errors
    /// If a setting is out of range, or the object or the hand is not closed.
    pub fn new(
        object: &'a GraspObject,
        hand: &'a dyn Hand,
        settings: &'a SynthesisSettings,
        run: &'a RunSettings,
    ) -> Result<Self, GraspError> {
        settings.validate()?;
        run.validate()?;
        let judged = ObjectUnderTest::new(&object.source.mesh)?.with_cache(object.cache.clone());
        let fitter = (settings.conformity.as_ref())
            .map(|conformity| HandFitter::new(hand, conformity))
            .transpose()?;
        Ok(Self {
            object,
            judged,
            hand,
            fitter,
            settings,
            run,
        })
    }

    /// The grasp of start `index`, judged but not ranked: the same, timings apart, whatever was made before.
    ///
    /// # Errors
    /// If the optimisation diverges.
    pub fn grasp(&self, index: usize, observer: &dyn RunObserver) -> Result<Grasp, GraspError> {
        let Self {
            object,
            hand,
            settings,
            run,
            ..
        } = *self;
        let (fitter, judged) = (self.fitter.as_ref(), &self.judged);
        let started = Instant::now();
        let start = match fitter {
            Some(fitter) => best_fitted_start(object, hand, fitter, settings, run.seed, index)?,
            None => draw_start(object, hand, settings, run.seed, index)?,
        };
        let mut trajectory = Vec::new();
        let mut observe = |step: usize, pose: &HandPose, losses: &Losses| {
            observer.step(index, step);
            if run
                .trajectory_every
                .is_some_and(|every| step.is_multiple_of(every.max(1)))
            {
                trajectory.push(TrajectoryPoint {
                    step,
                    pose: pose.clone(),
                    losses: *losses,
                });
            }
        };
        let mut synthesis =
            synthesize::<f32>(hand, &object.simulated, start, settings, &mut observe)?;
        if !is_finite(&synthesis) {
            return Err(GraspError::Diverged { index });
        }
        if let Some(fitter) = fitter {
            synthesis.pose = fitter.fine(object.simulated.sdf(), &synthesis.pose).pose;
        }
        let synthesis_seconds = started.elapsed().as_secs_f64();

        let started = Instant::now();
        let metrics = evaluate(judged, &hand.surface(&synthesis.pose), &run.evaluation)?;
        let seconds = Seconds {
            synthesis: synthesis_seconds,
            evaluation: started.elapsed().as_secs_f64(),
        };
        let mut record = record_of(object, hand, settings, &run.execution, &synthesis, index);
        record.seed = Some(run.seed);
        record.metrics = Some(metrics);
        record.seconds = Some(seconds);
        observer.finished(&record);
        Ok(Grasp {
            record,
            pose: synthesis.pose,
            trajectory,
        })
    }
}

/// Whether the optimisation ended in numbers; infinite ones become NaN within a step or two.
fn is_finite(synthesis: &Synthesis) -> bool {
    let Synthesis { pose, losses, .. } = synthesis;
    let (t, q) = (pose.translation, pose.rotation);
    [t.x, t.y, t.z, q.w, q.x, q.y, q.z]
        .iter()
        .chain(&pose.articulation)
        .chain(&[losses.physics, losses.task, losses.range])
        .chain(&[losses.limit, losses.intersection])
        .all(|number| number.is_finite())
}

fn record_of(
    object: &GraspObject,
    hand: &dyn Hand,
    settings: &SynthesisSettings,
    execution: &ExecutionSettings,
    synthesis: &Synthesis,
    index: usize,
) -> GraspRecord {
    let names = hand.articulation_names();
    let (pose, losses) = (&synthesis.pose, &synthesis.losses);
    let before = plan_pre_grasp(hand, object, pose, execution);
    let after = plan_squeeze(hand, object, pose, execution);
    GraspRecord {
        schema: SCHEMA.into(),
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
            .mano_shape()
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
        optimizer: Some(OptimizerRecord {
            preset: settings.preset.clone(),
            steps: synthesis.steps,
            l_phys: losses.physics,
            l_task: losses.task,
            l_range: losses.range,
            l_limit: losses.limit,
            l_inter: losses.intersection,
            task_satisfied: synthesis.task_satisfied,
        }),
        rank: None,
        seconds: None,
    }
}
