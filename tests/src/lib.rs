//! Tests and benchmarks that cross crates; the library itself is empty.
//!
//! A crate's own tests live with the crate. Here is what needs several of them at once:
//!
//! | where | what | run it with |
//! |---|---|---|
//! | `tests/pipeline_gradient` | gradients through hand, contact and object together | `cargo test -p graspd-tests` |
//! | `tests/fast_path` | one pass in single precision against four in double precision, along a recorded optimisation | `cargo test -p graspd-tests --test fast_path` |
//! | `tests/allocations.rs` | steps of a synthesis allocate nothing | `cargo test -p graspd-tests --test allocations` |
//! | `benches/backends.rs` | tape, duals and lanes, kernel to whole synthesis, one thread and two | `cargo xtask bench` |
//! | `examples/precision.rs` | grasps from the same starts in single and in double precision, judged | `cargo run --release -p graspd-tests --example precision` |
//! | `examples/hand_figures/` | every hand on one object: the tables and pictures of `docs/hands.md` | `cargo run --release -p graspd-tests --example hand_figures` |
//! | `examples/human_hand_picture.rs` | the picture of `docs/human-hand.md` | `cargo run --release -p graspd-tests --example human_hand_picture` |
//! | `benches/step.rs` | a synthesis step and its parts, reference and fast precision side by side | `cargo bench -p graspd-tests --bench step` |
//!
//! Benchmarks name backend and size, so that numbers can be compared across machines; `-- --quick` gives a first look
//! in a minute. They run in the bench profile: those of a dev build say nothing.
