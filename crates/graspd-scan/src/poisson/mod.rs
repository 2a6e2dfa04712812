//! Screened Poisson reconstruction: from oriented samples of a surface to a closed mesh.

mod cube_cases;
mod density;
mod extract;
mod field;
mod octree;
mod runs;
mod samples;
mod settings;
mod solve;
mod splat;
mod surface;
mod system;
mod thin_walls;
mod transfer;

pub use settings::PoissonSettings;
pub use surface::{PoissonSurface, poisson_surface};
