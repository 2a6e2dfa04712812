//! How much each vertex of the skin follows each bone.

use graspd_geom::TriangleMesh;
use nalgebra::{Point3, Vector3};

use super::proportions::{Chain, MM, RAYS, THUMB, chains};
use crate::mano::SKINNED_JOINTS;

/// Over which distance on either side of a joint the skin passes from one bone to the next, in half breadths of the
/// finger there: at the first joint, which lies deep in the palm, and at the others.
const ROOT_WIDTH: f64 = 1.25;
const HINGE_WIDTH: f64 = 0.8;
/// How far the border at a finger's first joint leans towards the tip on the side of the palm (tangent): fingers fold
/// at the crease, well beyond the joint.
const ROOT_LEAN: f64 = 0.45;
/// How sharply the skin is divided between neighbouring fingers, and between the thumb and the rest. Distances to
/// fingers are from within the flesh, this part of the half breadth from the bone: close fingers stay apart.
const FINGER_SHARPNESS: i32 = 8;
const FINGER_DEPTH: f64 = 0.6;
const THUMB_SHARPNESS: i32 = 4;
/// Parts below this are dropped.
const MIN_WEIGHT: f64 = 0.01;
/// Rounds of averaging with the neighbours.
const SMOOTHING_ROUNDS: usize = 1;

/// Returns the weights of every vertex of the skin \[m\]; rows are non-negative and sum to 1.
pub(crate) fn skin_weights(skin: &TriangleMesh) -> Vec<[f64; SKINNED_JOINTS]> {
    let chains = chains();
    let mut weights: Vec<_> = (skin.vertices.iter())
        .map(|p| weights_at(&chains, &(p / MM)))
        .collect();
    for _ in 0..SMOOTHING_ROUNDS {
        weights = smoothed(skin, &weights);
    }
    weights.iter_mut().for_each(drop_small);
    weights
}

