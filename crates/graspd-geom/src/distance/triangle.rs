//! The point of a triangle nearest to a given point.

use nalgebra::{Point3, Vector3};

/// How thin, height over longest edge, a triangle may be before it is taken for its three edges.
///
/// That moves no distance by more than this times the longest edge; below it the normal has lost half its digits.
const THINNEST: f64 = 1e-9;

/// A triangle a, b, c, made ready for distance queries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    a: Point3<f64>,
    ab: Vector3<f64>,
    ac: Vector3<f64>,
    /// Gradients of the barycentric coordinates of b and c; NaN for a triangle without area.
    grad_b: Vector3<f64>,
    grad_c: Vector3<f64>,
    /// 1 / |ab|^2, 1 / |ac|^2, 1 / |bc|^2, or 0 for an edge of length 0.
    inverse_squared: [f64; 3],
}

impl Triangle {
    pub(crate) fn new([a, b, c]: [Point3<f64>; 3]) -> Self {
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let normal = ab.cross(&ac);
        let longest_squared = ab
            .norm_squared()
            .max(ac.norm_squared())
            .max(bc.norm_squared());
        let (grad_b, grad_c) = if normal.norm() > THINNEST * longest_squared {
            let scaled = normal / normal.norm_squared();
            (ac.cross(&scaled), scaled.cross(&ab))
        } else {
            (Vector3::repeat(f64::NAN), Vector3::repeat(f64::NAN))
        };
        let inverse = |edge: Vector3<f64>| {
            let squared = edge.norm_squared();
            if squared > f64::MIN_POSITIVE {
                squared.recip()
            } else {
                0.0
            }
        };
        Self {
            a,
            ab,
            ac,
            grad_b,
            grad_c,
            inverse_squared: [inverse(ab), inverse(ac), inverse(bc)],
        }
    }

    /// The vector from `p` to the nearest point of the triangle.
    ///
    /// Where p projects into the triangle, that is the projection. Elsewhere the nearest point lies on an edge
    /// beyond which p lies: its normal cone is spanned by the outward normals of the edges there, and p cannot
    /// be on the inner side of all of them. NaN coordinates fail every test, so then all three edges are looked at.
    #[inline]
    pub(crate) fn to_closest(self, p: &Point3<f64>) -> Vector3<f64> {
        let ap = p - self.a;
        let v = self.grad_b.dot(&ap);
        let w = self.grad_c.dot(&ap);
        let u = 1.0 - v - w;
        if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            return self.ab * v + self.ac * w - ap;
        }
        let [inverse_ab, inverse_ac, inverse_bc] = self.inverse_squared;
        let mut best = Vector3::zeros();
        let mut best_squared = f64::INFINITY;
        let mut try_edge = |start: Vector3<f64>, edge: Vector3<f64>, inverse: f64| {
            // `start` is p relative to the edge's first end.
            let along = (start.dot(&edge) * inverse).clamp(0.0, 1.0);
            let to_edge = edge * along - start;
            let squared = to_edge.norm_squared();
            if squared < best_squared {
                (best, best_squared) = (to_edge, squared);
            }
        };
        let beyond = |coordinate: f64| coordinate < 0.0 || coordinate.is_nan();
        if beyond(w) {
            try_edge(ap, self.ab, inverse_ab);
        }
        if beyond(v) {
            try_edge(ap, self.ac, inverse_ac);
        }
        if beyond(u) {
            try_edge(ap - self.ab, self.ac - self.ab, inverse_bc);
        }
        best
    }
}
