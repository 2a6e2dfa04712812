//! Left hands from right ones.

use graspd_ad::Element;
use graspd_geom::{Mat3, Quaternion, Rigid, TriangleMesh, Vec3};
use nalgebra::{DMatrix, Point3, Vector3};

use crate::double_single::set_double_single;
use crate::{
    CollisionSpheres, ContactPoints, Hand, HandPose, HandScratch, JacobianRows, Kinematics, Limit,
    PalmFrame, Part, PointBuffer, PointForces, PoseGradient, PosedHand,
};

/// A reflection at a plane through the origin: S = I - 2 n n^T.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reflection {
    normal: Vec3<f64>,
}

impl Reflection {
    /// At the plane of a palm's normal and finger direction, which swaps its left and right.
    pub(crate) fn across(palm: &PalmFrame) -> Self {
        let side = palm.normal.cross(&palm.fingers).normalize();
        Self {
            normal: side.into(),
        }
    }

    /// S v.
    pub(crate) fn vector(self, v: Vec3<f64>) -> Vec3<f64> {
        v - self.normal * (2.0 * self.normal.dot(v))
    }

    /// -S w, which is what becomes of rotation vectors and other axial vectors: S exp(w) S = exp(-S w).
    pub(crate) fn axial(self, w: Vec3<f64>) -> Vec3<f64> {
        -self.vector(w)
    }

    /// S M S.
    pub(crate) fn rigid(self, motion: &Rigid<f64>) -> Rigid<f64> {
        // S R S for R's rows r_i: rows of S (S r_i stacked), both sides being symmetric.
        let right = Mat3 {
            rows: motion.rotation.rows.map(|row| self.vector(row)),
        };
        let columns = right.transpose().rows.map(|column| self.vector(column));
        Rigid {
            rotation: Mat3 { rows: columns }.transpose(),
            translation: self.vector(motion.translation),
        }
    }

    fn quaternion(self, q: Quaternion<f64>) -> Quaternion<f64> {
        let axis = self.axial(Vec3::new(q.x, q.y, q.z));
        Quaternion {
            w: q.w,
            x: axis.x,
            y: axis.y,
            z: axis.z,
        }
    }

    /// The mesh on the other side, still outward oriented.
    pub(crate) fn mesh(self, mesh: &TriangleMesh) -> TriangleMesh {
        let reflected = |p: &Point3<f64>| Point3::from(self.vector((*p).into()));
        TriangleMesh {
            vertices: mesh.vertices.iter().map(reflected).collect(),
            faces: mesh.faces.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        }
    }

    pub(crate) fn palm(self, palm: &PalmFrame) -> PalmFrame {
        let direction = |v: Vector3<f64>| Vector3::from(self.vector(v.into()));
        PalmFrame {
            center: Point3::from(self.vector(palm.center.into())),
            normal: direction(palm.normal),
            fingers: direction(palm.fingers),
        }
    }

    pub(crate) fn points<E: Element>(self, from: &PointBuffer<E>, to: &mut PointBuffer<E>) {
        for index in 0..from.len() {
            to.set(index, self.vector(from.get(index)));
        }
    }

    fn pose(self, pose: &HandPose) -> HandPose {
        self.pose_in(pose, Vec::new())
    }

    /// The pose on the other side, its articulation in the vector given.
    fn pose_in(self, pose: &HandPose, mut articulation: Vec<f64>) -> HandPose {
        articulation.clear();
        articulation.extend_from_slice(&pose.articulation);
        HandPose {
            translation: self.vector(pose.translation),
            rotation: self.quaternion(pose.rotation),
            articulation,
        }
    }
}

/// What a mirrored hand is called: left for right and the other way round, or with `_mirrored` added.
pub(crate) fn mirrored_name(name: &str) -> String {
    const PAIRS: [(&str, &str); 3] = [("right", "left"), ("Right", "Left"), ("RIGHT", "LEFT")];
    for (right, left) in PAIRS {
        if name.contains(right) {
            return name.replace(right, left);
        }
        if name.contains(left) {
            return name.replace(left, right);
        }
    }
    match name.strip_suffix("_mirrored") {
        Some(original) => original.to_owned(),
        None => format!("{name}_mirrored"),
    }
}

