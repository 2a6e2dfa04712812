//! Contact manifolds: what the solver is given of the contacts of one piece.
//!
//! A piece touches several triangles of the hand, most of them nearly coplanar. Their contact
//! points are clustered by normal, nearly coincident ones merged, and each cluster is reduced to at
//! most [`MAX_POINTS`] points. Impulses of the last step warm-start the nearest points of the new
//! manifolds.
//!
//! # Source
//! Rules and constants: rapier 0.36 (contact clustering and manifold reduction).

use parry3d_f64::math::Vector;
use parry3d_f64::query::ContactManifold;

use super::manifold_reduction::{Candidate, Cluster, MAX_POINTS, reduce};
use super::rigid_body::RigidBody;

/// Normals that make an angle with at least this cosine (5.1 degrees) belong to one manifold.
const SAME_NORMAL: f64 = 0.996;
/// Points closer than this fraction of the prediction distance are merged.
const SAME_POINT: f64 = 0.25;
/// Points kept in a manifold: those that are not solved keep their impulses for a later warm start.
const MAX_KEPT_POINTS: usize = 12;

/// Contacts of a piece with one triangle.
pub(super) type TriangleContacts = ContactManifold<(), ()>;

/// A contact point of a manifold.
#[derive(Clone, Copy)]
pub(super) struct ManifoldPoint {
    /// Point of the hand \[m\].
    on_hand: Vector,
    /// Point of the object relative to its centre of mass, along its own axes \[m\].
    on_object: Vector,
    /// Distance of both along the manifold's normal minus the gap along the triangle's own normal \[m\].
    offset: f64,
    /// Lever arm of impulses about the centre of mass, world frame, when the point was found \[m\].
    pub(super) arm: Vector,
    /// Impulse along the normal, for 1 kg \[m/s\].
    pub(super) impulse: f64,
    /// Friction impulse, world frame, for 1 kg \[m/s\].
    pub(super) friction: Vector,
    /// Whether it carried a load in the last step.
    pub(super) was_loaded: bool,
}

impl ManifoldPoint {
    /// Returns the present gap between hand and object along the normal \[m\]; negative where they overlap.
    pub(super) fn gap(&self, normal: Vector, body: &RigidBody) -> f64 {
        let on_object = body.center + body.rotation * self.on_object;
        (on_object - self.on_hand).dot(normal) - self.offset
    }
}

/// Contact points with nearly the same normal.
#[derive(Clone, Copy)]
pub(super) struct Manifold {
    /// Unit normal from the hand into the object.
    pub(super) normal: Vector,
    /// Points to solve and points that only keep their impulses, in the order in which they were found.
    points: [ManifoldPoint; MAX_KEPT_POINTS],
    kept: u8,
    /// Indices of the points to solve.
    solved: [u8; MAX_POINTS],
    count: u8,
}

impl Manifold {
    /// Returns whether it has points to solve.
    pub(super) fn is_active(&self) -> bool {
        self.count > 0
    }

    /// Returns the indices of the points to solve.
    pub(super) fn solved(&self) -> impl Iterator<Item = usize> + use<> {
        let (solved, count) = (self.solved, self.count as usize);
        solved.into_iter().take(count).map(usize::from)
    }

    /// Returns all points.
    pub(super) fn points(&self) -> &[ManifoldPoint] {
        &self.points[..self.kept as usize]
    }

    pub(super) fn points_mut(&mut self) -> &mut [ManifoldPoint] {
        &mut self.points[..self.kept as usize]
    }
}

/// Builds manifolds; its buffers are reused from step to step.
#[derive(Default)]
pub(super) struct ManifoldBuilder {
    clusters: Vec<Cluster>,
    count: usize,
}

