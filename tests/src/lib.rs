//! Tests and benchmarks that cross crates: see the folders `tests` and `benches` of this package.
