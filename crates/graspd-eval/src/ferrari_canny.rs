//! Grasp quality: the largest ball of disturbances that the contacts can resist.

use crate::error::EvaluationError;
use crate::hull::{DepthBounds, HullShape, MOST_FACETS, convex_hull_limited, origin_depth_bounds};

/// A ball smaller than this, relative to the longest wrench, is the work of rounding.
const LEAST_EPSILON: f64 = 1e-10;

/// How well a grasp resists disturbing wrenches.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspQuality {
    /// Radius of the largest ball about the origin in the convex hull of the wrenches: the smallest wrench
    /// that the contacts cannot resist with normal forces that sum to 1 (the L1 measure). 0 without force
    /// closure.
    pub epsilon: f64,
    /// 6-dimensional volume of that hull; NaN where the hull has too many facets to be constructed.
    pub volume: f64,
    /// Whether the contacts can resist every wrench: whether epsilon is positive.
    pub force_closure: bool,
    /// Why there is no force closure.
    pub reason: Option<NotForceClosure>,
}

/// Why a grasp has epsilon 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotForceClosure {
    /// There are no wrenches.
    #[error("the hand does not touch the object")]
    NoContacts,
    /// The wrenches span fewer than six dimensions, so that some wrench is beyond them altogether.
    #[error("the contact wrenches span only {affine_dimension} of 6 dimensions")]
    Flat {
        /// Dimension of the affine hull.
        affine_dimension: usize,
    },
    /// The origin is not inside the hull: the contacts cannot even balance one another.
    #[error(
        "the contacts cannot balance one another (the hull of their wrenches is {separation} from the origin, or farther)"
    )]
    OriginOutside {
        /// A lower bound on the distance of the hull from the origin; 0 where the origin is on its boundary.
        separation: f64,
    },
    /// The wrenches could not be judged, and force closure is not ruled out.
    #[error("undecided: {0}")]
    Undecided(EvaluationError),
}

/// Epsilon and volume of the hull of `wrenches` (those of [`grasp_wrenches`](crate::grasp_wrenches)), exact to
/// within rounding.
///
/// The origin is not added to the wrenches: it would change nothing where epsilon is positive.
///
/// The hull of many wrenches in six dimensions is large (150 000 facets for 512, 460 000 for 1024), so reduce
/// hundreds of contacts first ([`reduce_contacts`](crate::reduce_contacts)), or use [`epsilon_bounds`], which
/// does without the hull.
///
/// # Source
/// C. Ferrari, J. Canny, "Planning optimal grasps", ICRA 1992; the volume: A. T. Miller, P. K. Allen,
/// "Examples of 3D grasp quality computations", ICRA 1999.
pub fn grasp_quality(wrenches: &[[f64; 6]]) -> GraspQuality {
    quality_by_hull(wrenches, MOST_FACETS)
}

/// The quality from the hull if that has no more than `most_facets`, else from bounds on epsilon alone.
fn quality_by_hull(wrenches: &[[f64; 6]], most_facets: usize) -> GraspQuality {
    match convex_hull_limited(wrenches, most_facets) {
        Ok(hull) => match (hull.shape, hull.origin_depth()) {
            (HullShape::Full, Some(depth)) => quality(depth, hull.volume, wrenches),
            (HullShape::Flat { affine_dimension }, _) => {
                without_closure(0.0, NotForceClosure::Flat { affine_dimension })
            }
            _ => without_closure(0.0, NotForceClosure::NoContacts),
        },
        Err(too_many @ EvaluationError::TooManyFacets { .. }) => {
            match origin_depth_bounds(wrenches, 0.0) {
                Ok(Some(DepthBounds { upper, .. })) if upper < 0.0 => {
                    quality(upper, f64::NAN, wrenches)
                }
                Ok(Some(DepthBounds { lower, .. })) => quality(lower, f64::NAN, wrenches),
                _ => without_closure(f64::NAN, NotForceClosure::Undecided(too_many)),
            }
        }
        Err(error) => without_closure(f64::NAN, NotForceClosure::Undecided(error)),
    }
}

/// Bounds on epsilon alone, in a fraction of [`grasp_quality`]'s time and memory.
///
/// Stops when `upper - lower <= relative_gap * upper`; with 0, both are epsilon to within rounding. Both are 0
/// without force closure.
///
/// # Errors
/// [`EvaluationError::NotFinite`] for a wrench that is NaN or infinite; [`EvaluationError::TooManyFacets`] where
/// the polytope that brackets the hull outgrows [`MOST_FACETS`](crate::MOST_FACETS).
pub fn epsilon_bounds(
    wrenches: &[[f64; 6]],
    relative_gap: f64,
) -> Result<DepthBounds, EvaluationError> {
    let nothing = DepthBounds {
        lower: 0.0,
        upper: 0.0,
    };
    let least = LEAST_EPSILON * longest(wrenches);
    Ok(match origin_depth_bounds(wrenches, relative_gap)? {
        Some(bounds) if bounds.upper > least => DepthBounds {
            lower: bounds.lower.max(0.0),
            upper: bounds.upper,
        },
        _ => nothing,
    })
}

fn quality(depth: f64, volume: f64, wrenches: &[[f64; 6]]) -> GraspQuality {
    if depth <= LEAST_EPSILON * longest(wrenches) {
        let separation = (-depth).max(0.0);
        return without_closure(volume, NotForceClosure::OriginOutside { separation });
    }
    GraspQuality {
        epsilon: depth,
        volume,
        force_closure: true,
        reason: None,
    }
}

fn without_closure(volume: f64, reason: NotForceClosure) -> GraspQuality {
    GraspQuality {
        epsilon: 0.0,
        volume,
        force_closure: false,
        reason: Some(reason),
    }
}

/// Length of the longest wrench.
fn longest(wrenches: &[[f64; 6]]) -> f64 {
    let squared = |wrench: &[f64; 6]| wrench.iter().map(|x| x * x).sum::<f64>();
    wrenches.iter().map(squared).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, FRICTION_EDGES, grasp_wrenches};
    use nalgebra::{Point3, Vector3};

    /// Contacts on the corners of a cube, `lifted` along z.
    fn wrenches(lifted: f64) -> Vec<[f64; 6]> {
        let contact = |corner: usize| {
            let sign = |bit: usize| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let outward = Vector3::new(sign(0), sign(1), sign(2)).normalize();
            Contact {
                point: outward.into(),
                normal: (Vector3::z() * lifted - outward).normalize(),
            }
        };
        let contacts: Vec<_> = (0..8).map(contact).collect();
        grasp_wrenches(&contacts, 0.5, FRICTION_EDGES, Point3::origin(), 1.0)
    }

    #[test]
    fn a_hull_too_large_to_build_costs_the_volume_alone() {
        let wrenches = wrenches(0.0);
        let full = grasp_quality(&wrenches);
        let limited = quality_by_hull(&wrenches, 500);
        assert!(limited.volume.is_nan() && limited.force_closure);
        assert!((limited.epsilon - full.epsilon).abs() < 1e-12);
    }

    #[test]
    fn the_same_holds_without_force_closure() {
        let wrenches = wrenches(5.0);
        let (full, limited) = (grasp_quality(&wrenches), quality_by_hull(&wrenches, 500));
        for quality in [&full, &limited] {
            assert_eq!(quality.epsilon, 0.0);
            let reason = quality.reason.as_ref();
            assert!(
                matches!(reason, Some(NotForceClosure::OriginOutside { separation }) if *separation > 0.1)
            );
        }
        assert!(full.volume > 0.0 && limited.volume.is_nan());
    }
}
