//! The cost of a pose, and its normal equations.

use graspd_geom::{SdfGrid, Vec3};
use graspd_hand::{Hand, HandPose, HandScratch, PointBuffer};
use nalgebra::{DMatrix, DVector, Vector3};

use super::cost::SkinCost;
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
    sdf: &'a SdfGrid,
    skin: &'a SkinSamples,
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
        sdf: &'a SdfGrid,
        skin: &'a SkinSamples,
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
            sdf,
            skin,
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
        self.skin.positions(&surface, &mut placement.positions);
        let outward = self.skin.normals(&surface);
        for (position, outward) in placement.positions.iter().zip(outward) {
            let (distance, gradient) = self.sdf.distance_and_gradient(Vec3::from(*position));
            let normal = Vector3::from(gradient.normalize_or_zero());
            placement.distance.push(distance);
            placement.normal.push(normal);
            placement.facing.push((-outward.dot(&normal)).max(0.0));
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
        skin + posture + self.intersection_factor * overlap
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
        // A hand moved as a whole overlaps itself as before.
        let mut overlap_by_pose = DMatrix::<f64>::zeros(unknowns, overlaps.len());
        let mut moved = pose.clone();
        let mut positions = Vec::new();
        for joint in 0..pose.articulation.len() {
            moved.articulation[joint] += DIFFERENCE;
            let surface = self.hand.surface(&moved);
            self.skin.positions(&surface, &mut positions);
            for (column, &(point, ..)) in active.iter().enumerate() {
                let change = positions[point] - placement.positions[point];
                by_pose[(6 + joint, column)] = change.dot(&placement.normal[point]) / DIFFERENCE;
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
