//! A planner to compare with: simulated annealing over the hand's base and eigengrasp amplitudes, as in GraspIt!.

mod closing;
mod eigengrasps;
mod energy;
mod planner;
mod probe;
mod settings;

pub use planner::anneal;
pub use settings::AnnealingSettings;
