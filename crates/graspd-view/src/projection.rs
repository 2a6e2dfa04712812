//! From space to the sample grid of a picture and back along lines of sight.

use nalgebra::{Point3, Vector3};

use crate::camera::PictureAxes;
use crate::{Camera, ViewError};

/// Corners further than this from the picture's centre \[half widths or heights\] are cut off, so that grid
/// coordinates stay small integers.
const GUARD: f64 = 16.0;

/// A camera prepared for one picture. View coordinates: x right, y up, z = depth along the line of sight \[m\].
pub(crate) struct Projection {
    pub(crate) axes: PictureAxes,
    eye: Point3<f64>,
    /// Sample columns and rows.
    size: [f64; 2],
    /// Samples per unit of x/z.
    scale: f64,
    near: f64,
}

/// A point on the sample grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridPoint {
    /// Column and row \[samples\].
    pub(crate) position: [f64; 2],
    /// Grows towards the viewer and is linear on the grid over a plane: 1/depth \[1/m\], or a height towards a lamp.
    pub(crate) nearness: f64,
}

impl Projection {
    /// # Errors
    /// [`ViewError::Camera`].
    pub(crate) fn new(camera: &Camera, columns: usize, rows: usize) -> Result<Self, ViewError> {
        let axes = camera.axes()?;
        Ok(Self {
            axes,
            eye: camera.eye,
            size: [columns as f64, rows as f64],
            scale: 0.5 * rows as f64 / (0.5 * camera.vertical_angle).tan(),
            near: 1e-3 * (camera.eye - camera.target).norm(),
        })
    }

    /// Returns a point of space in view coordinates.
    fn to_view(&self, point: Point3<f64>) -> Vector3<f64> {
        let offset = point - self.eye;
        let PictureAxes { right, up, back } = &self.axes;
        Vector3::new(right.dot(&offset), up.dot(&offset), -back.dot(&offset))
    }

    /// Returns a point in view coordinates, in front of the eye, on the grid.
    fn to_grid(&self, view: Vector3<f64>) -> GridPoint {
        let scale = self.scale / view.z;
        GridPoint {
            position: [
                0.5 * self.size[0] + scale * view.x,
                0.5 * self.size[1] - scale * view.y,
            ],
            nearness: 1.0 / view.z,
        }
    }

    /// Returns the planes n . p + d >= 0 within which corners are kept.
    fn guard_planes(&self) -> [(Vector3<f64>, f64); 5] {
        let reach = self.size.map(|size| GUARD * 0.5 * size / self.scale);
        let side = |axis: usize, sign: f64| {
            let mut normal = Vector3::new(0.0, 0.0, reach[axis]);
            normal[axis] = sign;
            (normal, 0.0)
        };
        [
            (Vector3::z(), -self.near),
            side(0, 1.0),
            side(0, -1.0),
            side(1, 1.0),
            side(1, -1.0),
        ]
    }

    /// Calls `draw` with triangles that together cover what is in front of the eye of the given one.
    pub(crate) fn project_triangle(
        &self,
        corners: [Point3<f64>; 3],
        mut draw: impl FnMut([GridPoint; 3]),
    ) {
        let view = corners.map(|corner| self.to_view(corner));
        if !view.iter().all(|v| v.iter().all(|c| c.is_finite())) {
            return;
        }
        let planes = self.guard_planes();
        let is_inside = |v: &Vector3<f64>| planes.iter().all(|(n, d)| n.dot(v) + d >= 0.0);
        if view.iter().all(is_inside) {
            return draw(view.map(|v| self.to_grid(v)));
        }
        let mut polygon = view.to_vec();
        for (normal, distance) in &planes {
            polygon = cut(&polygon, |v| normal.dot(v) + distance);
        }
        let grid: Vec<_> = polygon.iter().map(|v| self.to_grid(*v)).collect();
        for i in 2..grid.len() {
            draw([grid[0], grid[i - 1], grid[i]]);
        }
    }

    /// Returns a point on the grid and its depth \[m\]; `None` behind the eye or where it is not finite.
    pub(crate) fn project_point(&self, point: Point3<f64>) -> Option<(GridPoint, f64)> {
        let view = self.to_view(point);
        let is_seen = view.z > self.near && view.iter().all(|c| c.is_finite());
        is_seen.then(|| (self.to_grid(view), view.z))
    }

    /// Returns the part of a segment that is in front of the eye and not far outside the picture, by its ends on the
    /// grid.
    pub(crate) fn project_segment(&self, ends: [Point3<f64>; 2]) -> Option<[GridPoint; 2]> {
        let [mut from, mut to] = ends.map(|end| self.to_view(end));
        if !from.iter().chain(to.iter()).all(|c| c.is_finite()) {
            return None;
        }
        for (normal, distance) in &self.guard_planes() {
            let [a, b] = [from, to].map(|v| normal.dot(&v) + distance);
            match (a >= 0.0, b >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (true, false) => to = from.lerp(&to, a / (a - b)),
                (false, true) => from = to.lerp(&from, b / (b - a)),
            }
        }
        Some([self.to_grid(from), self.to_grid(to)])
    }

    /// Samples per metre at this depth.
    pub(crate) fn samples_per_metre(&self, depth: f64) -> f64 {
        self.scale / depth
    }

    /// Returns the line of sight through a position on the grid: a point of it and its unit direction away from the
    /// viewer.
    pub(crate) fn line_of_sight(&self, position: [f64; 2]) -> (Point3<f64>, Vector3<f64>) {
        let PictureAxes { right, up, back } = &self.axes;
        let x = (position[0] - 0.5 * self.size[0]) / self.scale;
        let y = (0.5 * self.size[1] - position[1]) / self.scale;
        let lateral = right * x + up * y;
        (self.eye, (lateral - back).normalize())
    }
}

/// Returns the part of a convex polygon where `height` is not negative (Sutherland and Hodgman's step for one plane).
fn cut(polygon: &[Vector3<f64>], height: impl Fn(&Vector3<f64>) -> f64) -> Vec<Vector3<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, current) in polygon.iter().enumerate() {
        let next = &polygon[(i + 1) % polygon.len()];
        let (a, b) = (height(current), height(next));
        if a >= 0.0 {
            kept.push(*current);
        }
        if (a >= 0.0) != (b >= 0.0) {
            kept.push(current.lerp(next, a / (a - b)));
        }
    }
    kept
}
