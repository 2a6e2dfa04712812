//! Contact constraints on a rigid body: normal impulses, solved one point or two points at a time,
//! and Coulomb friction.
//!
//! Impulses are those on a body of 1 kg \[m/s\]. The next normal impulse is `s max(0, l - m (J v +
//! b))`: l is the last one, m = 1 / (J M^-1 J^T) the effective mass, J v the speed at which the
//! point opens, b the bias (the speed at which it may close), and s <= 1 the softness.
//!
//! All constraints act on the same body, so that each waits for the one before: the latency from
//! velocity to velocity decides the speed. Everything that does not depend on the velocity is
//! therefore precomputed, and unloaded points leave the velocity alone.
//!
//! # Source
//! Soft constraints: E. Catto, "Soft constraints", GDC 2011. Two points at a time: the block solver of Box2D, a linear
//! complementarity problem, with softness as in rapier 0.36.

use parry3d_f64::math::{Matrix, Vector};

use super::rigid_body::Velocity;

/// Two points are solved together if the determinant of their inverse mass matrix exceeds this
/// fraction of the product of its diagonal: otherwise they nearly coincide, and the split of the
/// load is undetermined.
const MIN_CONDITION: f64 = 0.01;

/// Row of the contact Jacobian for one direction, and the velocity change of a unit impulse along it.
#[derive(Clone, Copy)]
pub(super) struct JacobianRow {
    pub(super) direction: Vector,
    /// Torque of a unit impulse about the centre of mass.
    torque: Vector,
    /// Change of the angular velocity by a unit impulse.
    spin: Vector,
}

impl JacobianRow {
    /// Builds the row of `direction` at `arm` from the centre of mass.
    pub(super) fn new(direction: Vector, arm: Vector, inverse_inertia: &Matrix) -> Self {
        let torque = arm.cross(direction);
        let spin = *inverse_inertia * torque;
        Self {
            direction,
            torque,
            spin,
        }
    }

    /// Returns the change of speed along this row by a unit impulse along another.
    fn response(&self, other: &Self) -> f64 {
        self.direction.dot(other.direction) + self.spin.dot(other.torque)
    }

    #[inline(always)]
    fn speed(&self, velocity: &Velocity) -> f64 {
        self.direction.dot(velocity.linear) + self.torque.dot(velocity.angular)
    }

    #[inline(always)]
    fn apply(&self, impulse: f64, velocity: &mut Velocity) {
        velocity.linear += self.direction * impulse;
        velocity.angular += self.spin * impulse;
    }
}

/// Non-penetration constraint of one point along its normal, which points from the hand into the object.
#[derive(Clone, Copy)]
pub(super) struct NormalConstraint {
    pub(super) row: JacobianRow,
    /// Effective mass, for a body of 1 kg.
    mass: f64,
    /// Largest speed at which it may close \[m/s\]; negative where it has to open.
    pub(super) target: f64,
    /// Factor on impulses; 1 for a rigid contact.
    pub(super) softness: f64,
    pub(super) impulse: f64,
}

impl NormalConstraint {
    pub(super) fn new(row: JacobianRow, impulse: f64) -> Self {
        Self {
            row,
            mass: 1.0 / row.response(&row),
            target: 0.0,
            softness: 1.0,
            impulse,
        }
    }

    /// Applies the accumulated impulse.
    pub(super) fn warm_start(&self, velocity: &mut Velocity) {
        self.row.apply(self.impulse, velocity);
    }

    /// Solves this constraint alone.
    #[inline(always)]
    pub(super) fn solve(&mut self, velocity: &mut Velocity) {
        let speed = self.row.speed(velocity) + self.target;
        let next = self.impulse - self.mass * speed;
        let next = if next > 0.0 {
            self.softness * next
        } else {
            0.0
        };
        self.change_to(next, velocity);
    }

    /// Applies restitution: makes a loaded point separate at `speed`.
    pub(super) fn bounce(&mut self, speed: f64, velocity: &mut Velocity) {
        let missing = self.row.speed(velocity) - speed;
        let next = (self.impulse - self.mass * missing).max(0.0);
        self.change_to(next, velocity);
    }

    #[inline(always)]
    fn change_to(&mut self, next: f64, velocity: &mut Velocity) {
        let change = next - self.impulse;
        if change != 0.0 {
            self.impulse = next;
            self.row.apply(change, velocity);
        }
    }
}

/// Block solver of two points of one manifold.
#[derive(Clone, Copy)]
pub(super) struct NormalPair {
    /// Inverse mass matrix: first, mixed and second element.
    inverse_masses: [f64; 3],
    /// Inverse of the same with softness.
    solution: [f64; 3],
    /// Effective mass of each point alone, with softness.
    alone: [f64; 2],
    has_solution: bool,
}

impl NormalPair {
    /// Couples two points with one normal; `None` where they are better solved one after the other.
    pub(super) fn new(a: &NormalConstraint, b: &NormalConstraint) -> Option<Self> {
        let [k_aa, k_ab, k_bb] = [
            a.row.response(&a.row),
            a.row.response(&b.row),
            b.row.response(&b.row),
        ];
        (k_aa * k_bb - k_ab * k_ab > MIN_CONDITION * k_aa * k_bb).then_some(Self {
            inverse_masses: [k_aa, k_ab, k_bb],
            solution: [0.0; 3],
            alone: [0.0; 2],
            has_solution: false,
        })
    }

