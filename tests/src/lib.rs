//! Tests, benchmarks and examples that need several crates at once; the library itself is empty.
//!
//! | file | what it shows | run by |
//! |---|---|---|
//! | `tests/pipeline_gradient` | the gradient of the losses by the hand's pose | `cargo test`, as all tests |
//! | `tests/fast_path` | one pass in single precision against four in double precision | |
//! | `tests/allocations.rs` | steps of a synthesis allocate nothing | |
//! | `tests/derivative_by_hand.rs` | the contact law differentiated by hand against duals | |
//! | `benches/backends` | tape, duals and lanes, from kernel to synthesis | `cargo xtask bench` |
//! | `benches/step.rs` | a synthesis step and its parts | `cargo bench -p graspd-tests --bench step` |
//! | `benches/sdf_query` | memory layouts of distance grids | `cargo bench ... --bench sdf_query` |
//! | `benches/wrench_space.rs` | epsilon and volume of the wrench space | `cargo bench ... --bench wrench_space` |
//! | `examples/hand_figures` | every hand on one object: `lab/hands.md` | `cargo run --release ... --example NAME` |
//! | `examples/human_hand_picture.rs` | the picture of `docs/human-hand.md` | |
//! | `examples/precision.rs` | grasps in single and in double precision, judged | |
//! | `examples/two_threads.rs` | what a second core brings | |
//!
//! Benchmarks name backend and size, so that numbers can be compared across machines; `-- --quick` gives a first look
//! in a minute. They run in the bench profile: those of a dev build say nothing.
