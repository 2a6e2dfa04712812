//! Tests and benchmarks that cross crates; the library itself is empty.
//!
//! A crate's own tests live with the crate. Here is what needs several of them at once:
//!
//! | where | what | run it with |
//! |---|---|---|
//! | `tests/` | gradients through hand, contact and object together | `cargo test -p graspd-tests` |
//! | `benches/step.rs` | a synthesis step and its parts, reference and fast precision side by side | `cargo bench -p graspd-tests --bench step` |
//!
//! Benchmarks name backend and size, so that numbers can be compared across machines; `-- --quick` gives a first look
//! in a minute. They run in the bench profile: those of a dev build say nothing.