/// The mirror image of any hand: its articulation means the same, and for a hand at `(t, R, theta)` every point is
/// S p(S t, S R S, theta), where p is the original's and S the reflection at the plane of its palm's normal and
/// finger direction.
pub struct MirroredHand {
    original: Box<dyn Hand>,
    reflection: Reflection,
    name: String,
    palm: PalmFrame,
}

impl MirroredHand {
    /// The mirror image of `original`.
    pub fn new(original: Box<dyn Hand>) -> Self {
        let reflection = Reflection::across(original.palm());
        Self {
            reflection,
            name: mirrored_name(original.name()),
            palm: reflection.palm(original.palm()),
            original,
        }
    }
}

/// Copies of a mirrored hand's inputs on the original's side, kept in [`HandScratch`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Reflected<E> {
    articulation: Vec<f64>,
    contacts: PointBuffer<E>,
    contact_gradient: PointBuffer<E>,
    spheres: PointBuffer<E>,
    sphere_gradient: PointBuffer<E>,
}

impl<E: Element> Reflected<E> {
    fn zeros(contacts: usize, spheres: usize) -> Self {
        Self {
            articulation: Vec::new(),
            contacts: PointBuffer::zeros(contacts),
            contact_gradient: PointBuffer::zeros(contacts),
            spheres: PointBuffer::zeros(spheres),
            sphere_gradient: PointBuffer::zeros(spheres),
        }
    }
}

/// The precisions that a mirrored hand comes in: where its copies are kept.
trait Precision: Element {
    fn reflected(scratch: &mut HandScratch) -> &mut Reflected<Self>;
    /// The contact points of the original, and what rounding left of them in `scratch`, to the other side.
    fn contacts(
        reflection: Reflection,
        scratch: &mut HandScratch,
        from: &PointBuffer<Self>,
        to: &mut PointBuffer<Self>,
    );
}
impl Precision for f32 {
    fn reflected(scratch: &mut HandScratch) -> &mut Reflected<f32> {
        &mut scratch.reflected_f32
    }
    fn contacts(
        reflection: Reflection,
        scratch: &mut HandScratch,
        from: &PointBuffer<f32>,
        to: &mut PointBuffer<f32>,
    ) {
        let remainder = &mut scratch.contact_remainder;
        for index in 0..from.len() {
            let point = from.get(index) + remainder.get(index);
            set_double_single(to, remainder, index, reflection.vector(point));
        }
    }
}
impl Precision for f64 {
    fn reflected(scratch: &mut HandScratch) -> &mut Reflected<f64> {
        &mut scratch.reflected_f64
    }
    fn contacts(
        reflection: Reflection,
        _scratch: &mut HandScratch,
        from: &PointBuffer<f64>,
        to: &mut PointBuffer<f64>,
    ) {
        reflection.points(from, to);
    }
}

impl<E: Precision> Kinematics<E> for MirroredHand
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    ) {
        let mut copies = std::mem::take(E::reflected(scratch));
        let articulation = std::mem::take(&mut copies.articulation);
        let mirrored = self.reflection.pose_in(pose, articulation);
        self.original.forward(
            &mirrored,
            scratch,
            &mut copies.contacts,
            &mut copies.spheres,
        );
        E::contacts(self.reflection, scratch, &copies.contacts, contacts);
        self.reflection.points(&copies.spheres, spheres);
        copies.articulation = mirrored.articulation;
        *E::reflected(scratch) = copies;
    }

    fn pullback(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &PointBuffer<E>,
        contact_gradient: &PointBuffer<E>,
        spheres: &PointBuffer<E>,
        sphere_gradient: &PointBuffer<E>,
        gradient: &mut PoseGradient,
    ) {
        let mut copies = std::mem::take(E::reflected(scratch));
        let articulation = std::mem::take(&mut copies.articulation);
        let mirrored = self.reflection.pose_in(pose, articulation);
        for (from, to) in [
            (contacts, &mut copies.contacts),
            (contact_gradient, &mut copies.contact_gradient),
            (spheres, &mut copies.spheres),
            (sphere_gradient, &mut copies.sphere_gradient),
        ] {
            self.reflection.points(from, to);
        }
        self.original.pullback(
            &mirrored,
            scratch,
            &copies.contacts,
            &copies.contact_gradient,
            &copies.spheres,
            &copies.sphere_gradient,
            gradient,
        );
        copies.articulation = mirrored.articulation;
        *E::reflected(scratch) = copies;
        gradient.translation = self.reflection.vector(gradient.translation);
        gradient.rotation = self.reflection.axial(gradient.rotation);
    }
}

