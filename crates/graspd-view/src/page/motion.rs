//! The hand in a page: rigid links once and their poses at every frame, or a skin's vertices at every frame.

use graspd_hand::{Hand, HandPose, PosedHand};
use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

use super::block::{Block, Section};
use super::shape::MeshDescription;

/// A hand's links are thinned out beyond this many faces in all.
const MAX_FACES: usize = 60_000;
/// Quaternions are multiples of 1 / this.
const TURN: f32 = 32767.0;

/// What does not change from frame to frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub(super) enum HandDescription {
    /// Solids fixed to bodies. A frame is the pose of each body: translation, quaternion (real part first).
    Rigid {
        bodies: usize,
        parts: Vec<PartDescription>,
    },
    /// A frame is the pose of the base, then the vertices in the frame of the base.
    Skinned { vertices: usize, faces: Section },
}

/// A solid in the frame of its body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct PartDescription {
    body: usize,
    mesh: MeshDescription,
}

impl HandDescription {
    pub(super) fn store(hand: &dyn Hand, block: &mut Block) -> Self {
        let at_rest = HandPose::at_origin(hand.open_articulation());
        let parts = hand.rigid_parts();
        if parts.is_empty() {
            let skin = hand.surface(&at_rest);
            let faces: Vec<u32> = skin.faces.iter().flatten().copied().collect();
            return Self::Skinned {
                vertices: skin.vertices.len(),
                faces: block.push(&faces, 4, 1),
            };
        }
        let faces: usize = parts.iter().map(|part| part.mesh.faces.len()).sum();
        let share = (MAX_FACES as f64 / faces.max(1) as f64).min(1.0);
        let store = |part: &graspd_hand::Part| PartDescription {
            body: part.body,
            mesh: MeshDescription::store(
                &part.mesh,
                (share * part.mesh.faces.len() as f64).ceil() as usize,
                block,
            ),
        };
        Self::Rigid {
            bodies: hand.body_names().len(),
            parts: parts.iter().map(store).collect(),
        }
    }

    /// Returns how many poses, of seven numbers each, a frame begins with.
    fn poses(&self) -> usize {
        match self {
            Self::Rigid { bodies, .. } => *bodies,
            Self::Skinned { .. } => 1,
        }
    }

    /// Returns how many numbers a frame has.
    pub(super) fn channels(&self) -> usize {
        match self {
            Self::Rigid { .. } => 7 * self.poses(),
            Self::Skinned { vertices, .. } => 7 + 3 * vertices,
        }
    }
}

/// Frames of one motion, `[frames * channels]`: lengths \[m\] and quaternions.
pub(super) struct Frames {
    values: Vec<f32>,
    channels: usize,
    poses: usize,
}

impl Frames {
    /// Returns the frames of these poses. A quaternion has the sign that is nearer to that of the frame before.
    pub(super) fn of(hand: &dyn Hand, description: &HandDescription, poses: &[HandPose]) -> Self {
        let channels = description.channels();
        let mut posed = PosedHand::default();
        let mut values: Vec<f32> = Vec::with_capacity(poses.len() * channels);
        for pose in poses {
            let start = values.len();
            match description {
                HandDescription::Rigid { .. } => {
                    hand.pose(pose, &mut posed);
                    for body in &posed.bodies {
                        push_pose(&mut values, &Isometry3::from(*body));
                    }
                }
                HandDescription::Skinned { .. } => {
                    push_pose(&mut values, &base_of(pose));
                    let skin = hand.surface(&HandPose::at_origin(pose.articulation.as_slice()));
                    values.extend(
                        skin.vertices
                            .iter()
                            .flat_map(|v| [v.x, v.y, v.z].map(|c| c as f32)),
                    );
                }
            }
            keep_signs(&mut values, start, channels, description.poses());
        }
        Self {
            values,
            channels,
            poses: description.poses(),
        }
    }

    /// Returns the largest length \[m\].
    pub(super) fn longest(&self) -> f32 {
        let lengths = self.values.iter().enumerate();
        lengths
            .filter(|(at, _)| !self.is_turn(*at))
            .map(|(_, value)| value.abs())
            .fold(0.0, f32::max)
    }

    /// Stores the frames with lengths as multiples of `length_step` \[m\].
    pub(super) fn store(&self, length_step: f32, block: &mut Block) -> Section {
        let values: Vec<i16> = (self.values.iter().enumerate())
            .map(|(at, value)| {
                let step = if self.is_turn(at) {
                    1.0 / TURN
                } else {
                    length_step
                };
                // A cast of a float saturates.
                (value / step).round() as i16
            })
            .collect();
        block.push_signed(&values, self.channels)
    }

    /// Returns whether a channel is part of a quaternion.
    fn is_turn(&self, at: usize) -> bool {
        let channel = at % self.channels;
        channel < 7 * self.poses && channel % 7 >= 3
    }
}

fn base_of(pose: &HandPose) -> Isometry3<f64> {
    let translation = Vector3::from(pose.translation);
    Isometry3::from_parts(translation.into(), pose.rotation.into())
}

