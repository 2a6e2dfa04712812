//! Ten shape parameters: how hands differ in size and proportions.
//!
//! Each parameter counts standard deviations from the mean hand. A parameter stretches bones by small strains; joints
//! move along, and the skin follows the bones by its weights, so that skeleton and skin stay together.
//!
//! # Source
//! Standard deviations of hand length (about 5 % within a sex, 6 % over both), hand breadth (about 5 %), segment
//! lengths (6 to 12 % with measuring errors; the share that single fingers vary beyond the whole hand is taken as 4 %)
//! and finger breadths (about 6 %): Greiner 1991, Buryanov and Kotiuk 2010, as in [`super::proportions`].

use nalgebra::{Matrix3, Point3, Vector3};

use super::proportions::{RAYS, THUMB, chains};
use crate::mano::{SKINNED_JOINT_PARENTS, SKINNED_JOINTS};

/// How many shape parameters there are.
pub(crate) const SHAPE_PARAMETERS: usize = HUMAN_SHAPE_NAMES.len();

/// What each shape parameter changes, and by how much a standard deviation.
pub const HUMAN_SHAPE_NAMES: [&str; 10] = [
    "size of the whole hand, 6 %",
    "length of the fingers beyond the palm, 4 %",
    "breadth of the palm, 5 %",
    "length of the palm, 4 %",
    "thickness of fingers and thumb, 6 %",
    "thickness of the palm, 6 %",
    "length of the thumb, 5 %",
    "length of the index finger against the ring finger, 3 %",
    "length of the little finger, 5 %",
    "length of the last bones against the first ones, 5 %",
];

/// Returns the strain of each bone for one parameter: a small symmetric matrix E, so that a point p of a bone whose
/// joint is at J and moves by t goes to p + t + E (p - J).
fn strains(parameter: usize) -> [Matrix3<f64>; SKINNED_JOINTS] {
    let mut strains = [Matrix3::zeros(); SKINNED_JOINTS];
    let axis_strain = |axis: Vector3<f64>, size: f64| axis * axis.transpose() * size;
    let chains = chains();
    let mut stretch = |ray: usize, bone: usize, size: f64| {
        let along = chains[ray].along[bone];
        strains[RAYS[ray].first_joint + bone] += axis_strain(along, size);
    };
    match parameter {
        0 => strains = [Matrix3::identity() * 0.06; SKINNED_JOINTS],
        1 => (0..THUMB).for_each(|ray| (0..3).for_each(|bone| stretch(ray, bone, 0.04))),
        2 => strains[0] = axis_strain(Vector3::z(), 0.05),
        3 => strains[0] = axis_strain(Vector3::x(), 0.04),
        4 => {
            for (ray, chain) in chains.iter().enumerate() {
                for bone in 0..3 {
                    let across = Matrix3::identity() - axis_strain(chain.along[bone], 1.0);
                    strains[RAYS[ray].first_joint + bone] = across * 0.06;
                }
            }
        }
        5 => strains[0] = axis_strain(Vector3::y(), 0.06),
        6 => (0..3).for_each(|bone| stretch(THUMB, bone, 0.05)),
        7 => (0..3).for_each(|bone| {
            stretch(0, bone, 0.03);
            stretch(3, bone, -0.03);
        }),
        8 => (0..3).for_each(|bone| stretch(2, bone, 0.05)),
        _ => (0..=THUMB).for_each(|ray| {
            stretch(ray, 0, -0.02);
            stretch(ray, 2, 0.05);
        }),
    }
    strains
}

/// Movement of joints and vertices by each shape parameter.
pub(crate) struct ShapeDirections {
    /// `[16, 3, 10]`, row by row.
    pub(crate) joints: Vec<f64>,
    /// `[v, 3, 10]`, row by row.
    pub(crate) vertices: Vec<f64>,
}

