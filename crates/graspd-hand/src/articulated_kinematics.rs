//! Positions of a rigid-link hand's points, and their transposed Jacobian, for buffers of either precision.

use std::ops::Range;

use graspd_ad::{Element, Real};
use graspd_geom::{Rigid, Vec3};

use crate::{
    ArticulatedHand, HandPose, HandScratch, Kinematics, POINT_PADDING, PointBuffer, PoseGradient,
};

/// The precisions in which a hand keeps its contact points.
trait LocalPoints: Element {
    fn local_points(hand: &ArticulatedHand) -> &PointBuffer<Self>;
}
impl LocalPoints for f64 {
    fn local_points(hand: &ArticulatedHand) -> &PointBuffer<Self> {
        &hand.local_points
    }
}
impl LocalPoints for f32 {
    fn local_points(hand: &ArticulatedHand) -> &PointBuffer<Self> {
        &hand.local_points_f32
    }
}

impl<E: LocalPoints> Kinematics<E> for ArticulatedHand {
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
        for (body, range) in &self.contact_ranges {
            let body_pose = &scratch.body_poses[*body];
            transform_blocks(body_pose, E::local_points(self), contacts, range);
        }
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
        } = scratch;
        forces.fill(Vec3::zero());
        torques.fill(Vec3::zero());
        for (body, range) in &self.contact_ranges {
            let origin = body_poses[*body].translation;
            let (force, torque) = sum_blocks(origin, contacts, contact_gradient, range);
            forces[*body] += force;
            torques[*body] += torque;
        }
        for (index, body) in self.spheres.body.iter().enumerate() {
            let body = *body as usize;
            let force = sphere_gradient.get(index);
            forces[body] += force;
            torques[body] += (spheres.get(index) - body_poses[body].translation).cross(force);
        }
        self.tree().pullback(body_poses, forces, torques, gradient);
    }
}

/// p = R local + t for whole blocks of points of one body. Fixed-length inner loops become SIMD.
fn transform_blocks<E: Element>(
    pose: &Rigid<f64>,
    local: &PointBuffer<E>,
    points: &mut PointBuffer<E>,
    range: &Range<usize>,
) {
    let row = |i: usize| {
        let row = pose.rotation.rows[i];
        [row.x, row.y, row.z, pose.translation.get(i)].map(<E as Real>::constant)
    };
    let matrix = [row(0), row(1), row(2)];
    let (x, y, z) = (
        blocks(&local.x, range),
        blocks(&local.y, range),
        blocks(&local.z, range),
    );
    let outputs = [&mut points.x, &mut points.y, &mut points.z];
    for (output, [a, b, c, t]) in outputs.into_iter().zip(matrix) {
        let (output, _) = output[range.clone()].as_chunks_mut::<POINT_PADDING>();
        for (((out, x), y), z) in output.iter_mut().zip(x).zip(y).zip(z) {
            for lane in 0..POINT_PADDING {
                out[lane] = a * x[lane] + b * y[lane] + c * z[lane] + t;
            }
        }
    }
}

/// Sums of g and (p - origin) x g over the points of one body, lane by lane in `E`, then in `f64`.
///
/// Arms are taken from the body's own origin: about a distant one most of the torque would cancel.
fn sum_blocks<E: Element>(
    origin: Vec3<f64>,
    points: &PointBuffer<E>,
    gradients: &PointBuffer<E>,
    range: &Range<usize>,
) -> (Vec3<f64>, Vec3<f64>) {
    let origin = [origin.x, origin.y, origin.z].map(<E as Real>::constant);
    let mut force = [[<E as Real>::constant(0.0); POINT_PADDING]; 3];
    let mut torque = force;
    let p = [&points.x, &points.y, &points.z].map(|values| blocks(values, range));
    let g = [&gradients.x, &gradients.y, &gradients.z].map(|values| blocks(values, range));
    for block in 0..p[0].len() {
        let (px, py, pz) = (&p[0][block], &p[1][block], &p[2][block]);
        let (gx, gy, gz) = (&g[0][block], &g[1][block], &g[2][block]);
        for lane in 0..POINT_PADDING {
            let (x, y, z) = (
                px[lane] - origin[0],
                py[lane] - origin[1],
                pz[lane] - origin[2],
            );
            force[0][lane] += gx[lane];
            force[1][lane] += gy[lane];
            force[2][lane] += gz[lane];
            torque[0][lane] += y * gz[lane] - z * gy[lane];
            torque[1][lane] += z * gx[lane] - x * gz[lane];
            torque[2][lane] += x * gy[lane] - y * gx[lane];
        }
    }
    let total = |sums: [[E; POINT_PADDING]; 3]| {
        let [x, y, z] = sums.map(|lanes| lanes.iter().map(|v| v.lane(0)).sum::<f64>());
        Vec3::new(x, y, z)
    };
    (total(force), total(torque))
}

fn blocks<'a, E>(values: &'a [E], range: &Range<usize>) -> &'a [[E; POINT_PADDING]] {
    values[range.clone()].as_chunks::<POINT_PADDING>().0
}
