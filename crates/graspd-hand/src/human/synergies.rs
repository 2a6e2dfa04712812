//! Pose spaces: joint angles with their ranges, and synergies.
//!
//! Both are orthonormal bases of the 45 rotation-vector entries. Joint angles have ranges that are exactly those of
//! the joints. Synergies are the principal components of a population of postures: few of them make a natural hand,
//! but ranges of their coefficients cannot keep single joints within theirs.
//!
//! # Source
//! The population is normally distributed around the relaxed hand, with covariances composed of what is known of
//! natural postures: one movement closes all fingers at their first and second joints while the thumb opposes; the
//! next trades flexion at the first joints for extension at the second (Santello, Flanders, Soechting, "Postural hand
//! synergies for tool use", Journal of Neuroscience 18, 1998: two components make over 80 % of the variance of 15
//! joint angles); fingers move with their neighbours, the thumb most independently and the index next (Ingram,
//! Koerding, Howard, Wolpert, "The statistics of natural hand movements", Experimental Brain Research 188, 2008); the
//! last joint bends by about two thirds of the middle one (Rijpkema and Girard, SIGGRAPH 1991). The sizes of the
//! movements are chosen to fill the joint ranges within two to three standard deviations.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::joint_ranges::{Freedom, freedoms, pose_of_angles};
use crate::Limit;
use crate::mano::POSE_VALUES;

/// A basis of the pose space with what is known of its coefficients.
pub(crate) struct PoseBasis {
    /// Orthonormal rows.
    pub(crate) components: Vec<[f64; POSE_VALUES]>,
    /// The pose of zero coefficients: the relaxed hand.
    pub(crate) mean: [f64; POSE_VALUES],
    pub(crate) limits: Vec<Limit>,
    pub(crate) open: Vec<f64>,
    pub(crate) names: Vec<String>,
}

/// Part of a middle joint's flexion that the last joint follows with.
const LAST_JOINT_RATIO: f64 = 2.0 / 3.0;
/// How far the last joint may depart from that, along the direction at right angles to it \[rad\].
const LAST_JOINT_PLAY: f64 = 0.3;
/// Coefficients of synergies may be this many standard deviations from 0.
const SYNERGY_RANGE: f64 = 2.5;

/// One row for each freedom of each joint; the last two joints of each finger bend together, with a little play.
pub(crate) fn joint_basis() -> PoseBasis {
    let freedoms = freedoms();
    let (mean, open) = postures(&freedoms);
    let mut basis = PoseBasis {
        components: Vec::new(),
        mean,
        limits: Vec::new(),
        open: Vec::new(),
        names: Vec::new(),
    };
    let mut push = |name: &str, parts: &[(usize, f64)], lower: f64, upper: f64| {
        let mut angles = [0.0; POSE_VALUES];
        parts
            .iter()
            .for_each(|&(index, factor)| angles[index] = factor);
        let row = pose_of_angles(&freedoms, &angles);
        basis.open.push(
            row.iter()
                .zip(&open)
                .zip(&mean)
                .map(|((r, o), m)| r * (o - m))
                .sum(),
        );
        basis.components.push(row);
        basis.limits.push(Limit { lower, upper });
        basis.names.push(name.to_owned());
    };
    for (index, freedom) in freedoms.iter().enumerate() {
        let range = |f: &Freedom| (f.lower - f.relaxed, f.upper - f.relaxed);
        let norm = LAST_JOINT_RATIO.hypot(1.0);
        let (cosine, sine) = (1.0 / norm, LAST_JOINT_RATIO / norm);
        if freedom.name.ends_with("pip_flexion") {
            // Together: the range that this joint has.
            let (lower, upper) = range(freedom);
            let parts = [(index, cosine), (index + 3, sine)];
            push(&freedom.name, &parts, lower / cosine, upper / cosine);
        } else if freedom.name.ends_with("dip_flexion") {
            let parts = [(index - 3, -sine), (index, cosine)];
            push(&freedom.name, &parts, -LAST_JOINT_PLAY, LAST_JOINT_PLAY);
        } else {
            let (lower, upper) = range(freedom);
            push(&freedom.name, &[(index, 1.0)], lower, upper);
        }
    }
    basis
}

