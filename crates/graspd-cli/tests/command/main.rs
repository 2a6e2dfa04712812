//! The `graspd` command as scripts see it: exit status, stdout, stderr and the files that it leaves.

mod bad_hands;
mod bad_objects;
mod bad_outputs;
mod bad_records;
mod bad_settings;
mod batch;
mod cache;
mod configuration;
mod determinism;
mod distance_grid;
mod export;
mod guides;
mod hands;
mod judging;
mod listings;
mod outcome;
mod repair;
mod run_extras;
mod run_folder;
mod shared_run;
mod shells;
mod streams;
mod wrench_sets;
