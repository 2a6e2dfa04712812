//! Spheres that stand for a hand of rigid links where it might intersect itself.

use graspd_geom::{Rigid, SignedDistance, Vec3};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::body_motion::BodyMotion;
use crate::collision_pairs::{SampledPoses, Sphere};
use crate::contact_points::SurfacePoint;
use crate::{HandOptions, Part};

/// Radius below which a sphere is not worth its cost \[m\].
const MIN_RADIUS: f64 = 2e-3;
/// Candidate centers along the longest side of a part.
const CANDIDATES_PER_SIDE: f64 = 8.0;
/// Attempts to move a candidate center towards the medial axis.
const CLIMBING_STEPS: usize = 8;
/// How far spheres may stand out of their parts, in their radii and at most \[m\]: inscribed ones alone leave edges
/// and corners uncovered, with which fingers would dig into each other unseen.
const PROTRUSIONS: [f64; 4] = [0.0, 0.07, 0.14, 0.21];
const MAX_PROTRUSION: f64 = 2e-3;
/// What counts as the gap between a surface point and the spheres of a body that has none yet \[m\].
const MAX_GAP: f64 = 0.02;
/// Candidates that are not worth sharing among threads.
const MIN_CANDIDATES_PER_TASK: usize = 64;
/// Surface points looked at.
const MAX_SURFACE_POINTS: usize = 1500;

/// Fits spheres that stand for the parts, and chooses the pairs of them that must not overlap; the open hand has no
/// overlap.
///
/// Spheres are added one by one, each time the one that takes most off the sum of squared distances between surface
/// points and the union of the spheres of their bodies, whether they lie outside it or within. A first round looks at
/// the whole surface; the final one only at those points that other bodies, as the first round's spheres, can come
/// near to. `open_poses`: the bodies' poses in the open hand.
pub(crate) fn fit(
    parts: &[Part],
    motion: &dyn BodyMotion,
    solids: &[SignedDistance],
    surface: &[SurfacePoint],
    open_poses: &[Rigid<f64>],
    options: &HandOptions,
) -> (Vec<Sphere>, Vec<[u32; 2]>) {
    let wanted = options.collision_spheres;
    if wanted == 0 {
        return (Vec::new(), Vec::new());
    }
    let bodies = motion.body_names().len();
    let parts = parts.par_iter().zip(solids);
    let candidates: Vec<Sphere> = parts
        .flat_map_iter(|(part, solid)| inscribed(solid, part.body))
        .collect();
    let surface: Vec<SurfacePoint> = surface
        .iter()
        .step_by(surface.len().div_ceil(MAX_SURFACE_POINTS))
        .copied()
        .collect();
    let first_round = most_useful(&candidates, &surface, bodies, wanted);
    let sampled = SampledPoses::new(motion, open_poses, options.seed);
    let reachable = sampled.reachable_points(&first_round, &surface);
    let mut spheres = most_useful(&candidates, &reachable, bodies, wanted);
    let mut pairs = sampled.pairs_that_may_meet(&spheres);
    part_in_open_hand(&mut spheres, &pairs, open_poses);
    pairs.truncate(options.collision_pairs);
    (spheres, pairs)
}

/// Takes from the spheres' protrusion what would overlap in the open hand.
fn part_in_open_hand(spheres: &mut [Sphere], pairs: &[[u32; 2]], open_poses: &[Rigid<f64>]) {
    for pair in pairs {
        let [a, b] = pair.map(|sphere| sphere as usize);
        let [at_a, at_b] = [a, b].map(|s| open_poses[spheres[s].body].apply(spheres[s].center));
        let room = (at_a - at_b).norm() - spheres[a].inscribed - spheres[b].inscribed;
        let [out_a, out_b] = [a, b].map(|s| spheres[s].radius - spheres[s].inscribed);
        let wanted = out_a + out_b;
        if wanted > room {
            // A little less, for the rounding of whoever asks again.
            let share = (room / wanted).max(0.0) * (1.0 - 1e-9);
            spheres[a].radius = spheres[a].inscribed + share * out_a;
            spheres[b].radius = spheres[b].inscribed + share * out_b;
        }
    }
}

/// Chooses up to `count` of the candidates, the most useful first.
fn most_useful(
    candidates: &[Sphere],
    surface: &[SurfacePoint],
    bodies: usize,
    count: usize,
) -> Vec<Sphere> {
    let mut fits: Vec<BodyFit> = (0..bodies)
        .into_par_iter()
        .map(|body| BodyFit::new(body, candidates, surface))
        .collect();
    let mut spheres = Vec::new();
    while spheres.len() < count {
        let best = (0..bodies).filter_map(|body| Some((body, fits[body].best?.0)));
        let Some((body, _)) = best.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        spheres.extend(fits[body].take_best());
    }
    spheres
}

