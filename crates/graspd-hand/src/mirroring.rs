//! Left hands from right ones.

use graspd_ad::Element;
use graspd_geom::{Mat3, Quaternion, Rigid, TriangleMesh, Vec3};
use nalgebra::{DMatrix, Point3, Vector3};

use crate::scratch::choose_mut;
use crate::{
    CollisionSpheres, ContactPoints, Hand, HandPose, HandScratch, HandState, JacobianRows,
    Kinematics, Limit, PalmFrame, Part, PointBuffer, PointForces, PoseGradient, PosedHand,
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

    /// Returns the mesh on the other side, still outward oriented.
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
        // Slices of one length, so that the loop needs no checks.
        let count = from.len();
        let [x, y, z] = [&from.x, &from.y, &from.z].map(|c| &c[..count]);
        let [to_x, to_y, to_z] = [&mut to.x, &mut to.y, &mut to.z].map(|c| &mut c[..count]);
        for i in 0..count {
            let point = Vec3::new(x[i].lane(0), y[i].lane(0), z[i].lane(0));
            let reflected = self.vector(point);
            to_x[i] = E::constant(reflected.x);
            to_y[i] = E::constant(reflected.y);
            to_z[i] = E::constant(reflected.z);
        }
    }

    /// Returns the pose on the other side, its articulation in the vector given.
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

/// What a mirrored hand keeps of the hand that it mirrors.
#[derive(Default)]
struct Original {
    pose: Option<HandPose>,
    posed: PosedHand,
}

/// Returns what a mirrored hand is called: left for right and the other way round, or with `_mirrored` added.
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
    faces: Vec<[u32; 3]>,
}

impl MirroredHand {
    /// Makes the mirror image of `original`.
    pub fn new(original: Box<dyn Hand>) -> Self {
        let reflection = Reflection::across(original.palm());
        Self {
            reflection,
            name: mirrored_name(original.name()),
            palm: reflection.palm(original.palm()),
            faces: (original.faces().iter())
                .map(|&[a, b, c]| [a, c, b])
                .collect(),
            original,
        }
    }
}

/// Working memory of a mirrored hand: that of the original, and copies of the inputs on the original's side.
#[derive(Debug, Default)]
struct MirroredScratch {
    original: HandScratch,
    articulation: Vec<f64>,
    single: Copies<f32>,
    double: Copies<f64>,
}

#[derive(Debug, Default)]
struct Copies<E> {
    contacts: PointBuffer<E>,
    contact_gradient: PointBuffer<E>,
    spheres: PointBuffer<E>,
    sphere_gradient: PointBuffer<E>,
}

impl<E: Element> Copies<E> {
    fn zeros(contacts: usize, spheres: usize) -> Self {
        Self {
            contacts: PointBuffer::zeros(contacts),
            contact_gradient: PointBuffer::zeros(contacts),
            spheres: PointBuffer::zeros(spheres),
            sphere_gradient: PointBuffer::zeros(spheres),
        }
    }
}

impl<E: Element> Kinematics<E> for MirroredHand
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
        let MirroredScratch {
            original,
            articulation,
            single,
            double,
        } = scratch.state.get_mut();
        let copies: &mut Copies<E> = choose_mut([single, double]);
        let mirrored = self.reflection.pose_in(pose, std::mem::take(articulation));
        self.original.forward(
            &mirrored,
            original,
            &mut copies.contacts,
            &mut copies.spheres,
        );
        *articulation = mirrored.articulation;
        for index in 0..contacts.len() {
            let point = copies.contacts.get(index) + original.contact_remainder.get(index);
            contacts.set_split(
                &mut scratch.contact_remainder,
                index,
                self.reflection.vector(point),
            );
        }
        self.reflection.points(&copies.spheres, spheres);
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
        let MirroredScratch {
            original,
            articulation,
            single,
            double,
        } = scratch.state.get_mut();
        let copies: &mut Copies<E> = choose_mut([single, double]);
        let mirrored = self.reflection.pose_in(pose, std::mem::take(articulation));
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
            original,
            &copies.contacts,
            &copies.contact_gradient,
            &copies.spheres,
            &copies.sphere_gradient,
            gradient,
        );
        *articulation = mirrored.articulation;
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
    fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }
    fn pose(&self, pose: &HandPose, posed: &mut PosedHand) {
        let PosedHand {
            vertices,
            spheres,
            bodies,
            state,
        } = posed;
        let original = state.get_or_default::<Original>();
        let articulation = original
            .pose
            .take()
            .map_or_else(Vec::new, |pose| pose.articulation);
        let pose = self.reflection.pose_in(pose, articulation);
        self.original.pose(&pose, &mut original.posed);
        original.pose = Some(pose);
        let original = &original.posed;
        let reflected = |p: &Point3<f64>| Point3::from(self.reflection.vector((*p).into()));
        for (points, from) in [(vertices, &original.vertices), (spheres, &original.spheres)] {
            points.clear();
            points.extend(from.iter().map(reflected));
        }
        bodies.clear();
        bodies.extend(
            original
                .bodies
                .iter()
                .map(|body| self.reflection.rigid(body)),
        );
    }
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        forces: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        let reflected = |forces: &PointForces| PointForces {
            points: (forces.points).map(|(point, force)| (point, self.reflection.vector(force))),
        };
        let mut of_original = std::mem::take(&mut rows.reflected);
        of_original.extend(forces.iter().map(reflected));
        let original = posed.state.get::<Original>();
        if let Some(pose) = &original.pose {
            (self.original).jacobian_rows(pose, &original.posed, &of_original, rows);
        }
        of_original.clear();
        rows.reflected = of_original;
        rows.set_base(forces, posed, pose.translation);
    }
    fn surface(&self, pose: &HandPose) -> TriangleMesh {
        let original = self.reflection.pose_in(pose, Vec::new());
        self.reflection.mesh(&self.original.surface(&original))
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
            contact_remainder: PointBuffer::zeros(contacts),
            state: HandState::new(MirroredScratch {
                original: self.original.new_scratch(),
                articulation: Vec::new(),
                single: Copies::zeros(contacts, spheres),
                double: Copies::zeros(contacts, spheres),
            }),
        }
    }
}
