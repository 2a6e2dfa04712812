//! A hand of rigid links: a kinematic tree with solids, contact points and spheres on its bodies.

use std::ops::Range;

use graspd_geom::{Rigid, SignedDistance, TriangleMesh, Vec3};
use graspd_settings::{Ranges, Validate, between, ranges};
use nalgebra::Isometry3;

use crate::contact_points::{self, SurfacePoint};
use crate::mirroring::{Reflection, mirrored_name};
use crate::part::Part;
use crate::self_collision::{self, Sphere};
use crate::{
    CollisionSpheres, ContactPoints, Hand, HandError, HandPose, HandScratch, JacobianRows,
    KinematicTree, Limit, PalmFrame, PointBuffer, PointForces, PosedHand,
};

/// How finely a hand is covered with contact points and spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct HandOptions {
    /// About how many contact points to spread over the outer surface; 3000 in the paper.
    pub contact_points: usize,
    /// At most this many spheres stand for the hand where it might intersect itself; 0 switches that off.
    pub collision_spheres: usize,
    /// At most this many pairs of spheres are looked at.
    pub collision_pairs: usize,
    /// Seed of whatever is sampled.
    pub seed: u64,
}

impl Default for HandOptions {
    fn default() -> Self {
        Self {
            contact_points: 3000,
            collision_spheres: 160,
            collision_pairs: 4000,
            seed: 0,
        }
    }
}

impl Validate for HandOptions {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            contact_points: between(8.0, 200_000.0),
            collision_spheres: between(0.0, 1000.0),
        }
    }
}

/// What a hand of rigid links is made from.
#[derive(Clone, Debug)]
pub struct HandDescription {
    /// Its name, as records give it.
    pub name: String,
    /// Its links and joints.
    pub tree: KinematicTree,
    /// The closed solids on its bodies.
    pub parts: Vec<Part>,
    /// The fully open hand, `[n]`.
    pub open: Vec<f64>,
    /// The palm.
    pub palm: PalmFrame,
    /// What had to be guessed or mended, for whoever inspects the hand.
    pub notes: Vec<String>,
}

/// A hand of rigid links, such as a URDF file describes.
#[derive(Clone, Debug)]
pub struct ArticulatedHand {
    description: HandDescription,
    contacts: ContactPoints,
    /// Points of one body: whole blocks of [`POINT_PADDING`](crate::POINT_PADDING).
    pub(crate) contact_ranges: Vec<(usize, Range<usize>)>,
    pub(crate) local_points: PointBuffer<f64>,
    local_normals: PointBuffer<f64>,
    /// The body of each vertex of the surface.
    pub(crate) vertex_bodies: Vec<u32>,
    pub(crate) spheres: CollisionSpheres,
    pub(crate) sphere_centers: Vec<Vec3<f64>>,
    /// See [`Hand::closing_overrides`].
    closing: Vec<Option<f64>>,
}

