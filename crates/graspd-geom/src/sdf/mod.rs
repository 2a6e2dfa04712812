//! Signed distances sampled on a grid.

mod build;
mod grid;
mod query;
mod rows;

pub use grid::SdfGrid;
