//! What a cluster of triangles adds to a winding number, seen from afar.
//!
//! With x = c + y on the surface, c the cluster's centre and d = c - p, the solid angle is
//!
//! ```text
//! 4 pi w(p) = integral of n . (d + y) / |d + y|^3 dA
//!           = N.d / R^3 - 3 d.Q d / R^5 + 15/2 S d d d / R^7 + remainder,     R = |d|
//! ```
//!
//! where N = integral of n dA, and Q and S are the symmetric parts without trace of the integrals of n y and n y y:
//! the derivatives of 1/|d| have neither an antisymmetric part nor a trace.
//!
//! **Remainder.** 1/|d + y| is the sum over l of the harmonic polynomials h_l(y) = (-1)^l |y|^l P_l(cos) / R^(l+1).
//! As P_l^2 + sin^2 P_l'^2 / (l (l + 1)) <= 1 for Legendre's P_l, |grad h_l| <= (l + 1/2) |y|^(l-1) / R^(l+1). What is
//! kept are l = 1, 2, 3, so with q = r / R, r the cluster's radius, and M the integral of |y|^3 dA
//!
//! ```text
//! 4 pi |remainder| <= M / R^5 * sum over l >= 4 of (l + 1/2) q^(l-4) = M / R^5 * (4.5 / (1 - q) + q / (1 - q)^2)
//! ```

use nalgebra::{Point3, Vector3};

/// Seen from nearer than its radius over this, a cluster is opened without asking for the remainder.
const WIDEST: f64 = 0.7;

/// The places of a symmetric third-order tensor, and how often each occurs in a contraction.
const TRIPLES: [([usize; 3], f64); 10] = [
    ([0, 0, 0], 1.0),
    ([1, 1, 1], 1.0),
    ([2, 2, 2], 1.0),
    ([0, 0, 1], 3.0),
    ([0, 0, 2], 3.0),
    ([0, 1, 1], 3.0),
    ([1, 1, 2], 3.0),
    ([0, 2, 2], 3.0),
    ([1, 2, 2], 3.0),
    ([0, 1, 2], 6.0),
];

/// The moments of some triangles about their centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    center: Point3<f64>,
    radius: f64,
    /// N
    normal: Vector3<f64>,
    /// Q: xx, yy, zz, xy, xz, yz; those off the diagonal twice, as they occur twice.
    second: [f64; 6],
    /// S, in the order of [`TRIPLES`] and times their counts.
    third: [f64; 10],
    /// M
    moment: f64,
    pub(super) area: f64,
}

impl Cluster {
    pub(super) fn new(triangles: &[[Point3<f64>; 3]]) -> Self {
        let center = center(triangles);
        let mut cluster = Self {
            center,
            radius: 0.0,
            normal: Vector3::zeros(),
            second: [0.0; 6],
            third: [0.0; 10],
            moment: 0.0,
            area: 0.0,
        };
        let mut q = [[0.0; 3]; 3];
        let mut t = [[[0.0; 3]; 3]; 3];
        for corners in triangles {
            let y = corners.map(|corner| corner - center);
            let n = area_vector(corners);
            let area = n.norm();
            let lengths = y.map(|y| y.norm());
            cluster.area += area;
            cluster.normal += n;
            cluster.radius = lengths.iter().copied().fold(cluster.radius, f64::max);
            // |y|^3 is convex: over a triangle its mean is at most that of the corners.
            cluster.moment += area * lengths.iter().map(|length| length.powi(3)).sum::<f64>() / 3.0;
            let sum = y[0] + y[1] + y[2];
            // The mean of y y^T over the triangle.
            let square = y.iter().fold(sum * sum.transpose(), |square, y| {
                square + y * y.transpose()
            }) / 12.0;
            for i in 0..3 {
                for j in 0..3 {
                    q[i][j] += n[i] * sum[j] / 3.0;
                    for k in 0..3 {
                        t[i][j][k] += n[i] * square[(j, k)];
                    }
                }
            }
        }
        let trace = (q[0][0] + q[1][1] + q[2][2]) / 3.0;
        cluster.second = [
            q[0][0] - trace,
            q[1][1] - trace,
            q[2][2] - trace,
            q[0][1] + q[1][0],
            q[0][2] + q[2][0],
            q[1][2] + q[2][1],
        ];
        let symmetric = |[i, j, k]: [usize; 3]| (t[i][j][k] + t[j][i][k] + t[k][i][j]) / 3.0;
        let trace = [0, 1, 2].map(|k| (0..3).map(|i| symmetric([i, i, k])).sum::<f64>() / 5.0);
        for (place, (ijk, count)) in TRIPLES.into_iter().enumerate() {
            let [i, j, k] = ijk;
            let delta = |a: usize, b: usize, c: usize| if a == b { trace[c] } else { 0.0 };
            let traces = delta(i, j, k) + delta(i, k, j) + delta(j, k, i);
            cluster.third[place] = count * (symmetric(ijk) - traces);
        }
        cluster
    }

