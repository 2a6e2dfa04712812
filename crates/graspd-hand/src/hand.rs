//! What every hand can do, whatever it is made of.

use graspd_ad::Element;
use graspd_geom::{Quaternion, Rigid, TriangleMesh, Vec3};
use nalgebra::{DMatrix, Point3, Vector3};

use crate::jacobian_rows::{
    JacobianRows, PointForces, PosedHand, jacobian_rows_by_differences, pose_by_forward,
};
use crate::mirroring::Reflected;
use crate::part::Part;

/// Where a hand is: its base in the object frame, and its articulation.
#[derive(Clone, Debug, PartialEq)]
pub struct HandPose {
    /// Position of the hand's base in the object frame \[m\].
    pub translation: Vec3<f64>,
    /// Rotation from the hand-base frame to the object frame; a unit quaternion.
    pub rotation: Quaternion<f64>,
    /// Joint angles \[rad\], joint positions \[m\] or pose-space coefficients, `[n]`.
    pub articulation: Vec<f64>,
}

/// The derivative of a scalar with respect to a [`HandPose`].
#[derive(Clone, Debug, PartialEq)]
pub struct PoseGradient {
    /// d/dt, object frame.
    pub translation: Vec3<f64>,
    /// Derivative with respect to w at w = 0 of the pose with rotation exp(w) R: the base turned about its own
    /// origin by a rotation vector given in the object frame.
    pub rotation: Vec3<f64>,
    /// d/dtheta, `[n]`.
    pub articulation: Vec<f64>,
}

impl PoseGradient {
    /// The zero gradient for a hand with `articulation_len` articulation parameters.
    pub fn zero(articulation_len: usize) -> Self {
        Self {
            translation: Vec3::zero(),
            rotation: Vec3::zero(),
            articulation: vec![0.0; articulation_len],
        }
    }
}

/// Points (or vectors) stored coordinate by coordinate, for SIMD.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointBuffer<E> {
    /// First coordinates, `[n]`.
    pub x: Vec<E>,
    /// Second coordinates, `[n]`.
    pub y: Vec<E>,
    /// Third coordinates, `[n]`.
    pub z: Vec<E>,
}

impl<E: Element> PointBuffer<E> {
    /// `len` points at the origin.
    pub fn zeros(len: usize) -> Self {
        let zeros = vec![E::default(); len];
        Self {
            x: zeros.clone(),
            y: zeros.clone(),
            z: zeros,
        }
    }
    /// How many points there are, padding included.
    pub fn len(&self) -> usize {
        self.x.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
    /// Point `index` in `f64`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn get(&self, index: usize) -> Vec3<f64> {
        Vec3::new(
            self.x[index].lane(0),
            self.y[index].lane(0),
            self.z[index].lane(0),
        )
    }
    /// Overwrites point `index`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn set(&mut self, index: usize, point: Vec3<f64>) {
        self.x[index] = E::constant(point.x);
        self.y[index] = E::constant(point.y);
        self.z[index] = E::constant(point.z);
    }
}

/// Lanes that buffers of contact points and spheres are padded to, so that a kernel never sees half a block.
pub const POINT_PADDING: usize = 8;

/// The points of the hand's surface that can touch, padded to whole blocks of [`POINT_PADDING`].
#[derive(Clone, Debug, Default)]
pub struct ContactPoints {
    /// 1 for a contact point, 0 for padding (a copy of another point), `[n]`.
    pub weight: Vec<f32>,
    /// The body (link or bone) that each point belongs to (on a skin: follows most), an index into
    /// [`Hand::body_names`], `[n]`.
    pub body: Vec<u32>,
    /// How many points are not padding.
    pub count: usize,
}

/// Spheres fixed to bodies, whose overlap measures how far a hand intersects itself.
#[derive(Clone, Debug, Default)]
pub struct CollisionSpheres {
    /// Radius of each sphere \[m\], `[s]` (no padding).
    pub radius: Vec<f64>,
    /// The body of each sphere, `[s]`.
    pub body: Vec<u32>,
    /// The pairs of spheres that must not overlap: never two of one body, of adjacent bodies, or of bodies that
    /// touch in the open pose.
    pub pairs: Vec<[u32; 2]>,
}

/// Lowest and highest value of one articulation parameter \[rad or m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Lowest allowed value; may be -infinity.
    pub lower: f64,
    /// Highest allowed value; may be infinity.
    pub upper: f64,
}

/// Where the palm is and which way it faces, in the hand-base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PalmFrame {
    /// Centre of the palm's surface \[m\].
    pub center: Point3<f64>,
    /// Unit normal that points out of the palm, to where an object is held.
    pub normal: Vector3<f64>,
    /// Unit direction of the outstretched fingers, orthogonal to the normal.
    pub fingers: Vector3<f64>,
}

