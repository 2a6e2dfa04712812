//! One time step of a body in contact with a fixed hand.
//!
//! The step is cut into substeps. In each, gravity acts, and then all normals are solved again and again, softly, so that they let go of an
//! overlap at a limited speed; the body moves on, and one pass with rigid contacts and friction takes out of its velocity what only pushed
//! the overlap apart. Impulses are kept from substep to substep and from step to step.
//!
//! No pass is left out: where a hand presses hard, impulses still change in the last one, and where the object ends depends on it.
//!
//! # Source
//! M. Macklin et al., "Small steps in physics simulation", SCA 2019; soft contacts with a relaxing pass: E. Catto, "Solver2D", 2024, as in rapier
//! 0.36, whose equations, order and constants these are.

use parry3d_f64::math::{Matrix, Vector};

use super::body::{Body, Velocity};
use super::constraint::{Coupling, FrictionPart, NormalPart, Push};
use super::patch::Patch;
use super::reduction::tangents;

/// Of contacts as springs: natural frequency \[rad/s\] and damping ratio.
const FREQUENCY: f64 = 60.0 * std::f64::consts::TAU;
const DAMPING: f64 = 10.0;
/// The fastest push-out of an overlap \[m/s\].
const MOST_PUSH: f64 = 0.3;

/// How a step is solved, whatever the contacts.
#[derive(Clone, Copy)]
pub(super) struct StepSettings {
    /// Time step \[s\]. Of a step without length nothing moves.
    pub(super) step: f64,
    pub(super) substeps: usize,
    /// Passes over the normals in each substep.
    pub(super) iterations: usize,
    /// Of the pair.
    pub(super) friction: f64,
    /// Of the pair.
    pub(super) restitution: f64,
}

/// What stays about a point within a step.
struct Anchor {
    /// From the centre of mass, along the object's axes.
    on_object: Vector,
    /// The gap where the point's place along the normal is 0.
    gap_at_origin: f64,
    /// How fast to leave after the step, if it has been loaded then.
    bounce: f64,
    /// Whether it has been loaded.
    bore: bool,
}

/// Points that are solved together.
struct Group {
    first: usize,
    /// Of the first with the one after it.
    coupling: Option<Coupling>,
}

/// Solves steps; kept, so that it need not allocate each time.
#[derive(Default)]
pub(super) struct Solver {
    normals: Vec<NormalPart>,
    anchors: Vec<Anchor>,
    frictions: Vec<FrictionPart>,
    groups: Vec<Group>,
    /// Of each patch, the groups and the points up to its end.
    ends: Vec<[usize; 2]>,
    taken_back: usize,
}

impl Solver {
    /// Forgets the step before.
    pub(super) fn clear(&mut self) {
        self.normals.clear();
        self.anchors.clear();
        self.frictions.clear();
        self.groups.clear();
        self.ends.clear();
        self.taken_back = 0;
    }

