//! Skinned hands in MANO's layout: every stage against an independent implementation, files, faults.

mod archives;
mod faults;
#[path = "../following/mod.rs"]
mod following;
mod kinematics;
mod mutations;
mod pickles;
mod plain;
mod real_hand;
mod synthetic;
