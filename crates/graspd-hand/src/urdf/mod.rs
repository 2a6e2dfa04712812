//! Hands from URDF files.

mod geometry;
mod mesh_files;
mod overrides;
mod xml;

use std::path::{Path, PathBuf};

use graspd_geom::{Quaternion, Rigid};
use nalgebra::UnitQuaternion;

use crate::palm::open_and_palm;
use crate::{
    ArticulatedHand, HandDescription, HandError, HandOptions, Joint, JointKind, KinematicTree,
    Limit, Mimic,
};
use geometry::GeometryReader;
use overrides::Overrides;

/// Larger files are no hands \[bytes\].
const MAX_FILE: u64 = 64 << 20;

/// How a URDF file is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UrdfOptions {
    /// Folders in which meshes are looked for besides the file's own folder and the folders above it: packages
    /// (`package://name/...` is looked for as `name/...` and `...` below each), or what relative paths start from.
    pub search_paths: Vec<PathBuf>,
    /// How finely the hand is covered.
    pub hand: HandOptions,
}

/// Returns the hand that a URDF file describes.
///
/// * Joints: fixed, revolute, continuous and prismatic; mimic joints follow. The articulation has one parameter for
///   each joint that moves by itself, in the order of the file.
/// * Shape: the collision geometry of each link, or its visual geometry where it has no collision geometry or where
///   a collision mesh has holes and the visual ones have none. A mesh with holes that nothing can stand in for is
///   replaced by its bounding box; [`Hand::notes`](crate::Hand::notes) tells.
/// * Open pose and palm frame, which URDF has no words for, follow from the kinematics: every joint is at 0, or in
///   its middle if it cannot get there, or at its other limit if it is closed at 0; the palm faces where the finger
///   tips move when all joints go to the middle of their ranges.
/// * `hand.toml` beside `hand.urdf`, if there is one, overrides any of this. All its keys may be left out:
///
///   ```toml
///   name = "my_hand"
///   package_paths = ["../meshes"]      # from this file's folder
///   [palm]                             # in the frame of the root link
///   center_m = [0.01, 0.0, 0.0]
///   normal = [1.0, 0.0, 0.0]           # out of the palm; any length
///   fingers = [0.0, 0.0, 1.0]          # where the fingers point; made orthogonal to the normal
///   [open]                             # joint = value [rad or m]
///   thumb_base = 0.8
///   [limits]                           # joint = [lower, upper]
///   thumb_base = [0.2, 1.4]
///   [closing]                          # joint = 1 (closes up), -1 (closes down) or 0
///   thumb_base = 1
///   [contacts]
///   count = 3000
///   [self_collision]
///   spheres = 160                      # 0 switches it off
///   allow = [["thumb_tip", "palm"]]    # links that may overlap
///   ```
///
/// Inertias, materials, transmissions, and anything else that does not bear on kinematics or shape, are not read.
///
/// # Errors
/// [`HandError::InFile`] with the fault, or [`HandError::Read`].
pub fn load_urdf(
    path: impl AsRef<Path>,
    options: &UrdfOptions,
) -> Result<ArticulatedHand, HandError> {
    let path = path.as_ref();
    parse_urdf(&read_text(path)?, path, options)
}

/// Returns the hand that the text of a URDF file describes, as [`load_urdf`] reads it.
///
/// `path`: where the text would stand; meshes and settings are looked for beside it.
///
/// # Errors
/// [`HandError::InFile`] with the fault.
pub fn parse_urdf(
    text: &str,
    path: impl AsRef<Path>,
    options: &UrdfOptions,
) -> Result<ArticulatedHand, HandError> {
    let path = path.as_ref();
    hand_from_text(text, path, options).map_err(|error| HandError::InFile {
        file: path.into(),
        error: Box::new(error),
    })
}

