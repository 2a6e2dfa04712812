//! How a distance grid is sampled.

use graspd_settings::{NOT_NEGATIVE, ranges};

use super::SdfGrid;
use super::grid::check_dims;
use super::tiles::Tiles;
use crate::distance::SignedDistance;
use crate::{CacheKey, DiskCache, GeometryError, Vec3};

/// Counts up whenever the same mesh and settings give other values, or these are stored in another way.
const VERSION: u32 = 1;
/// Bytes before the samples: nine numbers.
const HEADER_LEN: usize = 9 * 8;

/// How a mesh's distance grid is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SdfSampling {
    /// Samples along each axis, 2 to 1024; paper: 256.
    pub resolution: usize,
    /// Distance by which the grid reaches beyond the mesh's bounding box on every side \[m\]; paper: 0.01.
    pub padding: f64,
    /// Distance from the surface up to which samples must be exact \[m\]; `None`: all of them.
    ///
    /// Beyond it the sign is still right, and the sample's absolute value never larger than the distance d. With c
    /// the diagonal of a cell of 8 x 8 x 8 samples (7 mm for a grid of 256 samples along 14 cm), it falls short by
    /// about c^2 / 8 d, and by at most about c / 2 where the nearest point jumps, as it does in the middle of a
    /// cavity; it is continuous, and so has a gradient of use everywhere.
    pub band: Option<f64>,
}

impl SdfSampling {
    /// A band that holds whatever is about to touch \[m\].
    pub const USUAL_BAND: f64 = 0.02;

    /// Exact at every sample.
    pub fn exact(resolution: usize, padding: f64) -> Self {
        Self {
            resolution,
            padding,
            band: None,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// A resolution, padding or band out of range.
    pub fn validate(&self) -> Result<(), GeometryError> {
        check_dims([self.resolution; 3])?;
        Ok(ranges! { self => padding: NOT_NEGATIVE, band: NOT_NEGATIVE }.check()?)
    }

    /// What a grid sampled this way depends on.
    fn key(&self, surface: &SignedDistance) -> CacheKey {
        let triangles = surface.tree().corners().flatten();
        CacheKey::new("sdf", VERSION)
            .with_count(self.resolution)
            .with_numbers([self.padding, self.band.unwrap_or(f64::INFINITY)])
            .with_numbers(triangles.flat_map(|corner| [corner.x, corner.y, corner.z]))
    }
}

impl SdfGrid {
    /// As [`SdfGrid::sample`], but taken from the cache if it holds this grid, and else stored there; the result is
    /// the same to the last bit.
    ///
    /// # Errors
    /// As [`SdfGrid::sample`]. A cache that cannot be used is none: [`DiskCache::fault`] tells.
    pub fn sample_cached(
        surface: &SignedDistance,
        sampling: &SdfSampling,
        cache: &DiskCache,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, GeometryError> {
        sampling.validate()?;
        let key = sampling.key(surface);
        let stored = cache.load(&key);
        if let Some(grid) = stored.and_then(|bytes| Self::from_bytes(&bytes)) {
            progress(1.0);
            return Ok(grid);
        }
        let grid = Self::sample(surface, sampling, progress)?;
        cache.store(&key, &grid.to_bytes());
        Ok(grid)
    }

    /// Samples along each axis, origin, spacing, and the samples as they lie in memory; all little-endian.
    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_LEN + 4 * self.tiles.places().len());
        for count in self.dims() {
            bytes.extend((count as u64).to_le_bytes());
        }
        for vector in [self.origin, self.spacing] {
            for axis in 0..3 {
                bytes.extend(vector.get(axis).to_le_bytes());
            }
        }
        for value in self.tiles.places() {
            bytes.extend(value.to_le_bytes());
        }
        bytes
    }

    /// `None` if that is no grid.
    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (header, samples) = bytes.split_at_checked(HEADER_LEN)?;
        let mut fields = header
            .chunks_exact(8)
            .filter_map(|field| field.try_into().ok());
        let mut counts = [0; 3];
        for count in &mut counts {
            *count = usize::try_from(u64::from_le_bytes(fields.next()?)).ok()?;
        }
        let mut numbers = [0.0; 6];
        for number in &mut numbers {
            *number = f64::from_le_bytes(fields.next()?);
        }
        let [ox, oy, oz, sx, sy, sz] = numbers;
        check_dims(counts).ok()?;
        let mut tiles = Tiles::zeros(counts)?;
        if samples.len() != 4 * tiles.places().len() {
            return None;
        }
        for (place, sample) in tiles.places_mut().iter_mut().zip(samples.chunks_exact(4)) {
            *place = f32::from_le_bytes(sample.try_into().ok()?);
        }
        let is_sound = numbers.iter().all(|number| number.is_finite())
            && tiles.places().iter().all(|value| value.is_finite());
        is_sound.then_some(Self {
            origin: Vec3::new(ox, oy, oz),
            spacing: Vec3::new(sx, sy, sz),
            tiles,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_grid_is_refused() {
        let unit = Vec3::new(1.0, 1.0, 1.0);
        let values: Vec<f32> = (0..60).map(|at| at as f32).collect();
        let grid = SdfGrid::from_values(Vec3::zero(), unit, [3, 4, 5], &values).unwrap();
        let bytes = grid.to_bytes();
        assert!(SdfGrid::from_bytes(&bytes).unwrap() == grid);
        for len in (0..bytes.len()).step_by(7) {
            assert!(SdfGrid::from_bytes(&bytes[..len]).is_none());
        }
        for (at, part) in [
            (0, 1_u64.to_le_bytes()),
            (8, u64::MAX.to_le_bytes()),
            (16, 9_u64.to_le_bytes()),
            (24, f64::NAN.to_le_bytes()),
            (48, f64::INFINITY.to_le_bytes()),
            (HEADER_LEN, [255; 8]),
        ] {
            let mut bytes = bytes.clone();
            bytes[at..at + 8].copy_from_slice(&part);
            assert!(SdfGrid::from_bytes(&bytes).is_none(), "byte {at}");
        }
    }
}
