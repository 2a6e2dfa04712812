//! How different grasps are, and how to keep a spread of them.

use graspd_eval::GraspMetrics;
use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPose, Kinematics, PointBuffer};
use serde::{Deserialize, Serialize};

use crate::record::GraspRecord;

/// How far grasps are from each other, by [`pose_distances`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diversity {
    /// Mean over all pairs \[mm\].
    pub mean_distance_mm: f64,
    /// Mean over the grasps of the distance to the nearest other \[mm\].
    pub mean_nearest_mm: f64,
    /// The least of all distances \[mm\].
    pub least_distance_mm: f64,
}

impl Diversity {
    /// Of a square table of distances \[m\]; `None` for fewer than two grasps.
    pub fn of(distances: &[Vec<f64>]) -> Option<Self> {
        let count = distances.len();
        if count < 2 {
            return None;
        }
        let others = |a: usize| {
            (0..count)
                .filter(move |b| *b != a)
                .map(move |b| distances[a][b])
        };
        let nearest = |a: usize| others(a).fold(f64::INFINITY, f64::min);
        let pairs = (count * (count - 1)) as f64;
        Some(Self {
            mean_distance_mm: 1e3 * (0..count).flat_map(others).sum::<f64>() / pairs,
            mean_nearest_mm: 1e3 * (0..count).map(nearest).sum::<f64>() / count as f64,
            least_distance_mm: 1e3 * (0..count).map(nearest).fold(f64::INFINITY, f64::min),
        })
    }
}

/// The distance of every pose from every other \[m\], `[n][n]`: the mean over the hand's contact points of how far
/// apart they are in the object's frame. It sees base and joints alike, in the one unit that counts.
pub fn pose_distances(hand: &dyn Hand, poses: &[&HandPose]) -> Vec<Vec<f64>> {
    let weight = &hand.contact_points().weight;
    let mut scratch = hand.new_scratch();
    let mut points = PointBuffer::<f64>::zeros(weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    let places: Vec<Vec<Vec3<f64>>> = (poses.iter())
        .map(|pose| {
            Kinematics::<f64>::forward(hand, pose, &mut scratch, &mut points, &mut spheres);
            let counts = (0..points.len()).filter(|k| weight[*k] > 0.0);
            counts.map(|k| points.get(k)).collect()
        })
        .collect();
    let distance = |a: &[Vec3<f64>], b: &[Vec3<f64>]| {
        let sum: f64 = a.iter().zip(b).map(|(p, q)| (*p - *q).norm()).sum();
        sum / a.len().max(1) as f64
    };
    (places.iter())
        .map(|a| places.iter().map(|b| distance(a, b)).collect())
        .collect()
}

/// The numbers, in rising order, of `count` of the ranked records that are far from each other: the first, and then
/// one after the other the one farthest from those chosen, of those that hold ([`GraspMetrics::holds`]). Where
/// too few hold, the next in rank follow.
///
/// `distances`: `[n][n]`, see [`pose_distances`].
///
/// # Source
/// T. F. Gonzalez, "Clustering to minimize the maximum intercluster distance", Theoretical Computer Science 38, 1985
/// (farthest-point traversal).
pub fn diverse(records: &[GraspRecord], distances: &[Vec<f64>], count: usize) -> Vec<usize> {
    let holds = |record: &GraspRecord| {
        let metrics = record.metrics.as_ref();
        metrics.and_then(GraspMetrics::holds) == Some(true)
    };
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < count.min(records.len()) {
        let left = || (0..records.len()).filter(|k| !chosen.contains(k));
        let remoteness = |k: usize| {
            let distances = chosen.iter().map(|c| distances[k][*c]);
            distances.fold(f64::INFINITY, f64::min)
        };
        let farthest = (left().filter(|k| holds(&records[*k]))).fold(None, |best, k| match best {
            Some((_, most)) if remoteness(k) <= most => best,
            _ => Some((k, remoteness(k))),
        });
        match farthest.map(|(k, _)| k).or_else(|| left().next()) {
            Some(next) => chosen.push(next),
            None => break,
        }
    }
    chosen.sort_unstable();
    chosen
}
