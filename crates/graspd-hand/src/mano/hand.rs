//! A skinned hand: contact points, limits, palm and surface of a model with one shape.

use graspd_geom::{Quaternion, TriangleMesh, Vec3};
use nalgebra::{DMatrix, Point3, UnitQuaternion, Vector3};

use super::bones::BonePose;
use super::fingers::{Fingers, heaviest};
use super::model::{POSE_VALUES, SKINNED_JOINT_NAMES, SKINNED_JOINTS, SkinnedModel};
use super::open::open_coefficients;
use super::options::SkinnedHandOptions;
use super::skin::{Skin, SlotOrder, VertexInfluences};
use super::spheres;
use super::wrist_cap::WristCap;
use crate::{
    CollisionSpheres, ContactPoints, Hand, HandError, HandPose, HandScratch, JacobianRows, Limit,
    PalmFrame, PointForces, PosedHand,
};

/// A hand whose skin is moved by linear blend skinning with pose blendshapes, in MANO's layout.
///
/// * **Articulation**: the first n pose coefficients; pose = mean + coefficients . components. MANO's components are
///   unit rows, so that a coefficient is the length \[rad\] of the change of all 45 rotation-vector entries,
///   whichever component it belongs to; how far natural hands go along each differs, and stands in [`Hand::limits`]
///   where known.
/// * **Frame**: the model's own coordinates, x_object = R x_model + t. See [`SkinnedHand::pose_from_mano`].
/// * **Contact points**: all vertices that belong to a face.
/// * **Surface**: the skin with its wrist closed by a fan.
#[derive(Clone, Debug)]
pub struct SkinnedHand {
    pub(crate) model: SkinnedModel,
    shape: Vec<f64>,
    pub(crate) rest: Vec<Vec3<f64>>,
    pub(crate) joints: [Vec3<f64>; SKINNED_JOINTS],
    /// The first n components, and the pose that coefficients are counted from.
    pub(crate) components: Vec<[f64; POSE_VALUES]>,
    pub(crate) mean: [f64; POSE_VALUES],
    names: Vec<String>,
    limits: Option<Vec<Limit>>,
    open: Vec<f64>,
    bodies: Vec<String>,
    palm: PalmFrame,
    contacts: ContactPoints,
    order: SlotOrder,
    pub(crate) skin_f64: Skin<f64>,
    pub(crate) skin_f32: Skin<f32>,
    pub(crate) spheres: CollisionSpheres,
    pub(crate) sphere_centers: Vec<Vec3<f64>>,
    pub(crate) cap: WristCap,
    pub(crate) influences: VertexInfluences,
    notes: Vec<String>,
}

impl SkinnedHand {
    /// Gives the model a shape and lays its skin out for the kernels.
    ///
    /// # Errors
    /// [`HandError::BadModel`] as [`SkinnedModel::validate`] and where the surface cannot be closed;
    /// [`HandError::BadOption`].
    pub fn new(mut model: SkinnedModel, options: &SkinnedHandOptions) -> Result<Self, HandError> {
        model.validate()?;
        options.validate(&model)?;
        for weights in &mut model.weights {
            let sum: f64 = weights.iter().sum();
            for weight in weights {
                *weight /= sum;
            }
        }
        let mut notes = Vec::new();
        let rest = model.shaped_vertices(&options.shape);
        let joints = model.shaped_joints(&options.shape, &rest);
        let points: Vec<Point3<f64>> = rest.iter().map(|&p| p.into()).collect();
        let cap = WristCap::new(&points, &model.faces).map_err(|found| HandError::BadModel {
            array: "f",
            fault: format!(
                "is no surface that a fan at the wrist closes ({} edges of more than two triangles, {} whose \
                    triangles disagree about the outside, {} double triangles)",
                found.non_manifold_edges, found.misoriented_edges, found.duplicate_faces
            ),
        })?;
        let fingers = Fingers::find(&model, &rest, &joints, &mut notes);
        let count = options.components.min(model.pose_components.len());
        let components = model.pose_components[..count].to_vec();
        let mean = if options.flat_mean {
            [0.0; POSE_VALUES]
        } else {
            model.pose_mean
        };
        let space = open_coefficients(&model, &components, &mean);
        let order = SlotOrder::new(&model, used_vertices(&model, &mut notes));
        let names = match &model.component_names {
            Some(names) => names[..count].to_vec(),
            None => (0..count).map(|index| format!("pca_{index}")).collect(),
        };
        let mut hand = Self {
            palm: fingers.palm(&cap.surface(points)),
            skin_f64: Skin::new(&model, &rest, &order),
            skin_f32: Skin::new(&model, &rest, &order),
            contacts: contact_points(&model, &order),
            influences: VertexInfluences::new(&model.weights),
            shape: options.shape.clone(),
            components,
            mean,
            names,
            limits: space.limits,
            open: space.open,
            bodies: SKINNED_JOINT_NAMES.map(str::to_owned).to_vec(),
            order,
            spheres: CollisionSpheres::default(),
            sphere_centers: Vec::new(),
            cap,
            notes,
            rest,
            joints,
            model,
        };
        if options.collision_spheres {
            hand.add_spheres(&fingers);
        }
        Ok(hand)
    }

