//! From a cloud to a closed mesh in the object's own frame.

use std::f64::consts::{PI, TAU};

use graspd_settings::{NOT_NEGATIVE, Ranges, Validate};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::Plane;
use super::clipping::above;
use super::registration::{Registration, registered};
use crate::{KdTree, PointCloud, PoissonSettings, poisson_surface};
use graspd_geom::{GeometryError, SignedDistance, TriangleMesh, connected_parts};
use graspd_mesh::{RepairReport, RepairSettings, repair};

/// Turns about the vertical that an alignment starts from.
const STARTS: usize = 24;
/// Vertices nearer to the table than this part of a cell are moved onto it.
const SNAP: f64 = 0.05;
/// Points that take part in an alignment.
const ALIGNED_POINTS: usize = 3_000;

/// How a cloud becomes a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReconstructionSettings {
    /// The Poisson reconstruction's.
    pub poisson: PoissonSettings,
    /// The surface is cut away where it is farther from all points than so many cells of the finest depth (and than
    /// [`ReconstructionSettings::gap`]), and the hole patched: above all under the object. Infinity keeps the whole
    /// Poisson surface, which bulges there.
    pub trim: f64,
    /// Gaps between points that are bridged in any case \[m\].
    pub gap: f64,
}

impl Default for ReconstructionSettings {
    /// Depth 6: on rendered captures as accurate as any deeper one, and twice as accurate as the paper's 5
    /// (docs/rgbd.md).
    fn default() -> Self {
        Self {
            poisson: PoissonSettings {
                depth: 6,
                ..PoissonSettings::default()
            },
            trim: 1.5,
            gap: 0.005,
        }
    }
}

impl Validate for ReconstructionSettings {
    fn ranges(&self) -> Ranges {
        let trim = Some(self.trim).filter(|trim| *trim != f64::INFINITY);
        Ranges::default()
            .with("trim", &trim, NOT_NEGATIVE)
            .with("gap", &self.gap, NOT_NEGATIVE)
            .nested("poisson", &self.poisson)
    }
}

/// A closed mesh, and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Reconstruction {
    /// Closed and outward oriented.
    pub mesh: TriangleMesh,
    /// What repair did after trimming.
    pub repair: RepairReport,
    /// Part of the area of the Poisson surface that was cut away, as not seen.
    pub trimmed: f64,
}

/// Reconstructs a closed surface from points with outward normals: screened Poisson reconstruction, cut off at the
/// table that the object stands on, if that is known, and cut away where nothing was seen, closed by [`repair`].
///
/// `name`: for errors.
///
/// # Errors
/// As [`poisson_surface`] and [`repair`].
pub fn reconstruct(
    cloud: &PointCloud,
    table: Option<&Plane>,
    settings: &ReconstructionSettings,
    name: &str,
) -> Result<Reconstruction, GeometryError> {
    settings.validate()?;
    let surface = poisson_surface(cloud, &settings.poisson)?;
    let first = cloud.points[0];
    let (low, high) = (cloud.points.iter()).fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
    let cells = f64::from(1_u32 << settings.poisson.depth);
    let cell = settings.poisson.scale * (high - low).max() / cells;
    let standing = match table {
        Some(table) => above(&surface.mesh, table, SNAP * cell),
        None => surface.mesh.clone(),
    };
    let seen = near(&standing, cloud, (settings.trim * cell).max(settings.gap));
    let repaired = repair(&seen, &RepairSettings::default(), name)?;
    Ok(Reconstruction {
        trimmed: 1.0 - seen.area() / surface.mesh.area(),
        // Parts that met in a vertex are apart when they are closed.
        mesh: largest_part(&repaired.mesh),
        repair: repaired.report,
    })
}

/// The largest connected part of the faces of a mesh with a corner within `reach` of a point, and their vertices.
fn near(mesh: &TriangleMesh, cloud: &PointCloud, reach: f64) -> TriangleMesh {
    let tree = KdTree::new(&cloud.points);
    let is_near: Vec<bool> = (mesh.vertices.par_iter())
        .map_init(Vec::new, |found, vertex| {
            tree.nearest(vertex, 1, found);
            found.iter().any(|(squared, _)| *squared <= reach * reach)
        })
        .collect();
    let mut number = vec![None; mesh.vertices.len()];
    let mut kept = TriangleMesh::default();
    for face in &mesh.faces {
        if face.iter().any(|&v| is_near[v as usize]) {
            kept.faces.push(face.map(|v| {
                *number[v as usize].get_or_insert_with(|| {
                    kept.vertices.push(mesh.vertices[v as usize]);
                    kept.vertices.len() as u32 - 1
                })
            }));
        }
    }
    largest_part(&kept)
}

/// The connected part of the greatest area: an object is in one piece.
fn largest_part(mesh: &TriangleMesh) -> TriangleMesh {
    (connected_parts(mesh).into_iter())
        .max_by(|a, b| a.area().total_cmp(&b.area()))
        .unwrap_or_default()
}

/// Finds how a cloud lies on a mesh of the same object, both standing upright (`up` in the cloud's frame, z in the
/// mesh's): from 24 turns about the vertical, the best registration. Moves the cloud's frame to the mesh's. Objects
/// that look the same when turned come to lie in one of these ways.
///
/// # Errors
/// As [`SignedDistance::new`]; [`GeometryError::CloudTooSmall`] if the two have nothing in common.
pub fn align_to_mesh(
    cloud: &PointCloud,
    up: &Vector3<f64>,
    mesh: &TriangleMesh,
) -> Result<Registration, GeometryError> {
    cloud.require_points()?;
    let distance = SignedDistance::new(mesh)?;
    let stride = cloud.points.len().div_ceil(ALIGNED_POINTS);
    let points: Vec<Point3<f64>> = cloud.points.iter().step_by(stride).copied().collect();
    let upright = UnitQuaternion::rotation_between(up, &Vector3::z())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
    let stood: Vec<Point3<f64>> = points.iter().map(|p| upright * p).collect();
    let box_of = |points: &[Point3<f64>]| {
        (points.iter()).fold((points[0], points[0]), |(l, h), p| (l.inf(p), h.sup(p)))
    };
    let (mesh_low, mesh_high) = distance.bounds();
    let mesh_middle = nalgebra::center(&mesh_low, &mesh_high);
    let nearest = |p: &Point3<f64>| {
        let closest = distance.closest(p);
        Some((closest.point, closest.normal))
    };
    let mut best: Option<Registration> = None;
    for start in 0..STARTS {
        let angle = TAU * start as f64 / STARTS as f64;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        let turned: Vec<Point3<f64>> = stood.iter().map(|p| turn * p).collect();
        let (low, high) = box_of(&turned);
        let middle = nalgebra::center(&low, &high);
        // Tops together: the lowest part may not have been seen.
        let shift = Vector3::new(
            mesh_middle.x - middle.x,
            mesh_middle.y - middle.y,
            mesh_high.z - high.z,
        );
        let motion = Isometry3::from_parts(shift.into(), turn * upright);
        if let Some(found) = registered(&points, &motion, nearest)
            && best.is_none_or(|best| found.rms < best.rms)
        {
            best = Some(found);
        }
    }
    best.ok_or(GeometryError::CloudTooSmall {
        points: 0,
        least: 6,
    })
}
