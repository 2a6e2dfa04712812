//! Convex hulls in two to six dimensions: facets, volume, and the distance of the origin to the boundary.
//!
//! # Method
//! Quickhull on simplicial facets. It runs twice at most:
//!
//! 1. in floating point with one tolerance, relative to the extent of the points: a point within the tolerance
//!    of a facet's hyperplane counts as inside, so coplanar and repeated points are no special case. Afterwards
//!    every ridge is checked: the two facets that meet there must form a convex edge;
//! 2. where that check fails, or the first run contradicts itself, again on points snapped to an integer grid
//!    2^-50 of the extent wide, with predicates evaluated in exact integer arithmetic. That run cannot fail.
//!
//! Points are never perturbed at random, so the same input gives the same facets.
//!
//! # Source
//! C. B. Barber, D. P. Dobkin, H. Huhdanpaa, "The Quickhull algorithm for convex hulls", ACM TOMS 22(4), 1996.

mod body;
mod certificate;
mod exact;
mod expansion;
mod facet;
mod frame;
mod frontier;
mod hyperplane;
mod inverse;
mod leaves;
mod polytope;
mod predicates;
mod quickhull;
mod simplex;
mod volume;
mod wide_integer;

use crate::error::EvaluationError;
use body::{Body, FramedSum, PointSet, SumOfGroups};
use certificate::DEPTH_SLACK;
use expansion::{Expansion, Goal};
use frame::{Frame, Start};
use frontier::Frontier;
use polytope::{Polytope, Stop};
use quickhull::Order;

pub use volume::{HullVolume, VolumeMethod, VolumeSettings, hull_volume};

/// The most facets that a hull may have before [`convex_hull`] gives up: about 256 MB in six dimensions.
///
/// The wrenches of 128 contacts with 8 edges each have about 460 000.
pub(crate) const MAX_FACETS: usize = 2_000_000;

/// What the points span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HullShape {
    /// There are no points.
    Empty,
    /// The points lie in an affine subspace of fewer dimensions than the space, to within 1e-10 of their extent.
    Flat {
        /// Dimension of that subspace: 0 for a single point, 1 for points on a line, and so on.
        affine_dimension: usize,
    },
    /// The hull has an interior.
    Full,
}

/// One simplex of a hull's boundary. Neighbouring facets may be coplanar: nothing is merged.
///
/// The second run's facets are those of points moved by up to 1e-15 of their extent. The hyperplane of a facet
/// thinner than that is no closer to the input points than its thickness allows, though its offset is no less
/// than the depth of the hull.
#[derive(Clone, Debug, PartialEq)]
pub struct HullFacet<const D: usize> {
    /// The points that span it: indices into the input.
    pub vertices: [u32; D],
    /// For each vertex, the facet that shares all the others: indices into [`ConvexHull::facets`].
    pub neighbours: [u32; D],
    /// Unit normal, pointing out of the hull.
    pub normal: [f64; D],
    /// The facet lies in `normal . x = offset`, the hull in `normal . x <= offset`.
    pub offset: f64,
    /// (D-1)-dimensional measure.
    pub area: f64,
}

/// The convex hull of a set of points.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexHull<const D: usize> {
    /// Whether the hull has an interior. Without one there are no facets.
    pub shape: HullShape,
    /// The boundary.
    pub facets: Vec<HullFacet<D>>,
    /// D-dimensional measure; 0 unless the shape is [`HullShape::Full`].
    pub volume: f64,
}

impl<const D: usize> ConvexHull<D> {
    /// The signed distance of the origin from the nearest facet's hyperplane, positive inside: the radius of
    /// the largest ball about the origin that the hull holds. `None` for a hull without interior.
    ///
    /// A negative value says that the origin is outside, at least that far away.
    pub fn origin_depth(&self) -> Option<f64> {
        self.facets
            .iter()
            .map(|facet| facet.offset)
            .reduce(f64::min)
    }

    /// The input points that are corners of the hull (or of a facet's triangulation), ascending.
    pub fn vertices(&self) -> Vec<u32> {
        let mut vertices: Vec<u32> = self
            .facets
            .iter()
            .flat_map(|facet| facet.vertices)
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }
}

/// The convex hull of `points` in `D` dimensions, 2 <= D <= 6.
///
/// Points that repeat, lie inside, or lie within 1e-12 of the extent from a facet are no vertices. Flat input
/// is no error: see [`ConvexHull::shape`].
///
/// # Errors
/// [`EvaluationError::NotFinite`] for a coordinate that is NaN or infinite;
/// [`EvaluationError::TooManyFacets`] where more than 2 million would be needed.
pub fn convex_hull<const D: usize>(points: &[[f64; D]]) -> Result<ConvexHull<D>, EvaluationError> {
    convex_hull_limited(points, MAX_FACETS)
}

