//! Boxes turned to fit the surface that they hold.
//!
//! Scans are smooth: a patch of a few triangles is nearly flat, and a box turned into its plane is far thinner
//! than one along the axes. The distance to such a box is then nearly the distance to the patch, so that a search
//! opens few boxes in vain.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

/// A box with edges along three unit vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrientedBox {
    /// The unit vectors, by rows.
    pub(super) axes: Matrix3<f64>,
    /// The centre's coordinates along them.
    pub(super) center: Vector3<f64>,
    /// Half the edges' lengths.
    pub(super) half: Vector3<f64>,
}

impl OrientedBox {
    /// A box around triangles: along the axes of space, or along the principal axes of the triangles' area,
    /// whichever has the smaller surface. Coordinates are relative to `middle`.
    pub(super) fn around(triangles: &[[Point3<f64>; 3]], middle: &Point3<f64>) -> Self {
        let upright = Self::along(Matrix3::identity(), triangles, middle);
        let turned = Self::along(principal_axes(triangles), triangles, middle);
        if turned.surface() < upright.surface() {
            turned
        } else {
            upright
        }
    }

    fn along(axes: Matrix3<f64>, triangles: &[[Point3<f64>; 3]], middle: &Point3<f64>) -> Self {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for corner in triangles.iter().flatten() {
            let along = axes * (corner - middle);
            (low, high) = (low.inf(&along), high.sup(&along));
        }
        Self {
            axes,
            center: (low + high) * 0.5,
            half: (high - low) * 0.5,
        }
    }

    fn surface(&self) -> f64 {
        let half = &self.half;
        half.x * half.y + half.y * half.z + half.z * half.x
    }
}

/// Directions of largest, middle and least extent of the triangles' area, by rows.
fn principal_axes(triangles: &[[Point3<f64>; 3]]) -> Matrix3<f64> {
    let mut area = 0.0;
    let mut mean = Vector3::zeros();
    let mut covariance = Matrix3::zeros();
    let origin = triangles[0][0];
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| corner - origin);
        let weight = (b - a).cross(&(c - a)).norm();
        let sum = a + b + c;
        area += weight;
        mean += sum * (weight / 3.0);
        // The integral of x x^T over a triangle, divided by its area.
        let moment =
            sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose();
        covariance += moment * (weight / 12.0);
    }
    if area <= 0.0 {
        return Matrix3::identity();
    }
    mean /= area;
    covariance = covariance / area - mean * mean.transpose();
    // Scaled to order 1, where the eigenvalue solver's tolerances are meant to be.
    let scale = covariance.amax();
    if scale <= 0.0 {
        return Matrix3::identity();
    }
    let axes = SymmetricEigen::new(covariance / scale)
        .eigenvectors
        .transpose();
    if axes.iter().all(|x| x.is_finite()) {
        axes
    } else {
        Matrix3::identity()
    }
}
