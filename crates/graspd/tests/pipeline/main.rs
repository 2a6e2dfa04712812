//! The pipeline as its users see it: starts, synthesis, runs, ranking, records, summaries.

mod ablation;
mod annealing;
mod dexgraspnet;
mod diversity;
mod execution;
mod fixtures;
mod invariance;
mod object;
mod preset;
mod rank;
mod record;
mod record_files;
mod released;
mod run;
mod skin_fit;
mod start;
mod summary;
mod synthesis;
