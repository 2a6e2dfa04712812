//! The cost of a pose, and its normal equations.

use graspd_hand::{Hand, HandPose, HandScratch, PointBuffer};
use nalgebra::{DMatrix, DVector, Vector3};

use super::core::HandCore;
use super::cost::SkinCost;
use super::field::DistanceField;
use super::settings::ConformitySettings;
use super::skin::SkinSamples;

/// Step of the one-sided differences by the joints \[rad or m\]: the surface is computed in double precision, and a
/// least-squares step needs no more than three digits.
const DIFFERENCE: f64 = 1e-5;
/// Self-intersections are counted in this unit \[m\].
const INTERSECTION_UNIT: f64 = 1e-3;
/// Joints with a smaller range than this count as if they had it \[rad\]: play is no reason to be stiff.
const LEAST_RANGE: f64 = 0.05;

/// Where the skin and the collision spheres of a posed hand are with respect to the object.
#[derive(Clone, Debug, Default)]
pub(super) struct Placement {
    positions: Vec<Vector3<f64>>,
    /// Signed distance of each point \[m\].
    pub(super) distance: Vec<f64>,
    /// The object's outward unit normal at each point, or 0.
    normal: Vec<Vector3<f64>>,
    /// How far each point faces the object: 0 to 1.
    facing: Vec<f64>,
    spheres: Vec<Vector3<f64>>,
    balls: Vec<Ball>,
}

/// A ball of the hand's core near the object.
#[derive(Clone, Copy, Debug)]
struct Ball {
    number: usize,
    center: Vector3<f64>,
    /// How much nearer the object is to its centre than its radius \[m\].
    lack: f64,
    /// The object's outward unit normal at its centre, or 0.
    normal: Vector3<f64>,
}

/// Points nearer to the object than this count as touching it \[m\].
const TOUCHING: f64 = 5e-4;

impl Placement {
    /// See [`FittedHand::imbalance`](super::FittedHand::imbalance).
    pub(super) fn imbalance(&self) -> f64 {
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for (i, &distance) in self.distance.iter().enumerate() {
            if distance < TOUCHING {
                sum += self.normal[i] * self.facing[i];
                total += self.facing[i];
            }
        }
        if total > 0.0 { sum.norm() / total } else { 1.0 }
    }
}

/// A pair of spheres that overlap.
struct Overlap {
    pair: [usize; 2],
    depth: f64,
    /// From the second to the first.
    direction: Vector3<f64>,
}

/// The cost as a function of the pose: that of all points of the skin, of posture and of self-intersection.
pub(super) struct PoseCost<'a> {
    hand: &'a dyn Hand,
    field: &'a dyn DistanceField,
    skin: &'a SkinSamples,
    core: &'a HandCore,
    /// The relaxed posture and the weight of each joint's distance from it.
    posture: Vec<(f64, f64)>,
    intersection_factor: f64,
    scratch: HandScratch,
    contacts: PointBuffer<f64>,
    spheres: PointBuffer<f64>,
}

impl<'a> PoseCost<'a> {
    pub(super) fn new(
        hand: &'a dyn Hand,
        field: &'a dyn DistanceField,
        skin: &'a SkinSamples,
        core: &'a HandCore,
        settings: &ConformitySettings,
    ) -> Self {
        let joints = hand.open_articulation().len();
        // Coefficients of hands in MANO's layout are counted from the relaxed hand.
        let relaxed_at_zero = hand.mano_shape().is_some();
        let posture = (0..joints).map(|joint| match hand.limits() {
            Some(limits) => {
                let limit = limits[joint];
                let range = limit.range().max(LEAST_RANGE);
                let middle = if relaxed_at_zero { 0.0 } else { limit.middle() };
                // An unlimited joint has no preference.
                (middle, settings.posture_weight / (range * range))
            }
            None => (0.0, settings.posture_weight),
        });
        Self {
            hand,
            field,
            skin,
            core,
            posture: posture.collect(),
            intersection_factor: settings.intersection_weight / INTERSECTION_UNIT.powi(2),
            scratch: hand.new_scratch(),
            contacts: PointBuffer::zeros(hand.contact_points().weight.len()),
            spheres: PointBuffer::zeros(hand.collision_spheres().radius.len()),
        }
    }

