//! The object's signed distance, as coarse as the eye: what the page colours penetration by.

use graspd_geom::{GeometryError, SdfGrid, SdfSampling, SignedDistance, TriangleMesh};
use serde::Serialize;

use super::block::{Block, Section};

/// Samples along each axis.
const SAMPLES: usize = 96;
/// Distances beyond this are cut off \[m\].
const RANGE: f64 = 0.005;

/// A grid of distances, first axis fastest: 0 is -`range`, 255 is `range`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FieldDescription {
    samples: Section,
    dims: [usize; 3],
    origin: [f64; 3],
    spacing: [f64; 3],
    range: f64,
}

impl FieldDescription {
    /// Samples the closed surface of `object`.
    ///
    /// # Errors
    /// If the surface is not closed.
    pub(super) fn store(object: &TriangleMesh, block: &mut Block) -> Result<Self, GeometryError> {
        let sampling = SdfSampling {
            resolution: SAMPLES,
            padding: 0.0,
            band: Some(1.2 * RANGE),
        };
        let grid = SdfGrid::sample(&SignedDistance::new(object)?, &sampling, &|_| {})?;
        let samples: Vec<u32> = (grid.to_values().into_iter())
            .map(|distance| {
                let share = (f64::from(distance) / RANGE).clamp(-1.0, 1.0);
                (127.5 * (share + 1.0)).round() as u32
            })
            .collect();
        let (origin, spacing) = (grid.origin(), grid.spacing());
        Ok(Self {
            samples: block.push(&samples, 1, 1),
            dims: grid.dims(),
            origin: [origin.x, origin.y, origin.z],
            spacing: [spacing.x, spacing.y, spacing.z],
            range: RANGE,
        })
    }
}
