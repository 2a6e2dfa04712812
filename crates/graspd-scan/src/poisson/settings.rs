//! What a reconstruction can be told.

use graspd_settings::{Ranges, Validate, between, ranges};

/// Depths beyond this would need terabytes.
const MAX_DEPTH: f64 = 13.0;

/// Settings of [`poisson_surface`](crate::poisson_surface).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoissonSettings {
    /// Depth of the octree, 2 to 13: the surface is made of cells of side `scale` times the cloud's longest extent /
    /// 2^depth. Each step more takes four times the time and memory. The paper of the grasps uses 5.
    pub depth: u32,
    /// Side of the cube that is solved in over the longest extent of the cloud, 1 to 10.
    pub scale: f64,
    /// How strongly the surface is drawn to the samples against following their normals, 0 or more: 4 as in the paper
    /// of the method. 0 is the unscreened reconstruction of 2006.
    pub point_weight: f64,
    /// How many samples a cell should hold; where they are fewer, normals are spread over larger cells. 1 to 1.5 for
    /// clean samples, up to 20 for noisy ones, which are smoothed so.
    pub samples_per_cell: f64,
    /// Most memory that may be used \[bytes\].
    pub max_memory: u64,
}

impl Default for PoissonSettings {
    fn default() -> Self {
        Self {
            depth: 8,
            scale: 1.1,
            point_weight: 4.0,
            samples_per_cell: 1.5,
            max_memory: 4 << 30,
        }
    }
}

impl Validate for PoissonSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            depth: between(2.0, MAX_DEPTH),
            scale: between(1.0, 10.0),
            point_weight: between(0.0, 1e6),
            samples_per_cell: between(0.1, 1000.0),
        }
    }
}
