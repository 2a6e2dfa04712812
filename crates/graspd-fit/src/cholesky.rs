//! Solution of the normal equations by faer's Cholesky factorisation.
//!
//! faer's vector kernels fuse multiplications with additions where the processor can, so that their
//! last bits depend on it. They need column-major storage; for a row-major matrix faer runs its
//! scalar kernel, a fixed sequence of plain operations, which gives the same bits everywhere. At
//! the 22 to 51 unknowns of a hand that costs a few microseconds. A test compares with the sequence
//! written out, so that another version of faer cannot change it unnoticed.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::{Auto, MatMut, Par, Spec};
use nalgebra::{DMatrix, DVector};

/// Solves systems of one size after another in the same memory.
#[derive(Default)]
pub(crate) struct Cholesky {
    /// For systems of that many unknowns.
    memory: Option<(usize, MemBuffer)>,
}

impl Cholesky {
    /// Solves `matrix` x = `right` for a symmetric matrix `[n, n]`, which is overwritten, and puts x in `right`;
    /// returns whether it could: if the matrix is positive definite.
    pub(crate) fn solve(&mut self, matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) -> bool {
        let n = matrix.nrows();
        // One block of unknowns: no recursion, hence no matrix products, which use vector kernels.
        let mut params = <LltParams as Auto<f64>>::auto();
        (params.recursion_threshold, params.block_size) = (n, n);
        let params = Spec::new(params);
        if self.memory.as_ref().is_none_or(|(size, _)| *size != n) {
            let memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(n, Par::Seq, params));
            self.memory = Some((n, memory));
        }
        let Some((_, memory)) = &mut self.memory else {
            return false;
        };
        // The transpose of a symmetric matrix is the same, and its rows are stored one after another.
        let rows = MatMut::from_row_major_slice_mut(matrix.as_mut_slice(), n, n);
        let stack = MemStack::new(memory);
        let regularization = LltRegularization::default();
        if cholesky_in_place(rows, regularization, Par::Seq, stack, params).is_err() {
            return false;
        }
        // Seen by columns, the factor L is the upper triangular L^T.
        matrix.tr_solve_upper_triangular_mut(right) && matrix.solve_upper_triangular_mut(right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn solve(mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> Option<DVector<f64>> {
        Cholesky::default()
            .solve(&mut matrix, &mut right)
            .then_some(right)
    }

    /// A = L L^T by dot products in ascending order, and L y = b, L^T x = y, as nalgebra substitutes.
    fn by_plain_loops(mut a: DMatrix<f64>, mut right: DVector<f64>) -> Option<DVector<f64>> {
        let n = a.nrows();
        for j in 0..n {
            for i in j..n {
                let mut sum = 0.0;
                for k in 0..j {
                    sum += a[(j, k)] * a[(i, k)];
                }
                a[(i, j)] -= sum;
            }
            if a[(j, j)] <= 0.0 {
                return None;
            }
            let inverse = a[(j, j)].sqrt().recip();
            for i in j..n {
                a[(i, j)] *= inverse;
            }
        }
        let upper = a.transpose();
        upper.tr_solve_upper_triangular_mut(&mut right);
        upper.solve_upper_triangular_mut(&mut right);
        Some(right)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn solutions_are_those_of_plain_loops_to_the_last_bit(
            n in 2_usize..70,
            numbers in prop::collection::vec(-1.0..1.0f64, 70 * 71),
        ) {
            let rows = DMatrix::from_column_slice(n, n, &numbers[..n * n]);
            let right = DVector::from_column_slice(&numbers[n * n..][..n]);
            // Symmetric to the last bit.
            let gram = |i: usize, j: usize| rows.row(i.max(j)).dot(&rows.row(i.min(j)));
            let matrix = DMatrix::from_fn(n, n, gram) + DMatrix::identity(n, n) * 0.1;
            let found = solve(matrix.clone(), right.clone()).unwrap();
            prop_assert_eq!(&Some(found.clone()), &by_plain_loops(matrix.clone(), right.clone()));
            prop_assert!((matrix * found - right).amax() < 1e-9);
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_solution() {
        let matrix = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, -1.0, 2.0]));
        assert_eq!(solve(matrix, DVector::zeros(3)), None);
        assert_eq!(
            solve(DMatrix::from_element(3, 3, f64::NAN), DVector::zeros(3)),
            None
        );
    }
}
