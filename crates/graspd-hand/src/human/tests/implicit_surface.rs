//! The flesh around the skeleton: a field that is negative inside, whose zero level is the skin.
//!
//! Rounded cones along the bones, pads and webs, joined by a smooth minimum. Millimetres, in the frame of
//! [`crate::human::proportions`]. Away from the skin the field is only roughly a distance.

use nalgebra::{Point3, Vector3};

use crate::human::proportions::{Chain, RAYS, THUMB, chains};

/// Depth of a finger over its breadth, at its base and at its tip.
const DEPTH_RATIO: [f64; 2] = [0.94, 0.8];
/// Breadth of a finger's pad over that of the finger.
const PAD_BREADTH: f64 = 0.97;
/// How far the joined shapes blend into each other \[mm\]: along a finger, in the palm, finger to palm.
const FINGER_BLEND: f64 = 3.0;
const PALM_BLEND: f64 = 9.0;
const ROOT_BLEND: f64 = 6.0;
/// Farther than any point of interest is from the hand \[mm\].
const FAR: f64 = 1e3;
/// The skin ends here beyond the wrist joint, with a rounded edge.
const WRIST_END: f64 = 20.0;

/// The convex hull of two balls, optionally squashed along one direction.
#[derive(Clone, Copy, Debug)]
struct RoundedCone {
    start: Point3<f64>,
    axis: Vector3<f64>,
    radii: [f64; 2],
    /// Direction along which it is thinner, and by what factor.
    squash: Option<(Vector3<f64>, f64)>,
}

impl RoundedCone {
    fn new(start: Point3<f64>, end: Point3<f64>, radii: [f64; 2]) -> Self {
        Self {
            start,
            axis: end - start,
            radii,
            squash: None,
        }
    }
    /// Bounds the value at `p` from below: the distance to a ball around the hull.
    fn lower_bound(&self, p: &Point3<f64>) -> f64 {
        let middle = self.start + self.axis * 0.5;
        (p - middle).norm() - 0.5 * self.axis.norm() - self.radii[0].max(self.radii[1])
    }
    /// Computes the signed distance to the hull of two balls (exact where it is not squashed).
    fn value(&self, p: &Point3<f64>) -> f64 {
        let mut from = p - self.start;
        if let Some((direction, factor)) = self.squash {
            from += direction * (direction.dot(&from) * (1.0 / factor - 1.0));
        }
        let [r0, r1] = self.radii;
        let length_squared = self.axis.norm_squared();
        let difference = r0 - r1;
        // Along the axis, and beside it; both times the axis's length.
        let along = from.dot(&self.axis);
        let beside = (from * length_squared - self.axis * along).norm_squared();
        let side = (length_squared - difference * difference).max(0.0);
        let sign = difference.signum() * difference * difference * beside;
        let (y2, z) = (along * along * length_squared, along - length_squared);
        let z2 = z * z * length_squared;
        if z.signum() * side * z2 > sign {
            return (beside + z2).sqrt() / length_squared - r1;
        }
        if along.signum() * side * y2 < sign {
            return (beside + y2).sqrt() / length_squared - r0;
        }
        ((beside * side / length_squared).sqrt() + along * difference) / length_squared - r0
    }
}

/// Returns the lesser of two values, rounded where they differ by less than `blend`.
fn smooth_minimum(a: f64, b: f64, blend: f64) -> f64 {
    let overlap = (blend - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * blend)
}

/// The flesh of the whole hand.
#[derive(Clone, Debug)]
pub(crate) struct ImplicitHand {
    palm: Vec<RoundedCone>,
    /// The parts of each ray, by ray.
    fingers: [Vec<RoundedCone>; 5],
}

