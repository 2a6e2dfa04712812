//! What stands on a table: the plane left out, the largest part kept.

use std::collections::HashMap;

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Plane;

/// Points that a plane is sought among; and planes tried.
const SAMPLE: usize = 5_000;
const TRIALS: usize = 400;
/// Distance from the plane at which a point votes for it \[m\].
const VOTING_DISTANCE: f64 = 0.004;
/// Part of the points that a table must have.
const MIN_PART: f64 = 0.2;
/// How much higher than the table, in deviations of its own points, and at least \[m\], the object begins.
const CLEARANCE: f64 = 3.0;
const MIN_CLEARANCE: f64 = 0.003;
/// Points in neighbouring cubes of this side are connected \[m\].
const LINK: f64 = 0.006;

/// The plane that most of the points lie on, its normal towards `eye`; `None` if there is none. The same for the
/// same points.
pub(super) fn dominant_plane(points: &[Point3<f64>], eye: &Point3<f64>) -> Option<Plane> {
    let stride = points.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<Point3<f64>> = points.iter().step_by(stride).copied().collect();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let near = |plane: &Plane| {
        let votes = sample
            .iter()
            .filter(|p| plane.height(p).abs() < VOTING_DISTANCE);
        votes.count()
    };
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..TRIALS {
        let mut corner = || sample.get(rng.random_range(0..sample.len().max(1)));
        let (a, b, c) = (corner()?, corner()?, corner()?);
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-9) else {
            continue;
        };
        let plane = Plane {
            normal,
            offset: -normal.dot(&a.coords),
        };
        let votes = near(&plane);
        if best.as_ref().is_none_or(|(most, _)| votes > *most) {
            best = Some((votes, plane));
        }
    }
    let (votes, plane) = best?;
    if (votes as f64) < MIN_PART * sample.len() as f64 {
        return None;
    }
    let plane = refined(points, &plane);
    Some(if plane.height(eye) < 0.0 {
        Plane {
            normal: -plane.normal,
            offset: -plane.offset,
        }
    } else {
        plane
    })
}

/// The least squares plane of the points near one.
fn refined(points: &[Point3<f64>], plane: &Plane) -> Plane {
    let near = points
        .iter()
        .filter(|p| plane.height(p).abs() < VOTING_DISTANCE);
    let near: Vec<Vector3<f64>> = near.map(|p| p.coords).collect();
    if near.len() < 3 {
        return *plane;
    }
    let mean = near.iter().sum::<Vector3<f64>>() / near.len() as f64;
    let spread: Matrix3<f64> = (near.iter())
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum();
    let eigen = SymmetricEigen::new(spread);
    let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    let normal = if normal.dot(&plane.normal) < 0.0 {
        -normal
    } else {
        normal
    };
    Plane {
        normal,
        offset: -normal.dot(&mean),
    }
}

/// The numbers of the points that stand on the table: above it by more than its own noise, in the largest connected
/// part.
pub(super) fn standing_on(points: &[Point3<f64>], table: &Plane) -> Vec<usize> {
    let table = refined(points, table);
    let (mut sum, mut count) = (0.0, 0.0);
    for p in points {
        let height = table.height(p);
        if height.abs() < 2.0 * VOTING_DISTANCE {
            sum += height * height;
            count += 1.0_f64;
        }
    }
    let clearance = (CLEARANCE * (sum / count.max(1.0)).sqrt()).max(MIN_CLEARANCE);
    let above: Vec<usize> = (0..points.len())
        .filter(|&i| table.height(&points[i]) > clearance)
        .collect();
    largest_part(points, &above)
}

/// The largest set of the given points that are connected by cubes that touch.
fn largest_part(points: &[Point3<f64>], numbers: &[usize]) -> Vec<usize> {
    let cube = |i: usize| points[i].coords.map(|x| (x / LINK).floor() as i64);
    let mut members: HashMap<Vector3<i64>, Vec<usize>> = HashMap::new();
    for &i in numbers {
        members.entry(cube(i)).or_default().push(i);
    }
    let mut best = Vec::new();
    // In the order of the points: a hash map's own order differs from run to run.
    for &i in numbers {
        let Some(first) = members.remove(&cube(i)) else {
            continue;
        };
        let (mut part, mut frontier) = (first, vec![cube(i)]);
        while let Some(center) = frontier.pop() {
            for code in 0..27 {
                let step = Vector3::new(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
                if let Some(more) = members.remove(&(center + step)) {
                    part.extend(more);
                    frontier.push(center + step);
                }
            }
        }
        if part.len() > best.len() {
            best = part;
        }
    }
    best.sort_unstable();
    best
}