    /// Puts the hand somewhere.
    pub(super) fn place(&mut self, pose: &HandPose) -> Placement {
        let surface = self.hand.surface(pose);
        let mut placement = Placement::default();
        for point in 0..self.skin.len() {
            let (position, outward) = self.skin.point_and_normal(&surface, point);
            let (distance, normal) = self.field.distance_and_normal(&position);
            placement.positions.push(position);
            placement.distance.push(distance);
            placement.normal.push(normal);
            placement.facing.push((-outward.dot(&normal)).max(0.0));
        }
        for number in 0..self.core.len() {
            let center = self.core.center(&surface, number);
            let (distance, normal) = self.field.distance_and_normal(&center);
            let lack = self.core.radius(number) - distance;
            if lack > 0.0 {
                placement.balls.push(Ball {
                    number,
                    center,
                    lack,
                    normal,
                });
            }
        }
        placement.spheres = self.sphere_centers(pose);
        placement
    }

    fn sphere_centers(&mut self, pose: &HandPose) -> Vec<Vector3<f64>> {
        if self.intersection_factor == 0.0 || self.spheres.is_empty() {
            return Vec::new();
        }
        self.hand.forward(
            pose,
            &mut self.scratch,
            &mut self.contacts,
            &mut self.spheres,
        );
        (0..self.spheres.len())
            .map(|i| self.spheres.get(i).into())
            .collect()
    }

    fn overlaps(&self, placement: &Placement) -> Vec<Overlap> {
        if placement.spheres.is_empty() {
            return Vec::new();
        }
        let spheres = self.hand.collision_spheres();
        let overlap = |&[first, second]: &[u32; 2]| {
            let (first, second) = (first as usize, second as usize);
            let between = placement.spheres[first] - placement.spheres[second];
            let depth = spheres.radius[first] + spheres.radius[second] - between.norm();
            // No direction parts concentric spheres.
            let direction = between.try_normalize(0.0)?;
            (depth > 0.0).then_some(Overlap {
                pair: [first, second],
                depth,
                direction,
            })
        };
        spheres.pairs.iter().filter_map(overlap).collect()
    }

    /// The cost of a pose, placed.
    pub(super) fn value(&self, pose: &HandPose, placement: &Placement, cost: &SkinCost) -> f64 {
        let points = placement.distance.iter().zip(&placement.facing);
        let skin: f64 = points.map(|(&d, &facing)| cost.value(d, facing)).sum();
        let joints = pose.articulation.iter().zip(&self.posture);
        let posture: f64 = joints
            .map(|(value, (relaxed, weight))| weight * (value - relaxed).powi(2))
            .sum();
        let overlaps = self.overlaps(placement);
        let overlap: f64 = overlaps.iter().map(|o| o.depth * o.depth).sum();
        let core: f64 = (placement.balls.iter())
            .map(|ball| cost.core_value(ball.lack))
            .sum();
        skin + core + posture + self.intersection_factor * overlap
    }

