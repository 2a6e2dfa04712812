//! What contacts do to a body's velocity: one impulse along the normal of each point, solved alone or two at once, and friction.
//!
//! Impulses are those on a body of 1 kg, which are changes of velocity \[m/s\]. The next impulse along a normal is
//! `s max(0, l - m (J v + b))`: l is the last one, m the mass that the point meets, J v how fast it opens, b how fast it should be
//! closing, and s <= 1 makes it soft.
//!
//! All points are of the same body, so that each has to wait for the one before; what takes time is therefore how long one takes from
//! velocity to velocity. Whatever does not depend on the velocity is made ready beforehand, and points that stay without
//! load leave the velocity alone, which the processor foresees.
//!
//! # Source
//! Soft constraints: E. Catto, "Soft constraints", GDC 2011. Two points at once: the block solver of his Box2D, as a linear
//! complementarity problem, with softness as rapier 0.36 has it. What is solved is what that engine solves.

use parry3d_f64::math::{Matrix, Vector};

use super::body::Velocity;

/// Two points of one patch are solved at once if the determinant of their inverse masses is more than this part of the product of its diagonal:
/// nearly the same point twice leaves the split of the load open.
const LEAST_CONDITION: f64 = 0.01;

/// What an impulse along a direction does.
#[derive(Clone, Copy)]
pub(super) struct Push {
    pub(super) direction: Vector,
    /// Torque about the centre of mass of an impulse of 1.
    torque: Vector,
    /// The spin that it causes.
    spin: Vector,
}

impl Push {
    /// Along `direction`, at `arm` from the centre of mass.
    pub(super) fn new(direction: Vector, arm: Vector, inverse_inertia: &Matrix) -> Self {
        let torque = arm.cross(direction);
        let spin = *inverse_inertia * torque;
        Self {
            direction,
            torque,
            spin,
        }
    }

    /// How much an impulse of 1 along another changes the speed along this.
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

/// A contact point along its normal, which points from the hand into the object.
#[derive(Clone, Copy)]
pub(super) struct NormalPart {
    pub(super) push: Push,
    /// The mass that it meets, for a body of 1 kg.
    mass: f64,
    /// Speed at which it should be closing at most; negative where it should be opening.
    pub(super) target: f64,
    /// What is kept of an impulse; 1 for a rigid contact.
    pub(super) softness: f64,
    pub(super) impulse: f64,
}

impl NormalPart {
    pub(super) fn new(push: Push, impulse: f64) -> Self {
        Self {
            push,
            mass: 1.0 / push.response(&push),
            target: 0.0,
            softness: 1.0,
            impulse,
        }
    }

    /// Applies the impulse that it has already.
    pub(super) fn warm_start(&self, velocity: &mut Velocity) {
        self.push.apply(self.impulse, velocity);
    }

    /// Solves it alone.
    #[inline(always)]
    pub(super) fn solve(&mut self, velocity: &mut Velocity) {
        let speed = self.push.speed(velocity) + self.target;
        let next = self.impulse - self.mass * speed;
        let next = if next > 0.0 {
            self.softness * next
        } else {
            0.0
        };
        self.change_to(next, velocity);
    }

    /// Makes it leave at `speed` if it has borne a load: a bounce.
    pub(super) fn bounce(&mut self, speed: f64, velocity: &mut Velocity) {
        let missing = self.push.speed(velocity) - speed;
        let next = (self.impulse - self.mass * missing).max(0.0);
        self.change_to(next, velocity);
    }

    #[inline(always)]
    fn change_to(&mut self, next: f64, velocity: &mut Velocity) {
        let change = next - self.impulse;
        if change != 0.0 {
            self.impulse = next;
            self.push.apply(change, velocity);
        }
    }
}

/// Two points of one patch that are solved at once.
#[derive(Clone, Copy)]
pub(super) struct Coupling {
    /// Inverse masses: of the first, of both, of the second.
    inverse_masses: [f64; 3],
    /// The inverse of the same with the softness of each.
    solution: [f64; 3],
    /// The inverses of each alone, soft.
    alone: [f64; 2],
    has_solution: bool,
}

impl Coupling {
    /// Of two points of one normal; `None` where they are better solved one after the other.
    pub(super) fn new(a: &NormalPart, b: &NormalPart) -> Option<Self> {
        let [k_aa, k_ab, k_bb] = [
            a.push.response(&a.push),
            a.push.response(&b.push),
            b.push.response(&b.push),
        ];
        (k_aa * k_bb - k_ab * k_ab > LEAST_CONDITION * k_aa * k_bb).then_some(Self {
            inverse_masses: [k_aa, k_ab, k_bb],
            solution: [0.0; 3],
            alone: [0.0; 2],
            has_solution: false,
        })
    }

