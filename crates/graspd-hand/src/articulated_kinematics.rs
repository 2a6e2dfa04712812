//! Positions of a rigid-link hand's points, and their transposed Jacobian, for buffers of either precision.

use std::ops::Range;

use graspd_ad::{Element, Kernel, Real};
use graspd_geom::{Rigid, Vec3};

use crate::body_motion::BodyLoads;
use crate::points::{lane_sums, store_split};
use crate::{
    ArticulatedHand, HandPose, HandScratch, Kinematics, POINT_PADDING, PointBuffer, PoseGradient,
};

/// The points of each body: whole blocks of [`POINT_PADDING`].
type BodyRanges = [(usize, Range<usize>)];

impl<E: Element> Kinematics<E> for ArticulatedHand {
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    ) {
        let poses = &mut scratch.state.get_mut::<BodyLoads>().poses;
        self.tree().forward(&pose.base(), &pose.articulation, poses);
        E::vectorize(Place {
            ranges: &self.points.contact_ranges,
            poses,
            local: &self.points.positions,
            points: contacts,
            remainder: &mut scratch.contact_remainder,
        });
        let centers = self.points.sphere_centers.iter();
        for (index, (center, body)) in centers.zip(&self.points.spheres.body).enumerate() {
            spheres.set(index, poses[*body as usize].apply(*center));
        }
    }

    fn pullback(
        &self,
        _pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &PointBuffer<E>,
        contact_gradient: &PointBuffer<E>,
        spheres: &PointBuffer<E>,
        sphere_gradient: &PointBuffer<E>,
        gradient: &mut PoseGradient,
    ) {
        let BodyLoads {
            poses,
            forces,
            torques,
        } = scratch.state.get_mut();
        forces.fill(Vec3::zero());
        torques.fill(Vec3::zero());
        E::vectorize(Sum {
            ranges: &self.points.contact_ranges,
            poses,
            points: contacts,
            gradients: contact_gradient,
            forces,
            torques,
        });
        for (index, body) in self.points.spheres.body.iter().enumerate() {
            let body = *body as usize;
            let force = sphere_gradient.get(index);
            forces[body] += force;
            torques[body] += (spheres.get(index) - poses[body].translation).cross(force);
        }
        self.tree().pullback(poses, forces, torques, gradient);
    }
}

/// Computes p = R local + t for the points of all bodies, in double precision and stored as the sum of two numbers.
struct Place<'a, E> {
    ranges: &'a BodyRanges,
    poses: &'a [Rigid<f64>],
    local: &'a PointBuffer<f64>,
    points: &'a mut PointBuffer<E>,
    remainder: &'a mut PointBuffer<f32>,
}

impl<E: Element> Kernel<E> for Place<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) {
        let local = self.local.blocks(0..self.local.len());
        let points = self.points.rows_mut();
        let remainder = self.remainder.rows_mut();
        for (body, range) in self.ranges {
            let pose = &self.poses[*body];
            for block in range.start / POINT_PADDING..range.end / POINT_PADDING {
                let (x, y, z) = (&local.x[block], &local.y[block], &local.z[block]);
                for axis in 0..3 {
                    let (r, t) = (pose.rotation.rows[axis], pose.translation.get(axis));
                    let mut row = [0.0; POINT_PADDING];
                    for lane in 0..POINT_PADDING {
                        row[lane] = r.x * x[lane] + r.y * y[lane] + r.z * z[lane] + t;
                    }
                    store_split(&row, &mut points[axis][block], &mut remainder[axis][block]);
                }
            }
        }
    }
}

/// Adds the sums of g and (p - origin) x g over each body's points to the body's force and torque.
///
/// Within a body lane by lane in `E`, then in `f64`. Arms are taken from the body's own origin: about a distant one
/// most of the torque would cancel.
struct Sum<'a, E> {
    ranges: &'a BodyRanges,
    poses: &'a [Rigid<f64>],
    points: &'a PointBuffer<E>,
    gradients: &'a PointBuffer<E>,
    forces: &'a mut [Vec3<f64>],
    torques: &'a mut [Vec3<f64>],
}

impl<E: Element> Kernel<E> for Sum<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) {
        for (body, range) in self.ranges {
            let origin = Vec3::<L>::constant(self.poses[*body].translation);
            let (mut force, mut torque) = (Vec3::<L>::zero(), Vec3::<L>::zero());
            let points = self.points.blocks(range.clone());
            let gradients = self.gradients.blocks(range.clone());
            for block in 0..points.x.len() {
                let mut lane = 0;
                while lane < POINT_PADDING {
                    let gradient = gradients.load::<L>(block, lane);
                    let arm = points.load::<L>(block, lane) - origin;
                    force += gradient;
                    torque += arm.cross(gradient);
                    lane += L::LANES;
                }
            }
            self.forces[*body] += lane_sums(force);
            self.torques[*body] += lane_sums(torque);
        }
    }
}
