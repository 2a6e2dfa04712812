//! Contact patches: what the solver is given of the contacts of one piece.
//!
//! A piece touches several triangles of the hand, most of them in nearly one plane. Their contact points are put together by normal, those
//! in nearly the same place counted once, and each patch is reduced to at most four points. The impulses that points have borne go
//! to those nearest to them in the next patches.
//!
//! # Source
//! The rules and their constants are those of rapier 0.36 (its contact clustering and manifold reduction).

use parry3d_f64::math::Vector;
use parry3d_f64::query::ContactManifold;

use super::body::Body;
use super::reduction::{Candidate, Cluster, MOST_POINTS, reduced};

/// Cosine of the angle up to which normals are one (5.1 degrees).
const SAME_NORMAL: f64 = 0.996;
/// Points closer than this part of the prediction distance are one.
const SAME_POINT: f64 = 0.25;
/// So many are kept: points that are not solved keep what they have borne, until they are again or others take it over.
const MOST_KEPT: usize = 12;

/// The contacts of a piece with a triangle.
pub(super) type Manifold = ContactManifold<(), ()>;

/// A contact point that the solver knows.
#[derive(Clone, Copy)]
pub(super) struct PatchPoint {
    /// On the hand \[m\].
    on_hand: Vector,
    /// On the object, from its centre of mass along its own axes \[m\].
    on_object: Vector,
    /// What both are apart along the normal beyond the gap between hand and object \[m\]: points keep the gap along the normals of their triangles.
    offset: f64,
    /// The point from the centre of mass, in the world, when it was found: where impulses attack until it is found anew \[m\].
    pub(super) arm: Vector,
    /// Along the normal, and in the tangent plane.
    pub(super) impulse: f64,
    pub(super) friction: Vector,
    /// Whether it bore a load in the last step.
    pub(super) bore: bool,
}

impl PatchPoint {
    /// How far apart hand and object are by now, along the normal \[m\]; negative where they overlap.
    pub(super) fn gap(&self, normal: Vector, body: &Body) -> f64 {
        let on_object = body.center + body.rotation * self.on_object;
        (on_object - self.on_hand).dot(normal) - self.offset
    }
}

/// Contact points of nearly one normal.
#[derive(Clone, Copy)]
pub(super) struct Patch {
    /// From the hand into the object.
    pub(super) normal: Vector,
    /// Those to be solved and those that only keep what they have borne, in the order in which they were found.
    points: [PatchPoint; MOST_KEPT],
    kept: u8,
    /// The places of those to be solved, in their order.
    solved: [u8; MOST_POINTS],
    count: u8,
}

impl Patch {
    /// Whether it has points to be solved.
    pub(super) fn is_solved(&self) -> bool {
        self.count > 0
    }

    /// The places of the points to be solved, in their order.
    pub(super) fn solved(&self) -> impl Iterator<Item = usize> + use<> {
        let (solved, count) = (self.solved, self.count as usize);
        solved.into_iter().take(count).map(usize::from)
    }

    /// All points, by place.
    pub(super) fn points(&self) -> &[PatchPoint] {
        &self.points[..self.kept as usize]
    }

    pub(super) fn points_mut(&mut self) -> &mut [PatchPoint] {
        &mut self.points[..self.kept as usize]
    }
}

/// Makes patches; kept, so that it need not allocate each time.
#[derive(Default)]
pub(super) struct PatchMaker {
    clusters: Vec<Cluster>,
    count: usize,
}

