//! Scenes: the built-in hand at analytic objects.

mod gradients;
mod invariance;
mod physics;
mod setting;
