//! A hand placed at an object: where its points are, and how deep.

use graspd_geom::{SdfGrid, Vec3};
use graspd_hand::{Hand, HandPose, HandScratch, Kinematics, PointBuffer};

/// A hand at an object, with the working memory for placing it.
pub(super) struct Probe<'a> {
    pub(super) hand: &'a dyn Hand,
    pub(super) sdf: &'a SdfGrid,
    scratch: HandScratch,
    points: PointBuffer<f64>,
    spheres: PointBuffer<f64>,
    /// Numbers of the points that count.
    pub(super) numbers: Vec<usize>,
}

impl<'a> Probe<'a> {
    pub(super) fn new(hand: &'a dyn Hand, sdf: &'a SdfGrid) -> Self {
        let weight = &hand.contact_points().weight;
        let counts = weight.iter().enumerate();
        Self {
            hand,
            sdf,
            scratch: hand.new_scratch(),
            points: PointBuffer::zeros(weight.len()),
            spheres: PointBuffer::zeros(hand.collision_spheres().radius.len()),
            numbers: (counts.filter(|(_, weight)| **weight > 0.0))
                .map(|(number, _)| number)
                .collect(),
        }
    }

    pub(super) fn place(&mut self, pose: &HandPose) {
        Kinematics::<f64>::forward(
            self.hand,
            pose,
            &mut self.scratch,
            &mut self.points,
            &mut self.spheres,
        );
    }

    pub(super) fn point(&self, number: usize) -> Vec3<f64> {
        self.points.get(number)
    }

    /// Every `1 / share` of the points that count, at least one.
    pub(super) fn thinned(&self, count: usize) -> Vec<usize> {
        let step = self.numbers.len().div_ceil(count.max(1)).max(1);
        self.numbers.iter().copied().step_by(step).collect()
    }

    /// Whether one of the points is inside the object.
    pub(super) fn enters(&self, numbers: &[usize]) -> bool {
        (numbers.iter()).any(|&number| self.sdf.distance(self.point(number)) < 0.0)
    }

    /// The sum over all points of how much deeper than `allowed` they are \[m\].
    pub(super) fn excess(&self, allowed: f64) -> f64 {
        let depth = |&number: &usize| -self.sdf.distance(self.point(number));
        self.numbers
            .iter()
            .map(|n| (depth(n) - allowed).max(0.0))
            .sum()
    }

    /// The sum over the pairs of the hand's spheres of how far they overlap \[m\].
    pub(super) fn overlap(&self) -> f64 {
        let spheres = self.hand.collision_spheres();
        let overlap = |&[first, second]: &[u32; 2]| {
            let (a, b) = (first as usize, second as usize);
            let distance = (self.spheres.get(a) - self.spheres.get(b)).norm();
            (spheres.radius[a] + spheres.radius[b] - distance).max(0.0)
        };
        spheres.pairs.iter().map(overlap).sum()
    }
}
