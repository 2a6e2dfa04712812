//! Where the picture is taken from.

use nalgebra::{Point3, Vector3};

use crate::{Scene, ViewError};

/// A camera that looks from an eye at a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it is.
    pub eye: Point3<f64>,
    /// What is in the middle of the picture.
    pub target: Point3<f64>,
    /// What points up on the picture; need not be orthogonal to the line of sight.
    pub up: Vector3<f64>,
    /// Angle between the upper and the lower edge of the picture \[rad\], below pi.
    pub vertical_angle: f64,
}

/// The unit axes of a picture in space: right, up, and backward (towards the viewer).
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureAxes {
    pub(crate) right: Vector3<f64>,
    pub(crate) up: Vector3<f64>,
    pub(crate) back: Vector3<f64>,
}

impl PictureAxes {
    /// Returns the axes for a viewer in direction `back`; where `up` is parallel to it (or zero), another up is
    /// chosen.
    fn new(back: Vector3<f64>, up: Vector3<f64>) -> Option<Self> {
        let back = back
            .try_normalize(0.0)
            .filter(|v| v.iter().all(|c| c.is_finite()))?;
        let spare = if back.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let up = up.try_normalize(0.0).unwrap_or(spare);
        let across = if up.cross(&back).norm() > 1e-6 {
            up.cross(&back)
        } else {
            spare.cross(&back)
        };
        let right = across.normalize();
        Some(Self {
            right,
            up: back.cross(&right),
            back,
        })
    }
}

impl Camera {
    /// The vertical angle of cameras that frame something \[rad\]: a mild perspective.
    pub const VERTICAL_ANGLE: f64 = 26f64.to_radians();

    /// Returns the camera in direction `towards_viewer` of the points, as near as it can be with all of them in the
    /// picture and a small margin around them.
    ///
    /// `aspect` is the picture's width over its height. Without a (finite) point, a cube of 20 cm about the origin is
    /// framed.
    pub fn framing(
        points: impl IntoIterator<Item = Point3<f64>>,
        towards_viewer: Vector3<f64>,
        up: Vector3<f64>,
        aspect: f64,
    ) -> Self {
        /// The part of the picture's half width and half height that the points may fill.
        const FILL: f64 = 0.92;
        let axes = PictureAxes::new(towards_viewer, up)
            .or_else(|| PictureAxes::new(Vector3::x(), Vector3::z()))
            .expect("x and z are orthogonal");
        let slope = FILL * (0.5 * Self::VERTICAL_ANGLE).tan();
        let mut extent = Extent::new([1.0 / (slope * aspect), 1.0 / slope]);
        // Coordinates are taken about one of the points, so that a scene far from the origin keeps its precision.
        let mut points = points
            .into_iter()
            .filter(|p| p.coords.iter().all(|c| c.is_finite()))
            .peekable();
        let reference = points.peek().copied().unwrap_or(Point3::origin());
        for p in points {
            extent.add(&axes, p - reference);
        }
        if extent.is_empty() {
            for corner in 0..8 {
                let half = |bit: usize| if corner >> bit & 1 == 1 { 0.1 } else { -0.1 };
                extent.add(&axes, Vector3::new(half(0), half(1), half(2)));
            }
        }
        let [across, upward] = extent.centers();
        let middle = 0.5 * (extent.back[0] + extent.back[1]);
        let target = reference + axes.right * across + axes.up * upward + axes.back * middle;
        // Nothing has zero size: a single point is seen from a millimetre.
        let [half_width, half_height] = extent.halves();
        let reach = half_width.max(half_height).max(1e-3);
        Self {
            eye: target + axes.back * (reach - middle).max(1e-3),
            target,
            up: axes.up,
            vertical_angle: Self::VERTICAL_ANGLE,
        }
    }

    /// Frames the whole scene from the front right and above, z up.
    pub fn three_quarter(scene: &Scene<'_>, aspect: f64) -> Self {
        let towards_viewer = direction(35f64.to_radians(), 24f64.to_radians());
        Self::framing(scene.points(), towards_viewer, Vector3::z(), aspect)
    }

    /// Returns the picture's axes.
    ///
    /// # Errors
    /// [`ViewError::Camera`] for a camera that looks nowhere.
    pub(crate) fn axes(&self) -> Result<PictureAxes, ViewError> {
        let is_finite = |v: &Vector3<f64>| v.iter().all(|c| c.is_finite());
        if ![&self.eye.coords, &self.target.coords, &self.up]
            .into_iter()
            .all(is_finite)
        {
            return Err(ViewError::Camera(
                "a coordinate of eye, target or up is not finite",
            ));
        }
        if !(self.vertical_angle > 0.0 && self.vertical_angle < std::f64::consts::PI) {
            return Err(ViewError::Camera(
                "the vertical angle must lie between 0 and pi",
            ));
        }
        PictureAxes::new(self.eye - self.target, self.up)
            .ok_or(ViewError::Camera("the eye is at the target"))
    }
}

/// Returns the unit vector with this azimuth (about z, from x) and elevation (from the xy plane) \[rad\].
pub(crate) fn direction(azimuth: f64, elevation: f64) -> Vector3<f64> {
    Vector3::new(
        azimuth.cos() * elevation.cos(),
        azimuth.sin() * elevation.cos(),
        elevation.sin(),
    )
}

/// Supports of a set of points in the directions of the picture's edges.
///
/// A camera at height D above the reference plane sees the point (x, z) if |x - c| <= s (D - z), that is
/// D >= (z + x/s) - c/s and D >= (z - x/s) + c/s. With A and B the largest z + x/s and z - x/s, the lowest D is
/// (A + B)/2 at c = s (A - B)/2.
struct Extent {
    inverse_slopes: [f64; 2],
    supports: [[f64; 2]; 2],
    back: [f64; 2],
}

impl Extent {
    fn new(inverse_slopes: [f64; 2]) -> Self {
        Self {
            inverse_slopes,
            supports: [[f64::NEG_INFINITY; 2]; 2],
            back: [f64::INFINITY, f64::NEG_INFINITY],
        }
    }
    fn add(&mut self, axes: &PictureAxes, offset: Vector3<f64>) {
        let back = axes.back.dot(&offset);
        self.back = [self.back[0].min(back), self.back[1].max(back)];
        for (edge, axis) in [axes.right, axes.up].iter().enumerate() {
            let lateral = axis.dot(&offset) * self.inverse_slopes[edge];
            let [above, below] = self.supports[edge];
            self.supports[edge] = [above.max(back + lateral), below.max(back - lateral)];
        }
    }
    fn is_empty(&self) -> bool {
        self.back[0] > self.back[1]
    }
    fn centers(&self) -> [f64; 2] {
        std::array::from_fn(|edge| {
            let [above, below] = self.supports[edge];
            0.5 * (above - below) / self.inverse_slopes[edge]
        })
    }
    fn halves(&self) -> [f64; 2] {
        self.supports.map(|[above, below]| 0.5 * (above + below))
    }
}
