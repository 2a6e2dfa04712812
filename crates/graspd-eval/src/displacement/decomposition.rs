//! Approximate convex decomposition of a closed mesh, accurate enough for thin shells.
//!
//! The solid S is cut by axis-aligned planes into boxes B; each piece is conv(S n B), so that the union of the
//! pieces covers S and exceeds it only across concave stretches of its surface. The box whose piece exceeds S by
//! the largest distance is cut again, at the plane (of a few along each axis) that leaves the smallest total
//! hull volume, until no piece exceeds S by more than the tolerance.
//!
//! Decompositions that measure concavity by volume over a voxel grid (V-HACD) leave several millimetres across
//! the wall of a mug or a bowl, where the volume at stake is small but a fingertip must fit.

use std::collections::BinaryHeap;

use graspd_geom::TriangleMesh;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::convex_piece::{ConvexPiece, simplified_hull};
use crate::polygon::{clip, crossing};

/// How finely an object is cut into convex pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DecompositionSettings {
    /// Largest distance by which a piece may reach outside the object \[m\]. Cutting ends when every piece keeps
    /// to it.
    pub overfill_tolerance: f64,
    /// Distance by which a piece may fall short of its exact hull in exchange for fewer vertices \[m\].
    pub simplification_tolerance: f64,
    /// Most pieces; cutting ends there at the latest.
    pub max_pieces: usize,
}

impl Default for DecompositionSettings {
    fn default() -> Self {
        Self {
            overfill_tolerance: 0.5e-3,
            simplification_tolerance: 0.05e-3,
            max_pieces: 512,
        }
    }
}

/// A solid as a union of convex pieces that touch at their cuts.
///
/// Computed once per object and shared by all of its grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectPieces {
    /// The pieces, in the object's frame.
    pub pieces: Vec<ConvexPiece>,
    /// Largest distance by which a piece reaches outside the object, at sampled points \[m\].
    pub overfill: f64,
    /// Total volume of the pieces \[m^3\].
    pub volume: f64,
}

/// Plane positions tried along each axis of a box, as fractions of its side.
const CUT_FRACTIONS: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// Relative hull volume that a cut through a box's middle may cost more than one along its face: decides where the
/// first cuts of a shell, which save no volume yet, are made.
const BALANCE: f64 = 0.05;
/// Points of a box's surface that the choice of a cut looks at, at most.
const SCORING_POINTS: usize = 300;
/// Boxes with no side longer than this \[m\] are not cut further: scans hold no detail below it.
const SMALLEST_SIDE: f64 = 2e-3;

impl ObjectPieces {
    /// Decomposes the solid bounded by `mesh`.
    ///
    /// `signed_distance`: the exact signed distance of the same mesh \[m\], negative inside.
    pub fn new(
        mesh: &TriangleMesh,
        signed_distance: &dyn Fn(&Point3<f64>) -> f64,
        settings: &DecompositionSettings,
    ) -> Self {
        let Some((low, high)) = mesh.bounds() else {
            return Self {
                pieces: Vec::new(),
                overfill: 0.0,
                volume: 0.0,
            };
        };
        let polygons = (0..mesh.faces.len())
            .map(|face| mesh.corners(face).to_vec())
            .collect();
        let mut queue = BinaryHeap::new();
        let mut done = Vec::new();
        queue.extend(Cell::new(low, high, polygons, signed_distance));
        while let Some(cell) = queue.pop() {
            let is_fine = cell.overfill <= settings.overfill_tolerance;
            if is_fine || done.len() + queue.len() + 1 >= settings.max_pieces || cell.is_smallest()
            {
                done.push(cell);
            } else {
                queue.extend(cell.cut(signed_distance).into_iter().flatten());
            }
        }
        // The order of a heap depends on its history; this one depends on the pieces alone.
        done.sort_by(|a, b| compare_points(&a.low, &b.low).then(compare_points(&a.high, &b.high)));
        let pieces: Vec<_> = done
            .iter()
            .filter_map(|cell| simplified_hull(&cell.hull, settings.simplification_tolerance))
            .collect();
        Self {
            overfill: done.iter().map(|cell| cell.overfill).fold(0.0, f64::max),
            volume: pieces.iter().map(ConvexPiece::volume).sum(),
            pieces,
        }
    }
}

fn compare_points(a: &Point3<f64>, b: &Point3<f64>) -> std::cmp::Ordering {
    (a.x.total_cmp(&b.x))
        .then(a.y.total_cmp(&b.y))
        .then(a.z.total_cmp(&b.z))
}

/// The part of the solid within a box.
struct Cell {
    low: Point3<f64>,
    high: Point3<f64>,
    /// The solid's surface within the box, as convex polygons.
    polygons: Vec<Vec<Point3<f64>>>,
    /// conv(S n B)
    hull: ConvexPiece,
    /// Largest distance of the hull outside the solid at sampled points \[m\].
    overfill: f64,
}