    /// The winding number as the expansion gives it, if it is sure to be off by at most `error`.
    #[inline]
    pub(super) fn seen_from(&self, p: &Point3<f64>, error: f64) -> Option<f64> {
        let d = self.center - p;
        let squared = d.norm_squared();
        if self.radius * self.radius > WIDEST * WIDEST * squared {
            return None;
        }
        let distance = squared.sqrt();
        let q = self.radius / distance;
        let near = 1.0 / (1.0 - q);
        let fifth = squared * squared * distance;
        let full_angle = 4.0 * std::f64::consts::PI;
        if self.moment * near * (4.5 + q * near) > error * full_angle * fifth {
            return None;
        }
        let [xx, yy, zz, xy, xz, yz] = self.second;
        let second =
            d.x * (xx * d.x + xy * d.y + xz * d.z) + d.y * (yy * d.y + yz * d.z) + zz * d.z * d.z;
        let [xxx, yyy, zzz, xxy, xxz, xyy, yyz, xzz, yzz, xyz] = self.third;
        let third = d.x * d.x * (xxx * d.x + xxy * d.y + xxz * d.z)
            + d.y * d.y * (yyy * d.y + xyy * d.x + yyz * d.z)
            + d.z * d.z * (zzz * d.z + xzz * d.x + yzz * d.y)
            + xyz * d.x * d.y * d.z;
        let sum = self.normal.dot(&d) + (-3.0 * second + 7.5 * third / squared) / squared;
        Some(sum / (full_angle * squared * distance))
    }
}

/// The mean of the triangles' area, or of their corners if they have none.
fn center(triangles: &[[Point3<f64>; 3]]) -> Point3<f64> {
    let origin = triangles[0][0];
    let (mut area, mut mean) = (0.0, Vector3::zeros());
    let (mut count, mut plain) = (0.0, Vector3::zeros());
    for corners in triangles {
        let third = corners
            .iter()
            .map(|corner| corner - origin)
            .sum::<Vector3<f64>>()
            / 3.0;
        let weight = area_vector(corners).norm();
        area += weight;
        mean += third * weight;
        count += 1.0;
        plain += third;
    }
    origin
        + if area > 0.0 {
            mean / area
        } else {
            plain / count
        }
}

/// The normal, as long as the triangle's area.
fn area_vector([a, b, c]: &[Point3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a)) * 0.5
}

/// The winding number of one triangle: the solid angle under which `p` sees its inner side, over 4 pi.
///
/// # Source
/// Van Oosterom & Strackee, "The Solid Angle of a Plane Triangle", IEEE Trans. Biomedical Engineering 1983.
#[inline]
pub(super) fn triangle_winding(corners: &[Point3<f64>; 3], p: &Point3<f64>) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - p);
    let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
    let volume = a.dot(&b.cross(&c));
    let rest = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    volume.atan2(rest) * std::f64::consts::FRAC_1_PI * 0.5
}
