//! Fills a grid with the exact signed distance to a mesh.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::SdfGrid;
use super::grid::{allocate, check_dims, node};
use crate::Vec3;
use crate::distance::{DistanceError, SignedDistance};

impl SdfGrid {
    /// Samples the exact signed distance `resolution`^3 times over the mesh's bounding box, grown on every side
    /// by `padding` \[m\]; the first and last samples along each axis lie on the faces of the grown box.
    ///
    /// Runs on rayon's current thread pool; the result does not depend on the number of threads. `progress` is
    /// called now and then, from any thread, with the share that is done.
    ///
    /// # Errors
    /// A resolution below 2 or above 1024, a padding that is negative or not finite or leaves the box flat, and
    /// a grid for which there is no memory.
    pub fn build(
        surface: &SignedDistance,
        resolution: usize,
        padding: f64,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, DistanceError> {
        let dims = [resolution; 3];
        check_dims(dims)?;
        let (low, high) = surface.bounds();
        let origin = Vec3::new(low.x - padding, low.y - padding, low.z - padding);
        let steps = (resolution - 1) as f64;
        let spacing = Vec3::new(
            (high.x - low.x + 2.0 * padding) / steps,
            (high.y - low.y + 2.0 * padding) / steps,
            (high.z - low.z + 2.0 * padding) / steps,
        );
        if !(padding >= 0.0 && padding.is_finite()) {
            let what = format!("the padding is {padding}");
            return Err(DistanceError::Extent { what });
        }
        let mut values = allocate(dims)?;
        values.resize(resolution.pow(3), 0.0);
        let done = AtomicUsize::new(0);
        let layer = resolution * resolution;
        values
            .par_chunks_mut(layer)
            .enumerate()
            .for_each(|(k, values)| {
                for (at, value) in values.iter_mut().enumerate() {
                    let index = [at % resolution, at / resolution, k];
                    let p = node(origin, spacing, index).into();
                    *value = surface.signed_distance(&p) as f32;
                }
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress(done as f64 / resolution as f64);
            });
        Self::from_values(origin, spacing, dims, values)
    }
}
