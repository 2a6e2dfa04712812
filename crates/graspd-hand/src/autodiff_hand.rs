//! A hand made from one formula: where its points are, over any scalar. Duals give the derivatives.

use std::ops::Range;

use graspd_ad::{Dual, Element, Real};
use graspd_geom::{Mat3, Rigid, TriangleMesh, Vec3};
use graspd_settings::Validate;
use nalgebra::Point3;

use crate::body_motion::BodyMotion;
use crate::body_points::BodyPoints;
use crate::{
    CollisionSpheres, ContactPoints, Hand, HandError, HandOptions, HandPose, HandScratch,
    HandState, JacobianRows, Kinematics, Limit, PalmFrame, Part, PointBuffer, PointForces,
    PoseGradient, PosedHand,
};

/// Where the points of a hand are as a function of its articulation: all that [`AutodiffHand`] needs to be told.
pub trait HandModel: Send + Sync {
    /// Moves `points` of the body `body` from where [`HandModelDescription::bodies`] has them to where they are at
    /// `articulation`, `[n]`, in the frame of the hand's base \[m\]. A smooth function, written for any scalar.
    fn forward<T: Real>(&self, articulation: &[T], body: usize, points: &mut [Vec3<T>]);
}

/// What a [`HandModel`] is besides its formula.
#[derive(Clone, Debug)]
pub struct HandModelDescription {
    /// Its name, as records give it.
    pub name: String,
    /// Names of the articulation parameters, `[n]`.
    pub articulation_names: Vec<String>,
    /// Their limits \[rad or m\], `[n]`.
    pub limits: Vec<Limit>,
    /// The fully open hand, `[n]`.
    pub open: Vec<f64>,
    /// The palm.
    pub palm: PalmFrame,
    /// Name and surface of each body \[m\], closed and outward oriented, in any position that
    /// [`HandModel::forward`] counts from.
    pub bodies: Vec<(String, TriangleMesh)>,
    /// Whether [`HandModel::forward`] bends bodies, so that they have no frames, and their surfaces yield to a touch.
    pub is_soft: bool,
}

/// Derivatives that one pass takes along.
const CHUNK: usize = 8;
/// Half the distance of the points that a body's frame is measured with \[m\].
const FRAME_STEP: f64 = 1e-2;

/// The [`Hand`] of a [`HandModel`]: contact points and collision spheres are spread over its bodies, and pullback and
/// Jacobian follow from its formula over [`Dual`] numbers, eight parameters a pass.
pub struct AutodiffHand<M> {
    model: M,
    description: HandModelDescription,
    body_names: Vec<String>,
    parts: Vec<Part>,
    points: BodyPoints,
    /// The contact points, then the sphere centres.
    touching: MaterialPoints,
    /// The vertices of the surface, then the sphere centres.
    surface: MaterialPoints,
}

impl<M: HandModel> AutodiffHand<M> {
    /// Spreads contact points and spheres over the bodies.
    ///
    /// # Errors
    /// [`HandError::BadOption`]; [`HandError::OpenPart`]; [`HandError::NoGeometry`] where there is no surface to touch
    /// with.
    ///
    /// # Panics
    /// If names, limits and the open hand differ in length.
    pub fn new(
        model: M,
        description: HandModelDescription,
        options: &HandOptions,
    ) -> Result<Self, HandError> {
        options.validate()?;
        let parameters = description.open.len();
        assert_eq!(
            description.articulation_names.len(),
            parameters,
            "one name each"
        );
        assert_eq!(description.limits.len(), parameters, "one limit each");
        let body_names: Vec<String> = description.bodies.iter().map(|b| b.0.clone()).collect();
        let part = |(body, (_, mesh)): (usize, &(String, TriangleMesh))| Part {
            body,
            mesh: mesh.clone(),
        };
        let parts: Vec<Part> = description.bodies.iter().enumerate().map(part).collect();
        let motion = Motion {
            model: &model,
            body_names: &body_names,
            limits: &description.limits,
            centers: (parts.iter())
                .map(|part| center(&part.mesh).ok_or(HandError::NoGeometry))
                .collect::<Result<_, _>>()?,
        };
        let points = BodyPoints::new(&parts, &motion, &description.open, options)?;
        let contacts = (0..points.positions.len())
            .map(|index| (points.contacts.body[index], points.positions.get(index)));
        let spheres = points
            .spheres
            .body
            .iter()
            .copied()
            .zip(points.sphere_centers.iter().copied());
        let vertices = (parts.iter()).flat_map(|part| {
            part.mesh
                .vertices
                .iter()
                .map(|&vertex| (part.body as u32, vertex.into()))
        });
        Ok(Self {
            touching: MaterialPoints::new(contacts.chain(spheres.clone())),
            surface: MaterialPoints::new(vertices.chain(spheres)),
            model,
            description,
            body_names,
            parts,
            points,
        })
    }

