//! What every hand can do, whatever it is made of.

use graspd_ad::Element;
use graspd_geom::{Quaternion, Rigid, TriangleMesh, Vec3};
use nalgebra::{DMatrix, Point3, Vector3};

use crate::{HandScratch, JacobianRows, Limit, PointBuffer, PointForces, PosedHand};

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

impl HandPose {
    /// Puts the base at the object frame's origin, its axes along the frame's.
    pub fn at_origin(articulation: impl Into<Vec<f64>>) -> Self {
        Self {
            translation: Vec3::zero(),
            rotation: Quaternion::identity(),
            articulation: articulation.into(),
        }
    }

    /// Returns the motion from the hand-base frame to the object frame.
    pub fn base(&self) -> Rigid<f64> {
        Rigid {
            rotation: self.rotation.to_matrix(),
            translation: self.translation,
        }
    }
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
    /// Makes the zero gradient for a hand with `articulation_len` articulation parameters.
    pub fn zero(articulation_len: usize) -> Self {
        Self {
            translation: Vec3::zero(),
            rotation: Vec3::zero(),
            articulation: vec![0.0; articulation_len],
        }
    }
}

/// The points of the hand's surface that can touch, padded to whole blocks of [`POINT_PADDING`](crate::POINT_PADDING).
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

/// One closed solid, fixed to a body.
#[derive(Clone, Debug)]
pub struct Part {
    /// The body that it belongs to, an index into [`Hand::body_names`].
    pub body: usize,
    /// Its surface in the body's frame: closed, outward oriented \[m\].
    pub mesh: TriangleMesh,
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

/// Positions of a hand's points as a function of its pose, and the transpose of that function's Jacobian, in
/// buffers of `E`.
pub trait Kinematics<E: Element> {
    /// Computes the contact points and the collision spheres' centres in the object frame.
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

    /// Computes the pose gradient of a scalar L from dL/d(contact points) and dL/d(sphere centres), object frame.
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

/// A hand: immutable and shared by all workers; what changes is in [`HandScratch`] and [`PosedHand`].
///
/// Whoever only has a formula for where a hand's points are implements [`HandModel`](crate::HandModel) instead, and
/// [`AutodiffHand`](crate::AutodiffHand) derives the rest.
pub trait Hand: Kinematics<f32> + Kinematics<f64> + Send + Sync {
    /// Returns its name, as records give it.
    fn name(&self) -> &str;
    /// Names the articulation parameters, `[n]`.
    fn articulation_names(&self) -> &[String];
    /// Returns the limits of the articulation parameters, `[n]`; `None` where the parameters need none.
    fn limits(&self) -> Option<&[Limit]>;
    /// Returns the fully open hand, `[n]`.
    fn open_articulation(&self) -> &[f64];
    /// Names the bodies (links, bones).
    fn body_names(&self) -> &[String];
    /// Returns the palm.
    fn palm(&self) -> &PalmFrame;
    /// Returns the points that can touch.
    fn contact_points(&self) -> &ContactPoints;
    /// Returns the spheres that must not overlap; none where self-intersection is not looked at.
    fn collision_spheres(&self) -> &CollisionSpheres;
    /// Returns the triangles that join [`PosedHand::vertices`], `[f]`: closed, outward oriented parts (they may
    /// overlap each other).
    fn faces(&self) -> &[[u32; 3]];
    /// Computes the vertices of the surface, the spheres' centres and the bodies' frames in the object frame; `posed`
    /// is overwritten.
    fn pose(&self, pose: &HandPose, posed: &mut PosedHand);
    /// Computes one row of derivatives for each of `forces`; `posed`: what [`Hand::pose`] has made of the pose.
    fn jacobian_rows(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        forces: &[PointForces],
        rows: &mut JacobianRows,
    );
    /// Returns B, `[z, n]`, if the columns of [`Hand::jacobian_rows`] are derivatives by coordinates z with z = z_0 +
    /// B articulation; `None` where z is the articulation itself.
    fn jacobian_basis(&self) -> Option<DMatrix<f64>> {
        None
    }
    /// Makes working memory for one worker.
    fn new_scratch(&self) -> HandScratch;

    /// Computes the posed surface in the object frame.
    fn surface(&self, pose: &HandPose) -> TriangleMesh {
        let mut posed = PosedHand::default();
        self.pose(pose, &mut posed);
        TriangleMesh {
            vertices: posed.vertices,
            faces: self.faces().to_vec(),
        }
    }
    /// Computes the surface of the open hand, its base at the origin.
    fn surface_at_rest(&self) -> TriangleMesh {
        self.surface(&HandPose {
            translation: Vec3::zero(),
            rotation: Quaternion::identity(),
            articulation: self.open_articulation().to_vec(),
        })
    }
    /// Returns the solids that the surface consists of, in its order, each in the frame of its body; none for a skin,
    /// which has no rigid parts.
    fn rigid_parts(&self) -> Vec<Part> {
        Vec::new()
    }
    /// Tells whether the hand has a soft skin, which yields where it touches; rigid links do not.
    fn is_soft(&self) -> bool {
        false
    }
    /// Returns the shape parameters that the hand was made with, as records of its grasps keep them; `None` for a hand
    /// that has none.
    fn shape_parameters(&self) -> Option<&[f64]> {
        None
    }
    /// Tells what had to be guessed or mended when the hand was made, one sentence each.
    fn notes(&self) -> &[String] {
        &[]
    }
    /// Describes the joints that follow others, one phrase each, such as `joint of b = 0.333 a`.
    fn coupled_joints(&self) -> Vec<String> {
        Vec::new()
    }
    /// Returns which way joints close as far as the hand's description declares it, for
    /// [`closing_directions`](crate::closing_directions): `[n]`, `None` where it is to be found; or empty.
    fn closing_overrides(&self) -> &[Option<f64>] {
        &[]
    }
}