/// [`convex_hull`] with another limit on the number of facets that exist at any one time.
///
/// # Errors
/// As for [`convex_hull`].
fn convex_hull_limited<const D: usize>(
    points: &[[f64; D]],
    max_facets: usize,
) -> Result<ConvexHull<D>, EvaluationError> {
    const { assert!(2 <= D && D <= 6, "hulls are for 2 to 6 dimensions") };
    let (mut frame, simplex) = match Frame::start(points)? {
        Start::Empty => return Ok(without_interior(HullShape::Empty)),
        Start::Flat { affine_dimension } => {
            return Ok(without_interior(HullShape::Flat { affine_dimension }));
        }
        Start::Full { frame, simplex } => (frame, simplex),
    };
    let run =
        |frame: &mut Frame<D>| quickhull::quickhull(frame, &simplex, max_facets, Order::Found);
    let (polytope, is_whole) = certified(&mut frame, run, |(polytope, _)| polytope)?;
    if !is_whole {
        return Err(EvaluationError::TooManyFacets { limit: max_facets });
    }
    Ok(in_input_coordinates(&frame, &polytope))
}

/// Lower and upper bound on the depth of the origin: the radius of the largest ball about it within the hull,
/// or where negative, minus a lower bound on its distance from the hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBounds {
    /// The depth is no less, unless [`Self::upper`] is negative.
    pub lower: f64,
    /// The depth is no more.
    pub upper: f64,
}

/// When the search for the depth of the origin ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSearch {
    /// Where `upper - lower <= relative_gap * upper`; with 0, both are the depth to within rounding.
    pub relative_gap: f64,
    /// Or where more facets than this would have to be kept, of those that may be the nearest (350
    /// bytes each) or, where rounding asks for it, of the whole inner polytope (130 bytes each).
    pub max_facets: usize,
}

impl Default for DepthSearch {
    fn default() -> Self {
        Self {
            relative_gap: 1e-9,
            max_facets: 500_000,
        }
    }
}

/// What is known of the depth of the origin in a convex body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OriginDepth {
    /// There are no points.
    Empty,
    /// The body has no interior: [`HullShape::Flat`].
    Flat {
        /// Dimension of its affine hull.
        affine_dimension: usize,
    },
    /// It has one.
    Between(DepthBounds),
}

/// Bounds on the depth of the origin in the hull of `points`, without constructing the whole hull: far faster
/// than [`convex_hull`], above all in many dimensions.
///
/// An inner polytope grows where it is nearest to the origin, by the point farthest beyond its nearest facet, until
/// that facet is one of the hull. Stops as well when `upper < 0`: then the origin is outside, at least `-upper` away.
///
/// # Errors
/// [`EvaluationError::NotFinite`] for a coordinate that is NaN or infinite.
///
/// # Source
/// The expansion step is that of Y. Zheng, "An efficient algorithm for a grasp quality measure", IEEE T-RO
/// 29(2), 2013.
pub fn origin_depth<const D: usize>(
    points: &[[f64; D]],
    search: &DepthSearch,
) -> Result<OriginDepth, EvaluationError> {
    const { assert!(2 <= D && D <= 6, "hulls are for 2 to 6 dimensions") };
    let (mut frame, simplex) = match Frame::start(points)? {
        Start::Empty => return Ok(OriginDepth::Empty),
        Start::Flat { affine_dimension } => return Ok(OriginDepth::Flat { affine_dimension }),
        Start::Full { frame, simplex } => (frame, simplex),
    };
    let body = PointSet::new(&frame.points);
    if let Some(bounds) = depth_by_frontier(&mut frame, &body, &simplex, search) {
        return Ok(OriginDepth::Between(bounds));
    }
    let build = |frame: &mut Frame<D>| {
        let body = PointSet::new(&frame.points);
        let (gap, most) = (search.relative_gap, search.max_facets);
        expansion::expand(frame, &body, &simplex, gap, most, Goal::Bounds)
    };
    let Expansion { bounds, .. } = certified(&mut frame, build, |found| &found.polytope)?;
    Ok(OriginDepth::Between(bounds))
}

