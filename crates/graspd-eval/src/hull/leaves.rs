//! Points in groups of neighbours, and those in groups, so that most of them need no look when the
//! farthest one is sought.

/// Points of a group, and groups of a larger one.
const SIZE: usize = 16;

/// Boxes, coordinate by coordinate.
struct Boxes<const D: usize> {
    low: [Vec<f64>; D],
    high: [Vec<f64>; D],
}

impl<const D: usize> Boxes<D> {
    fn new() -> Self {
        Self {
            low: std::array::from_fn(|_| Vec::new()),
            high: std::array::from_fn(|_| Vec::new()),
        }
    }

    fn push(&mut self, (low, high): ([f64; D], [f64; D])) {
        for k in 0..D {
            self.low[k].push(low[k]);
            self.high[k].push(high[k]);
        }
    }

    fn len(&self) -> usize {
        self.low[0].len()
    }

    /// How far each of a range of boxes may reach along a direction.
    fn reach(&self, direction: &[f64; D], first: usize, bounds: &mut [f64]) {
        bounds.fill(0.0);
        for k in 0..D {
            let x = direction[k];
            let side = if x > 0.0 { &self.high[k] } else { &self.low[k] };
            for (bound, side) in bounds.iter_mut().zip(&side[first..]) {
                *bound += x * side;
            }
        }
    }
}

/// Points, the boxes about groups of them, and their numbers.
pub(super) struct Leaves<const D: usize> {
    outer: Boxes<D>,
    inner: Boxes<D>,
    /// Coordinate by coordinate; the last group is filled up with copies.
    points: Vec<[[f64; SIZE]; D]>,
    numbers: Vec<[u32; SIZE]>,
    /// Of the outer boxes.
    bounds: Vec<f64>,
}

impl<const D: usize> Leaves<D> {
    pub(super) fn new(points: &[[f64; D]]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        split(points, &mut order);
        let mut leaves = Self {
            outer: Boxes::new(),
            inner: Boxes::new(),
            points: Vec::new(),
            numbers: Vec::new(),
            bounds: Vec::new(),
        };
        for group in order.chunks(SIZE) {
            let numbers: [u32; SIZE] = std::array::from_fn(|i| *group.get(i).unwrap_or(&group[0]));
            leaves.inner.push(bounds_of(points, group));
            leaves.points.push(std::array::from_fn(|k| {
                numbers.map(|number| points[number as usize][k])
            }));
            leaves.numbers.push(numbers);
        }
        for group in order.chunks(SIZE * SIZE) {
            leaves.outer.push(bounds_of(points, group));
        }
        leaves.bounds = vec![0.0; leaves.outer.len()];
        leaves
    }

    /// The point whose component along the direction is the largest, if that is larger than
    /// `least`; the one of the first group among equals.
    pub(super) fn farthest_beyond(&mut self, direction: &[f64; D], least: f64) -> Option<u32> {
        let mut bounds = std::mem::take(&mut self.bounds);
        self.outer.reach(direction, 0, &mut bounds);
        let mut best = (least, None);
        // The most promising first: after it few others are worth a look.
        let mut first = (0, f64::NEG_INFINITY);
        for (group, &bound) in bounds.iter().enumerate() {
            if bound > first.1 {
                first = (group, bound);
            }
        }
        if first.1 > least {
            self.look(first.0, direction, &mut best);
            for (group, &bound) in bounds.iter().enumerate() {
                if bound > best.0 && group != first.0 {
                    self.look(group, direction, &mut best);
                }
            }
        }
        self.bounds = bounds;
        best.1
    }

    /// Looks through the groups of an outer box.
    fn look(&self, group: usize, direction: &[f64; D], best: &mut (f64, Option<u32>)) {
        let first = group * SIZE;
        let mut bounds = [0.0; SIZE];
        let count = SIZE.min(self.inner.len() - first);
        self.inner.reach(direction, first, &mut bounds[..count]);
        for leaf in 0..count {
            if bounds[leaf] <= best.0 {
                continue;
            }
            let leaf = first + leaf;
            let mut heights = [0.0; SIZE];
            for (x, column) in direction.iter().zip(&self.points[leaf]) {
                for (height, coordinate) in heights.iter_mut().zip(column) {
                    *height += x * coordinate;
                }
            }
            for (height, number) in heights.into_iter().zip(self.numbers[leaf]) {
                if height > best.0 {
                    *best = (height, Some(number));
                }
            }
        }
    }
}

/// Orders points so that consecutive groups are near one another: halves along the longest side, and halves of those.
fn split<const D: usize>(points: &[[f64; D]], order: &mut [u32]) {
    if order.len() <= SIZE {
        return;
    }
    let (low, high) = bounds_of(points, order);
    let mut axis = 0;
    for k in 1..D {
        if high[k] - low[k] > high[axis] - low[axis] {
            axis = k;
        }
    }
    // Whole groups on the left.
    let middle = order.len().div_ceil(2 * SIZE) * SIZE;
    if middle < order.len() {
        let coordinate = |index: &u32| points[*index as usize][axis];
        // The number settles ties, so that there is one order.
        order.select_nth_unstable_by(middle, |a, b| {
            coordinate(a).total_cmp(&coordinate(b)).then(a.cmp(b))
        });
    }
    let (left, right) = order.split_at_mut(middle.min(order.len()));
    split(points, left);
    split(points, right);
}

fn bounds_of<const D: usize>(points: &[[f64; D]], numbers: &[u32]) -> ([f64; D], [f64; D]) {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for &number in numbers {
        for k in 0..D {
            let x = points[number as usize][k];
            low[k] = low[k].min(x);
            high[k] = high[k].max(x);
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::super::hyperplane::dot;
    use super::super::simplex::tests::noise_source;
    use super::*;

    #[test]
    fn the_farthest_point_is_that_of_a_look_at_all() {
        let mut noise = noise_source();
        for count in [1, 2, 15, 16, 17, 33, 100, 256, 257, 1000] {
            let points: Vec<[f64; 6]> = (0..count)
                .map(|_| std::array::from_fn(|_| noise()))
                .collect();
            let mut leaves = Leaves::new(&points);
            let mut found: Vec<u32> = leaves.numbers.iter().flatten().copied().collect();
            found.sort_unstable();
            found.dedup();
            assert_eq!(found.len(), count);
            for _ in 0..50 {
                let direction: [f64; 6] = std::array::from_fn(|_| noise());
                let heights = points.iter().map(|point| dot(point, &direction));
                let highest = heights.fold(f64::NEG_INFINITY, f64::max);
                let found = leaves.farthest_beyond(&direction, highest - 0.1).unwrap();
                assert_eq!(dot(&points[found as usize], &direction), highest);
                assert_eq!(leaves.farthest_beyond(&direction, highest + 1e-9), None);
            }
        }
    }
}
