//! The fit: Levenberg-Marquardt within the limits of the joints.

use graspd_geom::{Quaternion, SdfGrid, Vec3};
use graspd_hand::{Hand, HandPose, clamp_to_limits};
use graspd_settings::Validate;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::distance_field::DistanceField;
use crate::linearization::{Placement, PoseCost, TOUCHING};
use crate::medial_spheres::{HandSolids, MedialSpheres};
use crate::patches::SkinPatches;
use crate::settings::{CostStage, SkinFitSettings};
use crate::skin::SkinSamples;
use crate::{FitError, cholesky};

/// Depths up to this much beyond those asked for will do \[m\].
const SLACK: f64 = 3e-4;
/// Points that face the object by more than this count as contacts.
const MIN_FACING: f64 = 0.3;
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
/// Steps that are tried in one iteration.
const ATTEMPTS: usize = 6;
/// An iteration that lowers a cost by less than this part ends its stage, if the cost stays what it is.
const CONVERGED: f64 = 1e-4;
/// Keeps the matrix definite where nothing depends on some joint, relative to its trace.
const REGULARIZATION: f64 = 1e-9;

/// A hand fitted to an object.
#[derive(Clone, Debug)]
pub struct FittedHand {
    /// Where it is, its joints within their limits.
    pub pose: HandPose,
    /// The cost at the end, less than 0 where skin touches; in points of skin, each worth `area`.
    pub cost: f64,
    /// Area of the sampled skin inside the object \[m^2\].
    pub contact_area: f64,
    /// Length of the mean of the object's normals over the skin that touches, weighted by how far it faces the object:
    /// 1 where a flat hand presses against one side, 0 where hands press evenly from all sides, and 1 where none
    /// touches.
    pub imbalance: f64,
    /// Greatest depth of the sampled skin inside the object \[m\], 0 if none is.
    pub deepest: f64,
}

/// Fits one hand to objects; its skin is sampled once.
pub struct HandFitter<'a> {
    pub(crate) hand: &'a dyn Hand,
    pub(crate) settings: &'a SkinFitSettings,
    coarse: SkinSamples,
    fine: SkinSamples,
    /// For the projection, and for the depenetration after it.
    pub(crate) dense: SkinPatches,
    pub(crate) densest: SkinPatches,
    coarse_spheres: MedialSpheres,
    pub(crate) fine_spheres: MedialSpheres,
}

impl<'a> HandFitter<'a> {
    /// Samples the hand's skin.
    ///
    /// # Errors
    /// If a setting is out of range or the hand's surface is not closed.
    pub fn new(hand: &'a dyn Hand, settings: &'a SkinFitSettings) -> Result<Self, FitError> {
        settings.validate()?;
        let solids = HandSolids::new(hand)?;
        let skin = |count: usize| SkinSamples::on(&solids.open, &solids.open_distance, count);
        let spheres = |count: usize| MedialSpheres::new(&solids, count);
        let depths = settings.depths(hand.is_soft());
        let dense = |count: usize| SkinPatches::on(&solids.open, count);
        let ((dense, densest), ((coarse, fine), (coarse_spheres, fine_spheres))) = rayon::join(
            || {
                (
                    dense(depths.projection_samples),
                    dense(depths.check_samples),
                )
            },
            || {
                rayon::join(
                    || (skin(settings.coarse_samples), skin(settings.fine_samples)),
                    || {
                        (
                            spheres(settings.coarse_medial_spheres),
                            spheres(settings.fine_medial_spheres),
                        )
                    },
                )
            },
        );
        Ok(Self {
            hand,
            settings,
            coarse,
            fine,
            dense,
            densest,
            coarse_spheres,
            fine_spheres,
        })
    }

    pub(crate) fn is_soft(&self) -> bool {
        self.hand.is_soft()
    }

    /// Rates a fit, best first: its cost, discounted if it presses from one side only, where a hand
    /// can lean on an object but not hold it, and if it holds loosely, by `closure`: epsilon over a
    /// few of its [`HandFitter::contacts`].
    pub fn rating(&self, fitted: &FittedHand, closure: f64) -> f64 {
        let settings = self.settings;
        let discount = settings.imbalance_discount * fitted.imbalance;
        let looseness = 1.0 - (closure / settings.firm_closure).min(1.0);
        let share = (1.0 - discount) * (1.0 - settings.closure_discount * looseness);
        fitted.cost.min(0.0) * share + fitted.cost.max(0.0)
    }

