//! Which samples of a grid a triangle covers.

use std::ops::Range;

use crate::projection::GridPoint;

/// Samples along each side of a pixel.
pub(crate) const SAMPLES: usize = 3;
/// Steps of the integer grid to which corners are rounded, per sample.
const STEPS: i64 = 256;

/// A triangle with corners on an integer grid.
///
/// All decisions are made in integers: triangles that share an edge leave no sample uncovered and cover none
/// twice.
pub(crate) struct GridTriangle {
    /// Corners \[1/256 sample\], in the order that makes the area positive.
    corners: [[i64; 2]; 3],
    /// Nearness at the grid's origin and its slopes \[1/sample\].
    nearness: [f64; 3],
    /// Lowest and highest nearness of the corners: the plane of a sliver overshoots between samples.
    nearness_range: [f64; 2],
    /// What was drawn.
    pub(crate) face: u32,
}

impl GridTriangle {
    /// Rounds the corners to the grid; `None` where they are in line (on the integer grid) or further out than a
    /// picture reaches.
    pub(crate) fn new(points: [GridPoint; 3], face: u32) -> Option<Self> {
        const REACH: f64 = (1i64 << 28) as f64;
        let scaled = points.map(|p| p.position.map(|c| (c * STEPS as f64).round()));
        if !scaled.as_flattened().iter().all(|c| c.abs() <= REACH) {
            return None;
        }
        let mut corners = scaled.map(|p| p.map(|c| c as i64));
        let mut nearness = points.map(|p| p.nearness);
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0 {
            return None;
        }
        if area < 0 {
            corners.swap(1, 2);
            nearness.swap(1, 2);
        }
        let [a, b, c] = corners.map(|p| p.map(|c| c as f64 / STEPS as f64));
        let [ab, ac] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1]]);
        let rises = [nearness[1] - nearness[0], nearness[2] - nearness[0]];
        let determinant = ab[0] * ac[1] - ab[1] * ac[0];
        let slope_x = (rises[0] * ac[1] - rises[1] * ab[1]) / determinant;
        let slope_y = (rises[1] * ab[0] - rises[0] * ac[0]) / determinant;
        let at_origin = nearness[0] - slope_x * a[0] - slope_y * a[1];
        Some(Self {
            corners,
            nearness: [at_origin, slope_x, slope_y],
            nearness_range: [
                nearness.into_iter().fold(f64::INFINITY, f64::min),
                nearness.into_iter().fold(f64::NEG_INFINITY, f64::max),
            ],
            face,
        })
    }

    /// Columns (`axis` 0) or rows (`axis` 1) whose samples can be covered, within `0..count`.
    pub(crate) fn span(&self, axis: usize, count: usize) -> Range<usize> {
        let along = self.corners.map(|corner| corner[axis]);
        let low = along.into_iter().fold(i64::MAX, i64::min);
        let high = along.into_iter().fold(i64::MIN, i64::max);
        // Sample i stands at i + 1/2.
        let first = (low + STEPS / 2 - 1)
            .div_euclid(STEPS)
            .clamp(0, count as i64);
        let last = (high + STEPS / 2)
            .div_euclid(STEPS)
            .clamp(first, count as i64);
        first as usize..last as usize
    }

    /// Calls `visit(column, row, nearness)` for each covered sample in these rows of a grid of `columns`.
    pub(crate) fn for_each_sample(
        &self,
        columns: usize,
        rows: Range<usize>,
        mut visit: impl FnMut(usize, usize, f32),
    ) {
        let across = self.span(0, columns);
        let down = self.span(1, rows.end);
        if across.is_empty() {
            return;
        }
        let start = across.start as i64 * STEPS + STEPS / 2;
        // Edge functions: positive inside. A sample on an edge belongs to the triangle on one side of it only.
        let edges: [_; 3] = std::array::from_fn(|i| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 3]);
            let step = [a[1] - b[1], b[0] - a[0]];
            let owns_border = step[0] > 0 || (step[0] == 0 && step[1] > 0);
            let constant = -(step[0] * a[0] + step[1] * a[1]) - i64::from(!owns_border);
            (step, constant)
        });
        let [at_origin, slope_x, slope_y] = self.nearness;
        let [lowest, highest] = self.nearness_range;
        for row in down.start.max(rows.start)..down.end {
            let y = row as i64 * STEPS + STEPS / 2;
            let mut values = edges.map(|(step, constant)| step[0] * start + step[1] * y + constant);
            let row_nearness = at_origin + slope_y * (row as f64 + 0.5);
            for column in across.clone() {
                if values[0] | values[1] | values[2] >= 0 {
                    let nearness = row_nearness + slope_x * (column as f64 + 0.5);
                    visit(column, row, nearness.clamp(lowest, highest) as f32);
                }
                for (value, (step, _)) in values.iter_mut().zip(&edges) {
                    *value += step[0] * STEPS;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64) -> GridPoint {
        GridPoint {
            position: [x, y],
            nearness: 2.0 + 3.0 * x - y,
        }
    }

    /// Returns a fan of slivers about a point, all borders through samples or between them.
    #[test]
    fn triangles_that_share_edges_cover_each_sample_once() {
        const SIZE: usize = 64;
        let mut count = vec![0; SIZE * SIZE];
        let center = point(31.5, 32.5);
        let rim: Vec<_> = (0..97)
            .map(|i| {
                let angle = f64::from(i) / 97.0 * std::f64::consts::TAU;
                point(31.5 + 80.0 * angle.cos(), 32.5 + 80.0 * angle.sin())
            })
            .collect();
        for i in 0..rim.len() {
            let corners = [center, rim[i], rim[(i + 1) % rim.len()]];
            let triangle = GridTriangle::new(corners, 0).unwrap();
            triangle.for_each_sample(SIZE, 0..SIZE, |x, y, _| count[y * SIZE + x] += 1);
        }
        assert!(count.iter().all(|c| *c == 1));
    }

    #[test]
    fn nearness_is_linear_and_winding_does_not_matter() {
        let corners = [point(1.0, 1.0), point(20.0, 3.0), point(6.0, 18.0)];
        let mut forward = vec![];
        let mut reversed = vec![];
        let [a, b, c] = corners;
        let draw = |corners, list: &mut Vec<(usize, usize, f32)>| {
            GridTriangle::new(corners, 0)
                .unwrap()
                .for_each_sample(32, 0..32, |x, y, n| list.push((x, y, n)));
        };
        draw([a, b, c], &mut forward);
        draw([c, b, a], &mut reversed);
        assert!(forward.len() > 100);
        for (x, y, nearness) in forward.iter().chain(&reversed) {
            let exact = 2.0 + 3.0 * (*x as f64 + 0.5) - (*y as f64 + 0.5);
            assert!((f64::from(*nearness) - exact).abs() < 1e-4);
        }
        let places = |list: &[(usize, usize, f32)]| -> Vec<_> {
            list.iter().map(|(x, y, _)| (*x, *y)).collect()
        };
        assert_eq!(places(&forward), places(&reversed));
    }

    #[test]
    fn rows_can_be_drawn_in_bands() {
        let corners = [point(0.3, -5.0), point(31.0, 12.2), point(-4.0, 40.0)];
        let triangle = GridTriangle::new(corners, 0).unwrap();
        let (mut whole, mut banded) = (vec![], vec![]);
        triangle.for_each_sample(32, 0..32, |x, y, n| whole.push((x, y, n)));
        for band in 0..4 {
            triangle.for_each_sample(32, 8 * band..8 * band + 8, |x, y, n| banded.push((x, y, n)));
        }
        assert_eq!(whole, banded);
    }

    #[test]
    fn a_line_and_a_far_corner_give_no_triangle() {
        assert!(
            GridTriangle::new([point(1.0, 1.0), point(2.0, 2.0), point(5.0, 5.0)], 0).is_none()
        );
        assert!(
            GridTriangle::new([point(1.0, 1.0), point(1e12, 2.0), point(5.0, 5.0)], 0).is_none()
        );
        assert!(
            GridTriangle::new([point(1.0, f64::NAN), point(2.0, 2.0), point(5.0, 5.0)], 0)
                .is_none()
        );
    }
}
