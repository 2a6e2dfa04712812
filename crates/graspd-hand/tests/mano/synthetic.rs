//! A made-up model with the shapes of MANO's arrays: a flattened tube of 778 vertices, open at the wrist.

use std::f64::consts::TAU;

use graspd_hand::{
    JointPlacement, POSE_FEATURES, POSE_VALUES, SKINNED_JOINT_PARENTS, SKINNED_JOINTS, SkinnedModel,
};
use nalgebra::{DMatrix, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub(crate) const VERTICES: usize = 778;
pub(crate) const FACES: usize = 1538;
pub(crate) const SHAPES: usize = 10;

/// How far the hand bends towards its palm at height `y`.
fn curl(y: f64) -> f64 {
    y * y
}

/// Where the joints of the made-up hand are supposed to be: a right hand, fingers along +y, palm towards +z.
fn joint(joint: usize) -> Vector3<f64> {
    if joint == 0 {
        return Vector3::new(0.0, 0.01, 0.0);
    }
    let (finger, place) = ((joint - 1) / 3, ((joint - 1) % 3) as f64);
    match finger {
        4 => Vector3::new(0.02 + 0.005 * place, 0.03 + 0.02 * place, 0.01),
        _ => {
            let x = [0.024, 0.008, -0.024, -0.008][finger];
            let y = 0.09 + 0.025 * place;
            Vector3::new(x, y, curl(y))
        }
    }
}

/// One vertex at the tip, a ring of 9, then 48 rings of 16: MANO's numbers of vertices and triangles.
fn tube() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut vertices = vec![[0.0, 0.18, curl(0.18)]];
    let mut ring = |count: usize, y: f64, size: f64| {
        for k in 0..count {
            let angle = TAU * k as f64 / count as f64;
            vertices.push([size * angle.cos(), y, curl(y) + 0.35 * size * angle.sin()]);
        }
    };
    ring(9, 0.178, 0.015);
    for index in 0..48 {
        ring(
            16,
            0.175 * (1.0 - index as f64 / 47.0),
            0.04 - 0.01 * (index as f64 / 47.0),
        );
    }
    let mut faces = Vec::new();
    for k in 0..9 {
        faces.push([0, 1 + (k + 1) % 9, 1 + k]);
    }
    // A strip between rings of 9 and 16, always advancing the one that lags.
    let (mut inner, mut outer) = (0, 0);
    while inner < 9 || outer < 16 {
        if inner * 16 <= outer * 9 && inner < 9 {
            faces.push([1 + inner % 9, 1 + (inner + 1) % 9, 10 + outer % 16]);
            inner += 1;
        } else {
            faces.push([1 + inner % 9, 10 + (outer + 1) % 16, 10 + outer % 16]);
            outer += 1;
        }
    }
    for index in 0..47 {
        for k in 0..16 {
            let (a, b) = (10 + 16 * index + k, 10 + 16 * index + (k + 1) % 16);
            faces.push([a, b, b + 16]);
            faces.push([a, b + 16, a + 16]);
        }
    }
    (vertices, faces)
}

/// Rows of random orthonormal vectors.
fn orthonormal(random: &mut ChaCha8Rng) -> Vec<[f64; POSE_VALUES]> {
    let square = DMatrix::from_fn(POSE_VALUES, POSE_VALUES, |_, _| {
        random.random_range(-1.0..1.0)
    });
    let q = square.qr().q();
    (0..POSE_VALUES)
        .map(|row| std::array::from_fn(|column| q[(row, column)]))
        .collect()
}

/// The model; another `seed` gives other weights, directions and components.
pub(crate) fn model(seed: u64) -> SkinnedModel {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (template, faces) = tube();
    assert_eq!((template.len(), faces.len()), (VERTICES, FACES));
    let weights = template
        .iter()
        .map(|v| weights(Vector3::from(*v)))
        .collect();
    let regressor = (0..SKINNED_JOINTS)
        .map(|j| {
            // The three nearest vertices, with factors that sum to 1.
            let distance = |v: &usize| (Vector3::from(template[*v]) - joint(j)).norm();
            let mut order: Vec<usize> = (0..VERTICES).collect();
            order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            let mut row = vec![
                (order[0] as u32, 0.5),
                (order[1] as u32, 0.3),
                (order[2] as u32, 0.2),
            ];
            row.sort_by_key(|entry| entry.0);
            row
        })
        .collect();
    let mut numbers = |count: usize, size: f64| {
        (0..count)
            .map(|_| random.random_range(-size..size))
            .collect::<Vec<f64>>()
    };
    let shape_directions = numbers(VERTICES * 3 * SHAPES, 1e-3);
    let pose_directions = numbers(VERTICES * 3 * POSE_FEATURES, 2e-3);
    let mean = numbers(POSE_VALUES, 0.3);
    SkinnedModel {
        name: "made-up".into(),
        template,
        faces,
        parents: SKINNED_JOINT_PARENTS.to_vec(),
        weights,
        joints: JointPlacement::Regressed(regressor),
        shape_directions,
        pose_directions: Some(pose_directions),
        pose_components: orthonormal(&mut random),
        pose_mean: std::array::from_fn(|k| mean[k]),
        coefficient_limits: None,
        open_coefficients: None,
        component_names: None,
    }
}

/// The four nearest joints, falling off with the distance.
fn weights(vertex: Vector3<f64>) -> [f64; SKINNED_JOINTS] {
    let distances: [f64; SKINNED_JOINTS] = std::array::from_fn(|j| (vertex - joint(j)).norm());
    let mut order: Vec<usize> = (0..SKINNED_JOINTS).collect();
    order.sort_by(|&a, &b| distances[a].total_cmp(&distances[b]));
    let mut weights = [0.0; SKINNED_JOINTS];
    for &joint in &order[..4] {
        weights[joint] = (-distances[joint] / 0.01).exp() + 1e-3;
    }
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// The smallest model: a tetrahedron without blendshapes and with two components, for tests of many files.
pub(crate) fn smallest() -> SkinnedModel {
    let mut model = model(3);
    model.template = vec![
        [0.0, 0.0, 0.0],
        [0.05, 0.0, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.0, 0.05],
    ];
    model.faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    model.weights.truncate(4);
    model.joints = JointPlacement::Regressed(vec![vec![(0, 0.25), (2, 0.75)]; SKINNED_JOINTS]);
    model.shape_directions.truncate(4 * 3);
    model.pose_directions = None;
    model.pose_components.truncate(2);
    model
}