    fn motion(&self) -> Motion<'_, M> {
        Motion {
            model: &self.model,
            body_names: &self.body_names,
            limits: &self.description.limits,
            centers: self
                .parts
                .iter()
                .filter_map(|part| center(&part.mesh))
                .collect(),
        }
    }
}

/// Returns the middle of a mesh's bounding box.
fn center(mesh: &TriangleMesh) -> Option<Vec3<f64>> {
    let (low, high) = mesh.bounds()?;
    Some(nalgebra::center(&low, &high).into())
}

/// Points of bodies, where the model's description has them.
struct MaterialPoints {
    positions: Vec<Vec3<f64>>,
    /// Bodies, and points that follow one another and belong to them.
    groups: Vec<(usize, Range<usize>)>,
}

impl MaterialPoints {
    fn new(points: impl Iterator<Item = (u32, Vec3<f64>)>) -> Self {
        let (bodies, positions): (Vec<u32>, Vec<Vec3<f64>>) = points.unzip();
        let mut groups: Vec<(usize, Range<usize>)> = Vec::new();
        for group in bodies.chunk_by(|a, b| a == b) {
            let start = groups.last().map_or(0, |last| last.1.end);
            groups.push((group[0] as usize, start..start + group.len()));
        }
        Self { positions, groups }
    }

    /// Computes where the points are, in the frame of the hand's base.
    fn at<T: Real>(&self, model: &impl HandModel, articulation: &[T], moved: &mut Vec<Vec3<T>>) {
        moved.clear();
        moved.extend(
            self.positions
                .iter()
                .map(|&position| Vec3::constant(position)),
        );
        for (body, range) in &self.groups {
            model.forward(articulation, *body, &mut moved[range.clone()]);
        }
    }

    /// Computes the derivatives of the points by each parameter, and hands them to `visit`: parameter, point,
    /// derivative in the frame of the hand's base.
    fn differentiate(
        &self,
        model: &impl HandModel,
        articulation: &[f64],
        duals: &mut Duals,
        mut visit: impl FnMut(usize, usize, Vec3<f64>),
    ) {
        for first in (0..articulation.len()).step_by(CHUNK) {
            duals.articulation.clear();
            duals
                .articulation
                .extend(articulation.iter().map(|&value| Dual::constant(value)));
            let chunk = first..(first + CHUNK).min(articulation.len());
            for parameter in chunk.clone() {
                duals.articulation[parameter].derivative[parameter - first] = 1.0;
            }
            self.at(model, &duals.articulation, &mut duals.points);
            for (index, point) in duals.points.iter().enumerate() {
                for parameter in chunk.clone() {
                    let of = |value: Dual<f64, CHUNK>| value.derivative[parameter - first];
                    visit(
                        parameter,
                        index,
                        Vec3::new(of(point.x), of(point.y), of(point.z)),
                    );
                }
            }
        }
    }
}

/// Memory for one pass over duals.
#[derive(Debug, Default)]
struct Duals {
    articulation: Vec<Dual<f64, CHUNK>>,
    points: Vec<Vec3<Dual<f64, CHUNK>>>,
}

/// Working memory of an [`AutodiffHand`].
#[derive(Debug, Default)]
struct AutodiffScratch {
    /// Contact points and sphere centres in the frame of the base, or the gradients there.
    vectors: Vec<Vec3<f64>>,
    duals: Duals,
}

/// What [`PosedHand`] keeps of an [`AutodiffHand`].
#[derive(Debug, Default)]
struct PosedModel {
    points: Vec<Vec3<f64>>,
    duals: Duals,
    /// The derivatives of vertices and sphere centres by the parameters, object frame, `[points, n]`.
    columns: Vec<Vec3<f64>>,
}

/// The bodies' frames as the model moves them.
struct Motion<'a, M> {
    model: &'a M,
    body_names: &'a [String],
    limits: &'a [Limit],
    /// The middle of each body.
    centers: Vec<Vec3<f64>>,
}

impl<M: HandModel> BodyMotion for Motion<'_, M> {
    fn body_names(&self) -> &[String] {
        self.body_names
    }
    fn limits(&self) -> &[Limit] {
        self.limits
    }
    fn parent(&self, _body: usize) -> Option<usize> {
        None
    }
    fn body_poses(&self, articulation: &[f64]) -> Vec<Rigid<f64>> {
        let frame = |(body, &center): (usize, &Vec3<f64>)| {
            let step = |x: f64, y: f64, z: f64| Vec3::new(x, y, z) * FRAME_STEP;
            let ends = [
                step(1.0, 0.0, 0.0),
                step(0.0, 1.0, 0.0),
                step(0.0, 0.0, 1.0),
            ];
            let [x, y, z] = ends;
            let mut points = [
                center,
                center + x,
                center - x,
                center + y,
                center - y,
                center + z,
                center - z,
            ];
            self.model.forward(articulation, body, &mut points);
            let column = |k: usize| (points[k] - points[k + 1]) * (0.5 / FRAME_STEP);
            let rotation = Mat3 {
                rows: [column(1), column(3), column(5)],
            }
            .transpose();
            Rigid {
                rotation,
                translation: points[0] - rotation.apply(center),
            }
        };
        self.centers.iter().enumerate().map(frame).collect()
    }
}