fn push_pose(values: &mut Vec<f32>, pose: &Isometry3<f64>) {
    let (t, q) = (pose.translation.vector, pose.rotation);
    values.extend([t.x, t.y, t.z, q.w, q.i, q.j, q.k].map(|c| c as f32));
}

/// Flips the quaternions of the frame that begins at `start` whose signs are opposite to the frame before.
fn keep_signs(values: &mut [f32], start: usize, channels: usize, poses: usize) {
    let Some(before) = start.checked_sub(channels) else {
        return;
    };
    for pose in 0..poses {
        let turn = 7 * pose + 3..7 * pose + 7;
        let cosine: f32 = (turn.clone())
            .map(|at| values[start + at] * values[before + at])
            .sum();
        if cosine < 0.0 {
            for at in turn {
                values[start + at] = -values[start + at];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use graspd_geom::{Quaternion, Vec3};
    use graspd_hand::{LoadOptions, load_hand_from};
    use nalgebra::{Point3, Quaternion as NaQuaternion, UnitQuaternion};

    use super::*;

    /// Returns the vertices of a frame, as the page places them.
    fn placed(
        description: &HandDescription,
        block: &Block,
        section: Section,
        step: f64,
        frame: usize,
    ) -> Vec<Point3<f64>> {
        let channels = description.channels();
        let numbers: Vec<f64> = (block.read(section)[frame * channels..][..channels].iter())
            .map(|value| f64::from(*value as u16 as i16))
            .collect();
        let pose = |at: usize| {
            let n = &numbers[7 * at..][..7];
            let turn = NaQuaternion::new(n[3], n[4], n[5], n[6]);
            Isometry3::from_parts(
                (Vector3::new(n[0], n[1], n[2]) * step).into(),
                UnitQuaternion::from_quaternion(turn),
            )
        };
        match description {
            HandDescription::Rigid { parts, .. } => (parts.iter())
                .flat_map(|part| {
                    let vertices = part.mesh.read(block);
                    let pose = pose(part.body);
                    vertices.into_iter().map(move |vertex| pose * vertex)
                })
                .collect(),
            HandDescription::Skinned { vertices, .. } => (0..*vertices)
                .map(|vertex| {
                    let n = &numbers[7 + 3 * vertex..][..3];
                    pose(0) * Point3::new(n[0] * step, n[1] * step, n[2] * step)
                })
                .collect(),
        }
    }

    #[test]
    fn a_frame_is_the_hand_at_its_pose() {
        for (name, mirrored) in [
            ("allegro", false),
            ("barrett", true),
            ("human", false),
            ("human", true),
        ] {
            let options = LoadOptions {
                mirrored,
                ..LoadOptions::default()
            };
            let hand = load_hand_from(name, &options).unwrap();
            let closed: Vec<f64> = (hand.open_articulation().iter())
                .enumerate()
                .map(|(at, open)| open + 0.1 + 0.02 * at as f64)
                .collect();
            let poses: Vec<HandPose> = (0..5)
                .map(|frame| HandPose {
                    translation: Vec3::new(0.1, -0.2, 0.05 * f64::from(frame)),
                    // Past a half turn, where a quaternion's real part changes its sign.
                    rotation: Quaternion::exp(Vec3::new(0.3, -1.1 * f64::from(frame), 0.9)),
                    articulation: (hand.open_articulation().iter().zip(&closed))
                        .map(|(open, closed)| open + f64::from(frame) / 4.0 * (closed - open))
                        .collect(),
                })
                .collect();
            let mut block = Block::default();
            let description = HandDescription::store(&*hand, &mut block);
            let frames = Frames::of(&*hand, &description, &poses);
            let step = frames.longest() / f32::from(i16::MAX);
            let section = frames.store(step, &mut block);
            for (frame, pose) in poses.iter().enumerate() {
                let placed = placed(&description, &block, section, f64::from(step), frame);
                let surface = hand.surface(pose);
                // Vertices of a part may have been put together.
                let nearest = |p: &Point3<f64>| {
                    (surface.vertices.iter())
                        .map(|vertex| (vertex - p).norm())
                        .fold(f64::INFINITY, f64::min)
                };
                assert!(!placed.is_empty() && placed.len() <= surface.vertices.len());
                for point in placed.iter().step_by(placed.len() / 200 + 1) {
                    assert!(nearest(point) < 1e-4, "{name} {frame}: {}", nearest(point));
                }
                let low = placed.iter().fold(placed[0], |low, p| low.inf(p));
                let (wanted, _) = surface.bounds().unwrap();
                assert!((low - wanted).norm() < 2e-4, "{name} {frame}");
            }
            // Neighbouring frames have quaternions of one sign: blending them takes the short way.
            let values = &frames.values;
            for pair in 0..4 {
                let at = |frame: usize| &values[frame * frames.channels + 3..][..4];
                let cosine: f32 = at(pair).iter().zip(at(pair + 1)).map(|(a, b)| a * b).sum();
                assert!(cosine > 0.0);
            }
        }
    }
}