impl ShapeDirections {
    pub(crate) fn new(
        joints: &[Point3<f64>; SKINNED_JOINTS],
        vertices: &[Point3<f64>],
        weights: &[[f64; SKINNED_JOINTS]],
    ) -> Self {
        let mut directions = Self {
            joints: vec![0.0; joints.len() * 3 * SHAPE_PARAMETERS],
            vertices: vec![0.0; vertices.len() * 3 * SHAPE_PARAMETERS],
        };
        for parameter in 0..SHAPE_PARAMETERS {
            let strains = strains(parameter);
            let mut moved = [Vector3::zeros(); SKINNED_JOINTS];
            for joint in 1..SKINNED_JOINTS {
                let parent = SKINNED_JOINT_PARENTS[joint].unwrap_or(0);
                moved[joint] = moved[parent] + strains[parent] * (joints[joint] - joints[parent]);
            }
            let put = |into: &mut [f64], row: usize, movement: Vector3<f64>| {
                for axis in 0..3 {
                    into[(3 * row + axis) * SHAPE_PARAMETERS + parameter] = movement[axis];
                }
            };
            for (row, movement) in moved.iter().enumerate() {
                put(&mut directions.joints, row, *movement);
            }
            for (row, (p, weights)) in vertices.iter().zip(weights).enumerate() {
                let follow = |bone: usize| moved[bone] + strains[bone] * (p - joints[bone]);
                let movement = (0..SKINNED_JOINTS)
                    .map(|bone| follow(bone) * weights[bone])
                    .sum();
                put(&mut directions.vertices, row, movement);
            }
        }
        directions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::human::{proportions, skin, skin_weights};

    /// Joints and vertices with one parameter at 1.
    fn shaped(parameter: usize) -> ([Point3<f64>; SKINNED_JOINTS], Vec<Point3<f64>>) {
        let (skin, mut joints) = (skin::skin(), proportions::joints());
        let weights = skin_weights::skin_weights(&skin);
        let directions = ShapeDirections::new(&joints, &skin.vertices, &weights);
        let movement = |rows: &[f64], row: usize| {
            Vector3::from_fn(|axis, _| rows[(3 * row + axis) * SHAPE_PARAMETERS + parameter])
        };
        for (row, joint) in joints.iter_mut().enumerate() {
            *joint += movement(&directions.joints, row);
        }
        let mut vertices = skin.vertices;
        for (row, vertex) in vertices.iter_mut().enumerate() {
            *vertex += movement(&directions.vertices, row);
        }
        (joints, vertices)
    }

    fn extent(vertices: &[Point3<f64>], axis: usize) -> f64 {
        let low = vertices
            .iter()
            .map(|p| p[axis])
            .fold(f64::INFINITY, f64::min);
        vertices
            .iter()
            .map(|p| p[axis])
            .fold(f64::NEG_INFINITY, f64::max)
            - low
    }

    fn ratio(parameter: usize, [from, to]: [usize; 2]) -> f64 {
        let rest = proportions::joints();
        let (joints, _) = shaped(parameter);
        (joints[to] - joints[from]).norm() / (rest[to] - rest[from]).norm()
    }

    #[test]
    fn parameters_change_what_they_say() {
        let rest = skin::skin().vertices;
        let close =
            |value: f64, wanted: f64| assert!((value - wanted).abs() < 2e-3, "{value} {wanted}");
        let (_, larger) = shaped(0);
        (0..3).for_each(|axis| close(extent(&larger, axis) / extent(&rest, axis), 1.06));
        // Middle finger's first bone; wrist to the middle finger's first joint.
        close(ratio(1, [4, 5]), 1.04);
        close(ratio(1, [0, 4]), 1.0);
        close(ratio(3, [4, 5]), 1.0);
        close(ratio(3, [0, 4]), 1.04);
        // Across the palm, from the index to the little finger.
        assert!(ratio(2, [1, 7]) > 1.04);
        close(ratio(6, [13, 14]), 1.05);
        close(ratio(7, [1, 2]), 1.03);
        close(ratio(7, [10, 11]), 0.97);
        close(ratio(8, [7, 8]), 1.05);
        close(ratio(9, [4, 5]), 0.98);
        // Thickness moves no finger by more than half a millimetre.
        for parameter in [4, 5] {
            let (joints, vertices) = shaped(parameter);
            let moved = joints
                .iter()
                .zip(proportions::joints())
                .map(|(a, b)| (a - b).norm());
            assert!(moved.fold(0.0, f64::max) < 6e-4);
            assert!(extent(&vertices, 1) > 1.002 * extent(&rest, 1));
        }
    }
}
