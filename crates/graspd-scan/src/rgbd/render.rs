//! Depth images of a mesh, by casting rays.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use super::noise::{DepthNoise, SILHOUETTE_JUMP};
use super::{DepthImage, PinholeCamera};
use graspd_geom::TriangleTree;

/// What a camera looks at: an object, and a round table with its top at a height of 0.
#[derive(Clone, Copy, Debug)]
pub struct DepthScene<'a> {
    /// The object.
    pub object: &'a TriangleTree,
    /// From the frame of the table, z up and its axis at x = y = 0, to the object's.
    pub object_from_table: Isometry3<f64>,
    /// Radius of the table \[m\]; 0 for none.
    pub table_radius: f64,
}

/// What a ray meets first.
#[derive(Clone, Copy)]
struct Seen {
    /// Along the line of sight \[m\].
    depth: f64,
    /// Of the angle between ray and surface normal.
    cosine: f64,
}

impl DepthScene<'_> {
    /// The depth image that a camera takes; `view` numbers it among images with the same noise. Runs on rayon's
    /// current thread pool, with the same result for any number of threads.
    ///
    /// `unit`: metres for each unit of the image; what is farther than 65535 of them is not seen.
    pub fn depth_image(
        &self,
        camera: &PinholeCamera,
        table_from_camera: &Isometry3<f64>,
        noise: &DepthNoise,
        view: u64,
        unit: f64,
    ) -> DepthImage {
        let (width, height) = (camera.width, camera.height);
        let exact: Vec<Option<Seen>> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                self.seen(
                    camera,
                    table_from_camera,
                    (i % width) as f64,
                    (i / width) as f64,
                )
            })
            .collect();
        let raw = (0..height)
            .into_par_iter()
            .flat_map_iter(|row| {
                let mut rng = noise.row(view, row);
                let exact = &exact;
                (0..width).map(move |column| {
                    let facing = exact[row * width + column].map_or(1.0, |seen| seen.cosine);
                    let [right, down] = noise.jitter(facing, &mut rng);
                    let (u, v) = (column as f64 + right, row as f64 + down);
                    let seen = if noise.scale == 0.0 {
                        exact[row * width + column]
                    } else {
                        self.seen(camera, table_from_camera, u, v)
                    };
                    let is_silhouette = is_silhouette(exact, [width, height], column, row);
                    let (z, cosine) = seen.map_or((1.0, 1.0), |seen| (seen.depth, seen.cosine));
                    let measured = noise.measured(z, cosine, is_silhouette, &mut rng);
                    let depth = measured.filter(|_| seen.is_some());
                    let units = depth.map_or(0.0, |z| (z / unit).round());
                    if units <= f64::from(u16::MAX) {
                        units as u16
                    } else {
                        0
                    }
                })
            })
            .collect();
        DepthImage {
            width,
            height,
            raw,
            unit,
        }
    }

    /// In which pixels a camera sees the object, row by row.
    pub fn mask(&self, camera: &PinholeCamera, table_from_camera: &Isometry3<f64>) -> Vec<bool> {
        let object_from_camera = self.object_from_table * table_from_camera;
        let origin = object_from_camera * Point3::origin();
        // The table hides nothing of what stands on it from a camera above.
        (0..camera.width * camera.height)
            .into_par_iter()
            .map(|i| {
                let (u, v) = (i % camera.width, i / camera.width);
                camera.ray(u as f64, v as f64).is_some_and(|ray| {
                    let direction = object_from_camera * ray;
                    self.object.first_hit(&origin, &direction).is_some()
                })
            })
            .collect()
    }

    fn seen(
        &self,
        camera: &PinholeCamera,
        table_from_camera: &Isometry3<f64>,
        u: f64,
        v: f64,
    ) -> Option<Seen> {
        // With z = 1, so that lengths along it are depths.
        let ray = camera.ray(u, v)?;
        let eye = table_from_camera * Point3::origin();
        let direction = table_from_camera * ray;
        let cosine = |normal: &Vector3<f64>| normal.dot(&direction).abs() / direction.norm();
        let object = self
            .object
            .first_hit(
                &(self.object_from_table * eye),
                &(self.object_from_table * direction),
            )
            .map(|hit| Seen {
                depth: hit.length,
                cosine: cosine(&(self.object_from_table.inverse() * hit.normal)),
            });
        let to_table = -eye.z / direction.z;
        let at = eye + direction * to_table;
        let is_on_table = to_table > 0.0 && at.coords.xy().norm() <= self.table_radius;
        let table = is_on_table.then(|| Seen {
            depth: to_table,
            cosine: cosine(&Vector3::z()),
        });
        match (object, table) {
            (Some(a), Some(b)) => Some(if a.depth <= b.depth { a } else { b }),
            (a, b) => a.or(b),
        }
    }
}

/// Whether one of the eight neighbours of a pixel is much nearer or farther.
fn is_silhouette(
    seen: &[Option<Seen>],
    [width, height]: [usize; 2],
    column: usize,
    row: usize,
) -> bool {
    let depth = |i: usize| seen[i].map_or(f64::INFINITY, |seen| seen.depth);
    let own = depth(row * width + column);
    (row.saturating_sub(1)..=(row + 1).min(height - 1)).any(|y| {
        (column.saturating_sub(1)..=(column + 1).min(width - 1)).any(|x| {
            // Nothing beside nothing is no jump: the difference of infinities is NaN.
            (depth(y * width + x) - own).abs() > SILHOUETTE_JUMP
        })
    })
}