/// Working memory of one hand for one worker: what [`Kinematics::forward`] leaves for [`Kinematics::pullback`].
///
/// Made by [`Hand::new_scratch`]; what is in it is the hand's own business.
#[derive(Clone, Debug, Default)]
pub struct HandScratch {
    /// Pose of each body in the object frame.
    pub body_poses: Vec<Rigid<f64>>,
    /// Force on each body, object frame.
    pub(crate) forces: Vec<Vec3<f64>>,
    /// Torque on each body about a point that the hand chooses, such as the origin of that body.
    pub(crate) torques: Vec<Vec3<f64>>,
    /// See [`HandScratch::contact_remainder`].
    pub(crate) contact_remainder: PointBuffer<f32>,
    /// What a skinned hand keeps.
    pub(crate) skinned: Option<Box<crate::mano::SkinnedScratch>>,
    /// Copies that a mirrored hand hands to its original.
    pub(crate) reflected_f32: Reflected<f32>,
    pub(crate) reflected_f64: Reflected<f64>,
}

impl HandScratch {
    /// What the last [`Kinematics::forward`] in single precision rounded off the coordinates of the contact points
    /// \[m\], `[n]`: with it they are exact to some 1e-10 m.
    pub fn contact_remainder(&self) -> &PointBuffer<f32> {
        &self.contact_remainder
    }
}

/// Positions of a hand's points as a function of its pose, and the transpose of that function's Jacobian, in
/// buffers of `E`.
pub trait Kinematics<E: Element> {
    /// The contact points and the collision spheres' centres in the object frame.
    ///
    /// `contacts`: `[n]` as [`Hand::contact_points`]; `spheres`: `[s]` as [`Hand::collision_spheres`]. Both are
    /// overwritten; nothing is allocated.
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    );

    /// The pose gradient of a scalar L given dL/d(contact points) and dL/d(sphere centres), object frame.
    ///
    /// To be called after [`Kinematics::forward`] with the same scratch and the positions that it wrote.
    /// `gradient` is overwritten; nothing is allocated.
    #[allow(clippy::too_many_arguments)]
    fn pullback(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &PointBuffer<E>,
        contact_gradient: &PointBuffer<E>,
        spheres: &PointBuffer<E>,
        sphere_gradient: &PointBuffer<E>,
        gradient: &mut PoseGradient,
    );
}

/// A hand: immutable and shared by all workers; what changes is in [`HandScratch`].
pub trait Hand: Kinematics<f32> + Kinematics<f64> + Send + Sync {
    /// Its name, as records give it.
    fn name(&self) -> &str;
    /// Names of the articulation parameters, `[n]`.
    fn articulation_names(&self) -> &[String];
    /// Limits of the articulation parameters, `[n]`; `None` where the parameters need none.
    fn limits(&self) -> Option<&[Limit]>;
    /// The fully open hand, `[n]`.
    fn open_articulation(&self) -> &[f64];
    /// Names of the bodies (links, bones).
    fn body_names(&self) -> &[String];
    /// The palm.
    fn palm(&self) -> &PalmFrame;
    /// The points that can touch.
    fn contact_points(&self) -> &ContactPoints;
    /// The spheres that must not overlap; empty where self-intersection is not looked at.
    fn collision_spheres(&self) -> &CollisionSpheres;
    /// The posed surface in the object frame: closed, outward oriented parts (they may overlap each other).
    fn surface(&self, pose: &HandPose) -> TriangleMesh;
    /// The vertices of [`Hand::surface`] and the spheres' centres, for who asks often: `posed` is overwritten, and its
    /// memory used again.
    fn place(&self, pose: &HandPose, posed: &mut PosedHand) {
        pose_by_forward(self, pose, posed);
    }
    /// One row of derivatives for each pull on the hand, `posed` being what [`Hand::place`] has made of the pose.
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        pulls: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        jacobian_rows_by_differences(self, pose, posed, pulls, rows);
    }
    /// The columns of [`Hand::jacobian_rows`] are derivatives by coordinates z, with z = z_0 + B articulation: B, `[z, n]`;
    /// `None` where z is the articulation itself.
    fn jacobian_basis(&self) -> Option<DMatrix<f64>> {
        None
    }
    /// The solids that [`Hand::surface`] consists of, in its order, each in the frame of its body; none for a skin, which
    /// has no rigid parts.
    fn rigid_parts(&self) -> Vec<Part> {
        Vec::new()
    }
    /// The poses of the bodies of [`Hand::rigid_parts`] in the object frame, `[bodies]`; none for a skin.
    fn body_poses(&self, _pose: &HandPose) -> Vec<Rigid<f64>> {
        Vec::new()
    }
    /// What had to be guessed or mended when the hand was made, one sentence each.
    fn notes(&self) -> &[String] {
        &[]
    }
    /// Whether the hand has a soft skin, which yields where it touches; rigid links do not.
    fn is_soft(&self) -> bool {
        false
    }
    /// Shape parameters that the hand was made with, as records of its grasps keep them; `None` for a hand that has
    /// none.
    fn shape_parameters(&self) -> Option<&[f64]> {
        None
    }
    /// The joints that follow others, one phrase each, such as `joint of b = 0.333 a`.
    fn coupled_joints(&self) -> Vec<String> {
        Vec::new()
    }
    /// What its description says about the way in which joints close, for [`closing_directions`](crate::closing_directions)
    /// to follow: `[n]`, `None` where it is to be found; or empty.
    fn closing_overrides(&self) -> &[Option<f64>] {
        &[]
    }
    /// Working memory for one worker.
    fn new_scratch(&self) -> HandScratch;
}
