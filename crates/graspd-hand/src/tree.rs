//! The kinematic tree: which link hangs on which joint, and where everything is for given joint values.

use std::collections::HashMap;

use graspd_ad::Real;
use graspd_geom::{Mat3, Rigid, Vec3};

use crate::body_motion::BodyMotion;
use crate::jacobian_rows::Screw;
use crate::joint::{check_numbers, followed, limit_of, order_from_root};
use crate::mirroring::Reflection;
use crate::{HandError, Joint, JointKind, Limit, PoseGradient};

/// Where a link is: rigidly placed in one of the tree's bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkFrame {
    /// The link's name.
    pub name: String,
    /// The body that it is part of.
    pub body: usize,
    /// From the link's frame to the body's.
    pub placement: Rigid<f64>,
}

/// One movable body and the joint that it hangs on.
#[derive(Clone, Debug)]
struct Body {
    parent: usize,
    /// From the joint's frame to the parent body's.
    origin: Rigid<f64>,
    /// Unit axis in the joint's frame, which is also the body's.
    axis: Vec3<f64>,
    slides: bool,
    /// Joint value = multiplier * articulation[parameter] + offset.
    parameter: usize,
    multiplier: f64,
    offset: f64,
    /// Whether the joint mimics another.
    follows: bool,
}

/// A tree of rigid bodies joined by revolute, continuous and prismatic joints.
///
/// Links that are joined by fixed joints are one body; its frame is that of the link nearest to the root. Body 0
/// is the hand's base, and every body comes after its parent.
#[derive(Clone, Debug)]
pub struct KinematicTree {
    /// Body 0 has no joint: `bodies[b - 1]` is body b.
    bodies: Vec<Body>,
    body_names: Vec<String>,
    links: Vec<LinkFrame>,
    articulation_names: Vec<String>,
    limits: Vec<Limit>,
}

impl KinematicTree {
    /// Makes the tree that joints make of links; both in any order.
    ///
    /// The articulation parameters are the movable joints that mimic none, in the order of `joints`. A parameter's
    /// limits are narrowed by those of the joints that follow it.
    ///
    /// # Errors
    /// Whatever keeps links and joints from being one tree with sound numbers: see [`HandError`].
    pub fn new(links: &[String], joints: &[Joint]) -> Result<Self, HandError> {
        let order = order_from_root(links, joints)?;
        joints.iter().try_for_each(check_numbers)?;
        let joint_index: HashMap<&str, usize> = joints
            .iter()
            .enumerate()
            .map(|(i, joint)| (joint.name.as_str(), i))
            .collect();
        let free: Vec<usize> = (0..joints.len())
            .filter(|&i| joints[i].kind != JointKind::Fixed && joints[i].mimic.is_none())
            .collect();
        if free.is_empty() {
            return Err(HandError::NoMovableJoints);
        }

        let root = order.root;
        let mut tree = Self {
            bodies: Vec::new(),
            body_names: vec![links[root].clone()],
            links: vec![LinkFrame {
                name: links[root].clone(),
                body: 0,
                placement: Rigid::identity(),
            }],
            articulation_names: free.iter().map(|&i| joints[i].name.clone()).collect(),
            limits: free.iter().map(|&i| limit_of(&joints[i])).collect(),
        };
        let mut frame_of_link: HashMap<&str, usize> = HashMap::from([(links[root].as_str(), 0)]);
        for &index in &order.joints {
            let joint = &joints[index];
            let parent = tree.links[frame_of_link[joint.parent.as_str()]].clone();
            let placement = parent.placement.compose(&joint.origin);
            let frame = if joint.kind == JointKind::Fixed {
                LinkFrame {
                    name: joint.child.clone(),
                    body: parent.body,
                    placement,
                }
            } else {
                let (source, multiplier, offset) = followed(joints, &joint_index, index)?;
                let parameter = free.iter().position(|&i| i == source).unwrap_or_default();
                if source != index {
                    tree.narrow_limit(parameter, limit_of(joint), multiplier, offset);
                }
                tree.body_names.push(joint.child.clone());
                tree.bodies.push(Body {
                    parent: parent.body,
                    origin: placement,
                    axis: joint.axis.normalize_or_zero(),
                    slides: joint.kind == JointKind::Prismatic,
                    parameter,
                    multiplier,
                    offset,
                    follows: source != index,
                });
                LinkFrame {
                    name: joint.child.clone(),
                    body: tree.bodies.len(),
                    placement: Rigid::identity(),
                }
            };
            frame_of_link.insert(&joint.child, tree.links.len());
            tree.links.push(frame);
        }
        Ok(tree)
    }