impl ArticulatedHand {
    /// Spreads contact points and spheres over the described hand.
    ///
    /// # Errors
    /// [`HandError::BadOption`], [`HandError::OpenPart`], or [`HandError::NoGeometry`] where there is no surface to
    /// touch with.
    ///
    /// # Panics
    /// If `description.open` or a part's body does not fit the tree.
    pub fn new(description: HandDescription, options: &HandOptions) -> Result<Self, HandError> {
        options.validate()?;
        let tree = &description.tree;
        assert_eq!(description.open.len(), tree.articulation_names().len());
        let mut poses = vec![Rigid::identity(); tree.body_count()];
        tree.forward(&Rigid::identity(), &description.open, &mut poses);
        let solids = description
            .parts
            .iter()
            .map(|part| {
                SignedDistance::new(&part.mesh).map_err(|error| HandError::OpenPart {
                    body: tree.body_names()[part.body].clone(),
                    error,
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let points = contact_points::spread(&description.parts, &solids, &poses, options)?;
        let spheres = self_collision::fit(&description, &solids, &points, &poses, options);
        Ok(Self::assemble(description, points, spheres))
    }

    fn assemble(
        description: HandDescription,
        points: Vec<SurfacePoint>,
        (spheres, pairs): (Vec<Sphere>, Vec<[u32; 2]>),
    ) -> Self {
        let padded = contact_points::padded_by_body(&points);
        let len = padded.points.len();
        let mut hand = Self {
            contacts: ContactPoints {
                weight: padded.weight,
                body: padded.points.iter().map(|p| p.body as u32).collect(),
                count: points.len(),
            },
            contact_ranges: padded.ranges,
            local_points: PointBuffer::zeros(len),
            local_normals: PointBuffer::zeros(len),
            spheres: CollisionSpheres {
                radius: spheres.iter().map(|s| s.radius).collect(),
                body: spheres.iter().map(|s| s.body as u32).collect(),
                pairs,
            },
            sphere_centers: spheres.iter().map(|s| s.center).collect(),
            vertex_bodies: (description.parts.iter())
                .flat_map(|part| std::iter::repeat_n(part.body as u32, part.mesh.vertices.len()))
                .collect(),
            closing: Vec::new(),
            description,
        };
        for (index, point) in padded.points.iter().enumerate() {
            hand.local_points.set(index, point.position);
            hand.local_normals.set(index, point.normal);
        }
        hand
    }

    /// The mirror image: kinematics, meshes, contact points, spheres and palm reflected at the plane of the palm's
    /// normal and finger direction. Joints keep their names, limits and the sense in which they close.
    pub fn mirrored(&self) -> Self {
        let reflection = Reflection::across(&self.description.palm);
        let reflected = |points: &PointBuffer<f64>| {
            let mut mirrored = points.clone();
            reflection.points(points, &mut mirrored);
            mirrored
        };
        let local_points = reflected(&self.local_points);
        let description = &self.description;
        let mirrored_part = |part: &Part| Part {
            body: part.body,
            mesh: reflection.mesh(&part.mesh),
        };
        Self {
            description: HandDescription {
                name: mirrored_name(&description.name),
                tree: description.tree.mirrored(reflection),
                parts: description.parts.iter().map(mirrored_part).collect(),
                palm: reflection.palm(&description.palm),
                ..description.clone()
            },
            local_points,
            local_normals: reflected(&self.local_normals),
            sphere_centers: (self.sphere_centers.iter())
                .map(|center| reflection.vector(*center))
                .collect(),
            ..self.clone()
        }
    }

    /// Leaves out the pairs of spheres of two bodies, which then may overlap.
    pub(crate) fn allow_overlap(&mut self, a: usize, b: usize) {
        let bodies = &self.spheres.body;
        let of = |sphere: u32| bodies[sphere as usize] as usize;
        self.spheres.pairs.retain(|&[s, t]| {
            let pair = [of(s), of(t)];
            pair != [a, b] && pair != [b, a]
        });
    }

    /// Lays down which way joints close.
    pub(crate) fn describe_closing(&mut self, closing: Vec<Option<f64>>) {
        self.closing = closing;
    }

    /// The links and joints.
    pub fn tree(&self) -> &KinematicTree {
        &self.description.tree
    }
    /// The closed solids on the bodies.
    pub fn parts(&self) -> &[Part] {
        &self.description.parts
    }
    /// Position of each contact point in its body's frame \[m\], `[n]` with padding.
    pub fn local_contact_points(&self) -> &PointBuffer<f64> {
        &self.local_points
    }
    /// Outward unit normal at each contact point in its body's frame, `[n]` with padding.
    pub fn local_contact_normals(&self) -> &PointBuffer<f64> {
        &self.local_normals
    }
    /// Center of each collision sphere in its body's frame \[m\], `[s]`.
    pub fn local_sphere_centers(&self) -> &[Vec3<f64>] {
        &self.sphere_centers
    }
    /// Pose of the link named `link` in the object frame; `None` if there is no such link.
    pub fn link_pose(&self, pose: &HandPose, link: &str) -> Option<Rigid<f64>> {
        let frame = self.tree().links().iter().find(|l| l.name == link)?;
        Some(self.body_poses(pose)[frame.body].compose(&frame.placement))
    }
}

impl Hand for ArticulatedHand {
    fn name(&self) -> &str {
        &self.description.name
    }
    fn articulation_names(&self) -> &[String] {
        self.tree().articulation_names()
    }
    fn limits(&self) -> Option<&[Limit]> {
        Some(self.tree().limits())
    }
    fn open_articulation(&self) -> &[f64] {
        &self.description.open
    }
    fn body_names(&self) -> &[String] {
        self.tree().body_names()
    }
    fn palm(&self) -> &PalmFrame {
        &self.description.palm
    }
    fn contact_points(&self) -> &ContactPoints {
        &self.contacts
    }
    fn collision_spheres(&self) -> &CollisionSpheres {
        &self.spheres
    }
    fn surface(&self, pose: &HandPose) -> TriangleMesh {
        let poses: Vec<Isometry3<f64>> = self
            .body_poses(pose)
            .into_iter()
            .map(Isometry3::from)
            .collect();
        let mut surface = TriangleMesh::default();
        for part in self.parts() {
            surface.append(&part.mesh.transformed(&poses[part.body]));
        }
        surface
    }
    fn place(&self, pose: &HandPose, posed: &mut PosedHand) {
        self.place_points(pose, posed);
    }
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        pulls: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        self.rows_of(pose, posed, pulls, rows);
    }
    fn rigid_parts(&self) -> Vec<Part> {
        self.parts().to_vec()
    }
    fn body_poses(&self, pose: &HandPose) -> Vec<Rigid<f64>> {
        let mut poses = vec![Rigid::identity(); self.tree().body_count()];
        let base = Rigid {
            rotation: pose.rotation.to_matrix(),
            translation: pose.translation,
        };
        self.tree().forward(&base, &pose.articulation, &mut poses);
        poses
    }
    fn notes(&self) -> &[String] {
        &self.description.notes
    }
    fn coupled_joints(&self) -> Vec<String> {
        self.tree().coupled_joints()
    }
    fn closing_overrides(&self) -> &[Option<f64>] {
        &self.closing
    }
    fn new_scratch(&self) -> HandScratch {
        let bodies = self.tree().body_count();
        HandScratch {
            body_poses: vec![Rigid::identity(); bodies],
            forces: vec![Vec3::zero(); bodies],
            torques: vec![Vec3::zero(); bodies],
            contact_remainder: PointBuffer::zeros(self.local_points.len()),
            ..HandScratch::default()
        }
    }
}
