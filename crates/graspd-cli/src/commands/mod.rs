//! One file for each command.

pub(crate) mod batch;
pub(crate) mod cache;
pub(crate) mod configuration;
mod engine;
pub(crate) mod eval;
pub(crate) mod export;
pub(crate) mod gws;
pub(crate) mod hands;
pub(crate) mod input;
pub(crate) mod objects;
pub(crate) mod output;
pub(crate) mod reconstruct;
pub(crate) mod repair;
pub(crate) mod scan;
pub(crate) mod sdf;
pub(crate) mod shell;
pub(crate) mod subject;
pub(crate) mod synth;
pub(crate) mod view;
