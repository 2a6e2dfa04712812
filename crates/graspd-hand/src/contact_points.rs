//! Contact points: spread evenly over the outer surface of a hand of rigid links.

use std::ops::Range;

use graspd_geom::{Rigid, SignedDistance, TriangleMesh, Vec3};
use nalgebra::{Isometry3, Point3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::part::Part;
use crate::{HandError, HandOptions, POINT_PADDING};

/// A surface point is buried if the point this far above it is inside another part \[m\]: nothing fits in between.
const CLEARANCE: f64 = 5e-4;
/// Surfaces of two parts this near are one surface \[m\].
const SAME_SURFACE: f64 = 1e-6;

/// A point of the outer surface, in its body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePoint {
    pub(crate) body: usize,
    pub(crate) position: Vec3<f64>,
    pub(crate) normal: Vec3<f64>,
}

/// About `options.contact_points` points spread evenly over what can be touched of the parts when the bodies have
/// the given poses: points buried inside another part are left out. Sorted by body.
pub(crate) fn spread(
    parts: &[Part],
    solids: &[SignedDistance],
    poses: &[Rigid<f64>],
    options: &HandOptions,
) -> Result<Vec<SurfacePoint>, HandError> {
    let area: f64 = parts.iter().map(|part| part.mesh.area()).sum();
    if !(area > 0.0 && area.is_finite()) {
        return Err(HandError::NoGeometry);
    }
    let motions: Vec<Isometry3<f64>> = poses.iter().map(|&pose| pose.into()).collect();
    let spread_with = |density: f64| {
        let mut points = Vec::new();
        for (index, part) in parts.iter().enumerate() {
            let count = (density * part.mesh.area()).round() as usize;
            let mut random = ChaCha8Rng::seed_from_u64(options.seed);
            random.set_stream(index as u64);
            let samples = sample_evenly(&part.mesh, count, &mut random);
            points.extend(
                samples
                    .into_iter()
                    .filter(|&(position, normal)| {
                        is_exposed(index, position, normal, parts, solids, &motions)
                    })
                    .map(|(position, normal)| SurfacePoint {
                        body: part.body,
                        position: position.into(),
                        normal: normal.into(),
                    }),
            );
        }
        points
    };
    // How much is buried is only known once points have been spread.
    let wanted = options.contact_points as f64;
    let exposed = spread_with(wanted / area).len();
    if exposed == 0 {
        return Err(HandError::NoGeometry);
    }
    let mut points = spread_with(wanted / area * wanted / exposed as f64);
    points.sort_by_key(|point| point.body);
    Ok(points)
}

fn is_exposed(
    index: usize,
    position: Point3<f64>,
    normal: Vector3<f64>,
    parts: &[Part],
    solids: &[SignedDistance],
    motions: &[Isometry3<f64>],
) -> bool {
    let body = parts[index].body;
    let above = position + normal * CLEARANCE;
    (0..parts.len())
        .filter(|&other| other != index)
        .all(|other| {
            let other_body = parts[other].body;
            let into_other = |p: Point3<f64>| {
                if other_body == body {
                    p
                } else {
                    motions[other_body].inverse_transform_point(&(motions[body] * p))
                }
            };
            let (low, high) = solids[other].bounds();
            let (above, position) = (into_other(above), into_other(position));
            if (low - position).sup(&(position - high)).max() > CLEARANCE {
                return true;
            }
            // Where two parts share a stretch of surface, the first one keeps it.
            let is_shared = other < index
                && solids[other]
                    .closest_within(&position, SAME_SURFACE)
                    .is_some();
            !is_shared && !solids[other].is_inside(&above)
        })
}

/// Points grouped into whole blocks of [`POINT_PADDING`] points of one body.
pub(crate) struct PaddedPoints {
    pub(crate) points: Vec<SurfacePoint>,
    pub(crate) weight: Vec<f32>,
    pub(crate) ranges: Vec<(usize, Range<usize>)>,
}

/// Pads the points of each body with copies of its last one; `points` must be sorted by body.
pub(crate) fn padded_by_body(points: &[SurfacePoint]) -> PaddedPoints {
    let mut padded = PaddedPoints {
        points: Vec::new(),
        weight: Vec::new(),
        ranges: Vec::new(),
    };
    for group in points.chunk_by(|a, b| a.body == b.body) {
        let start = padded.points.len();
        padded.points.extend_from_slice(group);
        padded.weight.resize(start + group.len(), 1.0);
        let end = start + group.len().next_multiple_of(POINT_PADDING);
        padded.points.resize(end, group[group.len() - 1]);
        padded.weight.resize(end, 0.0);
        padded.ranges.push((group[0].body, start..end));
    }
    padded
}

/// About `count` points with outward unit normals, no two of them close.
fn sample_evenly(
    mesh: &TriangleMesh,
    count: usize,
    random: &mut ChaCha8Rng,
) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let mut cumulative = Vec::with_capacity(mesh.faces.len());
    let mut area = 0.0;
    for face in 0..mesh.faces.len() {
        area += 0.5 * mesh.area_vector(face).norm();
        cumulative.push(area);
    }
    let mut radius_squared = 0.7 * area / count as f64;
    let mut points: Vec<(Point3<f64>, Vector3<f64>)> = Vec::new();
    while points.len() < count {
        for _ in 0..4 * count {
            let target = area * random.random::<f64>();
            let face = cumulative
                .partition_point(|&a| a < target)
                .min(mesh.faces.len() - 1);
            let [a, b, c] = mesh.corners(face);
            let (r, s) = (random.random::<f64>().sqrt(), random.random::<f64>());
            let point = a + (b - a) * (r * (1.0 - s)) + (c - a) * (r * s);
            let is_free = points
                .iter()
                .all(|(other, _)| (other - point).norm_squared() > radius_squared);
            if is_free && points.len() < count {
                points.push((point, mesh.area_vector(face).normalize()));
            }
        }
        radius_squared *= 0.8;
    }
    points
}
