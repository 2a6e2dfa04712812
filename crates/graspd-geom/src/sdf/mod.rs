//! Signed distances sampled on a grid.

mod band;
mod build;
mod grid;
mod query;
mod rows;
mod sampling;
mod tiles;

pub use grid::SdfGrid;
pub use sampling::SdfSampling;
