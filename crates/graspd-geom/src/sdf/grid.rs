//! A regular grid of signed distances.

use nalgebra::Point3;

use super::tiles::Tiles;
use crate::{GeometryError, Vec3};

/// Most samples along one axis.
pub(super) const MAX_RESOLUTION: usize = 1024;

/// Signed distances sampled at the nodes of a box-shaped grid: the smoothed, differentiable shape of an object.
///
/// Node (i, j, k) lies at `origin + (i, j, k) * spacing`. How to look up the distance between nodes is said at
/// [`SdfGrid::distance_and_gradient`].
#[derive(Clone, Debug, PartialEq)]
pub struct SdfGrid {
    pub(super) origin: Vec3<f64>,
    pub(super) spacing: Vec3<f64>,
    pub(super) tiles: Tiles,
}

impl SdfGrid {
    /// A grid of given values, such as one read from a file; that of node (i, j, k) is number `i + nx (j + ny k)`.
    ///
    /// # Errors
    /// Fewer than 2 or more than 1024 samples along an axis, an origin or spacing that is not finite, a spacing
    /// that is not positive, a wrong number of values, or a value that is not finite.
    pub fn from_values(
        origin: Vec3<f64>,
        spacing: Vec3<f64>,
        dims: [usize; 3],
        values: impl AsRef<[f32]>,
    ) -> Result<Self, GeometryError> {
        let values = values.as_ref();
        check_dims(dims)?;
        let bad_values = |what| GeometryError::GridValues { dims, what };
        let bad_extent = |what: &str| GeometryError::GridExtent { what: what.into() };
        if values.len() != dims.iter().product::<usize>() {
            return Err(bad_values(format!("there are {} of them", values.len())));
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(bad_values(format!("number {at} is {}", values[at])));
        }
        for axis in 0..3 {
            if !origin.get(axis).is_finite() {
                return Err(bad_extent("the origin is not finite"));
            }
            if !(spacing.get(axis) > 0.0 && spacing.get(axis).is_finite()) {
                return Err(bad_extent("the spacing is not positive and finite"));
            }
        }
        let mut tiles = allocate(dims)?;
        let map = tiles.map();
        for (row, values) in values.chunks_exact(dims[0]).enumerate() {
            for (i, value) in values.iter().enumerate() {
                let place = map.place([i, row % dims[1], row / dims[1]]);
                tiles.places_mut()[place] = *value;
            }
        }
        Ok(Self {
            origin,
            spacing,
            tiles,
        })
    }

    /// Samples a function of position \[m\], such as the distance to an analytic shape.
    ///
    /// # Errors
    /// As [`SdfGrid::from_values`].
    pub fn from_function(
        origin: Vec3<f64>,
        spacing: Vec3<f64>,
        dims: [usize; 3],
        mut function: impl FnMut(Vec3<f64>) -> f64,
    ) -> Result<Self, GeometryError> {
        check_dims(dims)?;
        let mut values = Vec::new();
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                for i in 0..dims[0] {
                    values.push(function(node(origin, spacing, [i, j, k])) as f32);
                }
            }
        }
        Self::from_values(origin, spacing, dims, &values)
    }

    /// Samples along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.tiles.dims()
    }
    /// Position of the first sample \[m\].
    pub fn origin(&self) -> Vec3<f64> {
        self.origin
    }
    /// Distance between samples along x, y and z \[m\].
    pub fn spacing(&self) -> Vec3<f64> {
        self.spacing
    }
    /// A copy of the samples \[m\]; that of node (i, j, k) is number `i + nx (j + ny k)`.
    pub fn to_values(&self) -> Vec<f32> {
        let [nx, ny, nz] = self.dims();
        let mut values = Vec::with_capacity(nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                values.extend((0..nx).map(|i| self.value([i, j, k])));
            }
        }
        values
    }
    /// The sample at node (i, j, k) \[m\].
    ///
    /// # Panics
    /// If the node does not exist.
    pub fn value(&self, index: [usize; 3]) -> f32 {
        let dims = self.dims();
        assert!(
            (0..3).all(|axis| index[axis] < dims[axis]),
            "no node {index:?} in a grid of {dims:?}"
        );
        self.tiles.places()[self.tiles.map().place(index)]
    }
    /// Position of node (i, j, k) \[m\].
    pub fn node(&self, index: [usize; 3]) -> Point3<f64> {
        node(self.origin, self.spacing, index).into()
    }
    /// The lowest and highest corner of the grid's box \[m\].
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        (self.node([0; 3]), self.node(self.dims().map(|n| n - 1)))
    }
}

/// Where node (i, j, k) lies.
#[inline]
pub(super) fn node(origin: Vec3<f64>, spacing: Vec3<f64>, [i, j, k]: [usize; 3]) -> Vec3<f64> {
    Vec3::new(
        origin.x + i as f64 * spacing.x,
        origin.y + j as f64 * spacing.y,
        origin.z + k as f64 * spacing.z,
    )
}

pub(super) fn check_dims(dims: [usize; 3]) -> Result<(), GeometryError> {
    if dims.iter().all(|n| (2..=MAX_RESOLUTION).contains(n)) {
        Ok(())
    } else {
        Err(GeometryError::GridResolution {
            dims,
            max: MAX_RESOLUTION,
        })
    }
}

/// Room for a grid's samples.
pub(super) fn allocate(dims: [usize; 3]) -> Result<Tiles, GeometryError> {
    Tiles::zeros(dims).ok_or_else(|| GeometryError::GridMemory {
        dims,
        bytes: dims.iter().product::<usize>() * size_of::<f32>(),
    })
}
