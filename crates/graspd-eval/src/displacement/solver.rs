//! One time step of a rigid body in contact with a fixed hand, by sequential impulses with substeps.
//!
//! In each substep gravity acts; all normal constraints are solved `iterations` times with soft
//! contacts, which push overlaps apart at a limited speed; the body moves; and one relaxing pass
//! with rigid contacts and friction removes from the velocity what only pushed overlaps apart.
//! Impulses are kept from substep to substep and from step to step.
//!
//! Manifolds are solved in the order in which they are added: Gauss-Seidel does not converge within
//! 15 passes where a hand presses hard, so that results depend on the order by some hundredths of a
//! centimetre.
//!
//! # Source
//! M. Macklin et al., "Small steps in physics simulation", SCA 2019; soft contacts with a relaxing
//! pass: E. Catto, "Solver2D", 2024. Constants as in rapier 0.36.

use parry3d_f64::math::{Matrix, Vector};

use super::contact_constraint::{FrictionConstraint, JacobianRow, NormalConstraint, NormalPair};
use super::manifold::Manifold;
use super::manifold_reduction::tangents;
use super::rigid_body::{RigidBody, Velocity};

/// Natural frequency of soft contacts \[rad/s\].
const FREQUENCY: f64 = 60.0 * std::f64::consts::TAU;
/// Damping ratio of soft contacts.
const DAMPING: f64 = 10.0;
/// Largest speed at which an overlap is pushed apart \[m/s\].
const MAX_PUSH_SPEED: f64 = 0.3;

/// Constants of a step.
#[derive(Clone, Copy)]
pub(super) struct StepSettings {
    /// Time step \[s\].
    pub(super) step: f64,
    pub(super) substeps: usize,
    /// Passes over the normal constraints in each substep.
    pub(super) iterations: usize,
    /// Friction coefficient of the pair.
    pub(super) friction: f64,
    /// Restitution of the pair.
    pub(super) restitution: f64,
}

/// State of a point within a step.
struct PointState {
    /// Point relative to the centre of mass, along the object's axes \[m\].
    on_object: Vector,
    /// Gap minus the projection of the point onto the normal \[m\]: constant within a step.
    gap_at_origin: f64,
    /// Separation speed by restitution, applied after the step if the point was loaded \[m/s\].
    bounce: f64,
    /// Whether it has been loaded.
    was_loaded: bool,
}

/// One point, or two that are solved together.
struct Group {
    first: usize,
    /// Block solver of the first with the one after it.
    coupling: Option<NormalPair>,
}

/// Contact solver; its buffers are reused from step to step.
#[derive(Default)]
pub(super) struct Solver {
    normals: Vec<NormalConstraint>,
    states: Vec<PointState>,
    frictions: Vec<FrictionConstraint>,
    groups: Vec<Group>,
    /// Number of groups and of points up to the end of each manifold.
    ends: Vec<[usize; 2]>,
    stored_points: usize,
}

impl Solver {
    /// Removes all manifolds.
    pub(super) fn clear(&mut self) {
        self.normals.clear();
        self.states.clear();
        self.frictions.clear();
        self.groups.clear();
        self.ends.clear();
        self.stored_points = 0;
    }

    /// Adds a manifold after those added before.
    pub(super) fn add(
        &mut self,
        manifold: &Manifold,
        body: &RigidBody,
        inverse_inertia: &Matrix,
        settings: &StepSettings,
    ) {
        let normal = manifold.normal;
        let along = tangents(normal);
        let first = self.normals.len();
        for place in manifold.solved() {
            let point = &manifold.points()[place];
            let arm = point.arm;
            let bounces =
                settings.restitution > 0.0 && (!point.was_loaded || settings.restitution >= 1.0);
            let bounce = if bounces {
                let speed = body.velocity.linear + body.velocity.angular.cross(arm);
                -settings.restitution * speed.dot(normal)
            } else {
                0.0
            };
            self.states.push(PointState {
                on_object: body.rotation.inverse() * arm,
                gap_at_origin: point.gap(normal, body) - (body.center + arm).dot(normal),
                bounce,
                was_loaded: false,
            });
            let row = JacobianRow::new(normal, arm, inverse_inertia);
            self.normals.push(NormalConstraint::new(row, point.impulse));
            let rows = along.map(|tangent| JacobianRow::new(tangent, arm, inverse_inertia));
            self.frictions
                .push(FrictionConstraint::new(rows, point.friction));
        }
        let last = self.normals.len();
        let mut next = first;
        while next < last {
            let pair = &self.normals[next..last.min(next + 2)];
            let coupling = match pair {
                [a, b] => NormalPair::new(a, b),
                _ => None,
            };
            for offset in 0..pair.len() {
                if offset == 0 || coupling.is_none() {
                    let first = next + offset;
                    self.groups.push(Group { first, coupling });
                }
            }
            next += pair.len();
        }
        self.ends.push([self.groups.len(), last]);
    }

