//! Sparse sets of grid points, stored as runs along x.

use std::ops::Range;

use rayon::prelude::*;

/// Consecutive members of a set: those with x in `first..end`, numbered from `base`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    pub(super) first: u32,
    pub(super) end: u32,
    pub(super) base: u32,
}

/// A set of integer points in a cube of `side`^3, numbered by z, then y, then x.
///
/// A surface crosses few runs in each row, so that finding a point is a short search, and operations on neighbours go
/// along contiguous memory.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Runs {
    side: usize,
    /// The first run of each row (z, y), and the number of runs.
    row_start: Vec<u32>,
    runs: Vec<Run>,
    len: usize,
}

impl Runs {
    /// The set whose row (z, y) has the intervals of x that `fill` writes: ascending, disjoint, not touching.
    pub(super) fn build(
        side: usize,
        fill: impl Fn(usize, usize, &mut Vec<[u32; 2]>) + Sync,
    ) -> Self {
        let layers: Vec<(Vec<[u32; 2]>, Vec<u32>)> = (0..side)
            .into_par_iter()
            .map(|z| {
                let (mut intervals, mut counts) = (Vec::new(), Vec::with_capacity(side));
                let mut row = Vec::new();
                for y in 0..side {
                    row.clear();
                    fill(z, y, &mut row);
                    counts.push(row.len() as u32);
                    intervals.extend_from_slice(&row);
                }
                (intervals, counts)
            })
            .collect();
        let mut set = Self {
            side,
            row_start: Vec::with_capacity(side * side + 1),
            runs: Vec::with_capacity(layers.iter().map(|layer| layer.0.len()).sum()),
            len: 0,
        };
        let mut start = 0;
        for (intervals, counts) in layers {
            for count in counts {
                set.row_start.push(start);
                start += count;
            }
            for [first, end] in intervals {
                set.runs.push(Run {
                    first,
                    end,
                    base: set.len as u32,
                });
                set.len += (end - first) as usize;
            }
        }
        set.row_start.push(start);
        set
    }

    /// The set of the given points `[x, y, z]`, which are sorted by z, y, x and differ.
    pub(super) fn from_sorted(side: usize, points: &[[u32; 3]]) -> Self {
        Self::build(side, |z, y, row| {
            let key = |p: &[u32; 3]| (p[2] as usize, p[1] as usize);
            let start = points.partition_point(|p| key(p) < (z, y));
            for p in points[start..].iter().take_while(|p| key(p) == (z, y)) {
                match row.last_mut() {
                    Some(last) if last[1] == p[0] => last[1] += 1,
                    _ => row.push([p[0], p[0] + 1]),
                }
            }
        })
    }

    /// All points of the cube.
    pub(super) fn full(side: usize) -> Self {
        Self::build(side, |_, _, row| row.push([0, side as u32]))
    }

    pub(super) fn side(&self) -> usize {
        self.side
    }

    /// How many points there are.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The runs of a row; none where the row is outside the cube.
    pub(super) fn row(&self, z: usize, y: usize) -> &[Run] {
        if z >= self.side || y >= self.side {
            return &[];
        }
        let row = z * self.side + y;
        &self.runs[self.row_start[row] as usize..self.row_start[row + 1] as usize]
    }

    /// The run that holds a point.
    pub(super) fn run_at(&self, z: usize, y: usize, x: u32) -> Option<&Run> {
        let row = self.row(z, y);
        let run = match row {
            [] => return None,
            [one] => one,
            _ => row.get(row.partition_point(|run| run.end <= x))?,
        };
        (run.first <= x && x < run.end).then_some(run)
    }

    /// The number of a point.
    pub(super) fn find(&self, z: usize, y: usize, x: u32) -> Option<usize> {
        self.run_at(z, y, x)
            .map(|run| (run.base + (x - run.first)) as usize)
    }

    /// The numbers of the points of layer z.
    pub(super) fn layer(&self, z: usize) -> Range<usize> {
        let number = |run: u32| {
            self.runs
                .get(run as usize)
                .map_or(self.len, |run| run.base as usize)
        };
        number(self.row_start[z * self.side])..number(self.row_start[(z + 1) * self.side])
    }

    /// Values of all points, cut into those of each layer.
    pub(super) fn layers<'a, T>(&self, values: &'a mut [T]) -> Vec<&'a mut [T]> {
        let mut rest = values;
        (0..self.side)
            .map(|z| {
                let (layer, others) = std::mem::take(&mut rest).split_at_mut(self.layer(z).len());
                rest = others;
                layer
            })
            .collect()
    }

    /// All points `[x, y, z]` in order.
    pub(super) fn points(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        (0..self.side).flat_map(move |z| {
            (0..self.side).flat_map(move |y| {
                (self.row(z, y).iter())
                    .flat_map(move |run| (run.first..run.end).map(move |x| [x, y as u32, z as u32]))
            })
        })
    }
}

/// The union of intervals, in order; those that touch become one.
pub(super) fn union(intervals: &mut Vec<[u32; 2]>) {
    intervals.sort_unstable();
    let mut kept = 0;
    for i in 0..intervals.len() {
        let next = intervals[i];
        if kept > 0 && next[0] <= intervals[kept - 1][1] {
            intervals[kept - 1][1] = intervals[kept - 1][1].max(next[1]);
        } else {
            intervals[kept] = next;
            kept += 1;
        }
    }
    intervals.truncate(kept);
}

/// What two sorted lists of intervals have in common.
pub(super) fn intersection(a: &[[u32; 2]], b: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let (mut i, mut j) = (0, 0);
    let mut common = Vec::new();
    while i < a.len() && j < b.len() {
        let both = [a[i][0].max(b[j][0]), a[i][1].min(b[j][1])];
        if both[0] < both[1] {
            common.push(both);
        }
        if a[i][1] < b[j][1] {
            i += 1;
        } else {
            j += 1;
        }
    }
    common
}
