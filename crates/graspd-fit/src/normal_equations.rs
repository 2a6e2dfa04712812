//! Sums of weighted outer products of sparse rows.

use graspd_hand::JacobianRow;
use nalgebra::{DMatrix, DVector};

/// Unknowns of the base.
const BASE: usize = 6;

/// The matrix sum w r r^T and the vector sum s r over rows r, by the base and the coordinates of the rows; and both by
/// the articulation.
///
/// By plain loops in a fixed order: a library's product may round otherwise on another processor.
pub(crate) struct NormalEquations {
    /// The identity for the base, and B, with z = z_0 + B articulation; `None` where z is the articulation.
    basis: Option<SparseColumns>,
    /// Of each column what is not above the diagonal.
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
    /// M B, B^T M B and B^T v; empty without a basis.
    product: DMatrix<f64>,
    by_joints: (DMatrix<f64>, DVector<f64>),
    /// The row that is being added.
    columns: Vec<usize>,
    values: Vec<f64>,
}

/// The entries of each column that are not 0, and their rows.
type SparseColumns = Vec<Vec<(usize, f64)>>;

impl NormalEquations {
    /// `basis`: that of the hand's rows.
    pub(crate) fn new(basis: Option<DMatrix<f64>>, joints: usize) -> Self {
        let coordinates = basis.as_ref().map_or(joints, DMatrix::nrows);
        let size = BASE + coordinates;
        let sparse = |basis: DMatrix<f64>| {
            let entries = |column: usize| {
                let column = basis.column(column);
                let entries = column.iter().copied().enumerate();
                let entries = entries.filter(|(_, value)| *value != 0.0);
                entries.map(|(row, value)| (BASE + row, value)).collect()
            };
            let base = (0..BASE).map(|row| vec![(row, 1.0)]);
            base.chain((0..basis.ncols()).map(entries)).collect()
        };
        let unknowns = basis.as_ref().map_or(0, |basis| BASE + basis.ncols());
        Self {
            basis: basis.map(sparse),
            matrix: DMatrix::zeros(size, size),
            vector: DVector::zeros(size),
            product: DMatrix::zeros(size, unknowns),
            by_joints: (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns)),
            columns: Vec::new(),
            values: Vec::new(),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.matrix.fill(0.0);
        self.vector.fill(0.0);
    }

    /// Adds `weight` r r^T to the matrix and `slope` r to the vector.
    #[inline]
    pub(crate) fn add(&mut self, row: &JacobianRow<'_>, slope: f64, weight: f64) {
        self.columns.clear();
        self.values.clear();
        self.columns.extend(0..BASE);
        self.values.extend_from_slice(row.base);
        for &(column, value) in row.entries {
            self.columns.push(BASE + column as usize);
            self.values.push(value);
        }
        let size = self.vector.len();
        let matrix = self.matrix.as_mut_slice();
        for (number, (&column, &value)) in self.columns.iter().zip(&self.values).enumerate() {
            self.vector[column] += slope * value;
            let scaled = weight * value;
            // Columns come in any order: each pair once, wherever it falls.
            let line = &mut matrix[size * column..][..size];
            for (&other, &value) in self.columns[..=number].iter().zip(&self.values) {
                line[other] += scaled * value;
            }
        }
    }

    /// Completes the sums; returns the symmetric matrix and the vector by the base and the articulation.
    pub(crate) fn finish(&mut self) -> (&mut DMatrix<f64>, &mut DVector<f64>) {
        let Self {
            matrix,
            vector,
            product,
            by_joints,
            ..
        } = self;
        for column in 0..vector.len() {
            for row in 0..column {
                // A pair of columns was added in one order in some rows and in the other in others.
                let sum = matrix[(row, column)] + matrix[(column, row)];
                (matrix[(row, column)], matrix[(column, row)]) = (sum, sum);
            }
        }
        let Some(columns) = &self.basis else {
            return (matrix, vector);
        };
        product.fill(0.0);
        for (mut out, column) in product.column_iter_mut().zip(columns) {
            for &(row, value) in column {
                out.axpy(value, &matrix.column(row), 1.0);
            }
        }
        let (out, gradient) = by_joints;
        for (j, column) in columns.iter().enumerate() {
            gradient[j] = column.iter().map(|&(row, value)| vector[row] * value).sum();
            for i in 0..=j {
                let terms = columns[i].iter();
                let sum: f64 = terms.map(|&(row, value)| value * product[(row, j)]).sum();
                (out[(i, j)], out[(j, i)]) = (sum, sum);
            }
        }
        (out, gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same sums in another order; numbers are of order 1.
    const SAME: f64 = 1e-12;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn sums_are_those_of_dense_matrices(
            rows in prop::collection::vec(
                (
                    prop::array::uniform6(-1.0..1.0f64),
                    // Some columns, in any order.
                    prop::collection::hash_map(0..7_u32, -1.0..1.0f64, 0..5),
                    (-1.0..1.0f64, 0.0..1.0f64),
                ),
                0..12,
            ),
            // Half of the entries are 0.
            basis in prop::option::of(prop::collection::vec(-1.0..1.0f64, 21)),
        ) {
            let joints = if basis.is_some() { 3 } else { 7 };
            let basis = basis.map(|entries| DMatrix::from_vec(7, 3, entries).map(|x: f64| x.max(0.0)));
            let mut whole = DMatrix::identity(BASE + 7, BASE + joints);
            if let Some(basis) = &basis {
                whole.view_mut((BASE, BASE), (7, 3)).copy_from(basis);
            }
            let mut sums = NormalEquations::new(basis, joints);
            // What was there before must not count.
            sums.matrix.fill(9.0);
            sums.vector.fill(9.0);
            sums.clear();
            let mut matrix = DMatrix::zeros(BASE + joints, BASE + joints);
            let mut vector = DVector::zeros(BASE + joints);
            for (base, entries, (slope, weight)) in &rows {
                let entries: Vec<(u32, f64)> = entries.iter().map(|(&c, &v)| (c, v)).collect();
                let mut dense = DVector::zeros(BASE + 7);
                dense.rows_mut(0, BASE).copy_from_slice(base);
                for &(column, value) in &entries {
                    dense[BASE + column as usize] = value;
                }
                let by_joints = whole.transpose() * dense;
                matrix += &by_joints * by_joints.transpose() * *weight;
                vector += by_joints * *slope;
                sums.add(&JacobianRow { base, entries: &entries }, *slope, *weight);
            }
            let (found, gradient) = sums.finish();
            prop_assert!((&*found - matrix).amax() < SAME);
            prop_assert!((&*gradient - vector).amax() < SAME);
            prop_assert_eq!(&found.transpose(), found);
        }
    }
}
