//! Grasp quality: the largest ball of disturbances that the contacts can resist.

use serde::{Deserialize, Serialize};

use crate::error::EvaluationError;
use crate::hull::{
    DepthBounds, DepthSearch, HullVolume, OriginDepth, VolumeSettings, hull_volume, origin_depth,
    origin_depth_of_sum,
};

/// A ball smaller than this, relative to the longest wrench, is the work of rounding.
const MIN_EPSILON: f64 = 1e-10;

/// What the normal forces of a grasp may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ForceLimit {
    /// They sum to at most 1 (the L1 measure, the paper's): the grasp wrench space is the convex hull of the contacts'
    /// wrenches.
    #[default]
    Sum,
    /// Each is at most 1 (the L-infinity measure): the Minkowski sum of the hulls of each contact's wrenches and 0.
    Each,
}

/// How epsilon is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpsilonSettings {
    /// The forces that the contacts may exert.
    pub limit: ForceLimit,
    /// How many consecutive wrenches belong to one contact; matters to [`ForceLimit::Each`] alone.
    pub wrenches_per_contact: usize,
    /// When the bounds are close enough.
    pub search: DepthSearch,
}

impl EpsilonSettings {
    /// The L1 measure.
    pub fn sum() -> Self {
        Self {
            limit: ForceLimit::Sum,
            wrenches_per_contact: 1,
            search: DepthSearch::default(),
        }
    }

    /// The L-infinity measure of contacts with so many wrenches each, to 1 part in 10^6, or to what 300 000 facets
    /// (two seconds or so) allow.
    pub fn each(wrenches_per_contact: usize) -> Self {
        Self {
            limit: ForceLimit::Each,
            wrenches_per_contact,
            search: DepthSearch {
                relative_gap: 1e-6,
                max_facets: 300_000,
            },
        }
    }
}

/// Ferrari and Canny's epsilon with a certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct Epsilon {
    /// The smallest wrench that the contacts cannot resist: the radius of the largest ball about the origin in the
    /// grasp wrench space. The value is the lower bound, and 0 without force closure.
    pub value: f64,
    /// No wrench below this is beyond the contacts.
    pub lower: f64,
    /// Some wrench of this size is, or just above it.
    pub upper: f64,
    /// Why there is no force closure; `None` where there is.
    pub reason: Option<NotForceClosure>,
}

impl Epsilon {
    fn zero(reason: NotForceClosure) -> Self {
        let upper = match reason {
            NotForceClosure::Undecided { upper } => upper,
            _ => 0.0,
        };
        Self {
            value: 0.0,
            lower: 0.0,
            upper,
            reason: Some(reason),
        }
    }

    /// Whether the contacts can resist every wrench.
    pub fn is_force_closure(&self) -> bool {
        self.reason.is_none()
    }
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
    /// The origin is not inside the grasp wrench space: the contacts cannot even balance one another.
    #[error(
        "the contacts cannot balance one another (their wrench space is {separation} from the origin, or farther)"
    )]
    OriginOutside {
        /// A lower bound on the distance of the wrench space from the origin; 0 where the origin is on its boundary.
        separation: f64,
    },
    /// The search ended at its limit of facets before the origin was known to be inside.
    #[error("undecided: epsilon is at most {upper}; allow more facets to tell it from 0")]
    Undecided {
        /// Upper bound on epsilon.
        upper: f64,
    },
}

/// Epsilon of any set of wrenches, with bounds that certify it; hundreds of contacts take milliseconds.
///
/// The origin is not added to the wrenches in the L1 measure: it would change nothing where epsilon is positive.
///
/// # Errors
/// [`EvaluationError::NotFinite`] for a wrench that is NaN or infinite.
///
/// # Source
/// C. Ferrari, J. Canny, "Planning optimal grasps", ICRA 1992; the algorithm: Y. Zheng, "An efficient algorithm for
/// a grasp quality measure", IEEE T-RO 29(2), 2013.
pub fn ferrari_canny(
    wrenches: &[[f64; 6]],
    settings: &EpsilonSettings,
) -> Result<Epsilon, EvaluationError> {
    let group = settings.wrenches_per_contact.max(1);
    let depth = match settings.limit {
        ForceLimit::Sum => origin_depth(wrenches, &settings.search)?,
        ForceLimit::Each => origin_depth_of_sum(wrenches, group, &settings.search)?,
    };
    let DepthBounds { lower, upper } = match depth {
        OriginDepth::Between(bounds) => bounds,
        OriginDepth::Empty => return Ok(Epsilon::zero(NotForceClosure::NoContacts)),
        OriginDepth::Flat { affine_dimension } => {
            return Ok(Epsilon::zero(NotForceClosure::Flat { affine_dimension }));
        }
    };
    let reach = match settings.limit {
        ForceLimit::Sum => longest(wrenches),
        ForceLimit::Each => wrenches.chunks(group).map(longest).sum(),
    };
    let least = MIN_EPSILON * reach;
    Ok(if upper <= least {
        let separation = (-upper).max(0.0);
        Epsilon::zero(NotForceClosure::OriginOutside { separation })
    } else if lower <= least {
        Epsilon::zero(NotForceClosure::Undecided { upper })
    } else {
        Epsilon {
            value: lower,
            lower,
            upper,
            reason: None,
        }
    })
}

/// How well a grasp resists disturbing wrenches.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspQuality {
    /// The L1 measure.
    pub epsilon: Epsilon,
    /// 6-dimensional volume of the hull of the wrenches; 0 where they are flat.
    pub volume: HullVolume,
}

/// Epsilon (L1) and volume of the hull of `wrenches`, both with default settings.
///
/// # Errors
/// As for [`ferrari_canny`].
///
/// # Source
/// The volume: A. T. Miller, P. K. Allen, "Examples of 3D grasp quality computations", ICRA 1999.
pub fn grasp_quality(wrenches: &[[f64; 6]]) -> Result<GraspQuality, EvaluationError> {
    Ok(GraspQuality {
        epsilon: ferrari_canny(wrenches, &EpsilonSettings::sum())?,
        volume: hull_volume(wrenches, &VolumeSettings::default())?,
    })
}

/// Length of the longest wrench.
fn longest(wrenches: &[[f64; 6]]) -> f64 {
    let squared = |wrench: &[f64; 6]| wrench.iter().map(|x| x * x).sum::<f64>();
    wrenches.iter().map(squared).fold(0.0, f64::max).sqrt()
}
