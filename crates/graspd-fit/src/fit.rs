//! The fit: Levenberg-Marquardt within the limits of the joints, while the contact law's smoothing falls.

use graspd_geom::{Quaternion, SdfGrid, Vec3};
use graspd_hand::{Hand, HandPose, clamp_to_limits};
use graspd_settings::Validate;
use rayon::join;

use crate::FitError;
use crate::cost::ContactCost;
use crate::distance_field::DistanceField;
use crate::levenberg_marquardt::LevenbergMarquardt;
use crate::linearization::{Placement, PoseCost};
use crate::medial_spheres::{HandSolids, MedialSpheres};
use crate::patches::SkinPatches;
use crate::settings::SkinFitSettings;
use crate::skin::SkinSamples;

/// Depths up to this much beyond those asked for will do \[m\].
const SLACK: f64 = 3e-4;
/// Steps that are tried in one iteration.
const ATTEMPTS: usize = 6;
/// An iteration that lowers a cost by less than this part ends the fit, if the cost stays what it is.
const CONVERGED: f64 = 1e-4;

/// A hand fitted to an object.
#[derive(Clone, Debug)]
pub struct FittedHand {
    /// Where it is, its joints within their limits.
    pub pose: HandPose,
    /// The cost at the end, less than 0 where skin touches; in points of skin.
    pub cost: f64,
    /// Area of the sampled skin inside the object \[m^2\].
    pub contact_area: f64,
    /// Greatest depth of the sampled skin inside the object \[m\], 0 if none is.
    pub deepest: f64,
}

/// Samples of a hand by which its cost is computed.
pub(crate) struct HandSamples {
    pub(crate) skin: SkinSamples,
    pub(crate) spheres: MedialSpheres,
}

/// Sees the number of an iteration and the pose before it.
pub type FitObserver<'a> = &'a mut dyn FnMut(usize, &HandPose);

/// Fits one hand to objects; its skin is sampled once.
pub struct HandFitter<'a> {
    pub(crate) hand: &'a dyn Hand,
    pub(crate) settings: &'a SkinFitSettings,
    coarse: HandSamples,
    pub(crate) fine: HandSamples,
    /// For the projection, and for the depenetration after it.
    pub(crate) dense: SkinPatches,
}

impl<'a> HandFitter<'a> {
    /// Samples the hand's skin.
    ///
    /// # Errors
    /// If a setting is out of range or the hand's surface is not closed.
    pub fn new(hand: &'a dyn Hand, settings: &'a SkinFitSettings) -> Result<Self, FitError> {
        settings.validate()?;
        let solids = HandSolids::new(hand)?;
        let samples = |count: usize| HandSamples {
            skin: SkinSamples::on(&solids.open, &solids.open_distance, count),
            spheres: MedialSpheres::new(&solids, count),
        };
        let dense_samples = settings.depths(hand.is_soft()).dense_samples;
        let (dense, (coarse, fine)) = join(
            || SkinPatches::on(&solids.open, dense_samples),
            || {
                join(
                    || samples(settings.coarse_samples),
                    || samples(settings.fine_samples),
                )
            },
        );
        Ok(Self {
            hand,
            settings,
            coarse,
            fine,
            dense,
        })
    }

    /// Returns the settings.
    pub fn settings(&self) -> &SkinFitSettings {
        self.settings
    }

    pub(crate) fn is_soft(&self) -> bool {
        self.hand.is_soft()
    }

    /// Returns whether no sampled skin is much deeper than the limit.
    pub fn is_shallow(&self, fitted: &FittedHand) -> bool {
        fitted.deepest <= self.settings.depths(self.is_soft()).depth_limit + SLACK
    }

    /// Brings the hand to the object from a start some way off, with few points of its skin.
    ///
    /// The schedule begins where the smoothing is the hand's distance from the object.
    pub fn approach(
        &self,
        sdf: &SdfGrid,
        start: &HandPose,
        observe: FitObserver<'_>,
    ) -> FittedHand {
        let [end, ..] = self.settings.ends();
        let first = self.first_iteration(sdf, start).min(end);
        self.follow(sdf, &self.coarse, first..end, start, observe)
    }

    /// Brings a hand that is near into contact.
    pub fn contact(&self, sdf: &SdfGrid, near: &HandPose, observe: FitObserver<'_>) -> FittedHand {
        let [start, end, _] = self.settings.ends();
        self.follow(sdf, &self.coarse, start..end, near, observe)
    }

    /// Fits a hand that touches already, with many points of its skin.
    pub fn refine(
        &self,
        sdf: &SdfGrid,
        touching: &HandPose,
        observe: FitObserver<'_>,
    ) -> FittedHand {
        let [_, start, end] = self.settings.ends();
        self.follow(sdf, &self.fine, start..end, touching, observe)
    }

