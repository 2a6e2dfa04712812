//! Points moved onto a surface: iterative closest points, by distances to planes.

use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;

/// Steps after which a registration ends even if it still moves.
const MAX_STEPS: usize = 60;
/// It has come to rest when it moves by less \[m and rad\].
const AT_REST: f64 = 1e-7;
/// Weights fall from 1 to a half where the distance is so many times the median of all.
const ROBUSTNESS: f64 = 2.0;

/// How points came to lie on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// Moves the points onto the surface.
    pub motion: Isometry3<f64>,
    /// Root mean square of the distances from the points to the surface's planes after that \[m\].
    pub rms: f64,
    /// Their median \[m\].
    pub median: f64,
}

/// Moves points onto a surface, from where they are: each step finds for each point the nearest one of the surface and
/// its normal (`nearest`, `None` if it is too far away) and makes the distances to these planes least, large ones
/// counting less. `None` if fewer than six points have a partner.
///
/// # Source
/// Chen and Medioni, "Object modelling by registration of multiple range images", Image and Vision Computing 10
/// (1992), with Cauchy weights.
pub(super) fn registered(
    points: &[Point3<f64>],
    start: &Isometry3<f64>,
    nearest: impl Fn(&Point3<f64>) -> Option<(Point3<f64>, Vector3<f64>)> + Sync,
) -> Option<Registration> {
    let mut motion = *start;
    for step in 0.. {
        let pairs: Vec<(Vector3<f64>, Vector3<f64>, f64)> = (points.par_iter())
            .filter_map(|p| {
                let p = motion * p;
                let (q, normal) = nearest(&p)?;
                Some((p.coords, normal, normal.dot(&(p - q))))
            })
            .collect();
        if pairs.len() < 6 {
            return None;
        }
        let mut distances: Vec<f64> = pairs.iter().map(|(_, _, d)| d.abs()).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let median = distances[distances.len() / 2];
        let scale = (ROBUSTNESS * median).max(1e-9);
        let center = pairs.iter().map(|(p, ..)| p).sum::<Vector3<f64>>() / pairs.len() as f64;
        let (mut matrix, mut side) = (Matrix6::zeros(), Vector6::zeros());
        for (p, normal, distance) in &pairs {
            let weight = 1.0 / (1.0 + (distance / scale).powi(2));
            let turn = (p - center).cross(normal);
            let row = Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
            matrix += weight * row * row.transpose();
            side -= weight * distance * row;
        }
        // What the surface leaves free, such as turns about the axis of a can, stays as it is.
        let small = 1e-9 * matrix.trace();
        for i in 0..6 {
            matrix[(i, i)] += small;
        }
        let change = matrix.cholesky()?.solve(&side);
        if step == MAX_STEPS || change.amax() < AT_REST {
            let squares: f64 = distances.iter().map(|d| d * d).sum();
            return Some(Registration {
                motion,
                rms: (squares / distances.len() as f64).sqrt(),
                median,
            });
        }
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(change[0], change[1], change[2]));
        let shift = Vector3::new(change[3], change[4], change[5]);
        let about_center =
            Isometry3::from_parts(Translation3::from(center + shift - turn * center), turn);
        motion = about_center * motion;
    }
    None
}
