//! Skinned hands in MANO's layout: every stage against an independent implementation, files, faults.

mod archives;
mod faults;
#[path = "../jacobian_rows/mod.rs"]
mod jacobian_rows;
mod kinematics;
mod mutations;
mod pickles;
mod plain;
mod real_hand;
mod synthetic;
