//! One convex piece of an object.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::try_convex_hull;
use serde::{Deserialize, Serialize};

/// A convex polyhedron as a closed, outward-oriented triangle mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConvexPiece {
    /// Vertex positions \[m\], `[n, 3]`.
    pub vertices: Vec<[f64; 3]>,
    /// Vertex indices of each triangle, `[m, 3]`.
    pub faces: Vec<[u32; 3]>,
}

/// Hulls of less volume than this \[m^3\] are flat for our purposes (a 1 mm square 1 um thick).
const MIN_VOLUME: f64 = 1e-12;

impl ConvexPiece {
    /// The convex hull of `points`; `None` where it has no volume.
    pub fn hull_of(points: &[Point3<f64>]) -> Option<Self> {
        let points: Vec<_> = points.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
        let (vertices, faces) = try_convex_hull(&points).ok()?;
        let hull = Self {
            vertices: vertices.iter().map(|p| [p.x, p.y, p.z]).collect(),
            faces,
        };
        (hull.volume() > MIN_VOLUME).then_some(hull)
    }

    /// Volume \[m^3\], by the divergence theorem.
    pub fn volume(&self) -> f64 {
        let Some(first) = self.vertices.first() else {
            return 0.0;
        };
        let origin = Point3::from(*first);
        (0..self.faces.len())
            .map(|face| {
                let [a, b, c] = self.corners(face).map(|p| p - origin);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    fn corners(&self, face: usize) -> [Point3<f64>; 3] {
        self.faces[face].map(|index| Point3::from(self.vertices[index as usize]))
    }

    /// Points on the faces, at most `spacing` \[m\] apart along each edge.
    pub(super) fn surface_samples(&self, spacing: f64) -> impl Iterator<Item = Point3<f64>> {
        (0..self.faces.len()).flat_map(move |face| {
            let [a, b, c] = self.corners(face);
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            // At least the centroid and the middles of the edges, which vertices on the surface leave open.
            let parts = ((longest / spacing).ceil() as usize).clamp(2, 64);
            let step = 1.0 / parts as f64;
            (0..parts).flat_map(move |i| {
                (0..parts - i).map(move |j| {
                    let (u, v) = ((i as f64 + 1.0 / 3.0) * step, (j as f64 + 1.0 / 3.0) * step);
                    a + (b - a) * u + (c - a) * v
                })
            })
        })
    }

    /// Whether `point` lies inside, or outside no face by more than `tolerance` \[m\].
    pub fn contains(&self, point: &Point3<f64>, tolerance: f64) -> bool {
        self.planes()
            .all(|(normal, offset)| normal.dot(&point.coords) <= offset + tolerance)
    }

    /// Outward unit normal and offset of each face: n . p <= offset inside.
    fn planes(&self) -> impl Iterator<Item = (Vector3<f64>, f64)> {
        (0..self.faces.len()).filter_map(|face| {
            let [a, b, c] = self.corners(face);
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
            Some((normal, normal.dot(&a.coords)))
        })
    }
}

/// A hull of few of `hull`'s vertices from which no vertex of `hull` lies farther than `tolerance` \[m\] in the
/// direction of a face; `None` where it has no volume.
pub(super) fn simplified_hull(hull: &ConvexPiece, tolerance: f64) -> Option<ConvexPiece> {
    let all: Vec<_> = hull.vertices.iter().map(|p| Point3::from(*p)).collect();
    let farthest = |direction: &Vector3<f64>| {
        all.iter().copied().max_by(|a, b| {
            direction
                .dot(&a.coords)
                .total_cmp(&direction.dot(&b.coords))
        })
    };
    let mut chosen: Vec<Point3<f64>> = (0..27)
        .filter(|code| *code != 13)
        .map(|code| [code % 3, code / 3 % 3, code / 9].map(|k| f64::from(k) - 1.0))
        .filter_map(|d| farthest(&Vector3::from(d)))
        .collect();
    loop {
        let candidate = ConvexPiece::hull_of(&chosen);
        let Some(candidate) = candidate else {
            return Some(hull.clone()).filter(|h| !h.faces.is_empty());
        };
        let before = chosen.len();
        for (normal, offset) in candidate.planes() {
            if let Some(point) = farthest(&normal)
                && normal.dot(&point.coords) > offset + tolerance
                && !chosen.contains(&point)
            {
                chosen.push(point);
            }
        }
        if chosen.len() == before {
            return Some(candidate);
        }
    }
}
