//! Which places of a hand can meet which others, found by trying articulations.

use graspd_geom::{Rigid, Vec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::Limit;
use crate::body_motion::BodyMotion;
use crate::contact_points::SurfacePoint;

/// Articulations tried for pairs of spheres.
const SAMPLES: usize = 1000;
/// Articulations tried for surface points: each needs to be met only once, and its neighbours tell as much.
const SAMPLES_FOR_SURFACE: usize = 250;
/// Bodies whose spheres overlap in more than this share of all articulations are neighbours that always touch.
const ALWAYS: f64 = 0.9;
/// What never came closer than this in any articulation tried is taken never to meet \[m\].
const MAX_CLEARANCE: f64 = 0.01;

/// A sphere fixed to a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sphere {
    pub(crate) body: usize,
    /// In the body's frame.
    pub(crate) center: Vec3<f64>,
    pub(crate) radius: f64,
    /// The radius of the sphere of that center that just stays inside the part.
    pub(crate) inscribed: f64,
}

/// The bodies' poses in many articulations, the open hand first.
pub(crate) struct SampledPoses<'a> {
    motion: &'a dyn BodyMotion,
    /// The bodies' poses for each articulation.
    poses: Vec<Vec<Rigid<f64>>>,
}

impl<'a> SampledPoses<'a> {
    /// Tries articulations, half of them drawn evenly within the limits and half of them at the limits, where bodies
    /// reach farthest.
    pub(crate) fn new(motion: &'a dyn BodyMotion, open_poses: &[Rigid<f64>], seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut poses = vec![open_poses.to_vec()];
        for sample in 0..SAMPLES {
            let mut draw = |limit: &Limit| {
                let value = limit.sample(&mut random);
                if sample % 2 == 0 {
                    value
                } else {
                    nearest_bound(limit, value)
                }
            };
            let articulation: Vec<f64> = motion.limits().iter().map(&mut draw).collect();
            poses.push(motion.body_poses(&articulation));
        }
        Self { motion, poses }
    }

    /// Tells whether two bodies move against each other other than about a joint between them.
    fn can_collide(&self, a: usize, b: usize) -> bool {
        a != b && self.motion.parent(a) != Some(b) && self.motion.parent(b) != Some(a)
    }

    /// Returns the points that spheres of other bodies, parents and children excepted, come near to.
    pub(crate) fn reachable_points(
        &self,
        spheres: &[Sphere],
        points: &[SurfacePoint],
    ) -> Vec<SurfacePoint> {
        let mut is_reached = vec![false; points.len()];
        for poses in self.poses.iter().take(SAMPLES_FOR_SURFACE) {
            let centers = centers(spheres, poses);
            for (is_reached, point) in is_reached.iter_mut().zip(points) {
                if *is_reached {
                    continue;
                }
                let position = poses[point.body].apply(point.position);
                *is_reached = spheres.iter().zip(&centers).any(|(sphere, center)| {
                    let reach = sphere.radius + MAX_CLEARANCE;
                    (*center - position).norm_squared() < reach * reach
                        && self.can_collide(sphere.body, point.body)
                });
            }
        }
        let reached = points.iter().zip(is_reached);
        reached
            .filter_map(|(point, is_reached)| is_reached.then_some(*point))
            .collect()
    }

    /// Returns the pairs of spheres that can come close, nearest first; none of one body, of a body and its parent,
    /// or of two bodies that overlap, as their inscribed spheres tell, in the open hand or nearly always.
    pub(crate) fn pairs_that_may_meet(&self, spheres: &[Sphere]) -> Vec<[u32; 2]> {
        let mut pairs = self.candidate_pairs(spheres);
        let mut overlaps = BodyPairs::new(self.motion.body_names().len());
        overlaps.visit(spheres, &self.poses[0], &mut pairs);
        pairs.retain(|pair| overlaps.count(pair.bodies) == 0);
        for poses in &self.poses[1..] {
            overlaps.visit(spheres, poses, &mut pairs);
        }
        let too_often = (ALWAYS * SAMPLES as f64) as usize;
        pairs.retain(|pair| {
            overlaps.count(pair.bodies) <= too_often && pair.clearance() < MAX_CLEARANCE
        });
        pairs.sort_by(|x, y| {
            let by_clearance = x.clearance().total_cmp(&y.clearance());
            by_clearance.then((x.a, x.b).cmp(&(y.a, y.b)))
        });
        let narrow = |pair: SpherePair| [pair.a as u32, pair.b as u32];
        pairs.into_iter().map(narrow).collect()
    }

    fn candidate_pairs(&self, spheres: &[Sphere]) -> Vec<SpherePair> {
        let mut pairs = Vec::new();
        for (a, sphere_a) in spheres.iter().enumerate() {
            for (b, sphere_b) in spheres.iter().enumerate().skip(a + 1) {
                if self.can_collide(sphere_a.body, sphere_b.body) {
                    let (body_a, body_b) = (sphere_a.body, sphere_b.body);
                    pairs.push(SpherePair {
                        a,
                        b,
                        bodies: [body_a.min(body_b), body_a.max(body_b)],
                        nearest_squared: f64::INFINITY,
                        radii: sphere_a.radius + sphere_b.radius,
                        inscribed: sphere_a.inscribed + sphere_b.inscribed,
                    });
                }
            }
        }
        pairs
    }
}

/// Returns the finite bound on the side of the range's middle that `value` is on; `value` itself without one.
fn nearest_bound(limit: &Limit, value: f64) -> f64 {
    let bound = if value > limit.middle() {
        limit.upper
    } else {
        limit.lower
    };
    if bound.is_finite() { bound } else { value }
}

fn centers(spheres: &[Sphere], poses: &[Rigid<f64>]) -> Vec<Vec3<f64>> {
    let posed = |sphere: &Sphere| poses[sphere.body].apply(sphere.center);
    spheres.iter().map(posed).collect()
}

/// Two spheres, `a` before `b`, and how near they have come.
struct SpherePair {
    a: usize,
    b: usize,
    /// Their bodies, the lower number first.
    bodies: [usize; 2],
    /// Smallest square of the centers' distance in any articulation visited.
    nearest_squared: f64,
    radii: f64,
    /// The same for the spheres that stay inside their parts.
    inscribed: f64,
}

impl SpherePair {
    fn clearance(&self) -> f64 {
        self.nearest_squared.sqrt() - self.radii
    }
}

/// In how many articulations each pair of bodies overlapped.
struct BodyPairs {
    bodies: usize,
    counts: Vec<usize>,
}

impl BodyPairs {
    fn new(bodies: usize) -> Self {
        Self {
            bodies,
            counts: vec![0; bodies * bodies],
        }
    }

    fn count(&self, [low, high]: [usize; 2]) -> usize {
        self.counts[low * self.bodies + high]
    }

    fn visit(&mut self, spheres: &[Sphere], poses: &[Rigid<f64>], pairs: &mut [SpherePair]) {
        let centers = centers(spheres, poses);
        let mut is_overlapping = vec![false; self.counts.len()];
        for pair in pairs {
            let squared = (centers[pair.a] - centers[pair.b]).norm_squared();
            pair.nearest_squared = pair.nearest_squared.min(squared);
            if squared < pair.inscribed * pair.inscribed {
                is_overlapping[pair.bodies[0] * self.bodies + pair.bodies[1]] = true;
            }
        }
        for (count, is_overlapping) in self.counts.iter_mut().zip(is_overlapping) {
            *count += usize::from(is_overlapping);
        }
    }
}
