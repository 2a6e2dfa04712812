//! Reduction of a cluster of nearly coplanar contact points to four.
//!
//! # Source
//! Manifold reduction of rapier 0.36.

use parry3d_f64::math::Vector;

/// Points of a manifold that are solved.
pub(super) const MAX_POINTS: usize = 4;

/// A contact point of a triangle before the reduction.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub(super) on_hand: Vector,
    /// In the object's frame.
    pub(super) on_object: Vector,
    pub(super) distance: f64,
    /// Indices of the old manifold and its point whose impulses it takes over.
    pub(super) warm_start_from: Option<(usize, usize)>,
}

#[derive(Default)]
pub(super) struct Cluster {
    pub(super) normal: Vector,
    pub(super) points: Vec<Candidate>,
}

/// Selects the deepest point, the one farthest from it, and those farthest to either side of the
/// line through both, sorted by their position in the tangent plane; empty slots come last.
pub(super) fn reduce(cluster: &Cluster, prediction: f64) -> [Option<usize>; MAX_POINTS] {
    let points = &cluster.points;
    let mut chosen = [None; MAX_POINTS];
    if points.len() <= MAX_POINTS {
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
    chosen.sort_by(|a, b| match (key(a), key(b)) {
        (Some([a, b]), Some([c, d])) => a.total_cmp(&c).then(b.total_cmp(&d)),
        (a, b) => a.is_none().cmp(&b.is_none()),
    });
    chosen
}

fn choose(cluster: &Cluster, prediction: f64, chosen: &mut [Option<usize>; MAX_POINTS]) {
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

/// Returns two unit vectors that make a right-handed frame with a unit normal.
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
