//! The pinhole camera with lens distortion.

use nalgebra::{Matrix2, Matrix3, Point3, Vector2, Vector3};

use graspd_geom::GeometryError;

/// Newton steps after which an undistortion is given up; from a point in the image it takes 3 to 6.
const MAX_STEPS: usize = 30;
/// A ray is found when it is projected this near to its pixel, in units of the focal length: 1e-8 pixels.
const ENOUGH: f64 = 1e-11;
/// Pixels along each side beyond which a file is damaged rather than detailed.
const MAX_PIXELS: usize = 20_000;

/// A pinhole camera with the distortion of Brown and Conrady.
///
/// Its frame: x to the right of the image, y down, z along the line of sight; the first pixel's centre has the
/// coordinates (0, 0). A point (X, Y, Z) is seen at u = fx x'' + cx, v = fy y'' + cy, with x = X/Z, y = Y/Z, r^2 =
/// x^2 + y^2,
///
///   x'' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),
///   y'' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y.
///
/// # Source
/// Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32 (1966); coefficients in the order of
/// OpenCV and of the YCB calibrations.
#[derive(Clone, Debug, PartialEq)]
pub struct PinholeCamera {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal lengths along x and y \[pixels\].
    pub focal: [f64; 2],
    /// The pixel on the line of sight.
    pub center: [f64; 2],
    /// k1, k2, p1, p2, k3; all 0 for a perfect lens.
    pub distortion: [f64; 5],
}

impl PinholeCamera {
    /// A camera of `width` x `height` pixels from its matrix K = ((fx, 0, cx), (0, fy, cy), (0, 0, 1)), without
    /// distortion.
    ///
    /// # Errors
    /// [`GeometryError::Camera`] for a matrix of another form, or numbers that no camera has.
    pub fn from_matrix(
        width: usize,
        height: usize,
        k: &Matrix3<f64>,
    ) -> Result<Self, GeometryError> {
        let scale = k[(0, 0)].abs();
        let is_pinhole = k.row(2) == Vector3::z().transpose()
            && k[(1, 0)] == 0.0
            && k[(0, 1)].abs() <= 1e-6 * scale;
        if !is_pinhole {
            return Err(GeometryError::Camera {
                fault: format!("its matrix is {}", rows(k)),
                wanted: "fx 0 cx; 0 fy cy; 0 0 1",
            });
        }
        let camera = Self {
            width,
            height,
            focal: [k[(0, 0)], k[(1, 1)]],
            center: [k[(0, 2)], k[(1, 2)]],
            distortion: [0.0; 5],
        };
        camera.validate()?;
        Ok(camera)
    }

    /// The same camera with another lens: k1, k2, p1, p2, k3.
    pub fn with_distortion(mut self, distortion: [f64; 5]) -> Self {
        self.distortion = distortion;
        self
    }

    /// Checks that the numbers can be those of a camera.
    ///
    /// # Errors
    /// [`GeometryError::Camera`] that names the first that cannot.
    pub fn validate(&self) -> Result<(), GeometryError> {
        let fail = |fault: String, wanted| Err(GeometryError::Camera { fault, wanted });
        let (width, height) = (self.width, self.height);
        if [width, height]
            .iter()
            .any(|side| !(1..=MAX_PIXELS).contains(side))
        {
            return fail(
                format!("its image has {width} x {height} pixels"),
                "1 to 20000 each",
            );
        }
        let largest = width.max(height) as f64;
        if let Some(focal) = self
            .focal
            .iter()
            .find(|f| !(0.05 * largest..=100.0 * largest).contains(*f))
        {
            return fail(
                format!("its focal length is {focal} pixels for an image of {width} x {height}"),
                "focal lengths in pixels, 0.05 to 100 times the larger side",
            );
        }
        if let Some(center) = self
            .center
            .iter()
            .find(|c| !(-largest..=2.0 * largest).contains(*c))
        {
            return fail(
                format!("its centre is at pixel {center} of an image of {width} x {height}"),
                "a centre in or near the image",
            );
        }
        if let Some(k) = self
            .distortion
            .iter()
            .find(|k| k.is_nan() || k.abs() >= 1e3)
        {
            return fail(
                format!("it has the distortion {k}"),
                "k1, k2, p1, p2, k3, each below 1000",
            );
        }
        Ok(())
    }

    /// The matrix K.
    pub fn matrix(&self) -> Matrix3<f64> {
        let ([fx, fy], [cx, cy]) = (self.focal, self.center);
        Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    }

    /// The pixel, as (column, row) with fractions, at which a point of the camera's frame is seen, in or beyond the
    /// image; `None` for a point that is not in front of the camera.
    pub fn project(&self, p: &Point3<f64>) -> Option<[f64; 2]> {
        if p.z.is_nan() || p.z <= 0.0 {
            return None;
        }
        let (bent, _) = self.bend(&Vector2::new(p.x / p.z, p.y / p.z));
        let pixel = [0, 1].map(|axis| self.focal[axis] * bent[axis] + self.center[axis]);
        pixel.iter().all(|x| x.is_finite()).then_some(pixel)
    }

    /// The direction, with z = 1, of what is seen at pixel (`u`, `v`); `None` where the lens bends no ray there, as
    /// happens far outside the image.
    pub fn ray(&self, u: f64, v: f64) -> Option<Vector3<f64>> {
        let target = Vector2::new(
            (u - self.center[0]) / self.focal[0],
            (v - self.center[1]) / self.focal[1],
        );
        if self.distortion == [0.0; 5] {
            return Some(Vector3::new(target.x, target.y, 1.0));
        }
        // Newton's method: the fixed point iteration in common use does not converge for strong lenses.
        let mut guess = target;
        for _ in 0..MAX_STEPS {
            let (bent, derivative) = self.bend(&guess);
            let error = bent - target;
            if error.amax() < ENOUGH {
                // Beyond the fold of the lens, image and scene run against each other: not what was seen.
                return (derivative.determinant() > 0.0)
                    .then(|| Vector3::new(guess.x, guess.y, 1.0));
            }
            guess -= derivative.try_inverse()? * error;
            if !guess.iter().all(|x| x.is_finite()) {
                return None;
            }
        }
        None
    }

    /// The point of the camera's frame that is seen at pixel (`u`, `v`) at depth `z` along the line of sight \[m\].
    pub fn unproject(&self, u: f64, v: f64, z: f64) -> Option<Point3<f64>> {
        Some(Point3::from(self.ray(u, v)? * z))
    }

    /// The rays of all pixels, row by row: [`PinholeCamera::ray`] once for many images.
    pub fn rays(&self) -> Vec<Option<Vector3<f64>>> {
        (0..self.width * self.height)
            .map(|i| self.ray((i % self.width) as f64, (i / self.width) as f64))
            .collect()
    }

    /// x'', y'' and their derivative by x, y.
    fn bend(&self, p: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (x, y) = (p.x, p.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // d(radial)/d(r2), twice: the derivative of r2 by x is 2x.
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let bent = Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let mixed = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let derivative = Matrix2::new(
            radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (bent, derivative)
    }
}

/// A matrix for a message.
fn rows(k: &Matrix3<f64>) -> String {
    let row = |i: usize| format!("{} {} {}", k[(i, 0)], k[(i, 1)], k[(i, 2)]);
    format!("{}; {}; {}", row(0), row(1), row(2))
}