impl ManifoldBuilder {
    /// Replaces the manifolds of a piece by those of its present contacts, found `prediction` \[m\]
    /// ahead; `step` is the time step \[s\].
    pub(super) fn build<'a>(
        &mut self,
        triangle_contacts: impl Iterator<Item = &'a TriangleContacts>,
        body: &RigidBody,
        prediction: f64,
        step: f64,
        manifolds: &mut Vec<Manifold>,
    ) {
        self.collect(triangle_contacts, SAME_POINT * prediction);
        if self.count == 0 {
            manifolds.clear();
            return;
        }
        self.match_warm_starts(manifolds, prediction);
        let old = manifolds.len();
        for cluster in &mut self.clusters[..self.count] {
            let normal = cluster.normal;
            let chosen = reduce(cluster, prediction);
            let mut manifold = Manifold {
                normal,
                points: [NO_POINT; MAX_KEPT_POINTS],
                kept: 0,
                solved: [0; MAX_POINTS],
                count: 0,
            };
            let mut places = [None; MAX_POINTS];
            let mut others = MAX_KEPT_POINTS - MAX_POINTS;
            for (index, candidate) in cluster.points.iter().enumerate() {
                let number = chosen.iter().position(|chosen| *chosen == Some(index));
                if number.is_none() && (candidate.warm_start_from.is_none() || others == 0) {
                    continue;
                }
                let point = to_point(candidate, normal, body, &manifolds[..old]);
                manifold.points[manifold.kept as usize] = point;
                if let Some(number) = number {
                    let place = body.center + body.rotation * point.on_object;
                    let opening = body.velocity_at(place).dot(normal);
                    let nearest = candidate.distance.min(candidate.distance + opening * step);
                    places[number] = (nearest < prediction).then_some(manifold.kept);
                } else {
                    others -= 1;
                }
                manifold.kept += 1;
            }
            for place in places.into_iter().flatten() {
                manifold.solved[manifold.count as usize] = place;
                manifold.count += 1;
            }
            if manifold.kept > 0 {
                manifolds.push(manifold);
            }
        }
        manifolds.drain(..old);
    }

    /// Clusters all contact points by normal, dropping the shallower of two that coincide.
    fn collect<'a>(
        &mut self,
        triangle_contacts: impl Iterator<Item = &'a TriangleContacts>,
        same: f64,
    ) {
        self.count = 0;
        for contacts in triangle_contacts.filter(|contacts| !contacts.points.is_empty()) {
            let normal = contacts.local_n1;
            let mut known = self.clusters[..self.count].iter();
            let index = known.position(|cluster| cluster.normal.dot(normal) >= SAME_NORMAL);
            let index = index.unwrap_or_else(|| {
                if self.clusters.len() == self.count {
                    self.clusters.push(Cluster::default());
                }
                self.clusters[self.count].normal = normal;
                self.clusters[self.count].points.clear();
                self.count += 1;
                self.count - 1
            });
            let points = &mut self.clusters[index].points;
            for point in &contacts.points {
                let candidate = Candidate {
                    on_hand: point.local_p1,
                    on_object: point.local_p2,
                    distance: point.dist,
                    warm_start_from: None,
                };
                let near = |other: &&mut Candidate| {
                    (other.on_hand - candidate.on_hand).length_squared() < same * same
                };
                match points.iter_mut().find(near) {
                    Some(other) if candidate.distance < other.distance => *other = candidate,
                    Some(_) => {}
                    None => points.push(candidate),
                }
            }
        }
    }

    /// Lets the nearest new point with the same normal take over the impulses of each loaded point.
    fn match_warm_starts(&mut self, manifolds: &[Manifold], reach: f64) {
        for (index, manifold) in manifolds.iter().enumerate() {
            for (number, point) in manifold.points().iter().enumerate() {
                if !point.was_loaded {
                    continue;
                }
                let clusters = self.clusters[..self.count].iter_mut();
                let successors = clusters
                    .filter(|cluster| cluster.normal.dot(manifold.normal) >= SAME_NORMAL)
                    .flat_map(|cluster| &mut cluster.points)
                    .filter(|candidate| candidate.warm_start_from.is_none());
                let mut nearest = reach * reach;
                let mut successor = None;
                for candidate in successors {
                    let square = (candidate.on_hand - point.on_hand).length_squared();
                    if square < nearest {
                        nearest = square;
                        successor = Some(candidate);
                    }
                }
                if let Some(successor) = successor {
                    successor.warm_start_from = Some((index, number));
                }
            }
        }
    }
}

const NO_POINT: ManifoldPoint = ManifoldPoint {
    on_hand: Vector::ZERO,
    on_object: Vector::ZERO,
    offset: 0.0,
    arm: Vector::ZERO,
    impulse: 0.0,
    friction: Vector::ZERO,
    was_loaded: false,
};

/// Returns a candidate as a point, with the impulses of its predecessor.
fn to_point(
    candidate: &Candidate,
    normal: Vector,
    body: &RigidBody,
    old: &[Manifold],
) -> ManifoldPoint {
    let on_object = body.offset_from_center(candidate.on_object);
    let place = body.center + body.rotation * on_object;
    let offset = (place - candidate.on_hand).dot(normal) - candidate.distance;
    let middle = (candidate.on_hand + normal * offset + place) * 0.5;
    let predecessor = (candidate.warm_start_from)
        .map_or(NO_POINT, |(manifold, point)| old[manifold].points[point]);
    ManifoldPoint {
        on_hand: candidate.on_hand,
        on_object,
        offset,
        arm: middle - body.center,
        ..predecessor
    }
}
