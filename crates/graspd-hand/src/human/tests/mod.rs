//! Generation of the skin that the crate carries, and the solid that it is the surface of.

mod implicit_surface;
mod remeshing;
mod skin_generation;
