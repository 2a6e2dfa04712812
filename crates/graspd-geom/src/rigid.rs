//! Vectors, rotations and rigid motions over any [`Real`] scalar.
//!
//! nalgebra serves code in plain `f64`; these small types serve code through which gradients flow, since a
//! reverse-mode variable borrows its tape and so cannot enter nalgebra's `'static` matrices.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use graspd_ad::Real;
use nalgebra as na;

/// A vector or point in three dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<T> {
    /// First coordinate.
    pub x: T,
    /// Second coordinate.
    pub y: T,
    /// Third coordinate.
    pub z: T,
}

impl<T: Real> Vec3<T> {
    /// The vector (x, y, z).
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::new(T::zero(), T::zero(), T::zero())
    }
    /// The same constant vector in every lane.
    #[inline(always)]
    pub fn constant(v: impl Into<Vec3<f64>>) -> Self {
        let v = v.into();
        Self::new(T::constant(v.x), T::constant(v.y), T::constant(v.z))
    }
    /// Coordinate `axis` (0, 1 or 2).
    ///
    /// # Panics
    /// If `axis > 2`.
    #[inline(always)]
    pub fn get(self, axis: usize) -> T {
        [self.x, self.y, self.z][axis]
    }
    /// a . b
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
    /// a x b
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }
    /// Squared length.
    #[inline(always)]
    pub fn norm_squared(self) -> T {
        self.dot(self)
    }
    /// Length; derivative 0 at the zero vector.
    #[inline(always)]
    pub fn norm(self) -> T {
        self.norm_squared().sqrt()
    }
    /// The vector divided by its length; the zero vector (value and derivative 0) where the length is 0.
    #[inline(always)]
    pub fn normalize_or_zero(self) -> Self {
        let squared = self.norm_squared();
        let is_positive = squared.gt(T::constant(0.0));
        let safe = T::select(is_positive, squared, T::one());
        let inverse = T::select(is_positive, safe.sqrt().recip(), T::zero());
        self * inverse
    }
    /// The same value with derivative zero.
    #[inline(always)]
    pub fn detach(self) -> Self {
        Self::new(self.x.detach(), self.y.detach(), self.z.detach())
    }
    /// `on_true` where the mask holds, `on_false` elsewhere.
    #[inline(always)]
    pub fn select(mask: T::Mask, on_true: Self, on_false: Self) -> Self {
        Self::new(
            T::select(mask, on_true.x, on_false.x),
            T::select(mask, on_true.y, on_false.y),
            T::select(mask, on_true.z, on_false.z),
        )
    }
}

