//! Scenes: the built-in hand at analytic objects.

mod contacts_task;
mod force_step;
mod gradients;
mod invariance;
mod physics;
mod setting;
