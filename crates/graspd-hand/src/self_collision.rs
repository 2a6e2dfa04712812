//! Spheres that stand for a hand of rigid links where it might intersect itself.

use graspd_geom::{Rigid, SignedDistance, Vec3};
use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::articulated::HandDescription;
use crate::contact_points::SurfacePoint;
use crate::{HandOptions, KinematicTree};

/// Radius below which a sphere is not worth its cost \[m\].
const SMALLEST_RADIUS: f64 = 2e-3;
/// Candidate centers along the longest side of a part.
const CANDIDATES_PER_SIDE: f64 = 10.0;
/// Attempts to move a candidate center towards the medial axis.
const CLIMBING_STEPS: usize = 8;
/// What counts as the gap between a surface point and the spheres of a body that has none yet \[m\].
const LARGEST_GAP: f64 = 0.02;
/// Articulations tried when deciding which bodies can meet.
const SAMPLED_ARTICULATIONS: usize = 2000;
/// Bodies whose spheres overlap in this share of all articulations are neighbours that always touch.
const ALWAYS: f64 = 0.9;
/// Spheres that never came this close in any articulation tried are left unpaired \[m\].
const NEVER_CLOSER: f64 = 0.015;

/// A sphere fixed to a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sphere {
    pub(crate) body: usize,
    /// In the body's frame.
    pub(crate) center: Vec3<f64>,
    pub(crate) radius: f64,
}