fn read_text(path: &Path) -> Result<String, HandError> {
    let failed = |error| HandError::Read {
        file: path.into(),
        error,
    };
    let metadata = std::fs::metadata(path).map_err(failed)?;
    // A pipe or device could make the reader wait for ever.
    if !metadata.is_file() || metadata.len() > MAX_FILE {
        let fault = format!("not a regular file of at most {} MB", MAX_FILE >> 20);
        return Err(failed(std::io::Error::other(fault)));
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn hand_from_text(
    text: &str,
    path: &Path,
    options: &UrdfOptions,
) -> Result<ArticulatedHand, HandError> {
    if text.trim().is_empty() {
        return Err(HandError::Empty);
    }
    let mut robot = xml::read(text.trim_start_matches('\u{feff}'), path)?;
    name_in_one_line(&mut robot);
    let links: Vec<String> = robot.links.iter().map(|link| link.name.clone()).collect();
    let joints = robot.joints.iter().map(joint);
    let mut tree = KinematicTree::new(&links, &joints.collect::<Result<Vec<_>, _>>()?)?;
    let overrides = Overrides::read(path)?;
    overrides.limit(&mut tree)?;

    let mut reader = GeometryReader::new(path, &overrides.search_paths(&options.search_paths));
    let mut parts = Vec::new();
    for link in &robot.links {
        let frame = tree.links().iter().find(|frame| frame.name == link.name);
        if let Some(frame) = frame {
            parts.extend(reader.parts(link, frame)?);
        }
    }
    if parts.is_empty() {
        return Err(HandError::NoGeometry);
    }
    let mut notes = reader.into_notes();
    for (name, limit) in tree.articulation_names().iter().zip(tree.limits()) {
        if limit.range() == 0.0 {
            notes.push(format!(
                "joint `{name}` has no range and stays at {}",
                limit.lower
            ));
        }
    }
    let (mut open, mut palm) = open_and_palm(&tree, &parts, &mut notes);
    overrides.open(&tree, &mut open)?;
    overrides.palm(&mut palm)?;
    notes.extend(overrides.note());
    let file_stem = || {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let name = overrides
        .name()
        .or(Some(robot.name).filter(|name| !name.trim().is_empty()));
    let description = HandDescription {
        name: name.unwrap_or_else(file_stem),
        tree,
        parts,
        open,
        palm,
        notes,
    };
    let closing = overrides.closing(&description.tree)?;
    let mut hand = ArticulatedHand::new(description, &overrides.hand_options(&options.hand))?;
    hand.describe_closing(closing);
    overrides.allow_overlaps(&mut hand)?;
    Ok(hand)
}

fn joint(joint: &urdf_rs::Joint) -> Result<Joint, HandError> {
    use urdf_rs::JointType;
    let kind = match joint.joint_type {
        JointType::Fixed => JointKind::Fixed,
        JointType::Revolute => JointKind::Revolute,
        JointType::Continuous => JointKind::Continuous,
        JointType::Prismatic => JointKind::Prismatic,
        JointType::Floating | JointType::Planar | JointType::Spherical => {
            return Err(HandError::UnsupportedJoint {
                joint: joint.name.clone(),
                kind: format!("{:?}", joint.joint_type).to_lowercase(),
            });
        }
    };
    let mimic = joint.mimic.as_ref().map(|mimic| Mimic {
        joint: mimic.joint.clone(),
        multiplier: mimic.multiplier.unwrap_or(1.0),
        offset: mimic.offset.unwrap_or(0.0),
    });
    Ok(Joint {
        name: joint.name.clone(),
        kind,
        parent: joint.parent.link.clone(),
        child: joint.child.link.clone(),
        origin: placement(&joint.origin),
        axis: joint.axis.xyz.0.into(),
        limit: Limit {
            lower: joint.limit.lower,
            upper: joint.limit.upper,
        },
        mimic,
    })
}

/// Turn by rpy (about the fixed x, then y, then z axis), then shift by xyz.
fn placement(pose: &urdf_rs::Pose) -> Rigid<f64> {
    let [roll, pitch, yaw] = pose.rpy.0;
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Rigid {
        rotation: Quaternion::from(rotation).to_matrix(),
        translation: pose.xyz.0.into(),
    }
}

/// Character references such as `&#10;` can put line breaks into names, which would break the lines of messages.
fn name_in_one_line(robot: &mut urdf_rs::Robot) {
    let mend = |name: &mut String| {
        if name.contains(char::is_control) {
            *name = name.replace(char::is_control, "?");
        }
    };
    mend(&mut robot.name);
    for joint in &mut robot.joints {
        mend(&mut joint.name);
        mend(&mut joint.parent.link);
        mend(&mut joint.child.link);
        if let Some(mimic) = &mut joint.mimic {
            mend(&mut mimic.joint);
        }
    }
    for link in &mut robot.links {
        mend(&mut link.name);
        let seen = link.visual.iter_mut().map(|visual| &mut visual.geometry);
        let felt = link.collision.iter_mut().map(|part| &mut part.geometry);
        for geometry in seen.chain(felt) {
            if let urdf_rs::Geometry::Mesh { filename, .. } = geometry {
                mend(filename);
            }
        }
    }
}