impl Cell {
    /// `None` where the box holds no volume of the solid.
    fn new(
        low: Point3<f64>,
        high: Point3<f64>,
        polygons: Vec<Vec<Point3<f64>>>,
        signed_distance: &dyn Fn(&Point3<f64>) -> f64,
    ) -> Option<Self> {
        // The extreme points of S n B: those of the surface within B, and the corners of B within S.
        let mut points: Vec<_> = polygons.iter().flatten().copied().collect();
        points.extend(corners(&low, &high).filter(|p| signed_distance(p) < 0.0));
        let hull = ConvexPiece::hull_of(&points)?;
        let spacing = ((high - low).norm() / 12.0).max(1e-3);
        let overfill = hull
            .surface_samples(spacing)
            .map(|p| signed_distance(&p))
            .fold(0.0, f64::max);
        Some(Self {
            low,
            high,
            polygons,
            hull,
            overfill,
        })
    }

    fn is_smallest(&self) -> bool {
        (self.high - self.low).max() <= SMALLEST_SIDE
    }

    /// The two halves at the best of the candidate planes.
    fn cut(self, signed_distance: &dyn Fn(&Point3<f64>) -> f64) -> [Option<Self>; 2] {
        let mut best = (f64::INFINITY, 0, 0.0);
        let total: usize = self.polygons.iter().map(Vec::len).sum();
        let stride = total.div_ceil(SCORING_POINTS).max(1);
        for axis in 0..3 {
            if self.high[axis] - self.low[axis] <= SMALLEST_SIDE {
                continue;
            }
            for at in self.candidates(axis, stride) {
                let off_center =
                    ((at - self.low[axis]) / (self.high[axis] - self.low[axis]) - 0.5).abs();
                let score = (1.0 + BALANCE * off_center)
                    * self.hull_volume_after_cut(axis, at, stride, signed_distance);
                if score < best.0 {
                    best = (score, axis, at);
                }
            }
        }
        let (_, axis, at) = best;
        let (mut below, mut above) = (Vec::new(), Vec::new());
        for polygon in &self.polygons {
            let (low_part, high_part) = clip(polygon, axis, at);
            below.extend(low_part);
            above.extend(high_part);
        }
        let (mut middle_high, mut middle_low) = (self.high, self.low);
        middle_high[axis] = at;
        middle_low[axis] = at;
        [
            Self::new(self.low, middle_high, below, signed_distance),
            Self::new(middle_low, self.high, above, signed_distance),
        ]
    }

    /// Planes across `axis` worth trying: at fixed fractions of the side, and at the surface's own corners that are
    /// nearest to either end and in the middle, since the best cut of a wall is along its inner face.
    fn candidates(&self, axis: usize, stride: usize) -> Vec<f64> {
        let (low, high) = (self.low[axis], self.high[axis]);
        let margin = 1e-3 * (high - low);
        let mut corners: Vec<_> = (self.polygons.iter().flatten().step_by(stride))
            .map(|p| p[axis])
            .filter(|x| (low + margin..=high - margin).contains(x))
            .collect();
        corners.sort_by(f64::total_cmp);
        let own = [0, corners.len() / 2, corners.len().wrapping_sub(1)];
        CUT_FRACTIONS
            .map(|fraction| low + fraction * (high - low))
            .into_iter()
            .chain(own.iter().filter_map(|&i| corners.get(i).copied()))
            .collect()
    }

    /// Total volume of the hulls of both sides of the plane x\[axis\] = at, from every `stride`-th point \[m^3\].
    fn hull_volume_after_cut(
        &self,
        axis: usize,
        at: f64,
        stride: usize,
        signed_distance: &dyn Fn(&Point3<f64>) -> f64,
    ) -> f64 {
        let (mut below, mut above) = (Vec::new(), Vec::new());
        let mut put = |p: Point3<f64>| {
            if p[axis] <= at {
                below.push(p);
            }
            if p[axis] >= at {
                above.push(p);
            }
        };
        let mut index = 0;
        for polygon in &self.polygons {
            for (i, a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                if (a[axis] < at) != (b[axis] < at) {
                    put(crossing(a, &b, axis, at));
                }
                index += 1;
                if index % stride == 0 {
                    put(*a);
                }
            }
        }
        let (mut middle_high, mut middle_low) = (self.high, self.low);
        middle_high[axis] = at;
        middle_low[axis] = at;
        for corner in corners(&self.low, &middle_high).chain(corners(&middle_low, &self.high)) {
            if signed_distance(&corner) < 0.0 {
                put(corner);
            }
        }
        [below, above]
            .iter()
            .filter_map(|points| ConvexPiece::hull_of(points))
            .map(|hull| hull.volume())
            .sum()
    }
}

// The queue hands out the cell with the largest overfill first.
impl Ord for Cell {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.overfill
            .total_cmp(&other.overfill)
            .then_with(|| compare_points(&self.low, &other.low))
            .then_with(|| compare_points(&self.high, &other.high))
    }
}
impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Cell {}

fn corners(low: &Point3<f64>, high: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    let (low, high) = (*low, *high);
    (0..8).map(move |bits| {
        let pick = |axis: usize| {
            if bits >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        Point3::new(pick(0), pick(1), pick(2))
    })
}
