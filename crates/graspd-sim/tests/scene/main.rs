//! Scenes: the built-in hand at analytic objects.

mod contacts_task;
mod gradients;
mod invariance;
mod physics;
mod setting;
