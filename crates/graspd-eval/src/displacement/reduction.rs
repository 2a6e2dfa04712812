//! Which few of many contact points in one plane stand for all.
//!
//! # Source
//! The choice is that of rapier 0.36 (its manifold reduction).

use parry3d_f64::math::Vector;

/// So many points of a patch are solved.
pub(super) const MOST_POINTS: usize = 4;

/// A point of a triangle's contacts, and what it takes over.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub(super) on_hand: Vector,
    /// In the object's frame.
    pub(super) on_object: Vector,
    pub(super) distance: f64,
    /// Patch and point of it that it takes over from.
    pub(super) heir_of: Option<(usize, usize)>,
}

#[derive(Default)]
pub(super) struct Cluster {
    pub(super) normal: Vector,
    pub(super) points: Vec<Candidate>,
}

/// Which points stand for all: the deepest, the one farthest from it, and those farthest to either side of the line through both. In
/// the order of their places.
pub(super) fn reduced(cluster: &Cluster, prediction: f64) -> [Option<usize>; MOST_POINTS] {
    let points = &cluster.points;
    let mut chosen = [None; MOST_POINTS];
    if points.len() <= MOST_POINTS {
        for (index, slot) in chosen.iter_mut().enumerate().take(points.len()) {
            *slot = Some(index);
        }
    } else {
        choose(cluster, prediction, &mut chosen);
    }
    let along = tangents(cluster.normal);
    let key = |index: &Option<usize>| {
        index.map(|index| along.map(|tangent| points[index].on_hand.dot(tangent)))
    };
    // Empty ones last.
    chosen.sort_by(|a, b| match (key(a), key(b)) {
        (Some([a, b]), Some([c, d])) => a.total_cmp(&c).then(b.total_cmp(&d)),
        (a, b) => a.is_none().cmp(&b.is_none()),
    });
    chosen
}

fn choose(cluster: &Cluster, prediction: f64, chosen: &mut [Option<usize>; MOST_POINTS]) {
    let points = &cluster.points;
    // The first of the least.
    let least = |cost: &dyn Fn(usize) -> f64, without: [Option<usize>; 2]| {
        let mut best: Option<(f64, usize)> = None;
        for (index, point) in points.iter().enumerate() {
            let is_allowed = without == [None; 2]
                || !without.contains(&Some(index)) && point.distance <= prediction;
            if is_allowed && best.is_none_or(|(least, _)| cost(index) < least) {
                best = Some((cost(index), index));
            }
        }
        best.map(|(_, index)| index)
    };
    let Some(deepest) = least(&|index| points[index].distance, [None; 2]) else {
        return;
    };
    chosen[0] = Some(deepest);
    let start = points[deepest].on_hand;
    let nearness = |index: usize| -(points[index].on_hand - start).length_squared();
    let Some(farthest) = least(&nearness, [Some(deepest), None]) else {
        return;
    };
    let line = points[farthest].on_hand - start;
    if line == Vector::ZERO {
        return;
    }
    chosen[1] = Some(farthest);
    let across = line.cross(cluster.normal);
    let side = |index: usize| (points[index].on_hand - start).dot(across);
    let ends = [Some(deepest), Some(farthest)];
    chosen[2] = least(&side, ends);
    chosen[3] = least(&|index| -side(index), ends).filter(|index| Some(*index) != chosen[2]);
}

/// Two unit vectors that make a right-handed frame with a unit normal.
///
/// # Source
/// T. Duff et al., "Building an orthonormal basis, revisited", JCGT 2017.
pub(super) fn tangents(normal: Vector) -> [Vector; 2] {
    let sign = 1.0f64.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    [
        Vector::new(
            1.0 + sign * normal.x * normal.x * a,
            sign * b,
            -sign * normal.x,
        ),
        Vector::new(b, sign + normal.y * normal.y * a, -normal.y),
    ]
}
