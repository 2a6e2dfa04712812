//! Inverses of small matrices.

use std::cmp::Ordering;

/// The inverse of a matrix, by elimination with pivots from whole columns.
pub(super) fn inverse<const D: usize>(mut matrix: [[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let mut inverse = [[0.0; D]; D];
    for (k, row) in inverse.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for column in 0..D {
        let by_size = |a: &usize, b: &usize| -> Ordering {
            let size = |row: &usize| matrix[*row][column].abs();
            size(a).total_cmp(&size(b))
        };
        let pivot = (column..D).max_by(by_size)?;
        matrix.swap(column, pivot);
        inverse.swap(column, pivot);
        let scale = matrix[column][column].recip();
        if !scale.is_finite() {
            return None;
        }
        for k in 0..D {
            matrix[column][k] *= scale;
            inverse[column][k] *= scale;
        }
        let (own, own_inverse) = (matrix[column], inverse[column]);
        for row in 0..D {
            if row != column {
                let factor = matrix[row][column];
                for k in 0..D {
                    matrix[row][k] -= factor * own[k];
                    inverse[row][k] -= factor * own_inverse[k];
                }
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::super::hyperplane::dot;
    use super::super::simplex::tests::noise_source;
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let mut noise = noise_source();
        for _ in 0..100 {
            let matrix: [[f64; 6]; 6] = std::array::from_fn(|_| std::array::from_fn(|_| noise()));
            let inverse = inverse(matrix).unwrap();
            let size = inverse
                .iter()
                .flatten()
                .fold(1.0, |m: f64, x| m.max(x.abs()));
            for row in 0..6 {
                for column in 0..6 {
                    let other = std::array::from_fn(|k| inverse[k][column]);
                    let expected = f64::from(u8::from(row == column));
                    assert!((dot(&matrix[row], &other) - expected).abs() < 1e-14 * size);
                }
            }
        }
        assert_eq!(inverse([[1.0, 2.0], [2.0, 4.0]]), None);
        assert_eq!(
            inverse([[0.0, 2.0], [4.0, 0.0]]),
            Some([[0.0, 0.25], [0.5, 0.0]])
        );
    }
}
