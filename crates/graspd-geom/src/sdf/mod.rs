//! Signed distances sampled on a grid.

mod build;
mod grid;
mod query;

pub use grid::SdfGrid;
