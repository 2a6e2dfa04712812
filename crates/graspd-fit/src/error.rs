//! Errors of the skin fit.

use graspd_settings::OutOfRange;

/// Why a hand could not be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The hand's surface.
    #[error(transparent)]
    Geometry(#[from] graspd_geom::GeometryError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
}
