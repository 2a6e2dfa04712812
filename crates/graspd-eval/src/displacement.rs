//! Simulation displacement: how far the object moves in an independent physics engine while the hand is fixed.

mod climbing;
mod decomposition;
mod exchange;
mod piece;
mod protocol;
mod rapier;
mod separation;
mod shake;
mod stored;

#[cfg(test)]
mod tests;

pub use decomposition::{DecompositionSettings, ObjectPieces};
pub use exchange::{SimulationAnswer, SimulationJob, convex_parts};
pub use piece::ConvexPiece;
pub use protocol::{DisplacementSettings, ObjectMotion, SIX_DIRECTIONS, SixDisplacements};
pub use rapier::{DynamicObject, FixedHand, simulate, simulate_six_directions};
pub use shake::{ShakeOutcome, ShakeSettings, shake};