/// The same for the Minkowski sum of `conv(0, g)` over the groups g of `group` consecutive points each.
///
/// The sum of hundreds of groups has too many corners to list, but its support function is a sum of maxima.
///
/// # Errors
/// As for [`origin_depth`].
pub(crate) fn origin_depth_of_sum<const D: usize>(
    points: &[[f64; D]],
    group: usize,
    search: &DepthSearch,
) -> Result<OriginDepth, EvaluationError> {
    const { assert!(2 <= D && D <= 6, "hulls are for 2 to 6 dimensions") };
    let sum = SumOfGroups::new(points, group);
    let (mut frame, simplex) = match sum.start()? {
        Start::Empty => return Ok(OriginDepth::Empty),
        Start::Flat { affine_dimension } => return Ok(OriginDepth::Flat { affine_dimension }),
        Start::Full { frame, simplex } => (frame, simplex),
    };
    let first = frame.points.len();
    let body = FramedSum { sum: &sum };
    if let Some(bounds) = depth_by_frontier(&mut frame, &body, &simplex, search) {
        return Ok(OriginDepth::Between(bounds));
    }
    let build = |frame: &mut Frame<D>| {
        // A second run begins where the first did.
        frame.points.truncate(first);
        let (gap, most) = (search.relative_gap, search.max_facets);
        expansion::expand(frame, &body, &simplex, gap, most, Goal::Bounds)
    };
    let Expansion { bounds, .. } = certified(&mut frame, build, |found| &found.polytope)?;
    Ok(OriginDepth::Between(bounds))
}

/// The depth by an inner polytope until the origin is inside, and from then on by those of its facets that may be the
/// nearest; `None` where rounding got in the way of either.
fn depth_by_frontier<const D: usize>(
    frame: &mut Frame<D>,
    body: &impl Body<D>,
    simplex: &[u32],
    search: &DepthSearch,
) -> Option<DepthBounds> {
    let (gap, most) = (search.relative_gap, search.max_facets);
    let begun = expansion::expand(frame, body, simplex, gap, most, Goal::OriginInside).ok()?;
    if !certificate::is_convex(frame, &begun.polytope, DEPTH_SLACK) {
        return None;
    }
    if !begun.is_begun {
        return Some(begun.bounds);
    }
    let upper = begun.bounds.upper / frame.scale;
    let frontier = Frontier::new(frame, &begun.polytope, upper).ok()?;
    frontier.search(frame, body, gap, most).ok()
}

/// Runs a construction in rounded arithmetic and, if what it makes is not convex, again in exact arithmetic.
fn certified<const D: usize, R>(
    frame: &mut Frame<D>,
    mut construct: impl FnMut(&mut Frame<D>) -> Result<R, Stop>,
    polytope_of: impl Fn(&R) -> &Polytope<D>,
) -> Result<R, EvaluationError> {
    if let Ok(result) = construct(frame)
        && certificate::is_convex(frame, polytope_of(&result), DEPTH_SLACK)
    {
        return Ok(result);
    }
    frame.snap_to_grid();
    construct(frame).map_err(|_| EvaluationError::Unresolved)
}

fn without_interior<const D: usize>(shape: HullShape) -> ConvexHull<D> {
    ConvexHull {
        shape,
        facets: Vec::new(),
        volume: 0.0,
    }
}

/// Numbers the facets that are left without gaps, and undoes the frame's shift and scale.
fn in_input_coordinates<const D: usize>(frame: &Frame<D>, polytope: &Polytope<D>) -> ConvexHull<D> {
    let mut number = vec![u32::MAX; polytope.slots()];
    for (index, (slot, _)) in polytope.facets().enumerate() {
        number[slot as usize] = index as u32;
    }
    let area_scale = frame.scale.powi(D as i32 - 1);
    let mut volume = CompensatedSum::default();
    let facets = polytope
        .facets()
        .map(|(_, facet)| {
            let area = frame.area(facet);
            volume.add(area * frame.depth_of_interior(facet) / D as f64);
            HullFacet {
                vertices: facet.vertices,
                neighbours: facet.neighbours.map(|slot| number[slot as usize]),
                normal: facet.normal,
                offset: frame.depth_of_origin(facet) * frame.scale,
                area: area * area_scale,
            }
        })
        .collect();
    ConvexHull {
        shape: HullShape::Full,
        facets,
        volume: volume.value() * frame.scale.powi(D as i32),
    }
}

/// Neumaier's sum: half a million terms with the rounding of one.
#[derive(Default)]
struct CompensatedSum {
    sum: f64,
    lost: f64,
}

impl CompensatedSum {
    fn add(&mut self, term: f64) {
        let total = self.sum + term;
        self.lost += if self.sum.abs() >= term.abs() {
            (self.sum - total) + term
        } else {
            (term - total) + self.sum
        };
        self.sum = total;
    }

    fn value(&self) -> f64 {
        self.sum + self.lost
    }
}

#[cfg(test)]
mod tests;
