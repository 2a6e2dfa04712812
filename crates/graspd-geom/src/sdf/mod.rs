//! Signed distances sampled on a grid.

mod build;
mod grid;
mod query;
mod rows;
mod tiles;

pub use grid::SdfGrid;
