//! Convex bodies known by their support points: whichever lies farthest along a direction.

use super::exact;
use super::frame::{Frame, Start};
use super::hyperplane::dot;
use crate::error::EvaluationError;
use nalgebra::DMatrix;

/// Points looked at together; sixteen components fill the widest registers a few times over.
const BLOCK: usize = 16;

/// What an expansion asks of the body whose boundary it looks for.
pub(super) trait Body<const D: usize> {
    /// Index in `frame.points` of a point of the body that lies farthest along the direction; may add it there.
    fn farthest(&self, frame: &mut Frame<D>, direction: &[f64; D]) -> u32;
}

/// The hull of points, which are those of the frame.
pub(super) struct PointSet<const D: usize>(Columns<D>);

impl<const D: usize> PointSet<D> {
    pub(super) fn new(points: &[[f64; D]]) -> Self {
        Self(Columns::new(points))
    }

    /// The farthest of the points, the first among equals, and its component along the direction.
    pub(super) fn farthest_along(&self, direction: &[f64; D]) -> (u32, f64) {
        let mut best = (0, f64::NEG_INFINITY);
        self.0
            .for_each_block(direction, |start, components: &[f64]| {
                let most = components.iter().fold(f64::NEG_INFINITY, |m, &x| m.max(x));
                if most > best.1 {
                    let at = components.iter().position(|&x| x == most).unwrap_or(0);
                    best = ((start + at) as u32, most);
                }
            });
        best
    }
}

impl<const D: usize> Body<D> for PointSet<D> {
    fn farthest(&self, _: &mut Frame<D>, direction: &[f64; D]) -> u32 {
        self.farthest_along(direction).0
    }
}

/// The Minkowski sum of `conv(0, a group of points)` over groups of equal size: what contacts can do together
/// when each has its own limit.
pub(super) struct SumOfGroups<const D: usize> {
    columns: Columns<D>,
    points: Vec<[f64; D]>,
    group: usize,
}

impl<const D: usize> SumOfGroups<D> {
    pub(super) fn new(points: &[[f64; D]], group: usize) -> Self {
        Self {
            columns: Columns::new(points),
            points: points.to_vec(),
            group: group.max(1),
        }
    }

    /// A point of the sum farthest along the direction: of each group the farthest member, if that is beyond 0.
    fn support_point(&self, direction: &[f64; D]) -> [f64; D] {
        let mut components = Vec::with_capacity(self.points.len());
        self.columns
            .for_each_block(direction, |_, block| components.extend_from_slice(block));
        let mut sum = [0.0; D];
        for (points, components) in self
            .points
            .chunks(self.group)
            .zip(components.chunks(self.group))
        {
            let mut best = (None, 0.0);
            for (point, &component) in points.iter().zip(components) {
                if component > best.1 {
                    best = (Some(point), component);
                }
            }
            if let (Some(point), _) = best {
                for k in 0..D {
                    sum[k] += point[k];
                }
            }
        }
        sum
    }

    /// The frame and first simplex, from support points along the axes and, where those lie in a subspace, along
    /// the directions that it lacks.
    pub(super) fn start(&self) -> Result<Start<D>, EvaluationError> {
        if self.points.is_empty() {
            return Ok(Start::Empty);
        }
        if let Some(index) = self
            .points
            .iter()
            .position(|p| !p.iter().all(|x| x.is_finite()))
        {
            return Err(EvaluationError::NotFinite { index });
        }
        let mut found = vec![[0.0; D]];
        for axis in 0..2 * D {
            let mut direction = [0.0; D];
            direction[axis / 2] = [1.0, -1.0][axis % 2];
            found.push(self.support_point(&direction));
        }
        for _ in 0..D {
            let start = Frame::start(&found)?;
            if matches!(start, Start::Full { .. }) {
                return Ok(start);
            }
            for direction in principal_directions(&found) {
                found.push(self.support_point(&direction));
                found.push(self.support_point(&direction.map(|x| -x)));
            }
        }
        Frame::start(&found)
    }
}

/// A [`SumOfGroups`] in the coordinates of a frame.
pub(super) struct FramedSum<'a, const D: usize> {
    pub(super) sum: &'a SumOfGroups<D>,
}

impl<const D: usize> Body<D> for FramedSum<'_, D> {
    fn farthest(&self, frame: &mut Frame<D>, direction: &[f64; D]) -> u32 {
        // The frame shifts and scales alike along all axes, so directions are the same in it.
        let mut point = frame.in_frame(&self.sum.support_point(direction));
        if frame.is_exact {
            point = point.map(exact::snap);
        }
        let known = frame.points.iter().position(|other| *other == point);
        known.unwrap_or_else(|| {
            frame.points.push(point);
            frame.points.len() - 1
        }) as u32
    }
}

/// Orthonormal directions, among them those in which the points do not extend at all.
fn principal_directions<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; D]> {
    let first = points.first().copied().unwrap_or([0.0; D]);
    let spread = DMatrix::from_fn(D, D, |i, j| {
        let product = |p: &[f64; D]| (p[i] - first[i]) * (p[j] - first[j]);
        points.iter().map(product).sum::<f64>()
    });
    let axes = spread.symmetric_eigen().eigenvectors;
    axes.column_iter()
        .map(|axis| std::array::from_fn(|k| axis[k]))
        .collect()
}

/// Points by coordinate, so that products with one direction fill vector registers.
struct Columns<const D: usize> {
    columns: [Vec<f64>; D],
}

impl<const D: usize> Columns<D> {
    fn new(points: &[[f64; D]]) -> Self {
        Self {
            columns: std::array::from_fn(|k| points.iter().map(|point| point[k]).collect()),
        }
    }

    /// Calls `visit` with the index of each block's first point and the block's components along the direction,
    /// each rounded as [`dot`] rounds it.
    #[inline(always)]
    fn for_each_block(&self, direction: &[f64; D], mut visit: impl FnMut(usize, &[f64])) {
        let count = self.columns[0].len();
        let whole = count - count % BLOCK;
        for start in (0..whole).step_by(BLOCK) {
            let mut components = [0.0; BLOCK];
            for k in 0..D {
                let column = &self.columns[k][start..start + BLOCK];
                for (sum, x) in components.iter_mut().zip(column) {
                    *sum += direction[k] * x;
                }
            }
            visit(start, &components);
        }
        let rest: Vec<f64> = (whole..count)
            .map(|index| dot(direction, &std::array::from_fn(|k| self.columns[k][index])))
            .collect();
        if !rest.is_empty() {
            visit(whole, &rest);
        }
    }
}
