//! Points that follow a hand, and how its articulation moves them: row by row, for methods of second order.
//!
//! [`Kinematics::pullback`](crate::Kinematics::pullback) sums over all points at once. Least squares want the Jacobian
//! itself, of points that are chosen anew in each iteration; of each row only the joints that the points hang on are
//! not 0.

use graspd_geom::{Rigid, Vec3};
use nalgebra::{DMatrix, Point3};

use crate::mano::PosedSkin;
use crate::{Hand, HandPose, PointBuffer};

/// Half width of the central differences that stand in where a hand has no derivatives of its own \[rad or m\].
const DIFFERENCE: f64 = 1e-6;

/// Where the points of a hand are in one pose, object frame; filled by [`Hand::place`].
#[derive(Clone, Debug, Default)]
pub struct PosedHand {
    /// The vertices of [`Hand::surface`] \[m\].
    pub vertices: Vec<Point3<f64>>,
    /// The centres of [`Hand::collision_spheres`] \[m\], `[s]`.
    pub spheres: Vec<Point3<f64>>,
    /// The bodies of a hand of rigid links.
    pub(crate) bodies: Vec<Rigid<f64>>,
    /// What a skinned hand keeps.
    pub(crate) skin: PosedSkin,
    /// The original of a mirrored hand.
    pub(crate) original: Option<Box<PosedHand>>,
}

/// A point that follows a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandPoint {
    /// A vertex of [`Hand::surface`].
    Vertex(u32),
    /// The centre of a collision sphere.
    Sphere(u32),
}

/// Forces on up to three points: the scalar sum of force . position, for forces that stay what they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointForces {
    /// The points, and the force on each in the object frame; where there are fewer than three, with a force of 0.
    pub points: [(HandPoint, Vec3<f64>); 3],
}

/// The derivatives of [`PointForces`]s, one row each; filled by [`Hand::jacobian_rows`].
///
/// Columns are the coordinates z of [`Hand::jacobian_basis`]; those not mentioned are 0, and none is mentioned twice in a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JacobianRows {
    base: Vec<[f64; 6]>,
    ends: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JacobianRow<'a> {
    /// The derivatives by the base's position and by a rotation vector about its origin, both in the object frame.
    pub base: &'a [f64; 6],
    /// Columns, and the derivatives by them.
    pub entries: &'a [(u32, f64)],
}

impl JacobianRows {
    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
    /// The rows.
    pub fn iter(&self) -> impl Iterator<Item = JacobianRow<'_>> {
        let mut start = 0;
        self.base.iter().zip(&self.ends).map(move |(base, &end)| {
            let entries = &self.entries[start..end];
            start = end;
            JacobianRow { base, entries }
        })
    }

    pub(crate) fn clear(&mut self) {
        self.base.clear();
        self.ends.clear();
        self.entries.clear();
    }

    /// Adds to a column of the row that is being made.
    #[inline]
    pub(crate) fn add(&mut self, column: u32, value: f64) {
        let start = self.ends.last().copied().unwrap_or(0);
        match self.entries[start..].iter_mut().find(|e| e.0 == column) {
            Some(entry) => entry.1 += value,
            None => self.entries.push((column, value)),
        }
    }

    /// Adds a column, which it does not have yet, to the row that is being made.
    #[inline]
    pub(crate) fn push(&mut self, column: u32, value: f64) {
        self.entries.push((column, value));
    }

    /// Ends the row that is being made: that of a pull on a hand whose base is at `origin`.
    #[inline]
    pub(crate) fn end(&mut self, pull: &PointForces, posed: &PosedHand, origin: Vec3<f64>) {
        self.base.push(base_row(pull, posed, origin));
        self.ends.push(self.entries.len());
    }

    /// Makes the rows those of other pulls as far as the base goes.
    pub(crate) fn set_base(&mut self, pulls: &[PointForces], posed: &PosedHand, origin: Vec3<f64>) {
        for (base, pull) in self.base.iter_mut().zip(pulls) {
            *base = base_row(pull, posed, origin);
        }
    }
}

/// The force, and the torque about the base's origin.
#[inline]
fn base_row(pull: &PointForces, posed: &PosedHand, origin: Vec3<f64>) -> [f64; 6] {
    let (mut force, mut torque) = (Vec3::zero(), Vec3::zero());
    for &(point, own) in &pull.points {
        force += own;
        torque += (posed.position(point) - origin).cross(own);
    }
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

impl PosedHand {
    /// Where a point is.
    ///
    /// # Panics
    /// If the hand has no such point.
    #[inline]
    pub fn position(&self, point: HandPoint) -> Vec3<f64> {
        match point {
            HandPoint::Vertex(vertex) => self.vertices[vertex as usize].into(),
            HandPoint::Sphere(sphere) => self.spheres[sphere as usize].into(),
        }
    }
}

/// [`Hand::place`] by way of [`Hand::surface`] and [`Kinematics::forward`](crate::Kinematics::forward): what the others are tested against.
pub fn pose_by_forward<H: Hand + ?Sized>(hand: &H, pose: &HandPose, posed: &mut PosedHand) {
    let mut contacts = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::<f64>::zeros(hand.collision_spheres().radius.len());
    hand.forward(pose, &mut hand.new_scratch(), &mut contacts, &mut spheres);
    posed.vertices = hand.surface(pose).vertices;
    posed.spheres.clear();
    posed
        .spheres
        .extend((0..spheres.len()).map(|sphere| Point3::from(spheres.get(sphere))));
}

/// [`Hand::jacobian_rows`] by the articulation, by central differences of [`Hand::place`]: what the others are tested
/// against.
pub fn jacobian_rows_by_differences<H: Hand + ?Sized>(
    hand: &H,
    pose: &HandPose,
    posed: &PosedHand,
    pulls: &[PointForces],
    rows: &mut JacobianRows,
) {
    let joints = pose.articulation.len();
    let mut by_joint = DMatrix::<f64>::zeros(joints, pulls.len());
    let mut moved = pose.clone();
    let mut ends = [PosedHand::default(), PosedHand::default()];
    for joint in 0..joints {
        for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
            moved.articulation[joint] = pose.articulation[joint] + sign * DIFFERENCE;
            hand.place(&moved, end);
        }
        moved.articulation[joint] = pose.articulation[joint];
        let [before, after] = &ends;
        for (row, pull) in pulls.iter().enumerate() {
            let change = |&(point, force): &(HandPoint, Vec3<f64>)| {
                (after.position(point) - before.position(point)).dot(force)
            };
            by_joint[(joint, row)] =
                pull.points.iter().map(change).sum::<f64>() / (2.0 * DIFFERENCE);
        }
    }
    rows.clear();
    for (row, pull) in pulls.iter().enumerate() {
        for joint in 0..joints {
            rows.push(joint as u32, by_joint[(joint, row)]);
        }
        rows.end(pull, posed, pose.translation);
    }
}