/// The greedy choice within one body.
struct BodyFit {
    surface: Vec<Vec3<f64>>,
    gaps: Vec<f64>,
    candidates: Vec<Sphere>,
    /// Gain and index of the best candidate.
    best: Option<(f64, usize)>,
}

impl BodyFit {
    fn new(body: usize, candidates: &[Sphere], surface: &[SurfacePoint]) -> Self {
        let on_body = surface.iter().filter(|point| point.body == body);
        let surface: Vec<Vec3<f64>> = on_body.map(|point| point.position).collect();
        let own = candidates.iter().filter(|sphere| sphere.body == body);
        let mut fit = Self {
            gaps: vec![MAX_GAP; surface.len()],
            surface,
            candidates: own.copied().collect(),
            best: None,
        };
        fit.find_best();
        fit
    }

    fn find_best(&mut self) {
        let gain = |sphere: &Sphere| -> f64 {
            let terms = self.surface.iter().zip(&self.gaps).map(|(point, &gap)| {
                let new_gap = gap.min(gap_to(sphere, *point));
                gap * gap - new_gap * new_gap
            });
            terms.sum()
        };
        let gains = self
            .candidates
            .par_iter()
            .with_min_len(MIN_CANDIDATES_PER_TASK);
        let gains: Vec<f64> = gains.map(gain).collect();
        self.best = (gains.into_iter().enumerate())
            .filter(|&(_, gain)| gain > 0.0)
            .map(|(index, gain)| (gain, index))
            .max_by(|a, b| a.0.total_cmp(&b.0));
    }

    fn take_best(&mut self) -> Option<Sphere> {
        let (_, index) = self.best?;
        let sphere = self.candidates[index];
        for (point, gap) in self.surface.iter().zip(&mut self.gaps) {
            *gap = gap.min(gap_to(&sphere, *point));
        }
        self.find_best();
        Some(sphere)
    }
}

/// Returns how far a point is out of a sphere; negative inside.
fn gap_to(sphere: &Sphere, point: Vec3<f64>) -> f64 {
    (point - sphere.center).norm() - sphere.radius
}

/// Returns spheres inside a part that touch its surface, about a grid of centers that climb towards the medial axis,
/// and the same standing out a little.
fn inscribed(solid: &SignedDistance, body: usize) -> Vec<Sphere> {
    let (low, high) = solid.bounds();
    let (center, size) = (nalgebra::center(&low, &high), high - low);
    let spacing = size.max() / CANDIDATES_PER_SIDE;
    // As many steps to either side, so that planes of symmetry carry candidates.
    let steps = size.map(|side| (0.5 * side / spacing).floor() as i32);
    let mut spheres = Vec::new();
    for i in -steps.x..=steps.x {
        for j in -steps.y..=steps.y {
            for k in -steps.z..=steps.z {
                let offset = Vector3::new(f64::from(i), f64::from(j), f64::from(k));
                let (center, radius) = climb(solid, center + spacing * offset, 0.5 * spacing);
                if radius >= MIN_RADIUS {
                    spheres.extend(PROTRUSIONS.map(|share| Sphere {
                        body,
                        center: center.into(),
                        radius: radius + (share * radius).min(MAX_PROTRUSION),
                        inscribed: radius,
                    }));
                }
            }
        }
    }
    spheres
}

/// Moves away from the nearest surface while that leads deeper, halving the step where it does not; gives the
/// point reached and its depth, which is negative for a start outside.
fn climb(solid: &SignedDistance, start: Point3<f64>, step: f64) -> (Point3<f64>, f64) {
    let (mut position, mut step) = (start, step);
    let (mut distance, mut outward) = solid.distance_and_gradient(&start);
    if distance >= 0.0 {
        return (start, -distance);
    }
    for _ in 0..CLIMBING_STEPS {
        let moved = position - step * outward;
        let (moved_distance, moved_outward) = solid.distance_and_gradient(&moved);
        // Half the full gain: across the medial axis the rise is less, on a plateau of it there is none.
        if moved_distance < distance - 0.5 * step {
            (position, distance, outward) = (moved, moved_distance, moved_outward);
        } else {
            step *= 0.5;
        }
    }
    (position, -distance)
}
