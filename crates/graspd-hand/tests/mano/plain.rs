//! MANO by the formulas of its paper, in homogeneous matrices, with nothing shared with the crate's own code.

use graspd_hand::{HandPose, JointPlacement, SKINNED_JOINTS, SkinnedModel};
use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3, Vector4};

/// Vertices and joints of the shaped hand.
pub(crate) fn shaped(
    model: &SkinnedModel,
    shape: &[f64],
) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let directions = &model.shape_directions;
    let count = directions.len() / model.template.len() / 3;
    let mut vertices = Vec::new();
    for v in 0..model.template.len() {
        let mut vertex = Vector3::from(model.template[v]);
        for axis in 0..3 {
            for (s, beta) in shape.iter().enumerate() {
                vertex[axis] += directions[v * 3 * count + axis * count + s] * beta;
            }
        }
        vertices.push(vertex);
    }
    let joints = match &model.joints {
        JointPlacement::Regressed(rows) => rows
            .iter()
            .map(|row| row.iter().map(|&(v, w)| vertices[v as usize] * w).sum())
            .collect(),
        JointPlacement::Given { .. } => panic!("only regressed joints are tested here"),
    };
    (vertices, joints)
}

/// theta, `[45]`.
pub(crate) fn pose(model: &SkinnedModel, coefficients: &[f64], flat: bool) -> Vec<f64> {
    let start = |k: usize| if flat { 0.0 } else { model.pose_mean[k] };
    (0..45)
        .map(|k| {
            let rows = coefficients.iter().zip(&model.pose_components);
            start(k) + rows.map(|(c, row)| c * row[k]).sum::<f64>()
        })
        .collect()
}

/// The skinned vertices in the object frame.
pub(crate) fn skinned(
    model: &SkinnedModel,
    shape: &[f64],
    theta: &[f64],
    hand: &HandPose,
) -> Vec<Vector3<f64>> {
    let (rest, joints) = shaped(model, shape);
    let rotations: Vec<Matrix3<f64>> = (0..SKINNED_JOINTS)
        .map(|j| match j {
            0 => Matrix3::identity(),
            _ => Rotation3::new(Vector3::from_column_slice(&theta[3 * j - 3..3 * j])).into_inner(),
        })
        .collect();
    // World transforms, then the straight pose taken out of them.
    let rigid = |rotation: &Matrix3<f64>, translation: Vector3<f64>| {
        let mut m = Matrix4::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation);
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(&translation);
        m
    };
    let mut world: Vec<Matrix4<f64>> = Vec::new();
    for j in 0..SKINNED_JOINTS {
        world.push(match model.parents[j] {
            None => rigid(&rotations[j], joints[j]),
            Some(p) => world[p] * rigid(&rotations[j], joints[j] - joints[p]),
        });
    }
    let bind: Vec<Matrix4<f64>> = (0..SKINNED_JOINTS)
        .map(|j| world[j] * rigid(&Matrix3::identity(), -joints[j]))
        .collect();
    let mut feature = Vec::new();
    for rotation in &rotations[1..] {
        for row in 0..3 {
            for column in 0..3 {
                feature.push(rotation[(row, column)] - f64::from(u8::from(row == column)));
            }
        }
    }
    let base = UnitQuaternion::from(hand.rotation);
    (0..rest.len())
        .map(|v| {
            let mut vertex = rest[v];
            if let Some(directions) = &model.pose_directions {
                for axis in 0..3 {
                    for (k, f) in feature.iter().enumerate() {
                        vertex[axis] += directions[v * 405 + axis * 135 + k] * f;
                    }
                }
            }
            let blend: Matrix4<f64> = (0..SKINNED_JOINTS)
                .map(|j| bind[j] * model.weights[v][j])
                .sum();
            let placed = blend * Vector4::new(vertex.x, vertex.y, vertex.z, 1.0);
            base * placed.xyz() + Vector3::from(hand.translation)
        })
        .collect()
}
