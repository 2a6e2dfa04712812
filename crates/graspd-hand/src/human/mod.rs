//! A human right hand made by code, in MANO's layout.

#[cfg(test)]
#[path = "tests/mod.rs"]
mod generation;
mod joint_ranges;
mod proportions;
mod shape;
mod skin;
mod skin_weights;
mod synergies;
use graspd_geom::TriangleMesh;

use crate::HandError;
use crate::mano::{
    JointPlacement, SKINNED_JOINT_PARENTS, SkinnedHand, SkinnedHandOptions, SkinnedModel,
};
use synergies::PoseBasis;

pub use shape::HUMAN_SHAPE_NAMES;

/// The coordinates in which a [`human_model`] is posed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HumanPoseSpace {
    /// Angles of the joints, with the joints' own ranges as limits; the last two joints of a finger bend together.
    JointAngles,
    /// Principal components of natural postures, the most common movement first, within 2.5 standard deviations.
    Synergies,
}

/// Makes the model of the hand that [`human`] returns, in one of its pose spaces; always the same.
pub(crate) fn human_model(space: HumanPoseSpace) -> SkinnedModel {
    let skin = skin::skin();
    let weights = skin_weights::skin_weights(&skin);
    let joints = proportions::joints();
    let shape = shape::ShapeDirections::new(&joints, &skin.vertices, &weights);
    let basis = match space {
        HumanPoseSpace::JointAngles => synergies::joint_basis(),
        HumanPoseSpace::Synergies => synergies::synergy_basis(),
    };
    let TriangleMesh { vertices, faces } = skin;
    let PoseBasis {
        components,
        mean,
        limits,
        open,
        names,
    } = basis;
    SkinnedModel {
        name: "human".into(),
        template: vertices.iter().map(|p| p.coords.into()).collect(),
        faces,
        parents: SKINNED_JOINT_PARENTS.to_vec(),
        weights,
        joints: JointPlacement::Given {
            template: joints.iter().map(|p| p.coords.into()).collect(),
            shape_directions: shape.joints,
        },
        shape_directions: shape.vertices,
        pose_directions: None,
        pose_components: components,
        pose_mean: mean,
        coefficient_limits: Some(limits),
        open_coefficients: Some(open),
        component_names: Some(names),
    }
}

/// Returns a human right hand, made by code from published measures: an average adult hand of about 188 mm, open to
/// use without a licence.
///
/// In MANO's layout: 778 vertices, 16 joints in MANO's order, ten shape parameters ([`HUMAN_SHAPE_NAMES`]), 45 pose
/// components. The origin is the wrist joint; in the rest pose the fingers are straight towards -x, slightly spread,
/// the palm faces -y and the thumb points towards +z. The skin is closed, also at the wrist, and has the most vertices
/// on the pads of fingers and palm. It is posed by the angles of its joints.
///
/// # Errors
/// [`HandError::BadOption`] for options that the model cannot follow.
pub fn human(options: &SkinnedHandOptions) -> Result<SkinnedHand, HandError> {
    SkinnedHand::new(human_model(HumanPoseSpace::JointAngles), options)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::*;
    use crate::mano::{POSE_VALUES, SKINNED_JOINTS};
    use graspd_geom::{require_closed, signed_volume};

    /// Plain linear blend skinning of the unshaped model.
    pub(super) fn posed(model: &SkinnedModel, pose: &[f64; POSE_VALUES]) -> TriangleMesh {
        let JointPlacement::Given { template, .. } = &model.joints else {
            panic!("joints are given");
        };
        let rest: Vec<Vector3<f64>> = template.iter().map(|&p| p.into()).collect();
        let (mut turn, mut place) = (vec![Matrix3::identity(); SKINNED_JOINTS], rest.clone());
        for joint in 1..SKINNED_JOINTS {
            let parent = model.parents[joint].unwrap();
            let own = Rotation3::new(Vector3::from_column_slice(&pose[3 * joint - 3..3 * joint]));
            turn[joint] = turn[parent] * own.matrix();
            place[joint] = place[parent] + turn[parent] * (rest[joint] - rest[parent]);
        }
        let vertices = model
            .template
            .iter()
            .zip(&model.weights)
            .map(|(&p, weights)| {
                let follow =
                    |bone: usize| place[bone] + turn[bone] * (Vector3::from(p) - rest[bone]);
                let sum: Vector3<f64> = (0..SKINNED_JOINTS).map(|b| follow(b) * weights[b]).sum();
                sum.into()
            });
        TriangleMesh {
            vertices: vertices.collect(),
            faces: model.faces.clone(),
        }
    }

    /// Returns the pose in which flexion angles named by their ends have the given values in degrees.
    fn flexed(model: &SkinnedModel, wanted: &[(&str, f64)]) -> [f64; POSE_VALUES] {
        let mut pose = [0.0; POSE_VALUES];
        let names = model.component_names.as_ref().unwrap();
        for (name, row) in names.iter().zip(&model.pose_components) {
            for (_, degrees) in wanted.iter().filter(|(end, _)| name.ends_with(end)) {
                let angle = degrees.to_radians();
                pose.iter_mut().zip(row).for_each(|(p, r)| *p += angle * r);
            }
        }
        pose
    }

    #[test]
    fn the_model_is_valid_and_always_the_same() {
        for space in [HumanPoseSpace::JointAngles, HumanPoseSpace::Synergies] {
            let model = human_model(space);
            model.validate().unwrap();
            assert_eq!(model.shape_count(), HUMAN_SHAPE_NAMES.len());
            assert_eq!(model, human_model(space));
        }
    }

    #[test]
    fn bent_fingers_keep_their_skin_whole() {
        let model = human_model(HumanPoseSpace::JointAngles);
        let rest = posed(&model, &[0.0; POSE_VALUES]);
        let wanted = [("_mcp_flexion", 60.0), ("_pip_flexion", 90.0)];
        let bent = posed(&model, &flexed(&model, &wanted));
        require_closed(&bent, "bent hand").unwrap();
        // Blending linearly loses some of the volume at bent joints.
        let kept = signed_volume(&bent) / signed_volume(&rest);
        assert!((0.85..1.05).contains(&kept), "{kept}");
        let longest = |mesh: &TriangleMesh, [a, b]: [u32; 2]| {
            (mesh.vertices[a as usize] - mesh.vertices[b as usize]).norm()
        };
        for &[a, b, c] in &rest.faces {
            for edge in [[a, b], [b, c], [c, a]] {
                let stretch = longest(&bent, edge) / longest(&rest, edge);
                assert!(stretch < 3.0, "edge {edge:?} is torn: {stretch}");
            }
        }
    }

    #[test]
    fn flexion_brings_the_fingertips_to_the_palm() {
        let model = human_model(HumanPoseSpace::JointAngles);
        let tip = |pose: &[f64; POSE_VALUES]| {
            let hand = posed(&model, pose);
            // The middle finger's tip is the farthest vertex of the rest pose.
            let vertex = (0..model.template.len())
                .min_by(|&a, &b| model.template[a][0].total_cmp(&model.template[b][0]));
            hand.vertices[vertex.unwrap()]
        };
        let flat = tip(&[0.0; POSE_VALUES]);
        let relaxed = tip(&model.pose_mean);
        let closed = tip(&flexed(
            &model,
            &[("_mcp_flexion", 80.0), ("_pip_flexion", 110.0)],
        ));
        assert!(relaxed.y < flat.y - 0.03, "the relaxed hand is half closed");
        assert!(
            closed.y < -0.02 && (-0.10..-0.03).contains(&closed.x),
            "{closed}"
        );
    }
}
