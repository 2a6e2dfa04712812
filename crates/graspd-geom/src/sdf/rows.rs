//! The winding number at all nodes of some rows of a grid at once.
//!
//! Every triangle is drawn into the grid of rows, seen along x: in each row that it covers it is crossed once, at
//! some x, and adds its sign to all nodes before that. The predicates are those of the winding number of a single
//! point, so the two agree everywhere.

use nalgebra::Point3;

use super::grid::node;
use crate::Vec3;
use crate::distance::Column;

/// The nodes of some rows along x.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    pub(super) origin: Vec3<f64>,
    pub(super) spacing: Vec3<f64>,
    /// Nodes along x, rows along y.
    pub(super) nx: usize,
    pub(super) ny: usize,
    /// The layers of rows, by their number along z.
    pub(super) layers: (usize, usize),
}

impl Rows {
    /// The winding number at each node, x fastest.
    pub(super) fn winding_numbers<'a>(
        &self,
        triangles: impl Iterator<Item = &'a [Point3<f64>; 3]>,
    ) -> Vec<i32> {
        let layers = self.layers.1 - self.layers.0;
        // A crossing after node i is stored at node i; the sum of all later ones is the winding number.
        let mut winding = vec![0; self.nx * self.ny * layers];
        for corners in triangles {
            self.draw(corners, &mut winding);
        }
        for row in winding.chunks_exact_mut(self.nx) {
            for i in (1..self.nx).rev() {
                row[i - 1] += row[i];
            }
        }
        winding
    }

    /// The indices of all nodes, x fastest.
    pub(super) fn indices(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let Self { nx, ny, layers, .. } = *self;
        let rows = (layers.0..layers.1).flat_map(move |k| (0..ny).map(move |j| [j, k]));
        rows.flat_map(move |[j, k]| (0..nx).map(move |i| [i, j, k]))
    }

    fn draw(&self, corners: &[Point3<f64>; 3], winding: &mut [i32]) {
        let (first, end) = self.layers;
        let (k_first, k_last) = covered(corners, 2, self.origin.z, self.spacing.z);
        let (k_first, k_last) = (k_first.max(first as f64), k_last.min(end as f64 - 1.0));
        if k_first > k_last {
            return;
        }
        let (j_first, j_last) = covered(corners, 1, self.origin.y, self.spacing.y);
        let (j_first, j_last) = (j_first.max(0.0), j_last.min(self.ny as f64 - 1.0));
        let column = Column::new(corners);
        for k in k_first as usize..=k_last as usize {
            let mut j = j_first;
            while j <= j_last {
                let start = self.node([0, j as usize, k]);
                let crossing = column.crossing(start.y, start.z);
                if crossing != 0 {
                    let before = self.nodes_before(&column, corners, crossing, [j as usize, k]);
                    if before > 0 {
                        let row = self.nx * (j as usize + self.ny * (k - first));
                        winding[row + before - 1] += crossing;
                    }
                }
                j += 1.0;
            }
        }
    }

    /// How many nodes of a row lie before the triangle that the row crosses.
    fn nodes_before(
        &self,
        column: &Column<'_>,
        [a, b, c]: &[Point3<f64>; 3],
        crossing: i32,
        [j, k]: [usize; 2],
    ) -> usize {
        // An estimate from the plane's equation, put right by the exact predicate.
        let start = self.node([0, j, k]);
        let normal = (b - a).cross(&(c - a));
        let x = a.x - (normal.y * (start.y - a.y) + normal.z * (start.z - a.z)) / normal.x;
        let x = x.max(a.x.min(b.x).min(c.x)).min(a.x.max(b.x).max(c.x));
        let estimate = (x - self.origin.x) / self.spacing.x + 1.0;
        let mut before = (estimate.max(0.0) as usize).min(self.nx);
        let is_before = |i: usize| column.is_beyond(&self.node([i, j, k]), crossing);
        while before < self.nx && is_before(before) {
            before += 1;
        }
        while before > 0 && !is_before(before - 1) {
            before -= 1;
        }
        before
    }

    fn node(&self, index: [usize; 3]) -> Point3<f64> {
        node(self.origin, self.spacing, index).into()
    }
}

/// The first and the last row or layer that a triangle may cover; one more on either side for rounding.
fn covered(corners: &[Point3<f64>; 3], axis: usize, origin: f64, spacing: f64) -> (f64, f64) {
    let [a, b, c] = corners.map(|corner| corner[axis]);
    let low = (a.min(b).min(c) - origin) / spacing;
    let high = (a.max(b).max(c) - origin) / spacing;
    (low.floor() - 1.0, high.ceil() + 1.0)
}
