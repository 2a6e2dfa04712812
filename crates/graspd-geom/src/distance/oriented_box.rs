//! Boxes turned to fit the surface that they hold, and lower bounds of the distance to it.
//!
//! Scans are smooth: a patch of a few triangles is nearly flat, and a box turned into its plane is far thinner
//! than one along the axes. The distance to such a box is then nearly the distance to the patch, so that a search
//! opens few boxes in vain. The bounds are computed in single precision; [`Slack`] says how much that may cost.

use graspd_ad::Real;
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

/// How far a length computed in single precision may be off, relative to the lengths that went into it.
///
/// A bound is the length of a vector of three sums of four products of numbers rounded to 2^-24: less than 20
/// roundings. This is 64.
const ROUNDING: f64 = 4e-6;

/// A box with edges along three unit vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrientedBox {
    /// Unit vectors along the edges, by rows.
    axes: [[f32; 3]; 3],
    /// The centre's coordinates along them.
    center: [f32; 3],
    /// Half the edges' lengths.
    half: [f32; 3],
}

impl OrientedBox {
    /// A box around triangles: along the axes of space, or along the principal axes of the triangles' area,
    /// whichever has the smaller surface. Coordinates are relative to `middle`.
    pub(super) fn around(triangles: &[[Point3<f64>; 3]], middle: &Point3<f64>) -> Self {
        let upright = Self::along(&Matrix3::identity(), triangles, middle);
        let turned = Self::along(&principal_axes(triangles), triangles, middle);
        if turned.surface() < upright.surface() {
            turned
        } else {
            upright
        }
    }

    fn along(axes: &Matrix3<f64>, triangles: &[[Point3<f64>; 3]], middle: &Point3<f64>) -> Self {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for corner in triangles.iter().flatten() {
            let along = axes * (corner - middle);
            (low, high) = (low.inf(&along), high.sup(&along));
        }
        let single = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        Self {
            axes: [0, 1, 2].map(|row| single(axes.row(row).transpose())),
            center: single((low + high) * 0.5),
            half: single((high - low) * 0.5),
        }
    }

    fn surface(&self) -> f32 {
        let [a, b, c] = self.half;
        a * b + b * c + c * a
    }

    /// Squared distance from `p`, given relative to the middle of the mesh, to the box.
    #[inline(always)]
    pub(super) fn distance_squared<T: Real>(&self, p: [T; 3]) -> T {
        let mut sum = T::zero();
        for axis in 0..3 {
            let [x, y, z] = self.axes[axis];
            let along = (p[0] * number(x) + p[1] * number(y))
                + (p[2] * number(z) - number(self.center[axis]));
            let beyond = (along.abs() - number(self.half[axis])).max(T::zero());
            sum += beyond * beyond;
        }
        sum
    }
}

#[inline(always)]
fn number<T: Real>(x: f32) -> T {
    T::constant(f64::from(x))
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

/// How much wider than the best distance so far a search in single precision must look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slack {
    length: f64,
}

impl Slack {
    /// For points whose coordinates, relative to the middle of the mesh, and for a mesh whose extent, are at
    /// most `reach`.
    pub(super) fn new(reach: f64) -> Self {
        Self {
            length: ROUNDING * reach,
        }
    }

    /// The square of the distance up to which boxes must be opened, given the square of the best so far.
    #[inline(always)]
    pub(super) fn widen<T: Real>(self, best_squared: T) -> T {
        let wider = best_squared.sqrt() * T::constant(1.0 + ROUNDING) + T::constant(self.length);
        wider * wider
    }
}