/// Spheres inscribed in the parts, and the pairs of them that must not overlap.
///
/// Spheres are added one by one, each time the one that takes most off the sum of squared gaps between the hand's
/// surface points and the spheres of their bodies; so thick and large bodies get more of them. `open_poses`: the
/// bodies' poses in the open hand.
pub(crate) fn fit(
    description: &HandDescription,
    solids: &[SignedDistance],
    surface: &[SurfacePoint],
    open_poses: &[Rigid<f64>],
    options: &HandOptions,
) -> (Vec<Sphere>, Vec<[u32; 2]>) {
    let bodies = description.tree.body_count();
    let mut fits: Vec<BodyFit> = (0..bodies)
        .map(|body| {
            let parts = description.parts.iter().zip(solids);
            let own = parts.filter(|(part, _)| part.body == body);
            BodyFit::new(body, own.map(|(_, solid)| solid), surface)
        })
        .collect();
    let mut spheres = Vec::new();
    while spheres.len() < options.collision_spheres {
        let best = (0..bodies).filter_map(|body| Some((body, fits[body].best?.0)));
        let Some((body, _)) = best.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        spheres.extend(fits[body].take_best());
    }
    spheres.sort_by_key(|sphere| sphere.body);
    let pairs = pairs_that_may_meet(&description.tree, &spheres, open_poses, options);
    (spheres, pairs)
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
    fn new<'a>(
        body: usize,
        solids: impl Iterator<Item = &'a SignedDistance>,
        surface: &[SurfacePoint],
    ) -> Self {
        let on_body = surface.iter().filter(|point| point.body == body);
        let surface: Vec<Vec3<f64>> = on_body.map(|point| point.position).collect();
        let mut fit = Self {
            gaps: vec![LARGEST_GAP; surface.len()],
            surface,
            candidates: solids.flat_map(|solid| inscribed(solid, body)).collect(),
            best: None,
        };
        fit.find_best();
        fit
    }

    fn find_best(&mut self) {
        let gain = |sphere: &Sphere| -> f64 {
            let terms = self.surface.iter().zip(&self.gaps).map(|(point, &gap)| {
                let new_gap = gap_to(sphere, *point);
                if new_gap < gap {
                    gap * gap - new_gap * new_gap
                } else {
                    0.0
                }
            });
            terms.sum()
        };
        let gains = self.candidates.iter().map(gain).enumerate();
        self.best = gains
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

fn gap_to(sphere: &Sphere, point: Vec3<f64>) -> f64 {
    ((point - sphere.center).norm() - sphere.radius).max(0.0)
}

/// Spheres inside a part that touch its surface, about a grid of centers that climb towards the medial axis.
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
                if radius >= SMALLEST_RADIUS {
                    spheres.push(Sphere {
                        body,
                        center: center.into(),
                        radius,
                    });
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

/// Pairs of spheres that can come close and belong to bodies that do not always touch.
fn pairs_that_may_meet(
    tree: &KinematicTree,
    spheres: &[Sphere],
    open_poses: &[Rigid<f64>],
    options: &HandOptions,
) -> Vec<[u32; 2]> {
    let bodies = tree.body_count();
    let is_adjacent = |a: usize, b: usize| tree.parent(a) == Some(b) || tree.parent(b) == Some(a);
    let mut pairs: Vec<([usize; 2], f64)> = Vec::new();
    for a in 0..spheres.len() {
        for b in a + 1..spheres.len() {
            let (body_a, body_b) = (spheres[a].body, spheres[b].body);
            if body_a != body_b && !is_adjacent(body_a, body_b) {
                pairs.push(([a, b], f64::INFINITY));
            }
        }
    }
    let mut centers = vec![Vec3::zero(); spheres.len()];
    let mut overlap_count = vec![0_usize; bodies * bodies];
    // Visits the clearance of every pair, and marks each pair of bodies that overlaps.
    let mut measure =
        |poses: &[Rigid<f64>], pairs: &mut Vec<([usize; 2], f64)>, count: &mut [usize]| {
            for (center, sphere) in centers.iter_mut().zip(spheres) {
                *center = poses[sphere.body].apply(sphere.center);
            }
            let mut is_overlapping = vec![false; bodies * bodies];
            for ([a, b], closest) in pairs.iter_mut() {
                let radii = spheres[*a].radius + spheres[*b].radius;
                let clearance = (centers[*a] - centers[*b]).norm() - radii;
                *closest = closest.min(clearance);
                if clearance < 0.0 {
                    is_overlapping[spheres[*a].body * bodies + spheres[*b].body] = true;
                }
            }
            for (count, is_overlapping) in count.iter_mut().zip(is_overlapping) {
                *count += usize::from(is_overlapping);
            }
        };
    let body_pair = |[a, b]: [usize; 2]| spheres[a].body * bodies + spheres[b].body;

    measure(open_poses, &mut pairs, &mut overlap_count);
    pairs.retain(|(pair, _)| overlap_count[body_pair(*pair)] == 0);

    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let mut poses = open_poses.to_vec();
    for sample in 0..SAMPLED_ARTICULATIONS {
        let mut draw = |limit: &crate::Limit| {
            let value = limit.sample(&mut random);
            // Half of the articulations are extreme: there bodies reach farthest.
            let is_high = value > limit.middle();
            match (sample % 2 == 0, is_high) {
                (true, true) if limit.upper.is_finite() => limit.upper,
                (true, false) if limit.lower.is_finite() => limit.lower,
                _ => value,
            }
        };
        let articulation: Vec<f64> = tree.limits().iter().map(&mut draw).collect();
        tree.forward(&Rigid::identity(), &articulation, &mut poses);
        measure(&poses, &mut pairs, &mut overlap_count);
    }
    let too_often = (ALWAYS * SAMPLED_ARTICULATIONS as f64) as usize;
    pairs.retain(|(pair, closest)| {
        *closest < NEVER_CLOSER && overlap_count[body_pair(*pair)] <= too_often
    });
    if pairs.len() > options.collision_pairs {
        pairs.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        pairs.truncate(options.collision_pairs);
        pairs.sort_by_key(|(pair, _)| *pair);
    }
    let narrow = |[a, b]: [usize; 2]| [a as u32, b as u32];
    pairs.into_iter().map(|(pair, _)| narrow(pair)).collect()
}
