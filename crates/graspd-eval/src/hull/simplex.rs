//! The simplex that a hull grows from.

use super::hyperplane::{difference, dot};

/// Up to D + 1 points: the farthest from the middle, then again and again the one farthest from the affine
/// hull of those chosen. Stops early where the rest lie within `flat` of that hull.
pub(super) fn widest_simplex<const D: usize>(points: &[[f64; D]], flat: f64) -> Vec<u32> {
    let mut residuals = points.to_vec();
    let mut simplex = vec![farthest(&residuals).0];
    let first = residuals[simplex[0] as usize];
    for residual in &mut residuals {
        *residual = difference(residual, &first);
    }
    while simplex.len() <= D {
        let (next, squared) = farthest(&residuals);
        if squared.sqrt() <= flat {
            break;
        }
        simplex.push(next);
        let direction = residuals[next as usize].map(|x| x / squared.sqrt());
        for residual in &mut residuals {
            // Twice, so that what is left is orthogonal to the direction to the last digit.
            for _ in 0..2 {
                let along = dot(residual, &direction);
                for k in 0..D {
                    residual[k] -= along * direction[k];
                }
            }
        }
    }
    simplex
}

/// The longest vector, the first among equals, and its squared length.
fn farthest<const D: usize>(vectors: &[[f64; D]]) -> (u32, f64) {
    let mut best = (0, -1.0);
    for (index, vector) in vectors.iter().enumerate() {
        let squared = dot(vector, vector);
        if squared > best.1 {
            best = (index as u32, squared);
        }
    }
    best
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// All points whose coordinates are among `values`.
    pub(in crate::hull) fn lattice<const D: usize>(values: &[f64]) -> Vec<[f64; D]> {
        let count = values.len();
        let digit = |number: usize, k: usize| values[number / count.pow(k as u32) % count];
        (0..count.pow(D as u32))
            .map(|number| std::array::from_fn(|k| digit(number, k)))
            .collect()
    }

    /// The same numbers in [-1, 1) every time (a linear congruential generator).
    pub(in crate::hull) fn noise_source() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// The lattice of -1, 0 and 1 and its corners once more, each coordinate moved by up to `noise`: points
    /// that nearly coincide and nearly line up.
    pub(in crate::hull) fn noisy_lattice<const D: usize>(noise: f64) -> Vec<[f64; D]> {
        let mut random = noise_source();
        let mut moved = |x: f64| x + noise * random();
        let mut points: Vec<[f64; D]> = lattice(&[-1.0, 0.0, 1.0]);
        points.extend(lattice::<D>(&[-1.0, 1.0]));
        points.iter().map(|point| point.map(&mut moved)).collect()
    }

    #[test]
    fn the_simplex_of_a_cube_is_one_of_its_largest() {
        let points: Vec<[f64; 3]> = lattice(&[-1.0, 0.0, 1.0]);
        let simplex = widest_simplex(&points, 1e-10);
        let [a, b, c, d] = std::array::from_fn(|k| points[simplex[k] as usize]);
        let [u, v, w] = [b, c, d].map(|p| nalgebra::Vector3::from(difference(&p, &a)));
        // The largest tetrahedron in a cube takes a third of it; a corner's takes a sixth.
        assert!(u.cross(&v).dot(&w).abs() / 6.0 >= 8.0 / 6.0 - 1e-12);
    }

    #[test]
    fn points_on_a_line_yield_its_ends() {
        let points: Vec<[f64; 3]> = [0.2, 1.0, -0.3, -1.0].map(|t| [t, 2.0 * t, -t]).into();
        let mut simplex = widest_simplex(&points, 1e-10);
        simplex.sort_unstable();
        assert_eq!(simplex, [1, 3]);
    }
}