    /// Fits the hand from a start some way off: [`HandFitter::approach`], [`HandFitter::contact`] and
    /// [`HandFitter::refine`].
    pub fn fit(&self, sdf: &SdfGrid, start: &HandPose, observe: FitObserver<'_>) -> FittedHand {
        let near = self.approach(sdf, start, observe);
        let touching = self.contact(sdf, &near.pose, observe);
        self.refine(sdf, &touching.pose, observe)
    }

    /// Returns the first iteration whose smoothing is no more than the hand's distance from the object.
    fn first_iteration(&self, sdf: &SdfGrid, start: &HandPose) -> usize {
        let vertices = self.hand.surface(start).vertices;
        let skin = &self.coarse.skin;
        let distance = |point| sdf.distance(skin.position(&vertices, point).into());
        let closest = (0..skin.len()).map(distance).fold(f64::INFINITY, f64::min);
        let mut iterations = 0..self.settings.iterations;
        let is_near = |k: &usize| self.settings.smoothing(*k) <= closest.max(0.0);
        iterations.find(is_near).unwrap_or_default()
    }

    /// Runs the iterations of these numbers.
    fn follow(
        &self,
        sdf: &SdfGrid,
        samples: &HandSamples,
        iterations: std::ops::Range<usize>,
        start: &HandPose,
        observe: FitObserver<'_>,
    ) -> FittedHand {
        let first = iterations.start;
        let costs: Vec<_> = iterations
            .map(|k| self.settings.cost(k, self.is_soft()))
            .collect();
        self.run(
            sdf,
            (&samples.skin, &samples.spheres),
            &costs,
            start,
            &mut |k, pose| {
                observe(first + k, pose);
            },
        )
    }

    /// Minimises the costs one after the other, in one iteration each.
    ///
    /// Within an iteration a step is taken only if it lowers that iteration's cost. Joints at a limit that the
    /// gradient pushes beyond it are left where they are for that step.
    pub(crate) fn run(
        &self,
        field: &dyn DistanceField,
        (skin, spheres): (&SkinSamples, &MedialSpheres),
        costs: &[ContactCost],
        start: &HandPose,
        observe: FitObserver<'_>,
    ) -> FittedHand {
        let hand = self.hand;
        let farthest = costs.iter().map(ContactCost::farthest).fold(0.0, f64::max);
        let mut cost_of = PoseCost::new(hand, field, skin, spheres, self.settings, farthest);
        let mut pose = start.clone();
        if let Some(limits) = hand.limits() {
            clamp_to_limits(&mut pose.articulation, limits);
        }
        let mut next = pose.clone();
        let (mut placement, mut next_placement) = (Placement::default(), Placement::default());
        cost_of.place(&pose, None, &mut placement);
        let unknowns = 6 + pose.articulation.len();
        let mut steps = LevenbergMarquardt::new(unknowns, self.settings.second_order);
        let mut value = f64::INFINITY;
        for (iteration, cost) in costs.iter().enumerate() {
            observe(iteration, &pose);
            value = cost_of.value(&pose, &placement, cost);
            let before = value;
            steps.begin(
                hand,
                &pose,
                cost_of.normal_equations(&pose, &placement, cost),
            );
            for _ in 0..ATTEMPTS {
                let Some(step) = steps.step() else { continue };
                move_along(hand, &pose, step, &mut next);
                cost_of.place(&next, Some(&placement), &mut next_placement);
                let reached = cost_of.value(&next, &next_placement, cost);
                if steps.accept(reached < value) {
                    std::mem::swap(&mut pose, &mut next);
                    std::mem::swap(&mut placement, &mut next_placement);
                    value = reached;
                    break;
                }
            }
            let stays = costs.get(iteration + 1) == Some(cost);
            if stays && before - value <= CONVERGED * before.abs() {
                break;
            }
        }
        fitted(skin, pose, &placement, value)
    }
}

fn fitted(skin: &SkinSamples, pose: HandPose, placement: &Placement, cost: f64) -> FittedHand {
    let inside = placement.distances().filter(|&d| d < 0.0);
    FittedHand {
        pose,
        cost,
        contact_area: inside.clone().count() as f64 * skin.area(),
        deepest: inside.fold(0.0, |deepest: f64, d| deepest.max(-d)),
    }
}

/// Moves `pose` by (translation, rotation vector, joints), within the limits of the joints, to `next`.
pub(crate) fn move_along(hand: &dyn Hand, pose: &HandPose, step: &[f64], next: &mut HandPose) {
    next.translation = pose.translation + Vec3::new(step[0], step[1], step[2]);
    let turn = Quaternion::exp(Vec3::new(step[3], step[4], step[5]));
    next.rotation = turn.compose(pose.rotation).normalize();
    let joints = pose.articulation.iter().zip(&step[6..]);
    for (next, (value, change)) in next.articulation.iter_mut().zip(joints) {
        *next = value + change;
    }
    if let Some(limits) = hand.limits() {
        clamp_to_limits(&mut next.articulation, limits);
    }
}