impl ImplicitHand {
    pub(crate) fn new() -> Self {
        let chains = chains();
        Self {
            palm: palm(&chains),
            fingers: std::array::from_fn(|ray| finger(ray, &chains[ray])),
        }
    }
    /// Negative inside, positive outside, about the distance to the skin near it \[mm\].
    pub(crate) fn value(&self, p: &Point3<f64>) -> f64 {
        let joined = |parts: &[RoundedCone], blend: f64| {
            parts.iter().fold(FAR, |value, part| {
                // What is farther than the blend changes nothing.
                if part.lower_bound(p) >= value + blend {
                    return value;
                }
                smooth_minimum(value, part.value(p), blend)
            })
        };
        let mut value = joined(&self.palm, PALM_BLEND);
        // Fingers blend with the palm but not with each other: their gaps stay open.
        let fingers = (self.fingers.iter())
            .map(|parts| joined(parts, FINGER_BLEND))
            .fold(FAR, f64::min);
        value = smooth_minimum(value, fingers, ROOT_BLEND);
        -smooth_minimum(-value, WRIST_END - p.x, 6.0)
    }
    /// Returns the gradient of [`ImplicitHand::value`], by central differences.
    pub(crate) fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        const STEP: f64 = 0.02;
        Vector3::from_fn(|axis, _| {
            let mut step = Vector3::zeros();
            step[axis] = STEP;
            (self.value(&(p + step)) - self.value(&(p - step))) / (2.0 * STEP)
        })
    }
}

/// Returns the bones' own flesh and the pads of one finger or the thumb.
fn finger(ray: usize, chain: &Chain) -> Vec<RoundedCone> {
    let measures = &RAYS[ray];
    let half = measures.half_breadths;
    let mut parts = Vec::new();
    for bone in 0..3 {
        let depth = DEPTH_RATIO[0] + (DEPTH_RATIO[1] - DEPTH_RATIO[0]) * [0.0, 0.5, 1.0][bone];
        let end = match bone {
            2 => chain.tip(measures) - chain.along[2] * half[3],
            _ => chain.joints[bone + 1],
        };
        parts.push(RoundedCone {
            squash: Some((chain.pads[bone], depth)),
            ..RoundedCone::new(chain.joints[bone], end, [half[bone], half[bone + 1]])
        });
        // The pad bulges between the creases: at half the bone, in the tip beyond it. It is as broad as the finger but
        // flat, as pads are when they touch something. In half breadths: where its middle lies and how deep it is.
        let (place, offset, depth, reach) = match (bone, ray) {
            (0, THUMB) => continue,
            (0, _) => (0.62, 0.27, 0.68, 0.16),
            (1, _) => (0.5, 0.26, 0.64, 0.2),
            _ => (0.5, 0.32, 0.56, 0.3),
        };
        let half_breadth = 0.5 * (half[bone] + half[bone + 1]);
        let center = chain.joints[bone]
            + (end - chain.joints[bone]) * place
            + chain.pads[bone] * (offset * half_breadth);
        let reach = chain.along[bone] * (reach * measures.lengths[bone]);
        parts.push(RoundedCone {
            squash: Some((chain.pads[bone], depth)),
            ..RoundedCone::new(
                center - reach,
                center + reach,
                [PAD_BREADTH * half_breadth; 2],
            )
        });
    }
    parts
}

