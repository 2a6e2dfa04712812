//! Spheres along the bones of a skinned hand, so that its fingers do not pass through each other.

use graspd_geom::Vec3;
use nalgebra::Vector3;

use super::fingers::{Fingers, KNUCKLES, heaviest};
use super::model::{SKINNED_JOINTS, SkinnedModel};
use crate::CollisionSpheres;

/// How far from a bone its spheres reach: some share of the way to the skin that so large a part of it is nearer than.
#[derive(Clone, Copy)]
struct Reach {
    part: f64,
    share: f64,
}

/// Fingers are a little broader than deep; flesh gives a little.
const OF_FINGERS: Reach = Reach {
    part: 0.5,
    share: 0.97,
};
/// Most of the palm's skin belongs to other metacarpals.
const OF_PALM: Reach = Reach {
    part: 0.25,
    share: 0.9,
};
/// Overlap in the open pose from which on a pair of spheres is left alone \[m\].
const TOUCHING: f64 = 0.0;
/// Distance of neighbours on a bone, in radii: half way between two of them their union is 0.9 radii thick.
const SPACING: f64 = 0.9;
/// Spheres of one bone at most.
const MAX_ON_BONE: f64 = 6.0;

/// Returns the spheres, and their centers in the straight pose, model coordinates \[m\].
pub(crate) fn along_bones(
    model: &SkinnedModel,
    vertices: &[Vec3<f64>],
    fingers: &Fingers,
    open_frames: impl Fn(usize, Vec3<f64>) -> Vec3<f64>,
) -> (CollisionSpheres, Vec<Vec3<f64>>) {
    let mut spheres = CollisionSpheres::default();
    let mut centers = Vec::new();
    let mut cover = |body: usize, from: Vector3<f64>, to: Vector3<f64>, radius: f64| {
        if radius <= 0.0 {
            return;
        }
        let count = ((to - from).norm() / (SPACING * radius))
            .ceil()
            .clamp(1.0, MAX_ON_BONE);
        for index in 0..count as usize {
            // At the joints the neighbours' spheres cover.
            let share = (index as f64 + 0.5) / count;
            centers.push(Vec3::from(from + (to - from) * share));
            spheres.radius.push(radius);
            spheres.body.push(body as u32);
        }
    };
    for joint in 1..SKINNED_JOINTS {
        let (from, mut to) = (fingers.joints[joint], fingers.bone_end(joint));
        let radius = radius(model, vertices, joint, [from, to], OF_FINGERS);
        if joint.is_multiple_of(3) {
            // The tip lies on the skin.
            let length = (to - from).norm();
            to = from + (to - from) * (1.0 - radius / length.max(1e-9)).max(0.0);
        }
        cover(joint, from, to, radius);
    }
    for knuckle in KNUCKLES {
        let (from, to) = (fingers.joints[0], fingers.joints[knuckle]);
        // The wrist's half is left out: no finger reaches it.
        let from = from + (to - from) * 0.4;
        let radius = radius(model, vertices, 0, [from, to], OF_PALM);
        cover(0, from, to, radius);
    }
    let open: Vec<Vec3<f64>> = centers
        .iter()
        .zip(&spheres.body)
        .map(|(&center, &body)| open_frames(body as usize, center))
        .collect();
    spheres.pairs = pairs(&spheres, &open);
    (spheres, centers)
}

/// Returns the radius of spheres on a bone, from the distances of the skin that follows it.
fn radius(
    model: &SkinnedModel,
    vertices: &[Vec3<f64>],
    joint: usize,
    [from, to]: [Vector3<f64>; 2],
    reach: Reach,
) -> f64 {
    let bone = to - from;
    let length_squared = bone.norm_squared().max(1e-12);
    let own = (0..vertices.len()).filter(|&v| heaviest(&model.weights[v]) == joint);
    let beside = own.filter_map(|v| {
        let offset = Vector3::from(vertices[v]) - from;
        let along = offset.dot(&bone) / length_squared;
        (0.0..=1.0)
            .contains(&along)
            .then(|| (offset - bone * along).norm())
    });
    let mut distances: Vec<f64> = beside.collect();
    distances.sort_by(f64::total_cmp);
    let nearer = (reach.part * distances.len() as f64) as usize;
    distances.get(nearer).map_or(0.0, |d| d * reach.share)
}

/// Returns pairs of spheres of different fingers, or of a finger's outer bones and the palm, that are apart in the
/// open hand.
fn pairs(spheres: &CollisionSpheres, open: &[Vec3<f64>]) -> Vec<[u32; 2]> {
    let finger = |body: u32| body.div_ceil(3);
    let mut pairs = Vec::new();
    for a in 0..open.len() {
        for b in a + 1..open.len() {
            let (first, second) = (spheres.body[a], spheres.body[b]);
            let same = finger(first) == finger(second);
            // A finger's first bone rubs against the palm as it bends.
            let adjacent = (first == 0 && second % 3 == 1) || (second == 0 && first % 3 == 1);
            let gap = (open[a] - open[b]).norm() - spheres.radius[a] - spheres.radius[b];
            if !same && !adjacent && gap > TOUCHING {
                pairs.push([a as u32, b as u32]);
            }
        }
    }
    pairs
}