    /// Returns point and inward unit normal, object frame, of the coarse skin points that touch the
    /// object and face it.
    pub fn contacts(&self, sdf: &SdfGrid, fitted: &FittedHand) -> Vec<[Vector3<f64>; 2]> {
        let vertices = self.hand.surface(&fitted.pose).vertices;
        let contact = |number: usize| {
            let p = self.coarse.position(&vertices, number);
            let (distance, gradient) = sdf.distance_and_gradient(p.into());
            let inward = -Vector3::from(gradient);
            let facing = inward.dot(&self.coarse.outward(&vertices, number));
            (distance < TOUCHING && facing > MIN_FACING).then_some([p, inward])
        };
        (0..self.coarse.len()).filter_map(contact).collect()
    }

    /// Returns how many starts are tried for each grasp.
    pub fn candidates(&self) -> usize {
        self.settings.candidates
    }

    /// Returns how many of them go through the second stage.
    pub fn promising(&self) -> usize {
        self.settings.promising
    }

    /// Returns how many of them are tried at most until one ends shallow enough.
    pub fn finalists(&self) -> usize {
        self.settings.finalists
    }

    /// Returns whether no sampled skin is much deeper than the limit.
    pub fn is_shallow(&self, fitted: &FittedHand) -> bool {
        fitted.deepest <= self.settings.depths(self.is_soft()).depth_limit + SLACK
    }

    /// Brings the hand to the object from a start some way off, with few points of its skin.
    pub fn coarse(&self, sdf: &SdfGrid, start: &HandPose) -> FittedHand {
        let stages = self.settings.coarse_stages(self.is_soft());
        self.run(sdf, &self.coarse, &self.coarse_spheres, &stages, start)
    }

    /// Runs the stage `approach` alone.
    pub fn approach(&self, sdf: &SdfGrid, start: &HandPose) -> FittedHand {
        let [approach, _] = self.settings.coarse_stages(self.is_soft());
        self.run(sdf, &self.coarse, &self.coarse_spheres, &[approach], start)
    }

    /// Runs the stage `contact` alone.
    pub fn contact(&self, sdf: &SdfGrid, start: &HandPose) -> FittedHand {
        let [_, contact] = self.settings.coarse_stages(self.is_soft());
        self.run(sdf, &self.coarse, &self.coarse_spheres, &[contact], start)
    }

    /// Fits a hand that touches already.
    pub fn fine(&self, sdf: &SdfGrid, start: &HandPose) -> FittedHand {
        let stages = self.settings.fine_stages(self.is_soft());
        self.run(sdf, &self.fine, &self.fine_spheres, &stages, start)
    }

    /// Runs the stages one after the other.
    ///
    /// Within an iteration the cost is fixed and a step is taken only if it lowers it; from one
    /// iteration to the next the reach shrinks. Joints at a limit that the gradient pushes beyond
    /// it are left where they are for that step.
    pub(crate) fn run(
        &self,
        field: &dyn DistanceField,
        skin: &SkinSamples,
        spheres: &MedialSpheres,
        stages: &[CostStage],
        start: &HandPose,
    ) -> FittedHand {
        let hand = self.hand;
        let farthest = stages.iter().map(CostStage::farthest).fold(0.0, f64::max);
        let mut cost_of = PoseCost::new(hand, field, skin, spheres, self.settings, farthest);
        let mut pose = start.clone();
        if let Some(limits) = hand.limits() {
            clamp_to_limits(&mut pose.articulation, limits);
        }
        let (mut placement, mut next_placement) = (Placement::default(), Placement::default());
        cost_of.place(&pose, None, &mut placement);
        let mut damping = DAMPING;
        let mut last = f64::INFINITY;
        for stage in stages {
            for iteration in 0..stage.iterations {
                let cost = stage.cost(iteration);
                last = cost_of.value(&pose, &placement, &cost);
                let (matrix, gradient) = cost_of.normal_equations(&pose, &placement, &cost);
                let is_held = held_joints(hand, &pose, &gradient);
                let mut is_better = false;
                let before = last;
                for _ in 0..ATTEMPTS {
                    let Some(step) = damped_step(&matrix, &gradient, &is_held, damping) else {
                        damping = (damping * TIGHTENING).min(MAX_DAMPING);
                        continue;
                    };
                    let next = moved(hand, &pose, &step);
                    cost_of.place(&next, Some(&placement), &mut next_placement);
                    let value = cost_of.value(&next, &next_placement, &cost);
                    is_better = value < last;
                    if is_better {
                        (pose, last) = (next, value);
                        std::mem::swap(&mut placement, &mut next_placement);
                        damping = (damping * EASING).max(MIN_DAMPING);
                        break;
                    }
                    damping = (damping * TIGHTENING).min(MAX_DAMPING);
                }
                if !is_better {
                    // The next iteration has another cost: what failed for this one says little about it.
                    damping = 1.0;
                }
                if stage.is_constant() && before - last <= CONVERGED * before.abs() {
                    break;
                }
            }
        }
        fitted(skin, pose, &placement, last / skin.density())
    }
}