/// Returns the body of the hand: carpus, metacarpals, the balls of thumb and little finger, webs and the wrist.
fn palm(chains: &[Chain; 5]) -> Vec<RoundedCone> {
    let down = Vector3::new(0.0, -1.0, 0.0);
    let point = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
    let mut parts = Vec::new();
    for (ray, chain) in RAYS.iter().zip(chains) {
        let Some(base) = ray.metacarpal_base.map(Point3::from) else {
            continue;
        };
        let half = ray.half_breadths[0];
        let head = chain.joints[0];
        // The bone lies towards the back; below it are the tendons and pads of the palm.
        parts.push(RoundedCone::new(base, head, [12.0, half - 0.8]));
        let below = head + down * 3.0 + chain.along[0] * 4.0;
        parts.push(RoundedCone::new(
            base + down * 6.0,
            below,
            [11.0, half - 0.6],
        ));
    }
    // Webs between neighbouring fingers, at a third of their first bones, nearer the palm than the back.
    for pair in [[0, 1], [1, 3], [3, 2]] {
        let ends = pair.map(|ray| {
            let chain = &chains[ray];
            chain.joints[0] + chain.along[0] * (0.24 * RAYS[ray].lengths[0]) + down * 3.5
        });
        parts.push(RoundedCone::new(ends[0], ends[1], [7.0, 7.0]));
        // Between the knuckles, and between the pads below them.
        for (beyond, below, radius) in [(3.0, 1.0, 9.0), (8.0, 4.5, 8.5)] {
            let ends = pair
                .map(|ray| chains[ray].joints[0] + chains[ray].along[0] * beyond + down * below);
            parts.push(RoundedCone::new(ends[0], ends[1], [radius; 2]));
        }
    }
    // The ball of the thumb, the thumb's web, the ball of the little finger.
    let thumb = &chains[THUMB];
    let knuckle = thumb.joints[1];
    parts.push(RoundedCone::new(
        point(-16.0, -11.0, 14.0),
        point(-50.0, -19.0, 38.0),
        [11.5, 11.0],
    ));
    parts.push(RoundedCone::new(
        point(-26.0, -14.0, 17.0),
        point(-46.0, -16.5, 28.0),
        [12.5, 12.0],
    ));
    let index_side = chains[0].joints[0];
    parts.push(RoundedCone::new(
        thumb.joints[0] + (knuckle - thumb.joints[0]) * 0.75,
        index_side + point(24.0, -6.0, -4.0).coords,
        [8.0, 9.0],
    ));
    parts.push(RoundedCone::new(
        thumb.joints[0] + (knuckle - thumb.joints[0]) * 0.4,
        index_side + point(42.0, -5.0, -6.0).coords,
        [10.0, 11.0],
    ));
    parts.push(RoundedCone::new(
        point(-18.0, -10.0, -17.0),
        point(-64.0, -11.0, -34.5),
        [12.0, 11.0],
    ));
    // Carpus and wrist: breadth about 60 mm, depth about 39 mm.
    for (z, depth) in [(-13.0, 16.5), (0.0, 18.0), (13.0, 17.0)] {
        parts.push(RoundedCone::new(
            point(30.0, -1.0, z * 0.95),
            point(-4.0, -2.0, z),
            [depth, depth],
        ));
        parts.push(RoundedCone::new(
            point(-4.0, -2.0, z),
            point(-30.0, -2.0, z * 1.1),
            [depth, 13.5],
        ));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounded_cone_is_the_hull_of_its_balls() {
        let (start, end) = (point(1.0, 2.0, 3.0), point(5.0, 2.0, -1.0));
        let cone = RoundedCone::new(start, end, [2.0, 1.0]);
        for i in 0..200 {
            let t = f64::from(i);
            let p = point(
                3.0 + 6.0 * (1.7 * t).sin(),
                2.0 + 5.0 * (2.3 * t).cos(),
                4.0 * (0.7 * t).sin(),
            );
            // The hull is the union of the balls between the two.
            let nearest = (0..=4000)
                .map(|k| f64::from(k) / 4000.0)
                .map(|s| (p - (start + (end - start) * s)).norm() - (2.0 - s))
                .fold(f64::INFINITY, f64::min);
            assert!(
                (cone.value(&p) - nearest).abs() < 1e-4,
                "{} {nearest}",
                cone.value(&p)
            );
        }
    }

    #[test]
    fn every_bone_is_inside_and_the_gaps_between_fingers_are_open() {
        let flesh = ImplicitHand::new();
        let chains = chains();
        for chain in &chains {
            assert!(chain.joints.iter().all(|joint| flesh.value(joint) < -3.0));
        }
        for [a, b] in [[0, 1], [1, 3], [3, 2], [0, 4]] {
            let middle = nalgebra::center(&chains[a].joints[1], &chains[b].joints[1]);
            assert!(flesh.value(&middle) > 0.5, "{a} {b}");
        }
    }

    fn point(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }
}
