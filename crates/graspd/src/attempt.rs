//! How one start becomes the pose of a grasp: by steps of second order or of first, or by annealing.

use std::time::Instant;

use graspd_fit::{FittedHand, HandFitter};
use graspd_geom::SurfaceSampler;
use graspd_hand::{Hand, HandPose};
use graspd_sim::{Scene, limit_loss, range_loss};
use rayon::prelude::*;

use crate::GraspError;
use crate::annealing::{AnnealingSettings, anneal};
use crate::antipodal_start::AntipodalStarts;
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

    /// Solves by steps of second order from several starts, and takes the one rated best to the end and through the
    /// projection. If it is too deep even so, the next ones are tried, and the best is kept.
    pub(crate) fn fit(&self, fitter: &HandFitter<'_>) -> Result<Attempt, GraspError> {
        let (candidates, before) = self.candidates(fitter);
        let started = Instant::now();
        let object = &self.object.simulated;
        let mut best: Option<(f64, usize, HandPose)> = None;
        for (number, touching) in candidates {
            let mut observe = |step: usize, _: &HandPose| self.observer.step(self.index, step);
            let fitted = fitter.refine(object.sdf(), &touching.pose, &mut observe);
            let projected = fitter.project(object.sdf(), &self.object.distance, &fitted.pose);
            let is_shallow = fitter.is_shallow(&projected);
            let rating = fitter.rating(object, &projected, self.settings.friction_coefficient);
            if is_shallow || best.as_ref().is_none_or(|(least, ..)| rating < *least) {
                best = Some((rating, number, projected.pose));
            }
            if is_shallow {
                break;
            }
        }
        let Some((_, number, pose)) = best else {
            return self.simulate_from_start();
        };
        let seconds = before + started.elapsed().as_secs_f64();
        let (losses, task_satisfied) = self.losses(fitter, &pose);
        let synthesis = Synthesis {
            pose: pose.clone(),
            losses,
            task_satisfied,
            steps: fitter.settings().iterations,
        };
        if !is_finite(&synthesis) {
            return Err(GraspError::Diverged { index: self.index });
        }
        Ok(Attempt {
            pose,
            synthesis: Some(synthesis),
            trajectory: self.trajectory(fitter, number),
            seconds,
        })
    }

    /// Starts that belong to this grasp, brought into contact, by rating: those whose numbers are `candidates` times
    /// the grasp's and the next. And the seconds that they took in sum.
    ///
    /// In parallel: where fewer grasps are left than there are threads, these are what can be shared.
    fn candidates(&self, fitter: &HandFitter<'_>) -> (Vec<(usize, FittedHand)>, f64) {
        let object = &self.object.simulated;
        let count = fitter.settings().candidates;
        let first = self.index.saturating_mul(count);
        let starts: Vec<usize> = (0..count).map(|k| first.saturating_add(k)).collect();
        let (mut near, before) = timed(&starts, |&number| {
            (
                number,
                fitter.approach(object.sdf(), &self.start(number), &mut |_, _| {}),
            )
        });
        near.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
        near.truncate(fitter.settings().promising);
        let (mut rated, seconds) = timed(&near, |(number, near)| {
            let fitted = fitter.contact(object.sdf(), &near.pose, &mut |_, _| {});
            let rating = fitter.rating(object, &fitted, self.settings.friction_coefficient);
            (rating, (*number, fitted))
        });
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rated = rated.into_iter().map(|(_, candidate)| candidate);
        (rated.collect(), before + seconds)
    }

    /// The losses of a pose, those of the forces by the force step; and whether these meet the task.
    fn losses(&self, fitter: &HandFitter<'_>, pose: &HandPose) -> (Losses, bool) {
        let object = &self.object.simulated;
        let (simulation, limit) = (self.settings.simulation(), self.settings.task_limit);
        let targets = fitter.force_step(object, &simulation, pose, limit);
        let mut scene = Scene::<f64>::new(self.hand, object, &simulation);
        scene.place(pose);
        let joints = self.hand.limits().unwrap_or_default();
        let losses = Losses {
            physics: targets.iter().map(|target| target.physics).sum(),
            task: targets.iter().map(|target| target.task).sum(),
            range: range_loss(&pose.articulation[..joints.len()], joints),
            limit: limit_loss(&pose.articulation[..joints.len()], joints),
            intersection: scene.intersection_loss(0.0),
        };
        (losses, losses.task < limit)
    }

    /// The way from the start of this number, if it was to be kept: it is gone once more.
    fn trajectory(&self, fitter: &HandFitter<'_>, number: usize) -> Vec<TrajectoryPoint> {
        let mut trajectory = Vec::new();
        let Some(every) = self.trajectory_every else {
            return trajectory;
        };
        let mut observe = |step: usize, pose: &HandPose| {
            if step.is_multiple_of(every.max(1)) {
                trajectory.push(TrajectoryPoint {
                    step,
                    pose: pose.clone(),
                    losses: self.losses(fitter, pose).0,
                });
            }
        };
        fitter.fit(
            self.object.simulated.sdf(),
            &self.start(number),
            &mut observe,
        );
        trajectory
    }
}

/// Makes something of each item, in parallel; and the seconds that all took in sum.
fn timed<T: Sync, R: Send>(items: &[T], make: impl Fn(&T) -> R + Sync) -> (Vec<R>, f64) {
    let made = items.par_iter().map(|item| {
        let started = Instant::now();
        (make(item), started.elapsed().as_secs_f64())
    });
    let (made, seconds): (Vec<R>, Vec<f64>) = made.unzip();
    (made, seconds.iter().sum())
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
