//! The first triangle that a ray meets.

use nalgebra::{Point3, Vector3};

use super::tree::TriangleTree;

/// Where a ray first meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The point is `origin + length * direction`.
    pub length: f64,
    /// The face met.
    pub face: usize,
    /// Its unit outward normal; zero if it has no area.
    pub normal: Vector3<f64>,
}

impl TriangleTree {
    /// Where the ray from `origin` along `direction` (of any length) first meets the surface, from either side;
    /// `None` if it does not.
    ///
    /// A ray through an edge meets one of its faces: triangles are tested with the edges' signs taken from both
    /// sides alike, so that closed surfaces have no cracks but for rounding.
    ///
    /// # Source
    /// Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", Journal of Graphics Tools 2 (1997);
    /// here with edge functions about the ray, as in Woop, Benthin and Wald, "Watertight ray/triangle
    /// intersection", JCGT 2 (2013).
    pub fn first_hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<RayHit> {
        let ray = Ray::new(origin, direction);
        let mut best: Option<(f64, usize)> = None;
        let mut index = 0;
        while index < self.nodes.len() {
            let node = &self.nodes[index];
            let limit = best.map_or(f64::INFINITY, |(length, _)| length);
            let is_met = ray.meets(&self.extents[index], limit);
            if is_met && node.is_leaf() {
                for at in node.triangles() {
                    if let Some(length) = ray.length_to(&self.corners[at])
                        && best.is_none_or(|(shortest, _)| length < shortest)
                    {
                        best = Some((length, at));
                    }
                }
            }
            // Depth first, in storage order.
            index = if is_met { index + 1 } else { node.end as usize };
        }
        let (length, at) = best?;
        let [a, b, c] = self.corners[at];
        let normal = (b - a).cross(&(c - a));
        Some(RayHit {
            length,
            face: self.face(at),
            normal: normal
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or_else(Vector3::zeros),
        })
    }
}

/// A ray made ready: coordinates are permuted and sheared so that it runs along z.
struct Ray {
    origin: Point3<f64>,
    inverse: Vector3<f64>,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Ray {
    fn new(origin: &Point3<f64>, direction: &Vector3<f64>) -> Self {
        let z = direction.iamax();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [x, y, _] = axes;
        Self {
            origin: *origin,
            inverse: direction.map(f64::recip),
            axes,
            shear: [
                direction[x] / direction[z],
                direction[y] / direction[z],
                direction[z].recip(),
            ],
        }
    }

    /// Whether a box is met between the origin and `limit`; too often rather than not, where a ray grazes it.
    #[inline]
    fn meets(&self, [low, high]: &[Point3<f64>; 2], limit: f64) -> bool {
        // As large as the rounding of two differences and products.
        const SLACK: f64 = 1.0 + 8.0 * f64::EPSILON;
        let (mut near, mut far) = (0.0_f64, limit);
        for axis in 0..3 {
            let a = (low[axis] - self.origin[axis]) * self.inverse[axis];
            let b = (high[axis] - self.origin[axis]) * self.inverse[axis];
            // 0 * infinity is NaN, which min and max pass over: the box's face is in the ray's plane.
            near = near.max(a.min(b));
            far = far.min(a.max(b) * SLACK);
        }
        near <= far
    }

    #[inline]
    fn length_to(&self, corners: &[Point3<f64>; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let sheared = corners.map(|corner| {
            let p = corner - self.origin;
            [
                p[x] - self.shear[0] * p[z],
                p[y] - self.shear[1] * p[z],
                p[z] * self.shear[2],
            ]
        });
        let [a, b, c] = sheared;
        let edges = [
            c[0] * b[1] - c[1] * b[0],
            a[0] * c[1] - a[1] * c[0],
            b[0] * a[1] - b[1] * a[0],
        ];
        let is_outside = edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0);
        let determinant: f64 = edges.iter().sum();
        if is_outside || determinant == 0.0 {
            return None;
        }
        let length = (edges[0] * a[2] + edges[1] * b[2] + edges[2] * c[2]) / determinant;
        (length > 0.0).then_some(length)
    }
}
