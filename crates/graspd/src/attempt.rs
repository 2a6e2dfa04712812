//! How one start becomes the pose of a grasp: by the simulation alone, by fits before and after it, or by annealing.

use std::time::Instant;

use graspd_fit::{FittedHand, HandFitter};
use graspd_geom::SurfaceSampler;
use graspd_hand::{Hand, HandPose};
use rayon::prelude::*;

use crate::GraspError;
use crate::annealing::{AnnealingSettings, anneal};
use crate::antipodal_start::AntipodalStarts;
use crate::force_closure::epsilon_of_fit;
use crate::object::GraspObject;
use crate::preset::SynthesisSettings;
use crate::run::{RunObserver, TrajectoryPoint, draw_start_at};
use crate::start::start_rng;
use crate::synthesis::{Losses, Synthesis, synthesize};

/// Where one grasp comes from.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) object: &'a GraspObject,
    pub(crate) surface: &'a SurfaceSampler<'a>,
    pub(crate) antipodal: Option<&'a AntipodalStarts<'a>>,
    pub(crate) hand: &'a dyn Hand,
    pub(crate) settings: &'a SynthesisSettings,
    pub(crate) seed: u64,
    pub(crate) index: usize,
    pub(crate) trajectory_every: Option<usize>,
    pub(crate) observer: &'a dyn RunObserver,
}

/// The pose that came of a start.
pub(crate) struct Attempt {
    pub(crate) pose: HandPose,
    /// `None` if nothing was simulated.
    pub(crate) synthesis: Option<Synthesis>,
    pub(crate) trajectory: Vec<TrajectoryPoint>,
    /// Time that it took, summed over the threads that shared it \[s\].
    pub(crate) seconds: f64,
}

impl Job<'_> {
    fn start(&self, number: usize) -> HandPose {
        let Job {
            surface,
            object,
            hand,
            settings,
            seed,
            ..
        } = *self;
        if let Some(pose) = (self.antipodal).and_then(|starts| starts.start(seed, number)) {
            return pose;
        }
        draw_start_at(surface, object, hand, settings, seed, number)
    }

    /// Simulated annealing, the baseline.
    pub(crate) fn anneal(&self, annealing: &AnnealingSettings) -> Result<Attempt, GraspError> {
        let started = Instant::now();
        let start = self.start(self.index);
        let name = format!("{}, annealing", self.hand.name());
        let mut rng = start_rng(self.seed, &self.object.source.name, &name, self.index);
        let mut observe = |step: usize| self.observer.step(self.index, step);
        let steps = self.settings.steps;
        let (hand, object) = (self.hand, self.object);
        let pose = anneal(
            hand,
            object,
            &start,
            annealing,
            steps,
            &mut rng,
            &mut observe,
        )?;
        Ok(Attempt {
            pose,
            synthesis: None,
            trajectory: Vec::new(),
            seconds: started.elapsed().as_secs_f64(),
        })
    }

    /// The paper's optimisation, from the start of this number.
    pub(crate) fn simulate_from_start(&self) -> Result<Attempt, GraspError> {
        let started = Instant::now();
        let mut attempt = self.simulate(self.start(self.index))?;
        attempt.seconds = started.elapsed().as_secs_f64();
        Ok(attempt)
    }

    fn simulate(&self, start: HandPose) -> Result<Attempt, GraspError> {
        let mut trajectory = Vec::new();
        let mut observe = |step: usize, pose: &HandPose, losses: &Losses| {
            self.observer.step(self.index, step);
            let is_kept = |every: usize| step.is_multiple_of(every.max(1));
            if self.trajectory_every.is_some_and(is_kept) {
                trajectory.push(TrajectoryPoint {
                    step,
                    pose: pose.clone(),
                    losses: *losses,
                });
            }
        };
        let object = &self.object.simulated;
        let made = synthesize::<f32>(self.hand, object, start, self.settings, &mut observe)?;
        if !is_finite(&made) {
            return Err(GraspError::Diverged { index: self.index });
        }
        Ok(Attempt {
            pose: made.pose.clone(),
            synthesis: Some(made),
            trajectory,
            seconds: 0.0,
        })
    }

    /// Fits the hand from several starts, and takes the most promising through the simulation, a final fit and the
    /// projection. If it is too deep even so, the next ones are tried, and the best is kept.
    pub(crate) fn fit_and_simulate(&self, fitter: &HandFitter<'_>) -> Result<Attempt, GraspError> {
        let sdf = self.object.simulated.sdf();
        let (candidates, before) = self.candidates(fitter)?;
        let started = Instant::now();
        let seconds = || before + started.elapsed().as_secs_f64();
        let mut best: Option<(f64, Attempt)> = None;
        for candidate in candidates.into_iter().take(fitter.finalists()) {
            let mut attempt = self.simulate(candidate.pose)?;
            let fitted = fitter.fine(sdf, &attempt.pose);
            let projected = fitter.project(sdf, &self.object.distance, &fitted.pose);
            attempt.pose = projected.pose.clone();
            attempt.seconds = seconds();
            if fitter.is_shallow(&projected) {
                return Ok(attempt);
            }
            let closure = epsilon_of_fit(fitter, &projected, self.object)?;
            let rating = fitter.rating(&projected, closure);
            if best.as_ref().is_none_or(|(least, _)| rating < *least) {
                best = Some((rating, attempt));
            }
        }
        match best {
            Some((_, mut attempt)) => {
                attempt.seconds = seconds();
                Ok(attempt)
            }
            None => self.simulate_from_start(),
        }
    }

    /// Coarse fits from the starts that belong to this grasp, most promising first: those whose
    /// numbers are `candidates` times the grasp's and the next. And the seconds that they took in
    /// sum.
    ///
    /// In parallel: where fewer grasps are left than there are threads, these are what can be shared.
    fn candidates(&self, fitter: &HandFitter<'_>) -> Result<(Vec<FittedHand>, f64), GraspError> {
        let sdf = self.object.simulated.sdf();
        let first = self.index.saturating_mul(fitter.candidates());
        let starts = (0..fitter.candidates()).map(|candidate| first.saturating_add(candidate));
        let starts: Vec<usize> = starts.collect();
        let rated = |fitted: FittedHand| {
            let rating = fitter.rating(&fitted, epsilon_of_fit(fitter, &fitted, self.object)?);
            Ok((rating, fitted))
        };
        let (mut fitted, seconds) = if fitter.promising() < fitter.candidates() {
            let near = |start: &usize| Ok(fitter.approach(sdf, &self.start(*start)));
            let (mut near, before) = timed(&starts, near)?;
            near.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            near.truncate(fitter.promising());
            let (fitted, seconds) = timed(&near, |near| rated(fitter.contact(sdf, &near.pose)))?;
            (fitted, before + seconds)
        } else {
            timed(&starts, |start| {
                rated(fitter.coarse(sdf, &self.start(*start)))
            })?
        };
        fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok((
            fitted.into_iter().map(|(_, fitted)| fitted).collect(),
            seconds,
        ))
    }
}

/// Makes something of each item, in parallel; and the seconds that all took in sum.
fn timed<T: Sync, R: Send>(
    items: &[T],
    make: impl Fn(&T) -> Result<R, GraspError> + Sync,
) -> Result<(Vec<R>, f64), GraspError> {
    let made = items.par_iter().map(|item| {
        let started = Instant::now();
        Ok((make(item)?, started.elapsed().as_secs_f64()))
    });
    let (made, seconds): (Vec<R>, Vec<f64>) = made
        .collect::<Result<Vec<_>, GraspError>>()?
        .into_iter()
        .unzip();
    Ok((made, seconds.iter().sum()))
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
