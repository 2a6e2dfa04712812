//! Generation of the skin that the crate carries, and the solid that it is the surface of.

mod implicit_surface;
mod skin_generation;
