//! Steps of Levenberg-Marquardt.

use graspd_hand::{Hand, HandPose};
use nalgebra::{DMatrix, DVector};

use crate::cholesky::Cholesky;

/// Largest translation of the base in a step \[m\].
const MAX_TRANSLATION: f64 = 0.01;
/// Largest rotation of the base in a step \[rad\].
const MAX_ROTATION: f64 = 0.15;
/// Largest change of a joint in a step \[rad or m\].
const MAX_JOINT_STEP: f64 = 0.2;
/// Damping at first, relative to the matrix's diagonal, and its bounds.
const DAMPING: f64 = 1e-2;
const MIN_DAMPING: f64 = 1e-6;
const MAX_DAMPING: f64 = 1e6;
/// Factors on the damping after a step that helped and one that did not.
const EASING: f64 = 0.3;
const TIGHTENING: f64 = 8.0;
/// Damping after an iteration in which nothing helped: the next one has another cost, of which that says little.
const RESTART: f64 = 1.0;
/// Keeps the matrix definite where nothing depends on some joint, relative to its trace.
const REGULARIZATION: f64 = 1e-9;

/// The steps -(H + damping diag H)^-1 g of one cost after another, and the memory that they need.
pub(crate) struct LevenbergMarquardt {
    is_second_order: bool,
    damping: f64,
    has_moved: bool,
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Which unknowns are at a limit that the negative gradient points beyond.
    is_held: Vec<bool>,
    damped: DMatrix<f64>,
    step: DVector<f64>,
    cholesky: Cholesky,
}

impl LevenbergMarquardt {
    /// Makes those of `unknowns`; not of second order, H is its diagonal.
    pub(crate) fn new(unknowns: usize, is_second_order: bool) -> Self {
        Self {
            is_second_order,
            damping: DAMPING,
            has_moved: true,
            matrix: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            is_held: vec![false; unknowns],
            damped: DMatrix::zeros(unknowns, unknowns),
            step: DVector::zeros(unknowns),
            cholesky: Cholesky::default(),
        }
    }

    /// Newton's steps: without damping.
    pub(crate) fn undamped(unknowns: usize) -> Self {
        Self {
            damping: 0.0,
            ..Self::new(unknowns, true)
        }
    }

    /// Begins an iteration at a pose, with the Gauss-Newton matrix and gradient there.
    pub(crate) fn begin(
        &mut self,
        hand: &dyn Hand,
        pose: &HandPose,
        (matrix, gradient): (&DMatrix<f64>, &DVector<f64>),
    ) {
        if !self.has_moved {
            self.damping = RESTART;
        }
        self.has_moved = false;
        self.hold(hand, pose, gradient);
        self.set((matrix, gradient));
        if !self.is_second_order {
            self.matrix.fill_lower_triangle(0.0, 1);
            self.matrix.fill_upper_triangle(0.0, 1);
        }
    }

    /// Holds the joints that are at a limit which the negative gradient points beyond.
    pub(crate) fn hold(&mut self, hand: &dyn Hand, pose: &HandPose, gradient: &DVector<f64>) {
        for (joint, limit) in hand.limits().unwrap_or_default().iter().enumerate() {
            let (value, slope) = (pose.articulation[joint], gradient[6 + joint]);
            self.is_held[6 + joint] =
                (value <= limit.lower && slope > 0.0) || (value >= limit.upper && slope < 0.0);
        }
    }

    /// Sets H and g.
    pub(crate) fn set(&mut self, (matrix, gradient): (&DMatrix<f64>, &DVector<f64>)) {
        self.matrix.copy_from(matrix);
        self.gradient.copy_from(gradient);
    }

    /// Solves for the step among the unknowns that are not held; returns whether it could. Where nothing touches the
    /// matrix is 0, and so is the step.
    pub(crate) fn solve(&mut self) -> bool {
        let Self {
            matrix,
            damped,
            step,
            ..
        } = self;
        damped.copy_from(matrix);
        step.copy_from(&self.gradient);
        step.neg_mut();
        let floor = REGULARIZATION * matrix.trace() + f64::MIN_POSITIVE.sqrt();
        for (k, held) in self.is_held.iter().enumerate() {
            damped[(k, k)] += self.damping * matrix[(k, k)] + floor;
            if *held {
                let diagonal = damped[(k, k)];
                damped.row_mut(k).fill(0.0);
                damped.column_mut(k).fill(0.0);
                damped[(k, k)] = diagonal;
                step[k] = 0.0;
            }
        }
        self.cholesky.solve(damped, step)
    }

    /// The last step.
    pub(crate) fn solution(&self) -> &[f64] {
        self.step.as_slice()
    }

    /// Computes the step, shortened to the longest allowed; `None`, and more damping next time, if the matrix is not
    /// positive definite.
    pub(crate) fn step(&mut self) -> Option<&[f64]> {
        let is_solved = self.solve();
        let step = &mut self.step;
        let joints = step.rows(6, step.len() - 6);
        let excess = (step.fixed_rows::<3>(0).norm() / MAX_TRANSLATION)
            .max(step.fixed_rows::<3>(3).norm() / MAX_ROTATION)
            .max(joints.iter().fold(0.0, |most: f64, j| most.max(j.abs())) / MAX_JOINT_STEP);
        if !(is_solved && excess.is_finite()) {
            self.accept(false);
            return None;
        }
        *step /= excess.max(1.0);
        Some(self.solution())
    }

    /// Tells whether the step is taken, and returns that: the next one has less damping if it is, and more if not.
    pub(crate) fn accept(&mut self, is_better: bool) -> bool {
        let factor = if is_better { EASING } else { TIGHTENING };
        self.damping = (self.damping * factor).clamp(MIN_DAMPING, MAX_DAMPING);
        self.has_moved |= is_better;
        is_better
    }
}