/// Returns the principal components of natural postures, those of the greatest variance first.
pub(crate) fn synergy_basis() -> PoseBasis {
    let freedoms = freedoms();
    let (mean, open) = postures(&freedoms);
    let eigen = SymmetricEigen::new(covariance(&freedoms));
    let mut order: Vec<usize> = (0..POSE_VALUES).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut basis = PoseBasis {
        components: Vec::new(),
        mean,
        limits: Vec::new(),
        open: Vec::new(),
        names: (0..POSE_VALUES).map(|k| format!("synergy_{k}")).collect(),
    };
    for column in order {
        let mut angles: Vec<f64> = eigen.eigenvectors.column(column).iter().copied().collect();
        // An eigenvector has no sign of its own: positive closes the hand.
        let flexion: f64 = angles.iter().step_by(3).sum();
        if flexion < 0.0 {
            angles.iter_mut().for_each(|angle| *angle = -*angle);
        }
        let row = pose_of_angles(&freedoms, &angles);
        let reach = SYNERGY_RANGE * eigen.eigenvalues[column].max(0.0).sqrt();
        let wanted: f64 = row
            .iter()
            .zip(&open)
            .zip(&mean)
            .map(|((r, o), m)| r * (o - m))
            .sum();
        basis.open.push(wanted.clamp(-reach, reach));
        basis.components.push(row);
        basis.limits.push(Limit {
            lower: -reach,
            upper: reach,
        });
    }
    basis
}

/// Returns the relaxed and the open hand as rotation vectors.
fn postures(freedoms: &[Freedom]) -> ([f64; POSE_VALUES], [f64; POSE_VALUES]) {
    let relaxed: Vec<f64> = freedoms.iter().map(|f| f.relaxed).collect();
    let open: Vec<f64> = freedoms.iter().map(|f| f.open).collect();
    (
        pose_of_angles(freedoms, &relaxed),
        pose_of_angles(freedoms, &open),
    )
}

/// The fingers from the index to the little finger, as their ray numbers, with how far each takes part in movements
/// of single fingers.
const FINGERS: [(usize, f64); 4] = [(0, 1.2), (1, 0.9), (3, 0.9), (2, 1.1)];

/// Covariance of the angles of all freedoms \[rad^2\].
fn covariance(freedoms: &[Freedom]) -> DMatrix<f64> {
    let mut covariance = DMatrix::zeros(POSE_VALUES, POSE_VALUES);
    // Joints that hardly move still have play: no variance is zero.
    for (index, freedom) in freedoms.iter().enumerate() {
        let spread = 0.1 * (freedom.upper - freedom.lower).min(0.4);
        covariance[(index, index)] += spread * spread;
    }
    for movement in movements() {
        covariance += &movement * movement.transpose();
    }
    covariance
}

