//! Nearest neighbours among points.

use nalgebra::Point3;

/// Points in a leaf: searched one by one.
const LEAF: usize = 8;

/// Points sorted into nested halves, each cut across its longest extent.
#[derive(Clone, Debug)]
pub struct KdTree {
    /// The middle of each range separates its halves.
    points: Vec<Point3<f64>>,
    /// The number of each point as given.
    numbers: Vec<u32>,
    /// The axis across which the range with this middle is cut.
    axes: Vec<u8>,
}

impl KdTree {
    /// Sorts points, in O(n log n). Points in the same place are all kept.
    pub fn new(points: &[Point3<f64>]) -> Self {
        let mut numbered: Vec<(Point3<f64>, u32)> = points.iter().copied().zip(0..).collect();
        let mut axes = vec![0; points.len()];
        sort(&mut numbered, &mut axes);
        let (points, numbers) = numbered.into_iter().unzip();
        Self {
            points,
            numbers,
            axes,
        }
    }

    /// Finds the `count` points nearest to `p`, as (squared distance \[m^2\], number), nearest first, the lower number
    /// first among equally near ones. Replaces what is in `found`.
    pub fn nearest(&self, p: &Point3<f64>, count: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        if count > 0 {
            self.search(p, count, 0, self.points.len(), found);
        }
    }

    fn search(
        &self,
        p: &Point3<f64>,
        count: usize,
        start: usize,
        end: usize,
        found: &mut Vec<(f64, u32)>,
    ) {
        let mut consider = |i: usize| {
            let candidate = ((self.points[i] - p).norm_squared(), self.numbers[i]);
            if found.len() == count {
                // Also where a distance is NaN.
                if found
                    .last()
                    .is_some_and(|last| !is_before(&candidate, last))
                {
                    return;
                }
                found.pop();
            }
            let place = found.partition_point(|other| is_before(other, &candidate));
            found.insert(place, candidate);
        };
        if end - start <= LEAF {
            (start..end).for_each(consider);
            return;
        }
        let middle = start.midpoint(end);
        consider(middle);
        let axis = self.axes[middle] as usize;
        let offset = p[axis] - self.points[middle][axis];
        let halves = [(start, middle), (middle + 1, end)];
        let (near, far) = if offset < 0.0 {
            (halves[0], halves[1])
        } else {
            (halves[1], halves[0])
        };
        self.search(p, count, near.0, near.1, found);
        if found.len() < count || found.last().is_some_and(|last| offset * offset <= last.0) {
            self.search(p, count, far.0, far.1, found);
        }
    }
}

fn is_before(a: &(f64, u32), b: &(f64, u32)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

fn sort(points: &mut [(Point3<f64>, u32)], axes: &mut [u8]) {
    if points.len() <= LEAF {
        return;
    }
    let first = points[0].0;
    let (low, high) = (points.iter()).fold((first, first), |(l, h), (p, _)| (l.inf(p), h.sup(p)));
    let axis = (high - low).imax();
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| {
        a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1))
    });
    axes[middle] = axis as u8;
    let (before, after) = points.split_at_mut(middle);
    let (axes_before, axes_after) = axes.split_at_mut(middle);
    rayon::join(
        || sort(before, axes_before),
        || sort(&mut after[1..], &mut axes_after[1..]),
    );
}
