//! A few amplitudes that stand for all joints.

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{Hand, HandPose, clamp_to_limits, closed_articulation};

use super::probe::Probe;

/// Share of the way to the closed hand at which it is seen which points a joint moves.
const TRIAL: f64 = 0.3;
/// Points that move less than this do not move \[m\].
const STILL: f64 = 1e-5;

/// Directions in the space of joints, from the open hand.
#[derive(Clone, Debug)]
pub(super) struct Eigengrasps {
    open: Vec<f64>,
    /// `[k][n]`
    pub(super) directions: Vec<Vec<f64>>,
    /// Least and greatest amplitude of each.
    pub(super) ranges: Vec<[f64; 2]>,
}

impl Eigengrasps {
    /// At most `count` of them.
    ///
    /// A hand without joint limits has a pose space of its own, such as MANO's principal components: its first
    /// coefficients are the amplitudes. For others the first closes all joints at once, 1 being closed, and the
    /// second closes the distal joints of each finger and opens the others: flat against hooked fingers, much as
    /// the first two components of human grasps.
    ///
    /// # Source
    /// M. Ciocarlie, P. Allen, "Hand posture subspaces for dexterous robotic grasping", IJRR 28(7), 2009, section 3;
    /// M. Santello, M. Flanders, J. F. Soechting, "Postural hand synergies for tool use", J. Neuroscience 18, 1998.
    pub(super) fn of(hand: &dyn Hand, probe: &mut Probe<'_>, count: usize) -> Self {
        let open = hand.open_articulation().to_vec();
        if hand.limits().is_none() {
            let directions = (0..count.min(open.len()))
                .map(|k| {
                    (0..open.len())
                        .map(|j| f64::from(u8::from(j == k)))
                        .collect()
                })
                .collect::<Vec<_>>();
            // Two and a half standard deviations of MANO's first components.
            let ranges = vec![[-2.5, 2.5]; directions.len()];
            return Self {
                open,
                directions,
                ranges,
            };
        }
        let closed = closed_articulation(hand, 1.0);
        let way: Vec<f64> = closed.iter().zip(&open).map(|(c, o)| c - o).collect();
        let mut directions = vec![way.clone()];
        let mut ranges = vec![[0.0, 1.0]];
        if count > 1 {
            let sides = distal_sides(&open, &way, probe);
            directions.push(way.iter().zip(sides).map(|(w, side)| w * side).collect());
            ranges.push([-0.5, 0.5]);
        }
        Self {
            open,
            directions,
            ranges,
        }
    }

    /// The joints for given amplitudes, within their limits.
    pub(super) fn articulation(&self, hand: &dyn Hand, amplitudes: &[f64]) -> Vec<f64> {
        let mut joints = self.open.clone();
        for (direction, amplitude) in self.directions.iter().zip(amplitudes) {
            for (joint, change) in joints.iter_mut().zip(direction) {
                *joint += amplitude * change;
            }
        }
        if let Some(limits) = hand.limits() {
            clamp_to_limits(&mut joints, limits);
        }
        joints
    }
}

/// 1 for closing joints that other closing joints carry, -1 for those that carry others, 0 for all else.
fn distal_sides(open: &[f64], way: &[f64], probe: &mut Probe<'_>) -> Vec<f64> {
    let mut positions = |articulation: Vec<f64>| -> Vec<Vec3<f64>> {
        probe.place(&HandPose {
            translation: Vec3::zero(),
            rotation: Quaternion::identity(),
            articulation,
        });
        probe.numbers.iter().map(|&n| probe.point(n)).collect()
    };
    let at_rest = positions(open.to_vec());
    let moved: Vec<Vec<bool>> = (0..open.len())
        .map(|joint| {
            let mut articulation = open.to_vec();
            articulation[joint] += TRIAL * way[joint];
            let moved = positions(articulation);
            (moved.iter().zip(&at_rest))
                .map(|(after, before)| (*after - *before).norm() > STILL)
                .collect()
        })
        .collect();
    let count = |set: &[bool]| set.iter().filter(|moves| **moves).count();
    let carries = |a: usize, b: usize| {
        let is_subset = moved[b].iter().zip(&moved[a]).all(|(b, a)| !b || *a);
        is_subset && count(&moved[b]) > 0 && count(&moved[b]) < count(&moved[a])
    };
    let joints = 0..open.len();
    let closes = |joint: &usize| way[*joint] != 0.0;
    joints
        .clone()
        .map(|joint| {
            if !closes(&joint) {
                return 0.0;
            }
            let mut others = joints.clone().filter(closes);
            if others.clone().any(|other| carries(other, joint)) {
                1.0
            } else if others.any(|other| carries(joint, other)) {
                -1.0
            } else {
                0.0
            }
        })
        .collect()
}
