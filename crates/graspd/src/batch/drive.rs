//! Working through a batch: all cores busy, few objects in memory, nothing lost.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use graspd_geom::DiskCache;
use graspd_hand::Hand;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::folder::{BatchFolder, RunState};
use super::journal::{StartFailure, StartOutcome};
use super::plan::{BatchPlan, PlannedObject, PlannedRun, Shard};
use crate::GraspError;
use crate::object::{GraspObject, NamedMesh};
use crate::run::{GraspMaker, RunSettings};
use crate::run_description::ObjectRepair;

/// Loads an object, or tells in one line why it cannot be.
pub type ObjectLoader<'a> = dyn Fn(&PlannedObject) -> Result<NamedMesh, String> + Sync + 'a;

/// What a batch is made from.
pub struct BatchInput<'a> {
    /// What to make.
    pub plan: &'a BatchPlan,
    /// Which part of it.
    pub shard: Shard,
    /// The hands of the plan, loaded.
    pub hands: &'a [Box<dyn Hand>],
    /// How objects are loaded.
    pub load: &'a ObjectLoader<'a>,
    /// Where grids and decompositions are kept between runs.
    pub cache: Option<DiskCache>,
}

/// What a batch tells while it goes on; called from many threads.
pub trait BatchObserver: Sync {
    /// So many starts are left to be made.
    fn planned(&self, starts: usize);
    /// A start has been made, or has failed, and is on the disk; `is_restored` if it was there before.
    fn start_over(&self, run: &PlannedRun, outcome: &StartOutcome, is_restored: bool);
    /// None of the runs of an object that are left can be made: so many starts less to come.
    fn object_failed(&self, object: &PlannedObject, error: &str, starts: usize);
}

/// Says nothing.
impl BatchObserver for () {
    fn planned(&self, _starts: usize) {}
    fn start_over(&self, _run: &PlannedRun, _outcome: &StartOutcome, _is_restored: bool) {}
    fn object_failed(&self, _object: &PlannedObject, _error: &str, _starts: usize) {}
}

/// What a process did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchTally {
    /// Runs of the shard.
    pub runs: usize,
    /// Those of them that were done before.
    pub runs_done_before: usize,
    /// Starts that were in journals already.
    pub starts_done_before: usize,
    /// Starts made now, failed ones included.
    pub starts_made: usize,
    /// Runs of the shard without a grasp, whenever they failed.
    pub runs_failed: usize,
}

/// Works through a shard of a batch on `pool`; to be called from outside of it.
///
/// Objects are prepared and grasped on the pool's threads only. Enough objects are at hand at a time for every
/// thread to have a start to work on, and no more: a 256^3 grid takes 70 MB. What becomes of a start or an object
/// is recorded whether it fails or not; only files that cannot be written end the batch.
///
/// The final files are the same, timings apart, whatever the number of threads and however often the work was cut
/// short.
///
/// # Errors
/// If a file of the batch's folder cannot be read or written.
pub fn run_batch(
    input: &BatchInput<'_>,
    folder: &BatchFolder,
    pool: &ThreadPool,
    observer: &dyn BatchObserver,
) -> Result<BatchTally, GraspError> {
    let plan = input.plan;
    let mut tally = BatchTally::default();
    let mut pending = Vec::new();
    let mut starts = 0;
    for object in plan.objects_of(input.shard) {
        let mut runs = Vec::new();
        for run in &plan.runs[plan.objects[object].runs.clone()] {
            tally.runs += 1;
            match folder.state(run) {
                state @ (RunState::Done | RunState::Failed) => {
                    folder.tidy(run)?;
                    tally.runs_done_before += 1;
                    tally.runs_failed += usize::from(state == RunState::Failed);
                }
                _ => runs.push(run),
            }
        }
        starts += runs.len() * plan.starts;
        if !runs.is_empty() {
            pending.push((&plan.objects[object], runs));
        }
    }
    observer.planned(starts);

    let drivers = (pool.current_num_threads().div_ceil(plan.starts) + 1).min(pending.len());
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = Work {
        input,
        folder,
        observer,
        is_over: &is_over,
    };
    let total = Mutex::new((tally, None));
    std::thread::scope(|scope| {
        for _ in 0..drivers {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some((object, runs)) = pending.get(number) else {
                        break;
                    };
                    let result = pool.install(|| work.object(object, runs));
                    // Nothing panics while this is held.
                    let mut total = total
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner);
                    match result {
                        Ok(part) => {
                            total.0.starts_done_before += part.starts_done_before;
                            total.0.starts_made += part.starts_made;
                            total.0.runs_failed += part.runs_failed;
                        }
                        Err(error) => {
                            is_over.store(true, Ordering::Relaxed);
                            total.1.get_or_insert(error);
                        }
                    }
                }
            });
        }
    });
    let (tally, error) = total
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    error.map_or(Ok(tally), Err)
}

