//! A hand of rigid links: a kinematic tree with solids, contact points and spheres on its bodies.

use graspd_geom::{Rigid, TriangleMesh, Vec3};
use graspd_settings::Validate;

use nalgebra::Isometry3;

use crate::body_motion::BodyLoads;
use crate::body_points::{self, BodyPoints};
use crate::mirroring::{Reflection, mirrored_name};
use crate::{
    CollisionSpheres, ContactPoints, Hand, HandError, HandOptions, HandPose, HandScratch,
    HandState, JacobianRows, KinematicTree, Limit, PalmFrame, Part, PointBuffer, PointForces,
    PosedHand,
};

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
    pub(crate) points: BodyPoints,
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
        let HandDescription {
            tree, parts, open, ..
        } = &description;
        assert_eq!(open.len(), tree.articulation_names().len());
        Ok(Self {
            points: BodyPoints::new(parts, tree, open, options)?,
            closing: Vec::new(),
            description,
        })
    }

    /// Returns the mirror image: kinematics, meshes, contact points, spheres and palm reflected at the plane of the
    /// palm's normal and finger direction. Joints keep their names, limits and the sense in which they close.
    pub fn mirrored(&self) -> Self {
        let reflection = Reflection::across(&self.description.palm);
        let reflected = |points: &PointBuffer<f64>| {
            let mut mirrored = points.clone();
            reflection.points(points, &mut mirrored);
            mirrored
        };
        let (description, points) = (&self.description, &self.points);
        let mirrored_part = |part: &Part| Part {
            body: part.body,
            mesh: reflection.mesh(&part.mesh),
        };
        let parts: Vec<Part> = description.parts.iter().map(mirrored_part).collect();
        Self {
            points: BodyPoints {
                positions: reflected(&points.positions),
                normals: reflected(&points.normals),
                sphere_centers: (points.sphere_centers.iter())
                    .map(|center| reflection.vector(*center))
                    .collect(),
                faces: body_points::faces(&parts),
                ..points.clone()
            },
            description: HandDescription {
                name: mirrored_name(&description.name),
                tree: description.tree.mirrored(reflection),
                parts,
                palm: reflection.palm(&description.palm),
                ..description.clone()
            },
            closing: self.closing.clone(),
        }
    }

    /// Leaves out the pairs of spheres of two bodies, which then may overlap.
    pub(crate) fn allow_overlap(&mut self, a: usize, b: usize) {
        let spheres = &mut self.points.spheres;
        let bodies = &spheres.body;
        let of = |sphere: u32| bodies[sphere as usize] as usize;
        spheres.pairs.retain(|&[s, t]| {
            let pair = [of(s), of(t)];
            pair != [a, b] && pair != [b, a]
        });
    }

    /// Lays down which way joints close.
    pub(crate) fn describe_closing(&mut self, closing: Vec<Option<f64>>) {
        self.closing = closing;
    }

    /// Returns the links and joints.
    pub fn tree(&self) -> &KinematicTree {
        &self.description.tree
    }
    /// Returns the closed solids on the bodies.
    pub fn parts(&self) -> &[Part] {
        &self.description.parts
    }
    /// Returns the position of each contact point in its body's frame \[m\], `[n]` with padding.
    pub fn local_contact_points(&self) -> &PointBuffer<f64> {
        &self.points.positions
    }
    /// Outward unit normal at each contact point in its body's frame, `[n]` with padding.
    pub fn local_contact_normals(&self) -> &PointBuffer<f64> {
        &self.points.normals
    }
    /// Returns the centre of each collision sphere in its body's frame \[m\], `[s]`.
    pub fn local_sphere_centers(&self) -> &[Vec3<f64>] {
        &self.points.sphere_centers
    }
    /// Computes the pose of the link named `link` in the object frame; `None` if there is no such link.
    pub fn link_pose(&self, pose: &HandPose, link: &str) -> Option<Rigid<f64>> {
        let frame = self.tree().links().iter().find(|l| l.name == link)?;
        let bodies = self.tree().poses(&pose.base(), &pose.articulation);
        Some(bodies[frame.body].compose(&frame.placement))
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
        &self.points.contacts
    }
    fn collision_spheres(&self) -> &CollisionSpheres {
        &self.points.spheres
    }
    fn faces(&self) -> &[[u32; 3]] {
        &self.points.faces
    }
    fn pose(&self, pose: &HandPose, posed: &mut PosedHand) {
        self.place(pose, posed);
    }
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        forces: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        self.rows_of(pose, posed, forces, rows);
    }
    /// By quaternions, whose roundings differ from those of [`Hand::pose`]: samples of surfaces are drawn from these.
    fn surface(&self, pose: &HandPose) -> TriangleMesh {
        let bodies = self.tree().poses(&pose.base(), &pose.articulation);
        let mut surface = TriangleMesh::default();
        for part in self.parts() {
            surface.append(&part.mesh.transformed(&Isometry3::from(bodies[part.body])));
        }
        surface
    }
    fn rigid_parts(&self) -> Vec<Part> {
        self.parts().to_vec()
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
        HandScratch {
            contact_remainder: PointBuffer::zeros(self.points.positions.len()),
            state: HandState::new(BodyLoads::new(self.tree().body_count())),
        }
    }
}
