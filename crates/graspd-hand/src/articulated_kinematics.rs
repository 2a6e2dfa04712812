//! Positions of a rigid-link hand's points, and their transposed Jacobian, for buffers of either precision.

use std::ops::Range;

use graspd_ad::{Element, Kernel, Real, vectorize};
use graspd_geom::{Rigid, Vec3};

use crate::double_single::{DoubleSingleRows, Row};
use crate::{
    ArticulatedHand, HandPose, HandScratch, Kinematics, POINT_PADDING, PointBuffer, PoseGradient,
};

/// The points of each body: whole blocks of [`POINT_PADDING`].
type BodyRanges = [(usize, Range<usize>)];

/// The precisions of a hand's buffers: how points are placed, and which lanes go through them.
trait Precision: Element {
    /// Places the contact points by the poses in `scratch`.
    fn place(hand: &ArticulatedHand, scratch: &mut HandScratch, points: &mut PointBuffer<Self>);
    fn sum(kernel: Sum<'_, Self>);
}
impl Precision for f64 {
    fn place(hand: &ArticulatedHand, scratch: &mut HandScratch, points: &mut PointBuffer<f64>) {
        for (body, range) in &hand.contact_ranges {
            let pose = &scratch.body_poses[*body];
            for index in range.clone() {
                points.set(index, pose.apply(hand.local_points.get(index)));
            }
        }
    }
    fn sum(kernel: Sum<'_, Self>) {
        kernel.over::<f64>();
    }
}
impl Precision for f32 {
    fn place(hand: &ArticulatedHand, scratch: &mut HandScratch, points: &mut PointBuffer<f32>) {
        vectorize(SplitPlace {
            ranges: &hand.contact_ranges,
            poses: &scratch.body_poses,
            local: &hand.local_points,
            points,
            remainder: &mut scratch.contact_remainder,
        });
    }
    fn sum(kernel: Sum<'_, Self>) {
        vectorize(kernel);
    }
}

impl<E: Precision> Kinematics<E> for ArticulatedHand {
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    ) {
        let base = Rigid {
            rotation: pose.rotation.to_matrix(),
            translation: pose.translation,
        };
        self.tree()
            .forward(&base, &pose.articulation, &mut scratch.body_poses);
        E::place(self, scratch, contacts);
        let centers = self.sphere_centers.iter();
        for (index, (center, body)) in centers.zip(&self.spheres.body).enumerate() {
            spheres.set(index, scratch.body_poses[*body as usize].apply(*center));
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
        let HandScratch {
            body_poses,
            forces,
            torques,
            ..
        } = scratch;
        forces.fill(Vec3::zero());
        torques.fill(Vec3::zero());
        E::sum(Sum {
            ranges: &self.contact_ranges,
            poses: body_poses,
            points: contacts,
            gradients: contact_gradient,
            forces,
            torques,
        });
        for (index, body) in self.spheres.body.iter().enumerate() {
            let body = *body as usize;
            let force = sphere_gradient.get(index);
            forces[body] += force;
            torques[body] += (spheres.get(index) - body_poses[body].translation).cross(force);
        }
        self.tree().pullback(body_poses, forces, torques, gradient);
    }
}

/// p = R local + t for the points of all bodies, in double precision and stored as the sum of two numbers: at the contacts'
/// stiffness the rounding of a position is most of the rounding of a force.
struct SplitPlace<'a> {
    ranges: &'a BodyRanges,
    poses: &'a [Rigid<f64>],
    local: &'a PointBuffer<f64>,
    points: &'a mut PointBuffer<f32>,
    remainder: &'a mut PointBuffer<f32>,
}

impl Kernel for SplitPlace<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        let local = [&self.local.x, &self.local.y, &self.local.z].map(|x| x.as_chunks().0);
        let mut rows = DoubleSingleRows::of(self.points, self.remainder);
        for (body, range) in self.ranges {
            let pose = &self.poses[*body];
            for block in range.start / POINT_PADDING..range.end / POINT_PADDING {
                let [x, y, z]: [&Row; 3] = [&local[0][block], &local[1][block], &local[2][block]];
                for axis in 0..3 {
                    let (r, t) = (pose.rotation.rows[axis], pose.translation.get(axis));
                    let mut row = [0.0; POINT_PADDING];
                    for lane in 0..POINT_PADDING {
                        row[lane] = r.x * x[lane] + r.y * y[lane] + r.z * z[lane] + t;
                    }
                    rows[axis].set(block, &row);
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

impl<E: Element> Sum<'_, E> {
    #[inline(always)]
    fn over<L: Real<Element = E>>(self) {
        for (body, range) in self.ranges {
            let origin = Vec3::<L>::constant(self.poses[*body].translation);
            let (mut force, mut torque) = (Vec3::<L>::zero(), Vec3::<L>::zero());
            let points = Blocks::of(self.points, range);
            let gradients = Blocks::of(self.gradients, range);
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

impl Kernel for Sum<'_, f32> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        self.over::<L>();
    }
}

/// The points of one body in blocks of known length, so that access needs few checks.
struct Blocks<'a, E> {
    x: &'a [[E; POINT_PADDING]],
    y: &'a [[E; POINT_PADDING]],
    z: &'a [[E; POINT_PADDING]],
}

impl<'a, E: Element> Blocks<'a, E> {
    #[inline(always)]
    fn of(points: &'a PointBuffer<E>, range: &Range<usize>) -> Self {
        Self {
            x: points.x[range.clone()].as_chunks().0,
            y: points.y[range.clone()].as_chunks().0,
            z: points.z[range.clone()].as_chunks().0,
        }
    }
    /// The points of a block from lane `lane` on.
    #[inline(always)]
    fn load<L: Real<Element = E>>(&self, block: usize, lane: usize) -> Vec3<L> {
        Vec3::new(
            L::load(&self.x[block][lane..]),
            L::load(&self.y[block][lane..]),
            L::load(&self.z[block][lane..]),
        )
    }
}

/// Each coordinate summed over the lanes.
#[inline(always)]
fn lane_sums<L: Real>(v: Vec3<L>) -> Vec3<f64> {
    Vec3::new(lane_sum(v.x), lane_sum(v.y), lane_sum(v.z))
}

#[inline(always)]
fn lane_sum<L: Real>(value: L) -> f64 {
    // By way of memory: taking lanes out of registers one by one costs more.
    let mut lanes = [L::Element::default(); POINT_PADDING];
    value.store(&mut lanes);
    let mut sum = 0.0;
    for lane in &lanes[..L::LANES] {
        sum += lane.lane(0);
    }
    sum
}

// Blocks must be whole for the widest lanes.
const _: () = assert!(POINT_PADDING.is_multiple_of(<graspd_ad::Lanes as Real>::LANES));
