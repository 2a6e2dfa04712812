//! The open hand and the limits, in the coefficients that a hand uses.

use nalgebra::{DMatrix, DVector};

use super::model::{POSE_VALUES, SkinnedModel};
use crate::Limit;

/// What [`open_coefficients`] finds.
pub(crate) struct CoefficientRange {
    pub(crate) open: Vec<f64>,
    pub(crate) limits: Option<Vec<Limit>>,
}

/// Returns the open hand, and the limits counted from `mean` instead of from the model's own mean pose.
///
/// The open hand is what the model says, or else the pose of the space that is nearest to the template, in which hand
/// models hold their fingers straight and apart; the limits, where known, are widened to let it in.
pub(crate) fn open_coefficients(
    model: &SkinnedModel,
    components: &[[f64; POSE_VALUES]],
    mean: &[f64; POSE_VALUES],
) -> CoefficientRange {
    let count = components.len();
    // Coefficients of the model's mean, counted from `mean`.
    let offset = model.pose_mean.iter().zip(mean).map(|(from, to)| from - to);
    let offset = nearest(components, &offset.collect::<Vec<_>>());
    let limits = model.coefficient_limits.as_ref().map(|limits| {
        let limits = limits.iter().zip(&offset);
        limits
            .map(|(limit, by)| Limit {
                lower: limit.lower + by,
                upper: limit.upper + by,
            })
            .collect::<Vec<_>>()
    });
    let open = match &model.open_coefficients {
        Some(open) => (0..count).map(|k| open[k] + offset[k]).collect(),
        None => {
            let straight: Vec<f64> = mean.iter().map(|value| -value).collect();
            nearest(components, &straight)
        }
    };
    let limits = limits.map(|limits| {
        let limits = limits.into_iter().zip(&open);
        limits
            .map(|(limit, &open)| Limit {
                lower: limit.lower.min(open),
                upper: limit.upper.max(open),
            })
            .collect()
    });
    CoefficientRange { open, limits }
}

/// Returns the coefficients whose combination of components comes nearest to a pose; 0 along what the components do
/// not span.
fn nearest(components: &[[f64; POSE_VALUES]], pose: &[f64]) -> Vec<f64> {
    let basis = DMatrix::from_fn(POSE_VALUES, components.len(), |row, column| {
        components[column][row]
    });
    let pose = DVector::from_column_slice(pose);
    // Of unit size: MANO's rows are unit vectors, and other models' angles.
    let solution = basis.svd(true, true).solve(&pose, 1e-9);
    // Only asking for no singular vectors could fail.
    solution.map_or_else(|_| vec![0.0; components.len()], |x| x.as_slice().to_vec())
}
