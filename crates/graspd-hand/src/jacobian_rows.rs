//! Rows of the Jacobian of points that are chosen anew in each iteration, for methods of second order.
//!
//! [`Kinematics::pullback`](crate::Kinematics::pullback) sums over all points at once. Least squares want the Jacobian
//! itself; in each row only the joints that move the row's points are not 0.

use graspd_geom::Vec3;

use crate::scratch::{HandPoint, PosedHand};

/// Constant forces on up to three points: the scalar sum of force . position, of which a row is the derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointForces {
    /// The points, and the force on each in the object frame; where there are fewer than three, with a force of 0.
    pub points: [(HandPoint, Vec3<f64>); 3],
}

/// The derivatives of several [`PointForces`] by the pose, one row each; filled by
/// [`Hand::jacobian_rows`](crate::Hand::jacobian_rows).
///
/// Columns are the coordinates z of [`Hand::jacobian_basis`](crate::Hand::jacobian_basis); those not mentioned are 0,
/// and none is mentioned twice in a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JacobianRows {
    base: Vec<[f64; 6]>,
    ends: Vec<usize>,
    entries: Vec<(u32, f64)>,
    /// Memory of hands of rigid links; empty but while they make the rows.
    pub(crate) screws: Vec<Screw>,
    /// Memory of mirrored hands, as empty.
    pub(crate) reflected: Vec<PointForces>,
}

/// How a body moves for a small change of the parameter of its joint: x -> x + turn x x + shift, in the frame of the
/// poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Screw {
    pub(crate) parent: usize,
    pub(crate) parameter: u32,
    pub(crate) turn: Vec3<f64>,
    pub(crate) shift: Vec3<f64>,
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
    /// Counts the rows.
    pub fn len(&self) -> usize {
        self.ends.len()
    }
    /// Tells whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
    /// Iterates over the rows.
    pub fn iter(&self) -> impl Iterator<Item = JacobianRow<'_>> {
        let mut start = 0;
        self.base.iter().zip(&self.ends).map(move |(base, &end)| {
            let entries = &self.entries[start..end];
            start = end;
            JacobianRow { base, entries }
        })
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        self.base.clear();
        self.ends.clear();
        self.entries.clear();
    }

    /// Adds `value` to a column of the row that is being made.
    #[inline]
    pub fn add(&mut self, column: u32, value: f64) {
        let start = self.ends.last().copied().unwrap_or(0);
        match self.entries[start..].iter_mut().find(|e| e.0 == column) {
            Some(entry) => entry.1 += value,
            None => self.entries.push((column, value)),
        }
    }

    /// Adds a column, which it does not have yet, to the row that is being made.
    #[inline]
    pub fn push(&mut self, column: u32, value: f64) {
        self.entries.push((column, value));
    }

    /// Ends the row that is being made, that of `forces` on a hand whose base is at `origin`.
    #[inline]
    pub fn end(&mut self, forces: &PointForces, posed: &PosedHand, origin: Vec3<f64>) {
        self.base.push(base_row(forces, posed, origin));
        self.ends.push(self.entries.len());
    }

    /// Replaces the derivatives by the base, row by row, by those of other forces.
    pub(crate) fn set_base(
        &mut self,
        forces: &[PointForces],
        posed: &PosedHand,
        origin: Vec3<f64>,
    ) {
        for (base, forces) in self.base.iter_mut().zip(forces) {
            *base = base_row(forces, posed, origin);
        }
    }
}

/// Computes the total force, and the torque about the base's origin.
#[inline]
fn base_row(forces: &PointForces, posed: &PosedHand, origin: Vec3<f64>) -> [f64; 6] {
    let (mut force, mut torque) = (Vec3::zero(), Vec3::zero());
    for &(point, own) in &forces.points {
        force += own;
        torque += (posed.position(point) - origin).cross(own);
    }
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}