impl<T: Real> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}
impl<T: Real> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}
impl<T: Real> AddAssign for Vec3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<T: Real> SubAssign for Vec3<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl<T: Real> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}
impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl From<na::Vector3<f64>> for Vec3<f64> {
    fn from(v: na::Vector3<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}
impl From<na::Point3<f64>> for Vec3<f64> {
    fn from(p: na::Point3<f64>) -> Self {
        Self::new(p.x, p.y, p.z)
    }
}
impl From<[f64; 3]> for Vec3<f64> {
    fn from(v: [f64; 3]) -> Self {
        Self::new(v[0], v[1], v[2])
    }
}
impl From<Vec3<f64>> for na::Vector3<f64> {
    fn from(v: Vec3<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}
impl From<Vec3<f64>> for na::Point3<f64> {
    fn from(v: Vec3<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

/// A 3 x 3 matrix by rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<T> {
    /// The rows, top to bottom.
    pub rows: [Vec3<T>; 3],
}

impl<T: Real> Mat3<T> {
    /// The identity.
    #[inline(always)]
    pub fn identity() -> Self {
        let (zero, one) = (T::zero(), T::one());
        Self {
            rows: [
                Vec3::new(one, zero, zero),
                Vec3::new(zero, one, zero),
                Vec3::new(zero, zero, one),
            ],
        }
    }
    /// The same constant matrix in every lane.
    #[inline(always)]
    pub fn constant(m: &Mat3<f64>) -> Self {
        Self {
            rows: m.rows.map(Vec3::constant),
        }
    }
    /// The transposed matrix.
    #[inline(always)]
    pub fn transpose(self) -> Self {
        let [a, b, c] = self.rows;
        Self {
            rows: [
                Vec3::new(a.x, b.x, c.x),
                Vec3::new(a.y, b.y, c.y),
                Vec3::new(a.z, b.z, c.z),
            ],
        }
    }
    /// M v
    #[inline(always)]
    pub fn apply(&self, v: Vec3<T>) -> Vec3<T> {
        Vec3::new(
            self.rows[0].dot(v),
            self.rows[1].dot(v),
            self.rows[2].dot(v),
        )
    }
    /// M^T v
    #[inline(always)]
    pub fn apply_transposed(&self, v: Vec3<T>) -> Vec3<T> {
        self.rows[0] * v.x + self.rows[1] * v.y + self.rows[2] * v.z
    }
    /// The matrix product, self on the left.
    #[inline(always)]
    pub fn compose(&self, right: &Self) -> Self {
        Self {
            rows: self.rows.map(|row| right.apply_transposed(row)),
        }
    }
    /// The rotation by `angle` \[rad\] about the unit vector `axis` (Rodrigues' formula).
    #[inline(always)]
    pub fn from_axis_angle(axis: Vec3<T>, angle: T) -> Self {
        let (sine, cosine) = angle.sin_cos();
        let versine = T::one() - cosine;
        let Vec3 { x, y, z } = axis;
        Self {
            rows: [
                Vec3::new(
                    x * x * versine + cosine,
                    x * y * versine - z * sine,
                    x * z * versine + y * sine,
                ),
                Vec3::new(
                    x * y * versine + z * sine,
                    y * y * versine + cosine,
                    y * z * versine - x * sine,
                ),
                Vec3::new(
                    x * z * versine - y * sine,
                    y * z * versine + x * sine,
                    z * z * versine + cosine,
                ),
            ],
        }
    }
}

/// A rotation as a quaternion w + xi + yj + zk, of unit length unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion<T> {
    /// Real part.
    pub w: T,
    /// Coefficient of i.
    pub x: T,
    /// Coefficient of j.
    pub y: T,
    /// Coefficient of k.
    pub z: T,
}

impl<T: Real> Quaternion<T> {
    /// No rotation.
    pub fn identity() -> Self {
        Self {
            w: T::one(),
            x: T::zero(),
            y: T::zero(),
            z: T::zero(),
        }
    }
    /// The same constant in every lane.
    pub fn constant(q: Quaternion<f64>) -> Self {
        Self {
            w: T::constant(q.w),
            x: T::constant(q.x),
            y: T::constant(q.y),
            z: T::constant(q.z),
        }
    }
    /// The exponential map: the rotation by |v| \[rad\] about v/|v|.
    ///
    /// Near 0 a Taylor series takes over, so that value and derivatives are exact there too.
    pub fn exp(v: Vec3<T>) -> Self {
        let angle_squared = v.norm_squared();
        let is_small = angle_squared.lt(T::constant(1e-8));
        let safe = T::select(is_small, T::one(), angle_squared).sqrt();
        let half = safe * T::constant(0.5);
        let (sine, cosine) = half.sin_cos();
        // sin(t/2)/t = 1/2 - t^2/48 + ..., cos(t/2) = 1 - t^2/8 + ...
        let scale = T::select(
            is_small,
            T::constant(0.5) - angle_squared * T::constant(1.0 / 48.0),
            sine / safe,
        );
        let w = T::select(
            is_small,
            T::one() - angle_squared * T::constant(0.125),
            cosine,
        );
        Self {
            w,
            x: v.x * scale,
            y: v.y * scale,
            z: v.z * scale,
        }
    }
    /// The Hamilton product: first `right`, then `self`.
    pub fn compose(self, right: Self) -> Self {
        let (a, b) = (self, right);
        Self {
            w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        }
    }
    /// Divided by its length.
    pub fn normalize(self) -> Self {
        let squared = self.w * self.w + self.x * self.x + self.y * self.y + self.z * self.z;
        let inverse = squared.sqrt().recip();
        Self {
            w: self.w * inverse,
            x: self.x * inverse,
            y: self.y * inverse,
            z: self.z * inverse,
        }
    }
    /// The rotation matrix of a unit quaternion.
    pub fn to_matrix(self) -> Mat3<T> {
        let Self { w, x, y, z } = self;
        let (one, two) = (T::one(), T::constant(2.0));
        Mat3 {
            rows: [
                Vec3::new(
                    one - two * (y * y + z * z),
                    two * (x * y - w * z),
                    two * (x * z + w * y),
                ),
                Vec3::new(
                    two * (x * y + w * z),
                    one - two * (x * x + z * z),
                    two * (y * z - w * x),
                ),
                Vec3::new(
                    two * (x * z - w * y),
                    two * (y * z + w * x),
                    one - two * (x * x + y * y),
                ),
            ],
        }
    }
}

impl From<na::UnitQuaternion<f64>> for Quaternion<f64> {
    fn from(q: na::UnitQuaternion<f64>) -> Self {
        Self {
            w: q.w,
            x: q.i,
            y: q.j,
            z: q.k,
        }
    }
}
impl From<Quaternion<f64>> for na::UnitQuaternion<f64> {
    fn from(q: Quaternion<f64>) -> Self {
        Self::from_quaternion(na::Quaternion::new(q.w, q.x, q.y, q.z))
    }
}

/// A rigid motion p -> R p + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid<T> {
    /// R
    pub rotation: Mat3<T>,
    /// t \[m\]
    pub translation: Vec3<T>,
}

impl<T: Real> Rigid<T> {
    /// No motion.
    pub fn identity() -> Self {
        Self {
            rotation: Mat3::identity(),
            translation: Vec3::zero(),
        }
    }
    /// The same constant motion in every lane.
    #[inline(always)]
    pub fn constant(m: &Rigid<f64>) -> Self {
        Self {
            rotation: Mat3::constant(&m.rotation),
            translation: Vec3::constant(m.translation),
        }
    }
    /// R p + t
    #[inline(always)]
    pub fn apply(&self, point: Vec3<T>) -> Vec3<T> {
        self.rotation.apply(point) + self.translation
    }
    /// First `right`, then `self`.
    #[inline(always)]
    pub fn compose(&self, right: &Self) -> Self {
        Self {
            rotation: self.rotation.compose(&right.rotation),
            translation: self.apply(right.translation),
        }
    }
}

impl From<na::Isometry3<f64>> for Rigid<f64> {
    fn from(m: na::Isometry3<f64>) -> Self {
        Self {
            rotation: Quaternion::from(m.rotation).to_matrix(),
            translation: m.translation.vector.into(),
        }
    }
}
impl From<Rigid<f64>> for na::Isometry3<f64> {
    fn from(m: Rigid<f64>) -> Self {
        let rows = m
            .rotation
            .rows
            .map(|row| na::Vector3::from(row).transpose());
        let rotation = na::Rotation3::from_matrix_unchecked(na::Matrix3::from_rows(&rows));
        Self::from_parts(
            na::Translation3::from(na::Vector3::from(m.translation)),
            na::UnitQuaternion::from_rotation_matrix(&rotation),
        )
    }
}