    /// Takes over the softness of both.
    pub(super) fn soften(&mut self, a: &NormalConstraint, b: &NormalConstraint) {
        let [k_aa, k_ab, k_bb] = self.inverse_masses;
        let (k_aa, k_bb) = (k_aa / a.softness, k_bb / b.softness);
        let determinant = k_aa * k_bb - k_ab * k_ab;
        self.has_solution = determinant > 0.0;
        self.solution = [k_bb, k_ab, k_aa].map(|element| element / determinant);
        self.alone = [1.0 / k_aa, 1.0 / k_bb];
    }

    /// Finds impulses x, y >= 0 such that each point is either unloaded and opening fast enough, or
    /// exactly at its target speed.
    #[inline(always)]
    pub(super) fn solve(
        &self,
        a: &mut NormalConstraint,
        b: &mut NormalConstraint,
        velocity: &mut Velocity,
    ) {
        let [k_aa, k_ab, k_bb] = self.inverse_masses;
        // The residuals without the accumulated impulses.
        let missing_a = (a.target - k_aa * a.impulse - k_ab * b.impulse) + a.row.speed(velocity);
        let missing_b = (b.target - k_ab * a.impulse - k_bb * b.impulse) + b.row.speed(velocity);
        let [s_aa, s_ab, s_bb] = self.solution;
        let both = (
            s_ab * missing_b - s_aa * missing_a,
            s_ab * missing_a - s_bb * missing_b,
        );
        let (x, y) = if self.has_solution && both.0 >= 0.0 && both.1 >= 0.0 {
            both
        } else if missing_a >= 0.0 && missing_b >= 0.0 {
            (0.0, 0.0)
        } else {
            let (x, y) = (-missing_a * self.alone[0], -missing_b * self.alone[1]);
            if x >= 0.0 && missing_b + k_ab * x >= 0.0 {
                (x, 0.0)
            } else if y >= 0.0 && missing_a + k_ab * y >= 0.0 {
                (0.0, y)
            } else {
                return;
            }
        };
        let (change_a, change_b) = (x - a.impulse, y - b.impulse);
        if change_a == 0.0 && change_b == 0.0 {
            return;
        }
        (a.impulse, b.impulse) = (x, y);
        velocity.linear += a.row.direction * (change_a + change_b);
        velocity.angular += a.row.spin * change_a + b.row.spin * change_b;
    }
}

/// Coulomb friction of one point: two tangential rows, solved together and clamped to the friction disc.
#[derive(Clone, Copy)]
pub(super) struct FrictionConstraint {
    rows: [JacobianRow; 2],
    /// Inverse of their inverse mass matrix.
    solution: [f64; 3],
    impulse: [f64; 2],
}

impl FrictionConstraint {
    /// Builds the constraint and warm-starts it by the tangential part of `impulse`.
    pub(super) fn new(rows: [JacobianRow; 2], impulse: Vector) -> Self {
        let [k_aa, k_ab, k_bb] = [
            rows[0].response(&rows[0]),
            rows[0].response(&rows[1]),
            rows[1].response(&rows[1]),
        ];
        let determinant = k_aa * k_bb - k_ab * k_ab;
        Self {
            solution: [k_bb, k_ab, k_aa].map(|element| element / determinant),
            impulse: rows.map(|row| row.direction.dot(impulse)),
            rows,
        }
    }

    /// Applies the accumulated impulse.
    pub(super) fn warm_start(&self, velocity: &mut Velocity) {
        for (row, impulse) in self.rows.iter().zip(self.impulse) {
            row.apply(impulse, velocity);
        }
    }

    /// Stops the point as far as an impulse of at max_impulse `max_impulse` can.
    #[inline(always)]
    pub(super) fn solve(&mut self, max_impulse: f64, velocity: &mut Velocity) {
        if max_impulse == 0.0 && self.impulse == [0.0; 2] {
            return;
        }
        let slip = [self.rows[0].speed(velocity), self.rows[1].speed(velocity)];
        let [s_aa, s_ab, s_bb] = self.solution;
        let mut next = [
            self.impulse[0] - (s_aa * slip[0] - s_ab * slip[1]),
            self.impulse[1] - (s_bb * slip[1] - s_ab * slip[0]),
        ];
        let square = next[0] * next[0] + next[1] * next[1];
        if square > max_impulse * max_impulse {
            let scale = max_impulse / square.sqrt();
            next = next.map(|component| component * scale);
        }
        let change = [next[0] - self.impulse[0], next[1] - self.impulse[1]];
        self.impulse = next;
        let [one, other] = &self.rows;
        velocity.linear += one.direction * change[0] + other.direction * change[1];
        velocity.angular += one.spin * change[0] + other.spin * change[1];
    }

    /// Returns the impulse in the world frame.
    pub(super) fn total(&self) -> Vector {
        self.rows[0].direction * self.impulse[0] + self.rows[1].direction * self.impulse[1]
    }
}
