//! What can go wrong when a grasp is judged.

use graspd_settings::OutOfRange;

/// Why a grasp or an object could not be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// A point or wrench has a coordinate that is NaN or infinite.
    #[error(
        "point or wrench {index} has a coordinate that is not a finite number; \
         check the contacts that it was made from"
    )]
    NotFinite {
        /// Index of the first such point in the input.
        index: usize,
    },
    /// A convex hull has more facets than memory was granted for.
    #[error(
        "the convex hull has more than {limit} facets; take fewer points, \
         or bounds (`origin_depth`, `hull_volume`) that do without it"
    )]
    TooManyFacets {
        /// The limit that was reached.
        limit: usize,
    },
    /// Points that no arithmetic at hand tells apart.
    #[error(
        "the boundary of the convex body could not be resolved; leave out nearly coincident points"
    )]
    Unresolved,
    /// A mesh has no faces, or an index beyond its vertices, or a coordinate that is not a finite number.
    #[error(
        "the {mesh} mesh cannot be evaluated: {fault}; close and orient it with a mesh repair tool, or load another"
    )]
    BadMesh {
        /// Which mesh: "object" or "hand".
        mesh: &'static str,
        /// What is wrong with it.
        fault: String,
    },
    /// A setting lies outside the range in which it makes sense.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// The physics engine produced a pose that is not a finite number.
    #[error(
        "the displacement simulation diverged at step {step}; report this grasp as unstable or lower `time_step`"
    )]
    Diverged {
        /// The first step with a bad pose.
        step: usize,
    },
    /// This program was built without a physics engine.
    #[error(
        "this program was built without the physics engine {engine}; \
         build it with the feature `{engine}`, or choose `graspd`"
    )]
    MissingEngine {
        /// The engine.
        engine: &'static str,
    },
    /// Another engine's answer does not fit the job that it was given.
    #[error("the engine's answer lacks motions of hand {hand}; check its version")]
    BadAnswer {
        /// Index of the hand in the job.
        hand: usize,
    },
    /// A list of metrics has a name that is none.
    #[error(
        "there is no metric `{name}`; choose from ca, iv, pd, spd, gws, sd, sd6, shake and all"
    )]
    UnknownMetric {
        /// The name.
        name: String,
    },
}
