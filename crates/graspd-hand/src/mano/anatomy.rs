//! A pose space for models that bring none: the joints of a human hand, bending as its joints do.

use nalgebra::Vector3;

use super::fingers::{FINGERS, Fingers, THUMB};
use super::model::{POSE_VALUES, SkinnedModel};
use crate::Limit;

/// Names of the fingers, in the order of their joints.
const FINGER_NAMES: [&str; 5] = ["index", "middle", "pinky", "ring", "thumb"];

// Ranges [degrees] as clinicians measure them, 0 being the stretched finger: American Academy of Orthopaedic Surgeons,
// Joint Motion: Method of Measuring and Recording (1965); sideways and hyperextension as hands do without help.
const KNUCKLE_FLEXION: [f64; 2] = [-15.0, 90.0];
const KNUCKLE_ABDUCTION: [f64; 2] = [-15.0, 15.0];
const MIDDLE_FLEXION: [f64; 2] = [0.0, 100.0];
const END_FLEXION: [f64; 2] = [0.0, 80.0];
const THUMB_BASE_FLEXION: [f64; 2] = [-20.0, 30.0];
const THUMB_BASE_ABDUCTION: [f64; 2] = [-10.0, 50.0];
const THUMB_BASE_TWIST: [f64; 2] = [-20.0, 20.0];
const THUMB_KNUCKLE_FLEXION: [f64; 2] = [-10.0, 60.0];
const THUMB_END_FLEXION: [f64; 2] = [-10.0, 80.0];

/// Gives a model components that each turn one joint about one anatomical axis, so that coefficients are angles
/// \[rad\].
///
/// * Index to pinky: the knuckle bends and spreads, the two outer joints bend; all bend about the axis that takes the
///   finger towards the palm. Ranges count from the straight finger, whatever the template's pose is.
/// * Thumb: the base bends across the palm, lifts out of it and twists; the outer joints bend. Ranges count from the
///   template's pose.
/// * The open hand has straight fingers and a stretched thumb.
pub(crate) fn add_anatomical_pose_space(model: &mut SkinnedModel, fingers: &Fingers) {
    let mut space = Space::default();
    for (name, first) in FINGER_NAMES.into_iter().zip(FINGERS) {
        if first == THUMB {
            add_thumb(&mut space, fingers);
        } else {
            add_finger(&mut space, fingers, name, first);
        }
    }
    model.pose_components = space.components;
    model.pose_mean = [0.0; POSE_VALUES];
    model.coefficient_limits = Some(space.limits);
    model.open_coefficients = Some(space.open);
    model.component_names = Some(space.names);
}

#[derive(Default)]
struct Space {
    components: Vec<[f64; POSE_VALUES]>,
    limits: Vec<Limit>,
    open: Vec<f64>,
    names: Vec<String>,
}

impl Space {
    /// Adds a hinge with a range in degrees, whose angle in the template is `rest` \[rad\] and in the open hand
    /// `open`.
    fn add(
        &mut self,
        name: String,
        joint: usize,
        axis: Vector3<f64>,
        range: [f64; 2],
        rest: f64,
        open: f64,
    ) {
        let mut component = [0.0; POSE_VALUES];
        component[3 * (joint - 1)..3 * joint].copy_from_slice(axis.as_slice());
        let limit = Limit {
            lower: range[0].to_radians() - rest,
            upper: range[1].to_radians() - rest,
        };
        self.components.push(component);
        self.open.push(limit.clamp(open - rest));
        self.limits.push(limit);
        self.names.push(name);
    }
}

fn bone(fingers: &Fingers, joint: usize) -> Vector3<f64> {
    let bone = fingers.bone_end(joint) - fingers.joints[joint];
    bone.try_normalize(0.0).unwrap_or(fingers.forward)
}

/// Returns the axis about which a positive angle moves a bone along `direction` towards `side`.
fn axis_towards(direction: Vector3<f64>, side: Vector3<f64>) -> Vector3<f64> {
    let axis = direction.cross(&side);
    axis.try_normalize(1e-9).unwrap_or_else(|| {
        // Whatever is orthogonal to a bone that points that way already.
        direction
            .cross(&Vector3::ith(direction.iamin(), 1.0))
            .normalize()
    })
}

fn add_finger(space: &mut Space, fingers: &Fingers, name: &str, first: usize) {
    let bones = [0, 1, 2].map(|k| bone(fingers, first + k));
    let flexion = axis_towards(bones[0], fingers.palmar);
    let metacarpal = (fingers.joints[first] - fingers.joints[0]).normalize();
    let bend =
        |from: Vector3<f64>, to: Vector3<f64>| flexion.dot(&from.cross(&to)).atan2(from.dot(&to));
    let spread = axis_towards(bones[0], flexion);
    space.add(
        format!("{name}_knuckle_spread"),
        first,
        spread,
        KNUCKLE_ABDUCTION,
        0.0,
        0.0,
    );
    let rests = [
        bend(metacarpal, bones[0]),
        bend(bones[0], bones[1]),
        bend(bones[1], bones[2]),
    ];
    let ranges = [KNUCKLE_FLEXION, MIDDLE_FLEXION, END_FLEXION];
    for (place, part) in ["knuckle", "middle", "end"].into_iter().enumerate() {
        let name = format!("{name}_{part}_flexion");
        space.add(
            name,
            first + place,
            flexion,
            ranges[place],
            rests[place],
            0.0,
        );
    }
}

fn add_thumb(space: &mut Space, fingers: &Fingers) {
    let bones = [0, 1, 2].map(|k| bone(fingers, THUMB + k));
    // The thumb bends across the palm, towards the root of the little finger.
    let across = fingers.joints[7] - fingers.tips[4];
    let flexion = axis_towards(bones[1], across);
    let lift = axis_towards(bones[0], fingers.palmar);
    let stretched = THUMB_BASE_FLEXION[0].to_radians();
    let base = axis_towards(bones[0], across);
    space.add(
        "thumb_base_flexion".into(),
        THUMB,
        base,
        THUMB_BASE_FLEXION,
        0.0,
        stretched,
    );
    space.add(
        "thumb_base_abduction".into(),
        THUMB,
        lift,
        THUMB_BASE_ABDUCTION,
        0.0,
        0.0,
    );
    space.add(
        "thumb_base_twist".into(),
        THUMB,
        bones[0],
        THUMB_BASE_TWIST,
        0.0,
        0.0,
    );
    space.add(
        "thumb_knuckle_flexion".into(),
        THUMB + 1,
        flexion,
        THUMB_KNUCKLE_FLEXION,
        0.0,
        0.0,
    );
    space.add(
        "thumb_end_flexion".into(),
        THUMB + 2,
        flexion,
        THUMB_END_FLEXION,
        0.0,
        0.0,
    );
}
