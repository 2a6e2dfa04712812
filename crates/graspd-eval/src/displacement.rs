//! Simulation displacement: how far the object moves under independent physics while the hand is fixed.

mod body;
mod clearing;
mod climbing;
#[cfg(test)]
mod climbing_shape;
mod constraint;
mod decomposition;
mod exchange;
mod fall;
mod order;
mod overlap;
mod patch;
mod piece;
mod protocol;
#[cfg(test)]
mod rapier;
mod reduction;
mod search;
mod separation;
mod shake;
mod sides;
mod simulation;
mod solver;
mod stored;

#[cfg(test)]
mod rapier_tests;
#[cfg(test)]
mod tests;

pub use decomposition::{DecompositionSettings, ObjectPieces};
pub use exchange::{SimulationAnswer, SimulationJob, convex_parts};
pub use piece::ConvexPiece;
pub use protocol::{DisplacementSettings, ObjectMotion, SIX_DIRECTIONS, SixDisplacements};
pub use shake::{ShakeOutcome, ShakeSettings, shake};
pub use simulation::{DynamicObject, FixedHand, simulate, simulate_six_directions};