    /// The Gauss-Newton matrix and the gradient of the cost by (translation, rotation vector in the object frame,
    /// joints).
    pub(super) fn normal_equations(
        &mut self,
        pose: &HandPose,
        placement: &Placement,
        cost: &SkinCost,
    ) -> (DMatrix<f64>, DVector<f64>) {
        // (point, slope, weight) of those that matter.
        let points = placement.distance.iter().zip(&placement.facing).enumerate();
        let active: Vec<(usize, f64, f64)> = points
            .filter_map(|(point, (&distance, &facing))| {
                let (slope, weight) = cost.slope_and_weight(distance, facing);
                (weight > 0.0).then_some((point, slope, weight))
            })
            .collect();
        let overlaps = self.overlaps(placement);
        let unknowns = 6 + pose.articulation.len();
        let mut by_pose = DMatrix::<f64>::zeros(unknowns, active.len());
        let origin = Vector3::from(pose.translation);
        for (mut row, &(point, ..)) in by_pose.column_iter_mut().zip(&active) {
            let normal = placement.normal[point];
            row.fixed_rows_mut::<3>(0).copy_from(&normal);
            let lever = placement.positions[point] - origin;
            row.fixed_rows_mut::<3>(3).copy_from(&lever.cross(&normal));
        }
        // (ball, slope and weight by the distance of its centre) of those that something has gone into.
        let cut: Vec<(&Ball, f64, f64)> = (placement.balls.iter())
            .filter_map(|ball| {
                let (slope, weight) = cost.core_slope_and_weight(ball.lack);
                (weight > 0.0).then_some((ball, slope, weight))
            })
            .collect();
        let mut core_by_pose = DMatrix::<f64>::zeros(unknowns, cut.len());
        for (mut row, &(ball, ..)) in core_by_pose.column_iter_mut().zip(&cut) {
            row.fixed_rows_mut::<3>(0).copy_from(&ball.normal);
            let lever = ball.center - origin;
            row.fixed_rows_mut::<3>(3)
                .copy_from(&lever.cross(&ball.normal));
        }
        // A hand moved as a whole overlaps itself as before.
        let mut overlap_by_pose = DMatrix::<f64>::zeros(unknowns, overlaps.len());
        let mut moved = pose.clone();
        for joint in 0..pose.articulation.len() {
            moved.articulation[joint] += DIFFERENCE;
            let surface = self.hand.surface(&moved);
            for (column, &(point, ..)) in active.iter().enumerate() {
                let change = self.skin.position(&surface, point) - placement.positions[point];
                by_pose[(6 + joint, column)] = change.dot(&placement.normal[point]) / DIFFERENCE;
            }
            for (column, &(ball, ..)) in cut.iter().enumerate() {
                let change = self.core.center(&surface, ball.number) - ball.center;
                core_by_pose[(6 + joint, column)] = change.dot(&ball.normal) / DIFFERENCE;
            }
            if !overlaps.is_empty() {
                let centers = self.sphere_centers(&moved);
                let change = |sphere: usize| centers[sphere] - placement.spheres[sphere];
                for (column, overlap) in overlaps.iter().enumerate() {
                    let [first, second] = overlap.pair;
                    let parting = (change(first) - change(second)).dot(&overlap.direction);
                    overlap_by_pose[(6 + joint, column)] = -parting / DIFFERENCE;
                }
            }
            moved.articulation[joint] = pose.articulation[joint];
        }

        let mut matrix = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut gradient = DVector::<f64>::zeros(unknowns);
        for (row, &(_, slope, weight)) in by_pose.column_iter().zip(&active) {
            matrix.syger(weight, &row, &row, 1.0);
            gradient.axpy(slope, &row, 1.0);
        }
        for (row, &(_, slope, weight)) in core_by_pose.column_iter().zip(&cut) {
            matrix.syger(weight, &row, &row, 1.0);
            gradient.axpy(slope, &row, 1.0);
        }
        let factor = 2.0 * self.intersection_factor;
        for (row, overlap) in overlap_by_pose.column_iter().zip(&overlaps) {
            matrix.syger(factor, &row, &row, 1.0);
            gradient.axpy(factor * overlap.depth, &row, 1.0);
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        for (joint, (value, (relaxed, weight))) in
            pose.articulation.iter().zip(&self.posture).enumerate()
        {
            matrix[(6 + joint, 6 + joint)] += 2.0 * weight;
            gradient[6 + joint] += 2.0 * weight * (value - relaxed);
        }
        (matrix, gradient)
    }
}
