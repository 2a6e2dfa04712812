//! Fewer and better points: stray ones left out, dense ones averaged.

use graspd_settings::FINITE;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::{KdTree, PointCloud};
use graspd_geom::GeometryError;

impl PointCloud {
    /// The cloud without stray points: those whose mean distance to their `neighbours` nearest points is more than
    /// `deviations` standard deviations above the mean of all. 16 neighbours and 2 deviations are usual.
    pub fn without_outliers(&self, neighbours: usize, deviations: f64) -> Self {
        let tree = KdTree::new(&self.points);
        let distances: Vec<f64> = (self.points.par_iter())
            .map_init(Vec::new, |found, p| {
                tree.nearest(p, neighbours + 1, found);
                let sum: f64 = found.iter().map(|(squared, _)| squared.sqrt()).sum();
                sum / neighbours.max(1) as f64
            })
            .collect();
        let count = distances.len().max(1) as f64;
        let mean = distances.iter().sum::<f64>() / count;
        let variance = distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count;
        let most = mean + deviations * variance.sqrt();
        let kept: Vec<usize> = (0..self.points.len())
            .filter(|&i| distances[i] <= most)
            .collect();
        self.selected(&kept)
    }

    /// One point for each cube of side `cell` \[m\] with points: their mean, with their mean direction as normal.
    /// Points with normals that look opposite ways stay apart: they are of the two sides of a thin wall. In the
    /// order of the cubes, so that without normals the order of the points does not matter but for rounding.
    ///
    /// # Errors
    /// [`GeometryError::CloudNotFinite`]; [`GeometryError::Setting`] for a cell that is not positive, or over a
    /// billion times smaller than a coordinate.
    pub fn thinned(&self, cell: f64) -> Result<Self, GeometryError> {
        if let Some(point) = self
            .points
            .iter()
            .position(|p| !p.iter().all(|x| x.is_finite()))
        {
            return Err(GeometryError::CloudNotFinite {
                point,
                position: self.points[point].into(),
            });
        }
        let largest = self
            .points
            .iter()
            .map(|p| p.coords.amax())
            .fold(0.0, f64::max);
        let least = (1e-9 * largest).max(f64::MIN_POSITIVE);
        FINITE.at_least(least).check("cell", &cell)?;
        let mut order: Vec<([i64; 3], usize)> = (self.points.par_iter().enumerate())
            .map(|(number, p)| ([p.z, p.y, p.x].map(|x| (x / cell).floor() as i64), number))
            .collect();
        order.par_sort_unstable();
        let mut result = Self::default();
        for group in order.chunk_by(|a, b| a.0 == b.0) {
            // Count, and sums of positions and normals, of each side.
            let mut sides: Vec<(f64, Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(2);
            for &(_, i) in group {
                let normal = self.normals.get(i).copied().unwrap_or_default();
                let own = sides.iter_mut().find(|side| side.2.dot(&normal) >= 0.0);
                match own {
                    Some((count, position, direction)) => {
                        *count += 1.0;
                        *position += self.points[i].coords;
                        *direction += normal;
                    }
                    None => sides.push((1.0, self.points[i].coords, normal)),
                }
            }
            for (count, position, direction) in sides {
                result.points.push(Point3::from(position / count));
                if !self.normals.is_empty() {
                    let normal = direction.try_normalize(f64::MIN_POSITIVE);
                    result.normals.push(normal.unwrap_or_default());
                }
            }
        }
        Ok(result)
    }
}