    /// Adds a patch, after all that are solved before it.
    pub(super) fn add(
        &mut self,
        patch: &Patch,
        body: &Body,
        inverse_inertia: &Matrix,
        settings: &StepSettings,
    ) {
        let normal = patch.normal;
        let along = tangents(normal);
        let first = self.normals.len();
        for place in patch.solved() {
            let point = &patch.points()[place];
            let arm = point.arm;
            let bounces =
                settings.restitution > 0.0 && (!point.bore || settings.restitution >= 1.0);
            let bounce = if bounces {
                let speed = body.velocity.linear + body.velocity.angular.cross(arm);
                -settings.restitution * speed.dot(normal)
            } else {
                0.0
            };
            self.anchors.push(Anchor {
                on_object: body.rotation.inverse() * arm,
                gap_at_origin: point.gap(normal, body) - (body.center + arm).dot(normal),
                bounce,
                bore: false,
            });
            let push = Push::new(normal, arm, inverse_inertia);
            self.normals.push(NormalPart::new(push, point.impulse));
            let pushes = along.map(|tangent| Push::new(tangent, arm, inverse_inertia));
            self.frictions
                .push(FrictionPart::new(pushes, point.friction));
        }
        let last = self.normals.len();
        let mut next = first;
        while next < last {
            let pair = &self.normals[next..last.min(next + 2)];
            let coupling = match pair {
                [a, b] => Coupling::new(a, b),
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

    /// Moves the body by one step under all patches added.
    pub(super) fn solve(&mut self, body: &mut Body, gravity: Vector, settings: &StepSettings) {
        let time = settings.step / settings.substeps as f64;
        for _ in 0..settings.substeps {
            body.accelerate(gravity, time);
            self.aim(body, time, true);
            for (normal, friction) in self.normals.iter().zip(&self.frictions) {
                normal.warm_start(&mut body.velocity);
                friction.warm_start(&mut body.velocity);
            }
            for _ in 0..settings.iterations {
                self.pass(body);
            }
            body.advance(time, settings.step);
            self.aim(body, time, false);
            self.relax(body, settings.friction);
            for (anchor, normal) in self.anchors.iter_mut().zip(&self.normals) {
                anchor.bore |= normal.impulse > 0.0;
            }
        }
        for (anchor, normal) in self.anchors.iter().zip(&mut self.normals) {
            if anchor.bounce > 0.0 && anchor.bore {
                normal.bounce(anchor.bounce, &mut body.velocity);
            }
        }
    }

    /// Writes the impulses back to a patch; in the order in which they were added.
    pub(super) fn take_back(&mut self, patch: &mut Patch) {
        for place in patch.solved() {
            let point = &mut patch.points_mut()[place];
            let index = self.taken_back;
            point.impulse = self.normals[index].impulse;
            point.friction = self.frictions[index].total();
            point.bore = self.anchors[index].bore;
            self.taken_back += 1;
        }
    }

    /// Sets how fast each point should be closing or opening where the body is now, with or without letting go of overlaps.
    fn aim(&mut self, body: &Body, time: f64, lets_go: bool) {
        let per_time = if time > 0.0 { 1.0 / time } else { 0.0 };
        let push_rate = FREQUENCY / (time * FREQUENCY + 2.0 * DAMPING);
        let softness = softness(time * push_rate);
        let turned = Matrix::from_quat(body.rotation);
        for (anchor, normal) in self.anchors.iter().zip(&mut self.normals) {
            let place = body.center + turned * anchor.on_object;
            let gap = anchor.gap_at_origin + place.dot(normal.push.direction);
            normal.target = gap.max(0.0) * per_time;
            normal.softness = 1.0;
            if lets_go && gap <= 0.0 {
                normal.target += (gap * push_rate).max(-MOST_PUSH);
                normal.softness = softness;
            }
        }
        for group in &mut self.groups {
            if let Some(coupling) = &mut group.coupling {
                coupling.soften(&self.normals[group.first], &self.normals[group.first + 1]);
            }
        }
    }

    /// Solves all normals once.
    fn pass(&mut self, body: &mut Body) {
        let mut velocity = body.velocity;
        for group in &self.groups {
            group.solve(&mut self.normals, &mut velocity);
        }
        body.velocity = velocity;
    }

    /// Solves all once with friction, patch by patch.
    fn relax(&mut self, body: &mut Body, coefficient: f64) {
        let mut velocity = body.velocity;
        let [mut group, mut point] = [0, 0];
        for &[last_group, last_point] in &self.ends {
            for group in &self.groups[group..last_group] {
                group.solve(&mut self.normals, &mut velocity);
            }
            for index in point..last_point {
                let most = coefficient * self.normals[index].impulse;
                self.frictions[index].solve(most, &mut velocity);
            }
            [group, point] = [last_group, last_point];
        }
        body.velocity = velocity;
    }
}

impl Group {
    #[inline(always)]
    fn solve(&self, normals: &mut [NormalPart], velocity: &mut Velocity) {
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

/// What a soft contact keeps of an impulse, if in a substep it lets go of this part of its overlap.
fn softness(part: f64) -> f64 {
    if part == 0.0 {
        return 1.0;
    }
    let left = 1.0 / part - 1.0;
    let compliance = left * left / ((1.0 + left) * 4.0 * DAMPING * DAMPING);
    1.0 / (1.0 + compliance)
}