/// Movements that are independent of each other, each as large as its standard deviation.
fn movements() -> Vec<DVector<f64>> {
    const FLEXION: usize = 0;
    const SIDEWAYS: usize = 1;
    const TWIST: usize = 2;
    let index = |ray: usize, joint: usize, kind: usize| 9 * ray + 3 * joint + kind;
    let movement = |parts: &[(usize, f64)]| {
        let mut vector = DVector::zeros(POSE_VALUES);
        parts
            .iter()
            .for_each(|&(index, degrees)| vector[index] += degrees.to_radians());
        vector
    };
    let bend = |ray: usize, first: f64, middle: f64| {
        [
            (index(ray, 0, FLEXION), first),
            (index(ray, 1, FLEXION), middle),
            (index(ray, 2, FLEXION), LAST_JOINT_RATIO * middle),
        ]
    };
    let thumb = |joint, kind, degrees| (index(super::proportions::THUMB, joint, kind), degrees);
    let all = |first: f64, middle: f64| {
        FINGERS
            .iter()
            .flat_map(move |&(ray, _)| bend(ray, first, middle))
    };

    let mut movements = Vec::new();
    // Closing with the thumb opposed; first joints against middle ones.
    let opposing = [
        thumb(0, SIDEWAYS, 8.0),
        thumb(0, TWIST, 6.0),
        thumb(1, FLEXION, 5.0),
        thumb(2, FLEXION, 6.0),
    ];
    movements.push(movement(
        &all(20.0, 22.0).chain(opposing).collect::<Vec<_>>(),
    ));
    let straightening = [
        thumb(1, FLEXION, 4.0),
        thumb(2, FLEXION, -8.0),
        thumb(0, FLEXION, 5.0),
    ];
    movements.push(movement(
        &all(13.0, -15.0).chain(straightening).collect::<Vec<_>>(),
    ));
    // Spreading, with the first joints straightening.
    let spread = [(0, -6.0), (1, -1.0), (3, 4.0), (2, 8.0)];
    let parts = spread.iter().flat_map(|&(ray, degrees)| {
        [
            (index(ray, 0, SIDEWAYS), degrees),
            (index(ray, 0, FLEXION), -4.0),
        ]
    });
    movements.push(movement(&parts.collect::<Vec<_>>()));
    // From the pinch, with the little finger's side open, to the grip of that side.
    let grade = [-10.0, -2.0, 6.0, 10.0];
    let parts = FINGERS
        .iter()
        .zip(grade)
        .flat_map(|(&(ray, _), degrees)| bend(ray, degrees, 0.8 * degrees));
    movements.push(movement(&parts.collect::<Vec<_>>()));
    // The thumb by itself: across, away, and bent.
    movements.push(movement(&[
        thumb(0, FLEXION, 11.0),
        thumb(0, TWIST, 5.0),
        thumb(1, FLEXION, 8.0),
    ]));
    movements.push(movement(&[thumb(0, SIDEWAYS, 11.0), thumb(0, TWIST, 6.0)]));
    movements.push(movement(&[thumb(1, FLEXION, 8.0), thumb(2, FLEXION, 18.0)]));
    // Single fingers at the first and at the middle joint, taking their neighbours along.
    for (place, &(_, own)) in FINGERS.iter().enumerate() {
        for [first, middle] in [[8.0, 2.0], [-2.0, 8.0]] {
            let parts = FINGERS.iter().enumerate().flat_map(|(other, &(ray, _))| {
                let part = own * [1.0, 0.35, 0.1, 0.0][place.abs_diff(other)];
                bend(ray, part * first, part * middle)
            });
            movements.push(movement(&parts.collect::<Vec<_>>()));
        }
    }
    movements
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(a: &[f64; POSE_VALUES], b: &[f64; POSE_VALUES]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn both_bases_are_orthonormal_and_contain_the_relaxed_and_the_open_hand() {
        for basis in [joint_basis(), synergy_basis()] {
            assert_eq!(basis.components.len(), POSE_VALUES);
            for (i, a) in basis.components.iter().enumerate() {
                for (j, b) in basis.components.iter().enumerate() {
                    let wanted = f64::from(u8::from(i == j));
                    assert!((dot(a, b) - wanted).abs() < 1e-9);
                }
            }
            for ((limit, open), name) in basis.limits.iter().zip(&basis.open).zip(&basis.names) {
                assert!(
                    limit.lower < 0.0 && limit.upper > 0.0
                        || limit.lower <= 0.0 && limit.upper >= 0.0
                );
                assert!(
                    (limit.lower..=limit.upper).contains(open),
                    "{name}: {open} in {limit:?}"
                );
            }
        }
    }

    #[test]
    fn limits_of_joint_angles_are_the_ranges_of_the_joints() {
        let (basis, freedoms) = (joint_basis(), freedoms());
        // The worst that the corners of the box of all coefficients do to each freedom.
        for (index, freedom) in freedoms.iter().enumerate() {
            let mut unit = [0.0; POSE_VALUES];
            unit[index] = 1.0;
            let axis = pose_of_angles(&freedoms, &unit);
            let (mut lowest, mut highest) = (freedom.relaxed, freedom.relaxed);
            for (row, limit) in basis.components.iter().zip(&basis.limits) {
                let part = dot(row, &axis);
                lowest += (part * limit.lower).min(part * limit.upper);
                highest += (part * limit.lower).max(part * limit.upper);
            }
            // The last two joints of a finger share their ranges: the play of one is at the cost of the other.
            let slack = if freedom.name.ends_with("ip_flexion") {
                LAST_JOINT_PLAY + 0.15
            } else {
                1e-9
            };
            assert!(
                lowest > freedom.lower - slack,
                "{} down to {lowest}",
                freedom.name
            );
            assert!(
                highest < freedom.upper + slack,
                "{} up to {highest}",
                freedom.name
            );
        }
    }

    #[test]
    fn two_synergies_make_most_of_the_variance_as_published() {
        let basis = synergy_basis();
        let variance: Vec<f64> = basis
            .limits
            .iter()
            .map(|limit| limit.upper.powi(2))
            .collect();
        let part = variance[..2].iter().sum::<f64>() / variance.iter().sum::<f64>();
        // Santello et al.: over 80 % of the variance of 15 measured angles; here there are 45.
        assert!((0.7..0.9).contains(&part), "{part}");
        let freedoms = freedoms();
        let along = |component: usize, name: &str| {
            let index = freedoms.iter().position(|f| f.name == name).unwrap();
            let mut unit = [0.0; POSE_VALUES];
            unit[index] = 1.0;
            dot(
                &basis.components[component],
                &pose_of_angles(&freedoms, &unit),
            )
        };
        for finger in ["index", "middle", "ring", "pinky"] {
            let (mcp, pip) = (
                format!("{finger}_mcp_flexion"),
                format!("{finger}_pip_flexion"),
            );
            assert!(along(0, &mcp) > 0.1 && along(0, &pip) > 0.1);
            assert!(along(1, &mcp) * along(1, &pip) < 0.0);
        }
    }
}
