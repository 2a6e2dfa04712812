//! Points of a surface, as depth cameras give them.

mod filter;
mod kd_tree;
mod normals;

use std::path::Path;

use graspd_mesh::load_points;
use nalgebra::{Point3, Vector3};

use graspd_geom::GeometryError;

pub use kd_tree::KdTree;
pub(crate) use normals::plane_normal;

/// Fewest points that tell a surface.
const FEWEST: usize = 100;
/// Longest extent of an object \[m\]: a cloud that is larger is in millimetres.
const LONGEST: f64 = 10.0;

/// Points of a surface, with their normals where these are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Positions \[m\], `[n, 3]`.
    pub points: Vec<Point3<f64>>,
    /// Outward unit normals, `[n, 3]`; empty where they are not known.
    pub normals: Vec<Vector3<f64>>,
}

/// Reads a point cloud from a PLY file, binary or text: the element `vertex`, with normals if it has nx, ny and nz.
/// Coordinates are taken as they are, in metres by convention; faces are ignored.
///
/// # Errors
/// Another extension, or whatever is wrong with the file, as a [`GeometryError`] that names it.
/// [`PointCloud::require_points`] tells whether the points can be those of an object.
pub fn load_point_cloud(path: impl AsRef<Path>) -> Result<PointCloud, GeometryError> {
    let (points, normals) = load_points(path)?;
    Ok(PointCloud { points, normals })
}

impl PointCloud {
    /// A cloud without normals.
    pub fn from_points(points: Vec<Point3<f64>>) -> Self {
        Self {
            points,
            normals: Vec::new(),
        }
    }

    /// The points with the given numbers, and their normals.
    ///
    /// # Panics
    /// If a number is out of range.
    pub fn selected(&self, numbers: &[usize]) -> Self {
        let normals = if self.normals.is_empty() {
            Vec::new()
        } else {
            numbers.iter().map(|&i| self.normals[i]).collect()
        };
        Self {
            points: numbers.iter().map(|&i| self.points[i]).collect(),
            normals,
        }
    }

    /// Checks that the points can be those of an object: enough, finite, of a size in metres.
    ///
    /// # Errors
    /// [`GeometryError::CloudTooSmall`] for fewer than 100 points, [`GeometryError::CloudNotFinite`],
    /// [`GeometryError::CloudExtent`] for points all in one place or over more than 10 m.
    pub fn require_points(&self) -> Result<(), GeometryError> {
        if self.points.len() < FEWEST {
            return Err(GeometryError::CloudTooSmall {
                points: self.points.len(),
                least: FEWEST,
            });
        }
        let is_bad = |point: usize| {
            let normal = self.normals.get(point);
            !(self.points[point].iter().all(|x| x.is_finite())
                && normal.is_none_or(|normal| normal.iter().all(|x| x.is_finite())))
        };
        if let Some(point) = (0..self.points.len()).find(|&point| is_bad(point)) {
            return Err(GeometryError::CloudNotFinite {
                point,
                position: self.points[point].into(),
            });
        }
        let first = self.points[0];
        let (low, high) =
            (self.points.iter()).fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
        let extent = (high - low).max();
        let remedy = if extent > LONGEST {
            "if it is in millimetres, multiply it by 0.001; if it is a room, cut out the object"
        } else if extent < f64::from(f32::MIN_POSITIVE) {
            "all points are in the same place: capture the object again"
        } else {
            return Ok(());
        };
        Err(GeometryError::CloudExtent { extent, remedy })
    }

    /// Checks that the cloud has points and a normal for each.
    ///
    /// # Errors
    /// As [`PointCloud::require_points`]; [`GeometryError::CloudNormals`] if there are none, or not one for each
    /// point.
    pub fn require_surface(&self) -> Result<(), GeometryError> {
        self.require_points()?;
        if self.normals.len() == self.points.len() {
            return Ok(());
        }
        Err(GeometryError::CloudNormals {
            fault: format!(
                "there are {} normals for {} points",
                self.normals.len(),
                self.points.len()
            ),
        })
    }
}
