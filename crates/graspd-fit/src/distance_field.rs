//! What a fit knows of the object: how far it is, and which way.

use graspd_ad::{Kernel, Real, vectorize};
use graspd_geom::{SdfGrid, SignedDistance, Vec3};
use graspd_hand::{POINT_PADDING, PointBuffer};
use nalgebra::Vector3;

/// No distance changes by more than this many times the way that a point moves: along each axis that of a grid changes
/// by no more than the distances at its nodes.
pub(crate) const STEEPEST: f64 = 1.75;
/// Bounds on exact distances are widened by this share, for their rounding.
const ROUNDING: f64 = 1e-9;

/// A point whose distance is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub(crate) at: Vector3<f64>,
    /// Where it was before, and its distance there \[m\], from the same field.
    pub(crate) seen: Option<(Vector3<f64>, f64)>,
}

/// What is known of the object at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    /// Signed distance \[m\].
    pub(crate) distance: f64,
    /// The object's outward unit normal, 0 where there is none.
    pub(crate) normal: Vector3<f64>,
}

/// The signed distance to an object.
pub(crate) trait DistanceField {
    /// Answers all queries, in their order.
    fn look_up(&self, queries: &[Query], scratch: &mut LookUpScratch, answers: &mut Vec<Answer>);
}

/// Working memory of a look-up: points, what rounding has left of them, distances and normals.
#[derive(Default)]
pub(crate) struct LookUpScratch {
    points: PointBuffer<f32>,
    rest: PointBuffer<f32>,
    normals: PointBuffer<f32>,
    distances: Vec<f32>,
}

impl DistanceField for SdfGrid {
    fn look_up(&self, queries: &[Query], scratch: &mut LookUpScratch, answers: &mut Vec<Answer>) {
        let LookUpScratch {
            points,
            rest,
            normals,
            distances,
        } = scratch;
        let len = queries.len().next_multiple_of(POINT_PADDING);
        distances.resize(len, 0.0);
        for buffer in [&mut *points, &mut *rest, &mut *normals] {
            for axis in [&mut buffer.x, &mut buffer.y, &mut buffer.z] {
                axis.resize(len, 0.0);
            }
        }
        for (i, query) in queries.iter().enumerate() {
            let at = Vec3::from(query.at);
            points.set(i, at);
            rest.set(i, at - points.get(i));
        }
        vectorize(LookUp {
            grid: self,
            points,
            rest,
            normals,
            distances,
        });
        answers.clear();
        answers.extend((0..queries.len()).map(|i| Answer {
            distance: f64::from(distances[i]),
            normal: normals.get(i).into(),
        }));
    }
}

/// The grid's distances and unit normals at points, eight at a time.
struct LookUp<'a> {
    grid: &'a SdfGrid,
    points: &'a PointBuffer<f32>,
    rest: &'a PointBuffer<f32>,
    normals: &'a mut PointBuffer<f32>,
    distances: &'a mut [f32],
}

impl Kernel for LookUp<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        let mut first = 0;
        while first < self.distances.len() {
            let point = load::<L>(self.points, first);
            let rest = load::<L>(self.rest, first);
            let (distance, gradient) = self.grid.distance_and_gradient_of_sum(point, rest);
            let normal = gradient.normalize_or_zero();
            distance.store(&mut self.distances[first..]);
            normal.x.store(&mut self.normals.x[first..]);
            normal.y.store(&mut self.normals.y[first..]);
            normal.z.store(&mut self.normals.z[first..]);
            first += L::LANES;
        }
    }
}

#[inline(always)]
fn load<L: Real<Element = f32>>(points: &PointBuffer<f32>, first: usize) -> Vec3<L> {
    Vec3::new(
        L::load(&points.x[first..]),
        L::load(&points.y[first..]),
        L::load(&points.z[first..]),
    )
}

/// The grid, and near the surface, where cells are too coarse for edges, the mesh itself.
pub(crate) struct ExactNearSurface<'a> {
    pub(crate) grid: &'a SdfGrid,
    pub(crate) mesh: &'a SignedDistance,
    /// From this distance on the grid will do \[m\].
    pub(crate) band: f64,
}

impl ExactNearSurface<'_> {
    fn exact(&self, query: &Query, by_grid: f64) -> Answer {
        let at = query.at.into();
        // What the grid says is a mean of distances at corners of the cell.
        let off = Vector3::from(self.grid.spacing()).norm();
        let is_deep = by_grid < -off;
        let mut bound = (by_grid.abs() + off) * (1.0 + ROUNDING);
        let mut is_inside = is_deep.then_some(true);
        // A distance that large is the grid's.
        if let Some((from, distance)) = query.seen.filter(|seen| seen.1 <= self.band) {
            let moved = (query.at - from).norm();
            bound = bound.min((distance.abs() + moved) * (1.0 + ROUNDING) + f64::MIN_POSITIVE);
            // No surface is nearer than that to where it was.
            if moved < distance.abs() * (1.0 - ROUNDING) {
                is_inside = Some(distance < 0.0);
            }
        }
        let (distance, normal) = self
            .mesh
            .distance_and_gradient_within(&at, bound, is_inside);
        Answer { distance, normal }
    }
}

impl DistanceField for ExactNearSurface<'_> {
    fn look_up(&self, queries: &[Query], scratch: &mut LookUpScratch, answers: &mut Vec<Answer>) {
        self.grid.look_up(queries, scratch, answers);
        for (query, answer) in queries.iter().zip(answers) {
            if answer.distance <= self.band {
                *answer = self.exact(query, answer.distance);
            }
        }
    }
}