impl<M: HandModel, E: Element> Kinematics<E> for AutodiffHand<M> {
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    ) {
        let AutodiffScratch { vectors, .. } = scratch.state.get_mut();
        self.touching.at(&self.model, &pose.articulation, vectors);
        let base = pose.base();
        let count = contacts.len();
        for (index, &point) in vectors.iter().enumerate() {
            let placed = base.apply(point);
            match index.checked_sub(count) {
                None => contacts.set_split(&mut scratch.contact_remainder, index, placed),
                Some(sphere) => spheres.set(sphere, placed),
            }
        }
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
        let AutodiffScratch { vectors, duals } = scratch.state.get_mut();
        *gradient = PoseGradient {
            translation: Vec3::zero(),
            rotation: Vec3::zero(),
            articulation: std::mem::take(&mut gradient.articulation),
        };
        gradient.articulation.fill(0.0);
        let base = pose.base();
        vectors.clear();
        for (points, gradients) in [(contacts, contact_gradient), (spheres, sphere_gradient)] {
            for index in 0..points.len() {
                let force = gradients.get(index);
                gradient.translation += force;
                gradient.rotation += (points.get(index) - base.translation).cross(force);
                vectors.push(base.rotation.apply_transposed(force));
            }
        }
        let articulation = &mut gradient.articulation;
        self.touching.differentiate(
            &self.model,
            &pose.articulation,
            duals,
            |parameter, point, slope| {
                articulation[parameter] += slope.dot(vectors[point]);
            },
        );
    }
}

impl<M: HandModel> Hand for AutodiffHand<M> {
    fn name(&self) -> &str {
        &self.description.name
    }
    fn articulation_names(&self) -> &[String] {
        &self.description.articulation_names
    }
    fn limits(&self) -> Option<&[Limit]> {
        Some(&self.description.limits)
    }
    fn open_articulation(&self) -> &[f64] {
        &self.description.open
    }
    fn body_names(&self) -> &[String] {
        &self.body_names
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
        let PosedHand {
            vertices,
            spheres,
            bodies,
            state,
        } = posed;
        let PosedModel {
            points,
            duals,
            columns,
        } = state.get_or_default();
        let base = pose.base();
        self.surface.at(&self.model, &pose.articulation, points);
        let mut placed = points.iter().map(|&point| Point3::from(base.apply(point)));
        vertices.clear();
        vertices.extend(placed.by_ref().take(self.points.vertex_bodies.len()));
        spheres.clear();
        spheres.extend(placed);
        bodies.clear();
        if !self.description.is_soft {
            let frames = self.motion().body_poses(&pose.articulation);
            bodies.extend(frames.iter().map(|frame| base.compose(frame)));
        }
        let parameters = pose.articulation.len();
        columns.clear();
        columns.resize(points.len() * parameters, Vec3::zero());
        self.surface.differentiate(
            &self.model,
            &pose.articulation,
            duals,
            |parameter, point, slope| {
                columns[point * parameters + parameter] = base.rotation.apply(slope);
            },
        );
    }
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        forces: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        let PosedModel { columns, .. } = posed.state.get();
        let parameters = pose.articulation.len();
        rows.clear();
        for forces in forces {
            for parameter in 0..parameters {
                let slope = |&(point, force): &(crate::HandPoint, Vec3<f64>)| {
                    let index = match point {
                        crate::HandPoint::Vertex(vertex) => vertex as usize,
                        crate::HandPoint::Sphere(sphere) => posed.vertices.len() + sphere as usize,
                    };
                    columns[index * parameters + parameter].dot(force)
                };
                rows.push(parameter as u32, forces.points.iter().map(slope).sum());
            }
            rows.end(forces, posed, pose.translation);
        }
    }
    fn rigid_parts(&self) -> Vec<Part> {
        if self.description.is_soft {
            return Vec::new();
        }
        self.parts.clone()
    }
    fn is_soft(&self) -> bool {
        self.description.is_soft
    }
    fn new_scratch(&self) -> HandScratch {
        let points = self.touching.positions.len();
        HandScratch {
            contact_remainder: PointBuffer::zeros(self.points.positions.len()),
            state: HandState::new(AutodiffScratch {
                vectors: Vec::with_capacity(points),
                duals: Duals {
                    articulation: Vec::with_capacity(self.description.open.len()),
                    points: Vec::with_capacity(points),
                },
            }),
        }
    }
}