    /// Takes over how soft the two are.
    pub(super) fn soften(&mut self, a: &NormalPart, b: &NormalPart) {
        let [k_aa, k_ab, k_bb] = self.inverse_masses;
        let (k_aa, k_bb) = (k_aa / a.softness, k_bb / b.softness);
        let determinant = k_aa * k_bb - k_ab * k_ab;
        self.has_solution = determinant > 0.0;
        self.solution = [k_bb, k_ab, k_aa].map(|element| element / determinant);
        self.alone = [1.0 / k_aa, 1.0 / k_bb];
    }

    /// Finds impulses x, y >= 0 such that each point is either without load and not too slow, or just as fast as it should be.
    #[inline(always)]
    pub(super) fn solve(&self, a: &mut NormalPart, b: &mut NormalPart, velocity: &mut Velocity) {
        let [k_aa, k_ab, k_bb] = self.inverse_masses;
        // What is missing without the impulses so far.
        let missing_a = (a.target - k_aa * a.impulse - k_ab * b.impulse) + a.push.speed(velocity);
        let missing_b = (b.target - k_ab * a.impulse - k_bb * b.impulse) + b.push.speed(velocity);
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
        velocity.linear += a.push.direction * (change_a + change_b);
        velocity.angular += a.push.spin * change_a + b.push.spin * change_b;
    }
}

/// A contact point's friction: two directions in its tangent plane, solved at once and kept within Coulomb's circle.
#[derive(Clone, Copy)]
pub(super) struct FrictionPart {
    pushes: [Push; 2],
    /// The inverse of their inverse masses.
    solution: [f64; 3],
    impulse: [f64; 2],
}

impl FrictionPart {
    /// Begins with as much of `impulse` as lies in the tangent plane.
    pub(super) fn new(pushes: [Push; 2], impulse: Vector) -> Self {
        let [k_aa, k_ab, k_bb] = [
            pushes[0].response(&pushes[0]),
            pushes[0].response(&pushes[1]),
            pushes[1].response(&pushes[1]),
        ];
        let determinant = k_aa * k_bb - k_ab * k_ab;
        Self {
            solution: [k_bb, k_ab, k_aa].map(|element| element / determinant),
            impulse: pushes.map(|push| push.direction.dot(impulse)),
            pushes,
        }
    }

    /// Applies the impulse that it has already.
    pub(super) fn warm_start(&self, velocity: &mut Velocity) {
        for (push, impulse) in self.pushes.iter().zip(self.impulse) {
            push.apply(impulse, velocity);
        }
    }

    /// Stops the point as far as an impulse of at most `most` can.
    #[inline(always)]
    pub(super) fn solve(&mut self, most: f64, velocity: &mut Velocity) {
        if most == 0.0 && self.impulse == [0.0; 2] {
            return;
        }
        let slip = [
            self.pushes[0].speed(velocity),
            self.pushes[1].speed(velocity),
        ];
        let [s_aa, s_ab, s_bb] = self.solution;
        let mut next = [
            self.impulse[0] - (s_aa * slip[0] - s_ab * slip[1]),
            self.impulse[1] - (s_bb * slip[1] - s_ab * slip[0]),
        ];
        let square = next[0] * next[0] + next[1] * next[1];
        if square > most * most {
            let scale = most / square.sqrt();
            next = next.map(|component| component * scale);
        }
        let change = [next[0] - self.impulse[0], next[1] - self.impulse[1]];
        self.impulse = next;
        let [one, other] = &self.pushes;
        velocity.linear += one.direction * change[0] + other.direction * change[1];
        velocity.angular += one.spin * change[0] + other.spin * change[1];
    }

    /// The impulse in the world's axes.
    pub(super) fn total(&self) -> Vector {
        self.pushes[0].direction * self.impulse[0] + self.pushes[1].direction * self.impulse[1]
    }
}