    /// Counts the bodies, the base included.
    pub fn body_count(&self) -> usize {
        self.body_names.len()
    }
    /// Names each body: that of its link nearest to the root.
    pub fn body_names(&self) -> &[String] {
        &self.body_names
    }
    /// Returns every link, parents first, and where it is in its body.
    pub fn links(&self) -> &[LinkFrame] {
        &self.links
    }
    /// Names the articulation parameters, `[n]`.
    pub fn articulation_names(&self) -> &[String] {
        &self.articulation_names
    }
    /// Returns the limits of the articulation parameters, `[n]`.
    pub fn limits(&self) -> &[Limit] {
        &self.limits
    }
    /// Returns the body that `body` hangs on; `None` for the base.
    pub fn parent(&self, body: usize) -> Option<usize> {
        Some(self.bodies.get(body.checked_sub(1)?)?.parent)
    }

    /// Computes the pose of every body in the frame that `base` maps to, over any scalar.
    ///
    /// pose(b) = pose(parent) . origin . motion, where the motion is a turn about the axis or a shift along it.
    ///
    /// # Panics
    /// If `articulation` or `poses` are shorter than [`KinematicTree::articulation_names`] and
    /// [`KinematicTree::body_names`].
    pub fn forward<T: Real>(&self, base: &Rigid<T>, articulation: &[T], poses: &mut [Rigid<T>]) {
        poses[0] = *base;
        for (index, body) in self.bodies.iter().enumerate() {
            let value = articulation[body.parameter] * T::constant(body.multiplier)
                + T::constant(body.offset);
            let axis = Vec3::constant(body.axis);
            let motion = if body.slides {
                Rigid {
                    rotation: Mat3::identity(),
                    translation: axis * value,
                }
            } else {
                Rigid {
                    rotation: Mat3::from_axis_angle(axis, value),
                    translation: Vec3::zero(),
                }
            };
            poses[index + 1] = poses[body.parent]
                .compose(&Rigid::constant(&body.origin))
                .compose(&motion);
        }
    }

    /// Computes the pose of every body, `[bodies]`, as [`KinematicTree::forward`].
    pub(crate) fn poses(&self, base: &Rigid<f64>, articulation: &[f64]) -> Vec<Rigid<f64>> {
        let mut poses = vec![Rigid::identity(); self.body_count()];
        self.forward(base, articulation, &mut poses);
        poses
    }

    /// Applies the transposed Jacobian of [`KinematicTree::forward`]: what forces on the bodies say about the pose.
    ///
    /// `forces[b]` and `torques[b]`: sums over the body's points p of g and (p - origin of b) x g, where g is the
    /// derivative of a scalar with respect to p. From the leaves to the root each body hands its sums to its
    /// parent, with the torque moved to the parent's origin; a joint's derivative is the part of its body's torque
    /// (or force, if it slides) along its axis. On return both hold the sums over whole subtrees. `gradient` is
    /// overwritten.
    ///
    /// # Panics
    /// If a slice or `gradient.articulation` is shorter than the tree's bodies or parameters.
    pub fn pullback(
        &self,
        poses: &[Rigid<f64>],
        forces: &mut [Vec3<f64>],
        torques: &mut [Vec3<f64>],
        gradient: &mut PoseGradient,
    ) {
        gradient.articulation.fill(0.0);
        for (index, body) in self.bodies.iter().enumerate().rev() {
            let (force, torque, pose) = (forces[index + 1], torques[index + 1], &poses[index + 1]);
            let axis = pose.rotation.apply(body.axis);
            let along_axis = axis.dot(if body.slides { force } else { torque });
            gradient.articulation[body.parameter] += body.multiplier * along_axis;
            let arm = pose.translation - poses[body.parent].translation;
            forces[body.parent] += force;
            torques[body.parent] += torque + arm.cross(force);
        }
        gradient.translation = forces[0];
        gradient.rotation = torques[0];
    }

