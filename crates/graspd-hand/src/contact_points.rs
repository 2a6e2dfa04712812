//! Contact points: spread evenly over the outer surface of a hand of rigid links.

use std::ops::Range;

use graspd_geom::{Rigid, SignedDistance, Vec3, sample_evenly};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::sharp_edges::{SharpEdge, points_along, sharp_edges};
use crate::{HandError, HandOptions, POINT_PADDING, Part};

/// A surface point is buried if the point this far above it is inside another part \[m\]: nothing fits in between.
const CLEARANCE: f64 = 5e-4;
/// Surfaces of two parts this near are one surface \[m\].
const SAME_SURFACE: f64 = 1e-6;

/// At most this share of the points lies on sharp edges, which would otherwise dig in between points unseen.
const EDGE_SHARE: f64 = 0.3;
/// Fewer points than this are all needed on the faces.
const MIN_POINTS_FOR_EDGES: f64 = 500.0;
/// Points spread to learn how much of the surface is buried: enough to know it to about 1 %.
const TRIAL_POINTS: f64 = 1000.0;

/// A point of the outer surface, in its body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePoint {
    pub(crate) body: usize,
    pub(crate) position: Vec3<f64>,
    pub(crate) normal: Vec3<f64>,
}

/// Spreads about `options.contact_points` points evenly over the faces and along the sharp edges of what can be
/// touched of the parts when the bodies have the given poses: points buried inside another part are left out. Sorted
/// by body.
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
    let sharp_edges: Vec<_> = parts.iter().map(|part| sharp_edges(&part.mesh)).collect();
    let edge_length: f64 = sharp_edges.iter().flatten().map(SharpEdge::length).sum();
    let spread_with = |density: f64| {
        let mut points = Vec::new();
        // No denser along an edge than over a face.
        let share = if density * area < MIN_POINTS_FOR_EDGES {
            0.0
        } else {
            EDGE_SHARE
        };
        let edge_count = (share * density * area).min(edge_length * density.sqrt());
        let edge_spacing = if edge_count > 0.0 {
            edge_length / edge_count
        } else {
            f64::INFINITY
        };
        let face_density = density - edge_count / area;
        for (index, part) in parts.iter().enumerate() {
            let count = (face_density * part.mesh.area()).round() as usize;
            // Parts of one shape should not have one pattern.
            let samples = sample_evenly(&part.mesh, count, options.seed ^ ((index as u64) << 32));
            let on_faces = samples.into_iter().map(|s| (s.point, s.normal));
            let on_edges = points_along(&sharp_edges[index], edge_spacing);
            points.extend(
                on_faces
                    .chain(on_edges)
                    .filter(|&(p, normal)| is_exposed(index, p, normal, parts, solids, &motions))
                    .map(|(p, normal)| SurfacePoint {
                        body: part.body,
                        position: p.into(),
                        normal: normal.into(),
                    }),
            );
        }
        points
    };
    // How much is buried is only known once points have been spread.
    let wanted = options.contact_points as f64;
    let trial = wanted.min(TRIAL_POINTS);
    let exposed = spread_with(trial / area).len();
    let mut points = spread_with(wanted / area * trial / exposed.max(1) as f64);
    if points.is_empty() {
        return Err(HandError::NoGeometry);
    }
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
            let depth = -solids[other].signed_distance(&position);
            // Where two parts share a stretch of surface, the first one keeps it.
            let is_shared = other < index && depth >= -SAME_SURFACE;
            depth <= SAME_SURFACE && !is_shared && !solids[other].is_inside(&above)
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
