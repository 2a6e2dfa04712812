//! What can go wrong while making a picture.

use std::path::PathBuf;

/// Pixels of the largest picture that is made: 64 megapixels ...
pub(crate) const MAX_PIXELS: usize = 1 << 26;
/// ... of which no side is longer than this.
pub(crate) const MAX_SIDE: usize = 1 << 15;

/// Why a picture could not be made or written.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The picture has no pixels, or too many.
    #[error(
        "a picture of {width} x {height} pixels cannot be made: give sides of 1 to {} and at most {} pixels in all",
        MAX_SIDE,
        MAX_PIXELS
    )]
    Size {
        /// Asked width \[px\].
        width: usize,
        /// Asked height \[px\].
        height: usize,
    },
    /// A camera that looks nowhere: a coordinate is not finite, or the eye is at the target, or the lens has no
    /// extent.
    #[error("the camera cannot be used: {0}")]
    Camera(&'static str),
    /// A page that has nothing to show, or not all that it needs.
    #[error("the page cannot be made: {0}")]
    Page(String),
    /// An object that has no inside.
    #[error("the object cannot be shown: {0}")]
    Object(graspd_geom::GeometryError),
    /// The file could not be written.
    #[error(
        "{path}: cannot write the picture: {cause}; is the folder there, writable and not full?"
    )]
    Write {
        /// The file asked for.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
}
