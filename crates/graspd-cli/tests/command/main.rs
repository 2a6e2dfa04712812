//! The `graspd` command as scripts see it: exit status, stdout, stderr and the files that it leaves.

mod bad_hands;
mod bad_objects;
mod bad_outputs;
mod bad_records;
mod bad_settings;
mod browser;
mod cache;
mod captures;
mod determinism;
mod distance_grid;
mod foreign_grasps;
mod hands;
mod judging;
mod listings;
mod outcome;
mod repair;
mod run_extras;
mod run_folder;
mod shared_run;
mod streams;
mod view;
mod viewer;
mod wrench_sets;
