//! Very many points on a hand's surface, of which only those near the object are ever looked at.

use graspd_geom::TriangleMesh;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::distance_field::{Answer, DistanceField, LookUpScratch, Query};
use crate::skin::{Place, SkinSamples};

/// Points in a patch.
const MAX_POINTS: usize = 32;
/// Faces of skin become at most this much longer when it moves; rigid ones do not.
const STRETCH: f64 = 1.5;

/// Points next to each other in one face.
#[derive(Clone, Debug)]
struct Patch {
    first: usize,
    last: usize,
    middle: Place,
    /// No point is farther from the middle \[m\].
    radius: f64,
}

/// Points on a surface in patches.
#[derive(Clone, Debug)]
pub(crate) struct SkinPatches {
    skin: SkinSamples,
    patches: Vec<Patch>,
}

impl SkinPatches {
    /// About `count` points and all vertices: where a hand digs in first.
    pub(crate) fn on(surface: &TriangleMesh, count: usize) -> Self {
        let mut skin = SkinSamples::dense_on(surface, count);
        let places = skin.places_mut();
        places.par_sort_by_key(|place| place.corners);
        let faces = places.par_chunk_by_mut(|a, b| a.corners == b.corners);
        faces.for_each(sort_into_patches);
        let mut patches = Vec::new();
        let mut first = 0;
        for face in places.chunk_by(|a, b| a.corners == b.corners) {
            let count = face.len().div_ceil(MAX_POINTS);
            for points in face.chunks(face.len().div_ceil(count)) {
                patches.push(Patch::around(points, first, &surface.vertices));
                first += points.len();
            }
        }
        Self { skin, patches }
    }

    /// The points that are nearer to the object than this, of a hand with these vertices; by a
    /// field whose distances are off by up to `off` \[m\].
    pub(crate) fn nearer_than(
        &self,
        distance: f64,
        (field, off): (&dyn DistanceField, f64),
        vertices: &[Point3<f64>],
    ) -> (SkinSamples, Vec<f64>) {
        let middles = self.patches.iter().map(|patch| patch.middle.at(vertices));
        let answers = look_up(field, middles);
        let near = (self.patches.iter().zip(&answers))
            .filter(|(patch, answer)| answer.distance < distance + patch.radius + 2.0 * off);
        let points: Vec<usize> = near
            .flat_map(|(patch, _)| patch.first..patch.last)
            .collect();
        let places = points
            .iter()
            .map(|&point| self.skin.position(vertices, point));
        let answers = look_up(field, places);
        let near = (points.iter().zip(&answers)).filter(|(_, answer)| answer.distance < distance);
        let (points, distances): (Vec<usize>, Vec<f64>) = near
            .map(|(point, answer)| (*point, answer.distance))
            .unzip();
        (self.skin.only(&points), distances)
    }
}

impl Patch {
    fn around(points: &[Place], first: usize, vertices: &[Point3<f64>]) -> Self {
        let mut middle = points[0];
        middle.shares = [0, 1, 2]
            .map(|k| points.iter().map(|point| point.shares[k]).sum::<f64>() / points.len() as f64);
        let center = middle.at(vertices);
        let farthest = (points.iter())
            .map(|point| (point.at(vertices) - center).norm())
            .fold(0.0, f64::max);
        Self {
            first,
            last: first + points.len(),
            middle,
            radius: STRETCH * farthest,
        }
    }
}

fn look_up(field: &dyn DistanceField, places: impl Iterator<Item = Vector3<f64>>) -> Vec<Answer> {
    let queries: Vec<_> = places.map(|at| Query { at, seen: None }).collect();
    let mut answers = Vec::new();
    field.look_up(&queries, &mut LookUpScratch::default(), &mut answers);
    answers
}

/// Sorts the points of a face so that runs of equal length lie together.
fn sort_into_patches(points: &mut [Place]) {
    if points.len() <= MAX_POINTS {
        return;
    }
    let spread = |k: usize| {
        let shares = points.iter().map(|point| point.shares[k]);
        let (low, high) = shares.fold((f64::MAX, f64::MIN), |(low, high), share| {
            (low.min(share), high.max(share))
        });
        high - low
    };
    let spreads = [spread(0), spread(1), spread(2)];
    let widest = (0..3).max_by(|a, b| spreads[*a].total_cmp(&spreads[*b]));
    let widest = widest.unwrap_or(0);
    points.sort_by(|a, b| a.shares[widest].total_cmp(&b.shares[widest]));
    let patches = points.len().div_ceil(MAX_POINTS);
    let length = points.len().div_ceil(patches);
    let (one, other) = points.split_at_mut(patches.div_ceil(2) * length);
    sort_into_patches(one);
    sort_into_patches(other);
}
