//! Distances of eight points at a time.

use graspd_ad::{Mask, Real};
use nalgebra::Point3;

use super::oriented_box::Slack;
use super::tree::{STACK, TriangleTree};

/// How many points a packet holds.
pub(crate) const PACKET: usize = 8;

/// Eight neighbouring points, and what is known of their distances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packet {
    /// x, y and z of the points.
    pub(crate) points: [[f64; PACKET]; 3],
    /// Upper bounds of the distances that are known beforehand, or infinity.
    pub(crate) bounds: [f64; PACKET],
    /// The triangles that may well be nearest, in leaf order.
    pub(crate) guesses: [usize; 2],
}

/// Distances of eight points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketDistances {
    pub(crate) squared: [f64; PACKET],
    /// The triangles that are nearest to the first and the last point, in leaf order.
    pub(crate) nearest: [usize; 2],
}

impl TriangleTree {
    /// The distances of eight points; the nearer together they are, the faster.
    ///
    /// To be called within a [`graspd_ad::Kernel`], with eight lanes.
    #[inline(always)]
    pub(crate) fn packet_distances<L: Real<Element = f32>>(
        &self,
        packet: &Packet,
        slack: Slack,
    ) -> PacketDistances {
        const { assert!(L::LANES == PACKET) };
        let middle = self.middle();
        let relative = [
            L::from_lanes(|lane| packet.points[0][lane] - middle.x),
            L::from_lanes(|lane| packet.points[1][lane] - middle.y),
            L::from_lanes(|lane| packet.points[2][lane] - middle.z),
        ];
        let bounds = L::from_lanes(|lane| packet.bounds[lane] * packet.bounds[lane]);
        let mut best = [f64::INFINITY; PACKET];
        let mut nearest = packet.guesses;
        for guess in packet.guesses {
            self.improve(packet, guess, &mut best, &mut nearest);
        }
        let mut widened = slack.widen(L::from_lanes(|lane| best[lane]).min(bounds));
        let mut stack = [(0, L::zero()); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (index, lower_bound) = stack[top];
            if !lower_bound.le(widened).any() {
                continue;
            }
            let node = &self.nodes[index];
            if node.is_leaf() {
                for at in node.triangles() {
                    self.improve(packet, at, &mut best, &mut nearest);
                }
                widened = slack.widen(L::from_lanes(|lane| best[lane]).min(bounds));
                continue;
            }
            let (left, right) = (index + 1, self.nodes[index + 1].end as usize);
            let left_bound = self.boxes[left].distance_squared(relative);
            let right_bound = self.boxes[right].distance_squared(relative);
            let (near, far) = if right_bound.lane(0) < left_bound.lane(0) {
                ((right, right_bound), (left, left_bound))
            } else {
                ((left, left_bound), (right, right_bound))
            };
            if far.1.le(widened).any() {
                stack[top] = far;
                top += 1;
            }
            if near.1.le(widened).any() {
                stack[top] = near;
                top += 1;
            }
        }
        PacketDistances {
            squared: best,
            nearest,
        }
    }

    /// Takes the triangle number `at` into account.
    #[inline(always)]
    fn improve(
        &self,
        packet: &Packet,
        at: usize,
        best: &mut [f64; PACKET],
        nearest: &mut [usize; 2],
    ) {
        let triangle = &self.triangles[at];
        let mut squared = [0.0; PACKET];
        let [x, y, z] = &packet.points;
        for lane in 0..PACKET {
            squared[lane] = triangle.distance_squared([x[lane], y[lane], z[lane]]);
        }
        for (nearest, lane) in nearest.iter_mut().zip([0, PACKET - 1]) {
            if squared[lane] < best[lane] {
                *nearest = at;
            }
        }
        for lane in 0..PACKET {
            best[lane] = if squared[lane] < best[lane] {
                squared[lane]
            } else {
                best[lane]
            };
        }
    }

    /// The slack for packets within a box.
    pub(crate) fn packet_slack(&self, low: &Point3<f64>, high: &Point3<f64>) -> Slack {
        let middle = self.middle();
        self.slack((low - middle).amax().max((high - middle).amax()))
    }
}