    /// Advances the body by one step under all manifolds added.
    pub(super) fn solve(&mut self, body: &mut RigidBody, gravity: Vector, settings: &StepSettings) {
        let time = settings.step / settings.substeps as f64;
        for _ in 0..settings.substeps {
            body.accelerate(gravity, time);
            self.set_targets(body, time, true);
            for (normal, friction) in self.normals.iter().zip(&self.frictions) {
                normal.warm_start(&mut body.velocity);
                friction.warm_start(&mut body.velocity);
            }
            for _ in 0..settings.iterations {
                self.pass(body);
            }
            body.advance(time, settings.step);
            self.set_targets(body, time, false);
            self.relax(body, settings.friction);
            for (state, normal) in self.states.iter_mut().zip(&self.normals) {
                state.was_loaded |= normal.impulse > 0.0;
            }
        }
        for (state, normal) in self.states.iter().zip(&mut self.normals) {
            if state.bounce > 0.0 && state.was_loaded {
                normal.bounce(state.bounce, &mut body.velocity);
            }
        }
    }

    /// Stores the impulses in a manifold, for warm starts; to be called in the order of [`Solver::add`].
    pub(super) fn store_impulses(&mut self, manifold: &mut Manifold) {
        for place in manifold.solved() {
            let point = &mut manifold.points_mut()[place];
            let index = self.stored_points;
            point.impulse = self.normals[index].impulse;
            point.friction = self.frictions[index].total();
            point.was_loaded = self.states[index].was_loaded;
            self.stored_points += 1;
        }
    }

    /// Sets target speed and softness of each point at the present pose, with or without pushing overlaps apart.
    fn set_targets(&mut self, body: &RigidBody, time: f64, pushes_out: bool) {
        let per_time = if time > 0.0 { 1.0 / time } else { 0.0 };
        let push_rate = FREQUENCY / (time * FREQUENCY + 2.0 * DAMPING);
        let softness = softness(time * push_rate);
        let turned = Matrix::from_quat(body.rotation);
        for (state, normal) in self.states.iter().zip(&mut self.normals) {
            let place = body.center + turned * state.on_object;
            let gap = state.gap_at_origin + place.dot(normal.row.direction);
            normal.target = gap.max(0.0) * per_time;
            normal.softness = 1.0;
            if pushes_out && gap <= 0.0 {
                normal.target += (gap * push_rate).max(-MAX_PUSH_SPEED);
                normal.softness = softness;
            }
        }
        for group in &mut self.groups {
            if let Some(coupling) = &mut group.coupling {
                coupling.soften(&self.normals[group.first], &self.normals[group.first + 1]);
            }
        }
    }

    /// Solves all normal constraints once.
    fn pass(&mut self, body: &mut RigidBody) {
        let mut velocity = body.velocity;
        for group in &self.groups {
            group.solve(&mut self.normals, &mut velocity);
        }
        body.velocity = velocity;
    }

    /// Solves all constraints once with friction, manifold by manifold.
    fn relax(&mut self, body: &mut RigidBody, coefficient: f64) {
        let mut velocity = body.velocity;
        let [mut group, mut point] = [0, 0];
        for &[last_group, last_point] in &self.ends {
            for group in &self.groups[group..last_group] {
                group.solve(&mut self.normals, &mut velocity);
            }
            for index in point..last_point {
                let max_impulse = coefficient * self.normals[index].impulse;
                self.frictions[index].solve(max_impulse, &mut velocity);
            }
            [group, point] = [last_group, last_point];
        }
        body.velocity = velocity;
    }
}

impl Group {
    #[inline(always)]
    fn solve(&self, normals: &mut [NormalConstraint], velocity: &mut Velocity) {
        match &self.coupling {
            None => normals[self.first].solve(velocity),
            Some(coupling) => {
                if let [a, b] = &mut normals[self.first..self.first + 2] {
                    coupling.solve(a, b, velocity);
                }
            }
        }
    }
}

/// Returns the factor on impulses of a soft contact that resolves this fraction of its overlap in a substep.
fn softness(part: f64) -> f64 {
    if part == 0.0 {
        return 1.0;
    }
    let left = 1.0 / part - 1.0;
    let compliance = left * left / ((1.0 + left) * 4.0 * DAMPING * DAMPING);
    1.0 / (1.0 + compliance)
}
