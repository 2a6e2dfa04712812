//! RGB-D captures: cameras, layouts, rendering, and what is reconstructed from them.

mod bad_captures;
mod camera;
mod layouts;
mod real_captures;
mod rendering;
mod surfaces;