    /// Returns the screws of all joints for the bodies' poses, parents first: that of body b is number b - 1.
    pub(crate) fn screws<'t>(
        &'t self,
        poses: &'t [Rigid<f64>],
    ) -> impl Iterator<Item = Screw> + 't {
        let screw = move |(index, body): (usize, &'t Body)| {
            let pose = &poses[index + 1];
            let axis = pose.rotation.apply(body.axis) * body.multiplier;
            let (turn, shift) = if body.slides {
                (Vec3::zero(), axis)
            } else {
                (axis, pose.translation.cross(axis))
            };
            Screw {
                parent: body.parent,
                parameter: body.parameter as u32,
                turn,
                shift,
            }
        };
        self.bodies.iter().enumerate().map(screw)
    }

    /// Returns the tree on the other side of a mirror: the same values of the joints give the mirror image.
    pub(crate) fn mirrored(&self, reflection: Reflection) -> Self {
        let mut tree = self.clone();
        for body in &mut tree.bodies {
            body.origin = reflection.rigid(&body.origin);
            // S exp(a theta) S = exp(-S a theta), but shifts go along S a.
            body.axis = if body.slides {
                reflection.vector(body.axis)
            } else {
                reflection.axial(body.axis)
            };
        }
        for link in &mut tree.links {
            link.placement = reflection.rigid(&link.placement);
        }
        tree
    }

    /// Returns the joints that follow others, one phrase each.
    pub(crate) fn coupled_joints(&self) -> Vec<String> {
        let following = self.bodies.iter().zip(&self.body_names[1..]);
        following
            .filter(|(body, _)| body.follows)
            .map(|(body, name)| {
                let followed = &self.articulation_names[body.parameter];
                let offset = if body.offset == 0.0 {
                    String::new()
                } else {
                    format!(" {:+.4}", body.offset)
                };
                format!(
                    "joint of {name} = {:.4} {followed}{offset}",
                    body.multiplier
                )
            })
            .collect()
    }

    /// Replaces the limits of a parameter.
    pub(crate) fn set_limit(&mut self, parameter: usize, limit: Limit) {
        self.limits[parameter] = limit;
    }

    /// Keeps multiplier * value + offset inside `limit`, unless that would leave nothing.
    fn narrow_limit(&mut self, parameter: usize, limit: Limit, multiplier: f64, offset: f64) {
        if multiplier == 0.0 {
            return;
        }
        let (a, b) = (
            (limit.lower - offset) / multiplier,
            (limit.upper - offset) / multiplier,
        );
        let own = self.limits[parameter];
        let narrowed = Limit {
            lower: own.lower.max(a.min(b)),
            upper: own.upper.min(a.max(b)),
        };
        if narrowed.lower <= narrowed.upper {
            self.limits[parameter] = narrowed;
        }
    }
}

impl BodyMotion for KinematicTree {
    fn body_names(&self) -> &[String] {
        &self.body_names
    }
    fn limits(&self) -> &[Limit] {
        &self.limits
    }
    fn parent(&self, body: usize) -> Option<usize> {
        self.parent(body)
    }
    fn body_poses(&self, articulation: &[f64]) -> Vec<Rigid<f64>> {
        self.poses(&Rigid::identity(), articulation)
    }
}
