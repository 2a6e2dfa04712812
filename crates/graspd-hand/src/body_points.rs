//! What covers the solids of a hand's bodies: contact points, collision spheres and the vertices of the surface.

use std::ops::Range;

use graspd_geom::{SignedDistance, Vec3};

use crate::body_motion::BodyMotion;
use crate::contact_points;
use crate::self_collision;
use crate::{CollisionSpheres, ContactPoints, HandError, HandOptions, Part, PointBuffer};

/// Points of bodies, each in the frame of its body.
#[derive(Clone, Debug)]
pub(crate) struct BodyPoints {
    pub(crate) contacts: ContactPoints,
    /// The bodies that have contact points, and whose they are: whole blocks of
    /// [`POINT_PADDING`](crate::POINT_PADDING).
    pub(crate) contact_ranges: Vec<(usize, Range<usize>)>,
    /// Position of each contact point \[m\], and the outward unit normal there, `[n]`.
    pub(crate) positions: PointBuffer<f64>,
    pub(crate) normals: PointBuffer<f64>,
    pub(crate) spheres: CollisionSpheres,
    /// Centre of each sphere \[m\], `[s]`.
    pub(crate) sphere_centers: Vec<Vec3<f64>>,
    /// The body of each vertex of the surface, `[v]`.
    pub(crate) vertex_bodies: Vec<u32>,
    /// The triangles of the surface, `[f]`.
    pub(crate) faces: Vec<[u32; 3]>,
}

impl BodyPoints {
    /// Spreads contact points and spheres over the parts of a hand that is open at `open`.
    ///
    /// # Errors
    /// [`HandError::OpenPart`], or [`HandError::NoGeometry`] where there is no surface to touch with.
    pub(crate) fn new(
        parts: &[Part],
        motion: &dyn BodyMotion,
        open: &[f64],
        options: &HandOptions,
    ) -> Result<Self, HandError> {
        let poses = motion.body_poses(open);
        let solid = |part: &Part| {
            SignedDistance::new(&part.mesh).map_err(|error| HandError::OpenPart {
                body: motion.body_names()[part.body].clone(),
                error,
            })
        };
        let solids = parts.iter().map(solid).collect::<Result<Vec<_>, _>>()?;
        let points = contact_points::spread(parts, &solids, &poses, options)?;
        let (spheres, pairs) =
            self_collision::fit(parts, motion, &solids, &points, &poses, options);
        let padded = contact_points::padded_by_body(&points);
        let len = padded.points.len();
        let mut covered = Self {
            contacts: ContactPoints {
                weight: padded.weight,
                body: padded.points.iter().map(|p| p.body as u32).collect(),
                count: points.len(),
            },
            contact_ranges: padded.ranges,
            positions: PointBuffer::zeros(len),
            normals: PointBuffer::zeros(len),
            spheres: CollisionSpheres {
                radius: spheres.iter().map(|s| s.radius).collect(),
                body: spheres.iter().map(|s| s.body as u32).collect(),
                pairs,
            },
            sphere_centers: spheres.iter().map(|s| s.center).collect(),
            vertex_bodies: (parts.iter())
                .flat_map(|part| std::iter::repeat_n(part.body as u32, part.mesh.vertices.len()))
                .collect(),
            faces: faces(parts),
        };
        for (index, point) in padded.points.iter().enumerate() {
            covered.positions.set(index, point.position);
            covered.normals.set(index, point.normal);
        }
        Ok(covered)
    }
}

/// Joins the triangles of the parts, whose vertices follow one another.
pub(crate) fn faces(parts: &[Part]) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    let mut first = 0;
    for Part { mesh, .. } in parts {
        faces.extend(mesh.faces.iter().map(|face| face.map(|v| v + first)));
        first += mesh.vertices.len() as u32;
    }
    faces
}
