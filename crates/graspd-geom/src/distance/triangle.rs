//! The point of a triangle nearest to a given point.

use nalgebra::{Point3, Vector3};

/// How thin, height over longest edge, a triangle may be before it is taken for its three edges.
///
/// That moves no distance by more than this times the longest edge; below it the normal has lost half its digits.
const THINNEST: f64 = 1e-9;

/// A triangle a, b, c, made ready for distance queries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) a: [f64; 3],
    pub(super) ab: [f64; 3],
    pub(super) ac: [f64; 3],
    /// Gradients of the barycentric coordinates of b and c; NaN for a triangle without area.
    pub(super) grad_b: [f64; 3],
    pub(super) grad_c: [f64; 3],
    /// 1 / |ab|^2, 1 / |ac|^2, 1 / |bc|^2, or 0 for an edge of length 0.
    pub(super) inverse_squared: [f64; 3],
}

impl Triangle {
    pub(super) fn new([a, b, c]: [Point3<f64>; 3]) -> Self {
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
            a: a.coords.into(),
            ab: ab.into(),
            ac: ac.into(),
            grad_b: grad_b.into(),
            grad_c: grad_c.into(),
            inverse_squared: [inverse(ab), inverse(ac), inverse(bc)],
        }
    }

    /// The square of the distance from (x, y, z) to the triangle.
    #[inline(always)]
    pub(super) fn distance_squared(&self, p: [f64; 3]) -> f64 {
        self.nearest(p).0
    }

    /// The vector from `p` to the nearest point of the triangle.
    pub(super) fn to_closest(self, p: &Point3<f64>) -> Vector3<f64> {
        self.nearest([p.x, p.y, p.z]).1.into()
    }

    /// The square of the distance, and the vector to the nearest point.
    ///
    /// Where p projects into the triangle, that is the projection; elsewhere it is on one of the edges. NaN
    /// coordinates fail the test. There are no branches, so that eight points are served at once.
    #[inline(always)]
    fn nearest(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let [inverse_ab, inverse_ac, inverse_bc] = self.inverse_squared;
        let ap = minus(p, self.a);
        let v = dot(self.grad_b, ap);
        let w = dot(self.grad_c, ap);
        let is_above = (v >= 0.0) & (w >= 0.0) & (1.0 - v - w >= 0.0);
        let onto = minus(plus(times(self.ab, v), times(self.ac, w)), ap);
        let onto_ab = to_edge(ap, self.ab, inverse_ab);
        let onto_ac = to_edge(ap, self.ac, inverse_ac);
        let bp = minus(ap, self.ab);
        let onto_bc = to_edge(bp, minus(self.ac, self.ab), inverse_bc);
        let edge = nearer(nearer(onto_ab, onto_ac), onto_bc);
        let onto = (dot(onto, onto), onto);
        select(is_above, onto, edge)
    }
}

type Nearest = (f64, [f64; 3]);

/// From `p` to the nearest point of the edge from the origin to `edge`.
#[inline(always)]
fn to_edge(p: [f64; 3], edge: [f64; 3], inverse_squared: f64) -> Nearest {
    let along = dot(p, edge) * inverse_squared;
    let along = if along > 0.0 { along } else { 0.0 };
    let along = if along < 1.0 { along } else { 1.0 };
    let onto = minus(times(edge, along), p);
    (dot(onto, onto), onto)
}

#[inline(always)]
fn nearer(one: Nearest, other: Nearest) -> Nearest {
    select(one.0 <= other.0, one, other)
}

#[inline(always)]
fn select(is_first: bool, first: Nearest, second: Nearest) -> Nearest {
    if is_first { first } else { second }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn times(a: [f64; 3], factor: f64) -> [f64; 3] {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle's points are no farther from its longest edge than it is high, so distances to the two differ
    /// by no more, however thin the triangle is.
    #[test]
    fn thin_triangles_are_as_far_as_their_longest_edge() {
        for exponent in 2..20 {
            let height = 10.0_f64.powi(-exponent);
            // The longest edge is that from the third to the second, first to second, first to third corner.
            for (across, longest) in [(-0.3, [2, 1]), (0.4, [0, 1]), (1.2, [0, 2])] {
                let corners = [
                    [0.2, 0.0, 0.1],
                    [1.2, 0.0, 0.1],
                    [0.2 + across, height, 0.1],
                ]
                .map(Point3::from);
                let [a, b] = longest.map(|corner| corners[corner]);
                let (triangle, edge) = (Triangle::new(corners), Triangle::new([a, b, b]));
                for step in 0..200 {
                    let t = f64::from(step);
                    let p = [
                        (0.9 * t).sin() * 2.0,
                        (1.7 * t).cos(),
                        (2.3 * t).sin() / (1.0 + t),
                    ];
                    let [to_triangle, to_edge] =
                        [triangle, edge].map(|shape| shape.distance_squared(p).sqrt());
                    assert!(
                        (to_triangle - to_edge).abs() <= height + 1e-15,
                        "{height} {p:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_triangle_may_be_a_point() {
        let a = Point3::new(1.0, 2.0, 3.0);
        let point = Triangle::new([a; 3]);
        assert_eq!(point.distance_squared([1.0, 2.0, 5.0]), 4.0);
        assert_eq!(
            point.to_closest(&Point3::new(1.0, 2.0, 5.0)),
            Vector3::new(0.0, 0.0, -2.0)
        );
    }
}
