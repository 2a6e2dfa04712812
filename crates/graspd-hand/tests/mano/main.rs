//! Skinned hands in MANO's layout: every stage against an independent implementation, files, faults.

mod kinematics;
mod plain;
mod synthetic;