/// Rises smoothly from 0 at -1 to 1 at 1.
fn step(x: f64) -> f64 {
    let t = (0.5 + 0.5 * x).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn distance_to_segment(p: &Point3<f64>, start: &Point3<f64>, end: &Point3<f64>) -> f64 {
    let along: Vector3<f64> = end - start;
    let part = (p - start).dot(&along) / along.norm_squared();
    (p - (start + along * part.clamp(0.0, 1.0))).norm()
}

/// Distance to the middle line of a ray, from its first joint to the tip of the skin.
fn distance_to_chain(p: &Point3<f64>, ray: usize, chain: &Chain) -> f64 {
    let [first, second, third, _] = chain.joints;
    let tip = chain.tip(&RAYS[ray]);
    ([[first, second], [second, third], [third, tip]].iter())
        .map(|[start, end]| distance_to_segment(p, start, end))
        .fold(f64::INFINITY, f64::min)
}

/// Returns how far the skin at `p` has passed each of a ray's joints, from 0 to 1.
fn passed(p: &Point3<f64>, ray: usize, chain: &Chain) -> [f64; 3] {
    std::array::from_fn(|joint| {
        let from = p - chain.joints[joint];
        // Across a joint the border halves the angle between the bones.
        let across = match joint {
            0 => chain.along[0],
            _ => (chain.along[joint - 1] + chain.along[joint]).normalize(),
        };
        let half = RAYS[ray].half_breadths[joint];
        match (joint, ray) {
            (0, THUMB) => step(from.dot(&across) / (ROOT_WIDTH * half)),
            (0, _) => {
                let lean = ROOT_LEAN * from.dot(&chain.pads[0]);
                step((from.dot(&across) - lean) / (ROOT_WIDTH * half))
            }
            _ => step(from.dot(&across) / (HINGE_WIDTH * half)),
        }
    })
}

fn weights_at(chains: &[Chain; 5], p: &Point3<f64>) -> [f64; SKINNED_JOINTS] {
    let distances: [f64; 5] = std::array::from_fn(|ray| distance_to_chain(p, ray, &chains[ray]));
    let to_palm = (RAYS.iter())
        .filter_map(|ray| Some((Point3::from(ray.metacarpal_base?), Point3::from(ray.base))))
        .map(|(base, head)| distance_to_segment(p, &base, &head))
        .fold(f64::INFINITY, f64::min);
    let to_others = distances[..THUMB].iter().copied().fold(to_palm, f64::min);
    let of_thumb = 1.0 / (1.0 + (distances[THUMB] / to_others).powi(THUMB_SHARPNESS));
    let nearness: [f64; 5] = std::array::from_fn(|ray| {
        let depth = FINGER_DEPTH * RAYS[ray].half_breadths[1];
        (1.0 / (distances[ray] - depth).max(1.0)).powi(FINGER_SHARPNESS)
    });
    let of_fingers: f64 = nearness[..THUMB].iter().sum();

    let mut weights = [0.0; SKINNED_JOINTS];
    let thumb_total = of_thumb * passed(p, THUMB, &chains[THUMB])[0];
    for (ray, chain) in chains.iter().enumerate() {
        let passed = passed(p, ray, chain);
        let total = if ray == THUMB {
            thumb_total
        } else {
            (1.0 - thumb_total) * nearness[ray] / of_fingers * passed[0]
        };
        let first = RAYS[ray].first_joint;
        weights[first] = total * (1.0 - passed[1]);
        weights[first + 1] = total * passed[1] * (1.0 - passed[2]);
        weights[first + 2] = total * passed[1] * passed[2];
    }
    weights[0] = 1.0 - weights[1..].iter().sum::<f64>();
    drop_small(&mut weights);
    weights
}

fn drop_small(weights: &mut [f64; SKINNED_JOINTS]) {
    weights
        .iter_mut()
        .filter(|w| **w < MIN_WEIGHT)
        .for_each(|w| *w = 0.0);
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
}

/// Half of each vertex's weights, and half the mean of its neighbours'.
fn smoothed(skin: &TriangleMesh, weights: &[[f64; SKINNED_JOINTS]]) -> Vec<[f64; SKINNED_JOINTS]> {
    // Every edge of a closed mesh is met once in each direction.
    let mut sums = vec![([0.0; SKINNED_JOINTS], 0.0); weights.len()];
    for &[a, b, c] in &skin.faces {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let (sum, count) = &mut sums[to as usize];
            sum.iter_mut()
                .zip(&weights[from as usize])
                .for_each(|(sum, w)| *sum += w);
            *count += 1.0;
        }
    }
    (weights.iter().zip(sums))
        .map(|(own, (sum, count))| std::array::from_fn(|j| 0.5 * own[j] + 0.5 * sum[j] / count))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::human::skin::skin;

    #[test]
    fn weights_are_shares_and_tips_follow_their_own_bone() {
        let skin = skin();
        let weights = skin_weights(&skin);
        for row in &weights {
            assert!(row.iter().all(|&w| (0.0..=1.0).contains(&w)));
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        let nearest = |p: Point3<f64>| {
            let distance = |v: &usize| (skin.vertices[*v] - p).norm_squared();
            (0..skin.vertices.len())
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .unwrap()
        };
        for (ray, chain) in RAYS.iter().zip(chains()) {
            let tip = nearest(chain.tip(ray) * MM);
            assert!(weights[tip][ray.first_joint + 2] > 0.999, "{}", ray.name);
        }
        let palm = nearest(Point3::new(-0.055, -0.02, -0.01));
        assert!(weights[palm][0] > 0.95, "{:?}", weights[palm]);
    }

    #[test]
    fn no_finger_moves_the_skin_of_another() {
        let skin = skin();
        for (p, row) in skin.vertices.iter().zip(skin_weights(&skin)) {
            // Beyond the webs each vertex belongs to one finger.
            let rays = RAYS.iter().map(|ray| {
                row[ray.first_joint..ray.first_joint + 3]
                    .iter()
                    .sum::<f64>()
            });
            if p.x < -0.135 {
                assert!(rays.fold(0.0, f64::max) > 0.9, "{p}");
            }
        }
    }
}
