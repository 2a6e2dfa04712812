//! Simulation displacement: how far the object moves under independent physics while the hand is fixed.
//!
//! A rigid-body simulation for the one case there is here, a free object of convex pieces against a
//! fixed triangle mesh:
//!
//! | stage | module |
//! |---|---|
//! | object as convex pieces, fixed hand | `bodies`, `decomposition`, `convex_piece` |
//! | rigid body, its integration | `rigid_body` |
//! | contacts of pieces with triangles | `narrow_phase` by `sat`, `hill_climbing`, `clipping` |
//! | contact manifolds of at most four points | `manifold`, `manifold_reduction` |
//! | contact constraints, solved by sequential impulses | `contact_constraint`, `solver` |
//! | time stepping | `world` |
//! | the two tests | `protocol` and `simulation` (displacement), `shake` |
//! | other engines | `rapier` (feature `rapier`), `external_engine` (jobs for programs outside) |

mod bodies;
mod clipping;
mod contact_constraint;
mod convex_piece;
mod decomposition;
mod decomposition_cache;
mod engine;
mod external_engine;
mod hill_climbing;
mod manifold;
mod manifold_reduction;
mod narrow_phase;
mod protocol;
#[cfg(any(test, feature = "rapier"))]
mod rapier;
mod rigid_body;
mod sat;
mod shake;
mod simulation;
mod solver;
mod world;

#[cfg(test)]
mod rapier_tests;
#[cfg(test)]
mod tests;

pub use bodies::{DynamicObject, FixedHand};
pub use convex_piece::ConvexPiece;
pub use decomposition::{DecompositionSettings, ObjectPieces};
pub use engine::PhysicsEngine;
pub use external_engine::{SimulationAnswer, SimulationJob, convex_parts};
pub use protocol::{DisplacementSettings, ObjectMotion, SIX_DIRECTIONS, SixDisplacements};
pub use shake::{ShakeOutcome, ShakeSettings, shake};
pub use simulation::{simulate, simulate_six_directions};