    fn add_spheres(&mut self, fingers: &Fingers) {
        let mut bones = BonePose::default();
        self.set_bones(&HandPose::at_origin(self.open.clone()), &mut bones);
        let joints = self.joints;
        let open = |body: usize, center: Vec3<f64>| bones.frames[body].apply(center - joints[body]);
        (self.spheres, self.sphere_centers) =
            spheres::along_bones(&self.model, &self.rest, fingers, open);
    }

    /// Returns the model, its skinning weights made to sum to 1 exactly.
    pub fn model(&self) -> &SkinnedModel {
        &self.model
    }
    /// Vertices of the shaped hand in its straight pose, model coordinates \[m\], `[v]`.
    pub fn rest_vertices(&self) -> &[Vec3<f64>] {
        &self.rest
    }
    /// Joints of the shaped hand in its straight pose, model coordinates \[m\].
    pub fn rest_joints(&self) -> &[Vec3<f64>; SKINNED_JOINTS] {
        &self.joints
    }
    /// Returns the model vertex that each contact point is, padding included, `[n]`.
    pub fn contact_vertices(&self) -> &[u32] {
        &self.order.vertex
    }

    /// Returns the pose of this hand that MANO's own parameters describe.
    ///
    /// MANO turns the hand by `global_orient` (a rotation vector \[rad\]) about its wrist joint J_0 and then moves it
    /// by `trans` \[m\]: x = R (x_model - J_0) + J_0 + trans. So t = J_0 - R J_0 + trans. `coefficients` are counted
    /// as this hand's are (from the flat hand or from the mean); those not given are 0.
    pub fn pose_from_mano(
        &self,
        global_orient: [f64; 3],
        trans: [f64; 3],
        coefficients: &[f64],
    ) -> HandPose {
        let rotation = Quaternion::exp(Vec3::from(global_orient));
        let wrist = self.joints[0];
        let mut articulation = vec![0.0; self.components.len()];
        for (slot, &value) in articulation.iter_mut().zip(coefficients) {
            *slot = value;
        }
        HandPose {
            translation: wrist - rotation.to_matrix().apply(wrist) + Vec3::from(trans),
            rotation,
            articulation,
        }
    }

    /// MANO's `global_orient` \[rad\] and `trans` \[m\] of a pose: the inverse of [`SkinnedHand::pose_from_mano`].
    pub fn mano_placement(&self, pose: &HandPose) -> ([f64; 3], [f64; 3]) {
        let wrist = self.joints[0];
        let trans = pose.translation - wrist + pose.rotation.to_matrix().apply(wrist);
        let turn: Vector3<f64> = UnitQuaternion::from(pose.rotation).scaled_axis();
        (turn.into(), [trans.x, trans.y, trans.z])
    }
}

/// Returns the vertices that belong to a face.
fn used_vertices(model: &SkinnedModel, notes: &mut Vec<String>) -> Vec<u32> {
    let mut is_used = vec![false; model.template.len()];
    for &vertex in model.faces.iter().flatten() {
        is_used[vertex as usize] = true;
    }
    let unused = is_used.iter().filter(|used| !**used).count();
    if unused > 0 {
        notes.push(format!(
            "{unused} vertices belong to no triangle and are left out"
        ));
    }
    (0..model.template.len() as u32)
        .filter(|&v| is_used[v as usize])
        .collect()
}

fn contact_points(model: &SkinnedModel, order: &SlotOrder) -> ContactPoints {
    let body = |&vertex: &u32| heaviest(&model.weights[vertex as usize]) as u32;
    let weight = |slot: usize| if slot < order.count { 1.0 } else { 0.0 };
    ContactPoints {
        weight: (0..order.vertex.len()).map(weight).collect(),
        body: order.vertex.iter().map(body).collect(),
        count: order.count,
    }
}

impl Hand for SkinnedHand {
    fn name(&self) -> &str {
        &self.model.name
    }
    fn articulation_names(&self) -> &[String] {
        &self.names
    }
    fn limits(&self) -> Option<&[Limit]> {
        self.limits.as_deref()
    }
    fn open_articulation(&self) -> &[f64] {
        &self.open
    }
    fn body_names(&self) -> &[String] {
        &self.bodies
    }
    fn palm(&self) -> &PalmFrame {
        &self.palm
    }
    fn contact_points(&self) -> &ContactPoints {
        &self.contacts
    }
    fn collision_spheres(&self) -> &CollisionSpheres {
        &self.spheres
    }
    fn faces(&self) -> &[[u32; 3]] {
        &self.cap.faces
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
    /// By the reference formula, whose roundings differ from those of [`Hand::pose`]: samples of surfaces are drawn
    /// from these.
    fn surface(&self, pose: &HandPose) -> TriangleMesh {
        let base = pose.base();
        let posed = self.model.posed_vertices(
            &self.rest,
            &self.joints,
            &self.pose_of(&pose.articulation),
            &base.rotation,
            base.translation,
        );
        self.cap
            .surface(posed.into_iter().map(Point3::from).collect())
    }
    fn jacobian_basis(&self) -> Option<DMatrix<f64>> {
        Some(self.component_basis())
    }
    fn notes(&self) -> &[String] {
        &self.notes
    }
    fn is_soft(&self) -> bool {
        true
    }
    fn shape_parameters(&self) -> Option<&[f64]> {
        Some(&self.shape)
    }
    fn new_scratch(&self) -> HandScratch {
        self.scratch()
    }
}