impl Hand for MirroredHand {
    fn name(&self) -> &str {
        &self.name
    }
    fn articulation_names(&self) -> &[String] {
        self.original.articulation_names()
    }
    fn limits(&self) -> Option<&[Limit]> {
        self.original.limits()
    }
    fn open_articulation(&self) -> &[f64] {
        self.original.open_articulation()
    }
    fn body_names(&self) -> &[String] {
        self.original.body_names()
    }
    fn palm(&self) -> &PalmFrame {
        &self.palm
    }
    fn contact_points(&self) -> &ContactPoints {
        self.original.contact_points()
    }
    fn collision_spheres(&self) -> &CollisionSpheres {
        self.original.collision_spheres()
    }
    fn surface(&self, pose: &HandPose) -> TriangleMesh {
        self.reflection
            .mesh(&self.original.surface(&self.reflection.pose(pose)))
    }
    fn place(&self, pose: &HandPose, posed: &mut PosedHand) {
        let PosedHand {
            vertices,
            spheres,
            original,
            ..
        } = posed;
        let original = original.get_or_insert_default();
        self.original.place(&self.reflection.pose(pose), original);
        let reflected = |p: &Point3<f64>| Point3::from(self.reflection.vector((*p).into()));
        for (points, from) in [(vertices, &original.vertices), (spheres, &original.spheres)] {
            points.clear();
            points.extend(from.iter().map(reflected));
        }
    }
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        pulls: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        let Some(original) = &posed.original else {
            unreachable!("place has filled it");
        };
        let reflected = |pull: &PointForces| PointForces {
            points: pull
                .points
                .map(|(p, force)| (p, self.reflection.vector(force))),
        };
        let reflected: Vec<PointForces> = pulls.iter().map(reflected).collect();
        let pose_of_original = self.reflection.pose(pose);
        self.original
            .jacobian_rows(&pose_of_original, original, &reflected, rows);
        rows.set_base(pulls, posed, pose.translation);
    }
    fn jacobian_basis(&self) -> Option<DMatrix<f64>> {
        self.original.jacobian_basis()
    }
    fn rigid_parts(&self) -> Vec<Part> {
        let reflected = |part: Part| Part {
            mesh: self.reflection.mesh(&part.mesh),
            ..part
        };
        let parts = self.original.rigid_parts();
        parts.into_iter().map(reflected).collect()
    }
    fn body_poses(&self, pose: &HandPose) -> Vec<Rigid<f64>> {
        let poses = self.original.body_poses(&self.reflection.pose(pose));
        poses
            .iter()
            .map(|pose| self.reflection.rigid(pose))
            .collect()
    }
    fn notes(&self) -> &[String] {
        self.original.notes()
    }
    fn is_soft(&self) -> bool {
        self.original.is_soft()
    }
    fn shape_parameters(&self) -> Option<&[f64]> {
        self.original.shape_parameters()
    }
    fn coupled_joints(&self) -> Vec<String> {
        self.original.coupled_joints()
    }
    fn closing_overrides(&self) -> &[Option<f64>] {
        self.original.closing_overrides()
    }
    fn new_scratch(&self) -> HandScratch {
        let contacts = self.contact_points().weight.len();
        let spheres = self.collision_spheres().radius.len();
        HandScratch {
            reflected_f32: Reflected::zeros(contacts, spheres),
            reflected_f64: Reflected::zeros(contacts, spheres),
            ..self.original.new_scratch()
        }
    }
}