/// What all objects are worked on with.
struct Work<'a> {
    input: &'a BatchInput<'a>,
    folder: &'a BatchFolder,
    observer: &'a dyn BatchObserver,
    is_over: &'a AtomicBool,
}

impl Work<'_> {
    fn object(
        &self,
        planned: &PlannedObject,
        runs: &[&PlannedRun],
    ) -> Result<BatchTally, GraspError> {
        let mut tally = BatchTally::default();
        match unwound(|| self.prepare(planned)) {
            Ok(object) => {
                for run in runs {
                    if !self.is_over.load(Ordering::Relaxed) {
                        self.run(&object, run, &mut tally)?;
                    }
                }
            }
            Err(error) => {
                let starts = runs.len() * self.input.plan.starts;
                self.observer.object_failed(planned, &error, starts);
                for run in runs {
                    self.fail(run, &error, &mut tally)?;
                }
            }
        }
        Ok(tally)
    }

    /// Records that nothing of a run can be made; what a journal may hold is of no use then.
    fn fail(
        &self,
        run: &PlannedRun,
        error: &str,
        tally: &mut BatchTally,
    ) -> Result<(), GraspError> {
        self.folder.begin(run)?;
        let failure = StartFailure {
            index: None,
            error: error.to_owned(),
        };
        let outcomes = vec![StartOutcome::Failure(failure)];
        self.folder.finish(self.input.plan, run, outcomes, None)?;
        tally.runs_failed += 1;
        Ok(())
    }

    fn prepare(&self, planned: &PlannedObject) -> Result<GraspObject, String> {
        let configuration = &self.input.plan.configuration;
        let cache = self.input.cache.clone();
        let source = (self.input.load)(planned)?;
        let object = GraspObject::prepare_sampled(
            source,
            &configuration.sdf_sampling(),
            configuration.settings.density,
            cache,
            &|_| {},
        );
        object.map_err(|error| error.to_string())
    }

    fn run(
        &self,
        object: &GraspObject,
        run: &PlannedRun,
        tally: &mut BatchTally,
    ) -> Result<(), GraspError> {
        let plan = self.input.plan;
        let (journal, mut outcomes) = self.folder.begin(run)?;
        let mut is_there = vec![false; plan.starts];
        outcomes.retain(|outcome| {
            let slot = outcome.index().and_then(|index| is_there.get_mut(index));
            slot.is_some_and(|slot| !std::mem::replace(slot, true))
        });
        tally.starts_done_before += outcomes.len();
        for outcome in &outcomes {
            self.observer.start_over(run, outcome, true);
        }
        let missing: Vec<usize> = (0..plan.starts).filter(|index| !is_there[*index]).collect();
        let configuration = plan.configuration_of(run);
        let settings = RunSettings {
            seed: run.seed,
            count: plan.starts,
            trajectory_every: None,
            execution: configuration.execution,
            evaluation: configuration.evaluation,
        };
        let hand = self.input.hands[run.hand].as_ref();
        let maker = match GraspMaker::new(object, hand, &configuration.settings, &settings) {
            Ok(maker) => maker,
            Err(error) => {
                let error = error.to_string();
                let planned = &plan.objects[run.object];
                self.observer.object_failed(planned, &error, missing.len());
                return self.fail(run, &error, tally);
            }
        };
        let made = (missing.into_par_iter().with_max_len(1))
            .filter(|_| !self.is_over.load(Ordering::Relaxed))
            .map(|index| {
                let result = unwound(|| match maker.grasp(index, &()) {
                    // JSON has no word for what is not finite.
                    Ok(grasp) if !grasp.record.is_finite() => {
                        Err("it has a number that is not finite".into())
                    }
                    Ok(grasp) => Ok(StartOutcome::Grasp(Box::new(grasp.record))),
                    Err(error) => Err(error.to_string()),
                });
                let outcome = result.unwrap_or_else(|error| {
                    let index = Some(index);
                    StartOutcome::Failure(StartFailure { index, error })
                });
                journal.append(&outcome)?;
                self.observer.start_over(run, &outcome, false);
                Ok(outcome)
            })
            .collect::<Result<Vec<_>, GraspError>>();
        let made = made.inspect_err(|_| self.is_over.store(true, Ordering::Relaxed))?;
        tally.starts_made += made.len();
        outcomes.extend(made);
        if outcomes.len() < plan.starts {
            // Another object met with an error that ends the batch.
            return Ok(());
        }
        let repair = object.source.repair.as_ref().map(ObjectRepair::from);
        let (records, _) = self.folder.finish(plan, run, outcomes, repair)?;
        tally.runs_failed += usize::from(records.is_empty());
        Ok(())
    }
}

/// A panic is a bug, but one object's must not cost the others.
fn unwound<R>(work: impl FnOnce() -> Result<R, String>) -> Result<R, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned());
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
        Err(format!("internal error: {}", text.unwrap_or_default()))
    })
}
