//! What can go wrong when a grasp is judged.

/// Why a grasp or an object could not be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// A point or wrench has a coordinate that is NaN or infinite.
    #[error(
        "point or wrench {index} has a coordinate that is not a finite number; check the contacts that it was made from"
    )]
    NotFinite {
        /// Index of the first such point in the input.
        index: usize,
    },
    /// A convex hull has more facets than memory was granted for.
    #[error(
        "the convex hull has more than {limit} facets; reduce the contacts (`reduce_contacts`) or take fewer friction edges"
    )]
    TooManyFacets {
        /// The limit that was reached.
        limit: usize,
    },
}