impl PatchMaker {
    /// Replaces the patches of a piece by those of its present contacts, found `prediction` \[m\] ahead; `step` is the time step \[s\].
    pub(super) fn make<'a>(
        &mut self,
        manifolds: impl Iterator<Item = &'a Manifold>,
        body: &Body,
        prediction: f64,
        step: f64,
        patches: &mut Vec<Patch>,
    ) {
        self.collect(manifolds, SAME_POINT * prediction);
        if self.count == 0 {
            patches.clear();
            return;
        }
        self.inherit(patches, prediction);
        let old = patches.len();
        for cluster in &mut self.clusters[..self.count] {
            let normal = cluster.normal;
            let chosen = reduced(cluster, prediction);
            let mut patch = Patch {
                normal,
                points: [NO_POINT; MOST_KEPT],
                kept: 0,
                solved: [0; MOST_POINTS],
                count: 0,
            };
            let mut places = [None; MOST_POINTS];
            let mut others = MOST_KEPT - MOST_POINTS;
            for (index, candidate) in cluster.points.iter().enumerate() {
                let number = chosen.iter().position(|chosen| *chosen == Some(index));
                if number.is_none() && (candidate.heir_of.is_none() || others == 0) {
                    continue;
                }
                let point = settled(candidate, normal, body, &patches[..old]);
                patch.points[patch.kept as usize] = point;
                if let Some(number) = number {
                    let place = body.center + body.rotation * point.on_object;
                    let opening = body.velocity_at(place).dot(normal);
                    let nearest = candidate.distance.min(candidate.distance + opening * step);
                    places[number] = (nearest < prediction).then_some(patch.kept);
                } else {
                    others -= 1;
                }
                patch.kept += 1;
            }
            for place in places.into_iter().flatten() {
                patch.solved[patch.count as usize] = place;
                patch.count += 1;
            }
            if patch.kept > 0 {
                patches.push(patch);
            }
        }
        patches.drain(..old);
    }

    /// Sorts all contact points by normal, leaving out the shallower of two in one place.
    fn collect<'a>(&mut self, manifolds: impl Iterator<Item = &'a Manifold>, same: f64) {
        self.count = 0;
        for manifold in manifolds.filter(|manifold| !manifold.points.is_empty()) {
            let normal = manifold.local_n1;
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
            for point in &manifold.points {
                let candidate = Candidate {
                    on_hand: point.local_p1,
                    on_object: point.local_p2,
                    distance: point.dist,
                    heir_of: None,
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

    /// Lets each point that has borne a load be taken over by the nearest new one of its normal.
    fn inherit(&mut self, patches: &[Patch], reach: f64) {
        for (index, patch) in patches.iter().enumerate() {
            for (number, point) in patch.points().iter().enumerate() {
                if !point.bore {
                    continue;
                }
                let clusters = self.clusters[..self.count].iter_mut();
                let heirs = clusters
                    .filter(|cluster| cluster.normal.dot(patch.normal) >= SAME_NORMAL)
                    .flat_map(|cluster| &mut cluster.points)
                    .filter(|candidate| candidate.heir_of.is_none());
                let mut nearest = reach * reach;
                let mut heir = None;
                for candidate in heirs {
                    let square = (candidate.on_hand - point.on_hand).length_squared();
                    if square < nearest {
                        nearest = square;
                        heir = Some(candidate);
                    }
                }
                if let Some(heir) = heir {
                    heir.heir_of = Some((index, number));
                }
            }
        }
    }
}

const NO_POINT: PatchPoint = PatchPoint {
    on_hand: Vector::ZERO,
    on_object: Vector::ZERO,
    offset: 0.0,
    arm: Vector::ZERO,
    impulse: 0.0,
    friction: Vector::ZERO,
    bore: false,
};

/// A candidate as a point, with the impulses of the one that it takes over from.
fn settled(candidate: &Candidate, normal: Vector, body: &Body, old: &[Patch]) -> PatchPoint {
    let on_object = body.offset_from_center(candidate.on_object);
    let place = body.center + body.rotation * on_object;
    let offset = (place - candidate.on_hand).dot(normal) - candidate.distance;
    let middle = (candidate.on_hand + normal * offset + place) * 0.5;
    let predecessor =
        (candidate.heir_of).map_or(NO_POINT, |(patch, point)| old[patch].points[point]);
    PatchPoint {
        on_hand: candidate.on_hand,
        on_object,
        offset,
        arm: middle - body.center,
        ..predecessor
    }
}