fn fitted(skin: &SkinSamples, pose: HandPose, placement: &Placement, cost: f64) -> FittedHand {
    let inside = placement.distances().filter(|&d| d < 0.0);
    FittedHand {
        pose,
        cost,
        imbalance: placement.imbalance(),
        contact_area: inside.clone().count() as f64 * skin.area(),
        deepest: inside.fold(0.0, |deepest: f64, d| deepest.max(-d)),
    }
}

/// Which unknowns are at a limit that the negative gradient points beyond.
fn held_joints(hand: &dyn Hand, pose: &HandPose, gradient: &DVector<f64>) -> Vec<bool> {
    let mut is_held = vec![false; gradient.len()];
    if let Some(limits) = hand.limits() {
        let joints = pose.articulation.iter().zip(limits);
        for (joint, (&value, limit)) in joints.enumerate() {
            let slope = gradient[6 + joint];
            is_held[6 + joint] =
                (value <= limit.lower && slope > 0.0) || (value >= limit.upper && slope < 0.0);
        }
    }
    is_held
}

/// -(H + damping diag H)^-1 g among the unknowns that are not held, shortened to the longest steps allowed; `None` if
/// the matrix is not positive definite.
fn damped_step(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    is_held: &[bool],
    damping: f64,
) -> Option<DVector<f64>> {
    let mut damped = matrix.clone();
    let mut right = -gradient;
    // Where nothing touches the matrix is 0, and so is the step.
    let floor = REGULARIZATION * matrix.trace() + f64::MIN_POSITIVE.sqrt();
    for (k, held) in is_held.iter().enumerate() {
        damped[(k, k)] += damping * matrix[(k, k)] + floor;
        if *held {
            let diagonal = damped[(k, k)];
            damped.row_mut(k).fill(0.0);
            damped.column_mut(k).fill(0.0);
            damped[(k, k)] = diagonal;
            right[k] = 0.0;
        }
    }
    let step = cholesky::solve(damped, right)?;
    let joints = step.rows(6, step.len() - 6);
    let excess = (step.fixed_rows::<3>(0).norm() / MAX_TRANSLATION)
        .max(step.fixed_rows::<3>(3).norm() / MAX_ROTATION)
        .max(joints.iter().fold(0.0, |most: f64, j| most.max(j.abs())) / MAX_JOINT_STEP);
    excess.is_finite().then(|| step / excess.max(1.0))
}

fn moved(hand: &dyn Hand, pose: &HandPose, step: &DVector<f64>) -> HandPose {
    let mut next = pose.clone();
    next.translation += Vec3::new(step[0], step[1], step[2]);
    let turn = Quaternion::exp(Vec3::new(step[3], step[4], step[5]));
    next.rotation = turn.compose(pose.rotation).normalize();
    for (value, change) in next.articulation.iter_mut().zip(step.iter().skip(6)) {
        *value += change;
    }
    if let Some(limits) = hand.limits() {
        clamp_to_limits(&mut next.articulation, limits);
    }
    next
}

/// Fits a hand to an object: the pose, near `start`, in which as much skin as possible lies a fraction of a millimetre
/// inside the object's surface and none much deeper.
///
/// Levenberg-Marquardt on the base and all joints at once, within the joints' limits, first with
/// few points of the skin that feel the object from afar, then with many that feel it only close
/// by. `start` may be some way off.
///
/// # Errors
/// If a setting is out of range or the hand's surface is not closed.
pub fn fit_hand(
    hand: &dyn Hand,
    sdf: &SdfGrid,
    start: &HandPose,
    settings: &SkinFitSettings,
) -> Result<FittedHand, FitError> {
    let fitter = HandFitter::new(hand, settings)?;
    let near = fitter.coarse(sdf, start);
    Ok(fitter.fine(sdf, &near.pose))
}
