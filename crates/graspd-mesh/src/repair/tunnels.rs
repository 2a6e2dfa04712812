//! Narrow tunnels of a solid on a grid: they come from gaps between sheets that were meant to meet.

use std::collections::VecDeque;

/// The simplices of the cubes' tetrahedra whose lowest corner is a node, by the corners besides it as bits x, y, z:
/// each corner has all bits of the one before.
const EDGES: [usize; 7] = [1, 2, 3, 4, 5, 6, 7];
const TRIANGLES: [[usize; 2]; 12] = [
    [1, 3],
    [1, 5],
    [1, 7],
    [2, 3],
    [2, 6],
    [2, 7],
    [4, 5],
    [4, 6],
    [4, 7],
    [3, 7],
    [5, 7],
    [6, 7],
];
const TETRAHEDRA: [[usize; 3]; 6] = [
    [1, 3, 7],
    [1, 5, 7],
    [2, 3, 7],
    [2, 6, 7],
    [4, 5, 7],
    [4, 6, 7],
];

/// A set of grid nodes.
struct Nodes {
    dims: [usize; 3],
    is_in: Vec<bool>,
}

/// Makes nodes inside that lie in gaps of at most `2 reach` cells, where this closes more tunnels than it opens; gives
/// how many it closes. Values below 0 are inside; new ones get `filling`.
///
/// The solid of marching tetrahedra contracts to the simplices whose corners are all inside, so the change of its
/// Euler characteristic, one for each tunnel, is counted exactly, and only around the filled nodes.
pub(super) fn close_tunnels(
    values: &mut [f32],
    dims: [usize; 3],
    reach: usize,
    filling: f32,
) -> usize {
    let mut solid = Nodes {
        dims,
        is_in: values.iter().map(|&value| value < 0.0).collect(),
    };
    let mut closing = solid.is_in.clone();
    for is_wanted in [true, false] {
        for axis in 0..3 {
            closing = spread(&closing, dims, axis, reach, is_wanted);
        }
    }
    let mut gaps: Vec<bool> = (closing.iter().zip(&solid.is_in))
        .map(|(&after, &before)| after && !before)
        .collect();
    let mut closed = 0;
    for seed in 0..gaps.len() {
        if !gaps[seed] {
            continue;
        }
        let gap = take_component(&mut gaps, dims, seed);
        let gain = solid.fill(&gap);
        if gain > 0 {
            closed += gain as usize;
            for &node in &gap {
                values[node] = filling;
            }
        } else {
            for &node in &gap {
                solid.is_in[node] = false;
            }
        }
    }
    closed
}

/// Which nodes have one along an axis, at most `reach` away, that is (or with `is_wanted` false: none that is not) in
/// the set.
fn spread(set: &[bool], dims: [usize; 3], axis: usize, reach: usize, is_wanted: bool) -> Vec<bool> {
    let stride = [1, dims[0], dims[0] * dims[1]][axis];
    let mut result = set.to_vec();
    for (node, result) in result.iter_mut().enumerate() {
        if *result == is_wanted {
            continue;
        }
        let place = node / stride % dims[axis];
        let (low, high) = (place.min(reach), (dims[axis] - 1 - place).min(reach));
        let found = (1..=low).any(|step| set[node - step * stride] == is_wanted)
            || (1..=high).any(|step| set[node + step * stride] == is_wanted);
        if found {
            *result = is_wanted;
        }
    }
    result
}

/// Takes the nodes that hang together with one, across corners, too, out of a set.
fn take_component(set: &mut [bool], dims: [usize; 3], seed: usize) -> Vec<usize> {
    let mut component = vec![seed];
    let mut queue = VecDeque::from([seed]);
    set[seed] = false;
    while let Some(node) = queue.pop_front() {
        let [i, j, k] = place(node, dims);
        let around = |at: usize, axis: usize| at.saturating_sub(1)..(at + 2).min(dims[axis]);
        for k in around(k, 2) {
            for j in around(j, 1) {
                for i in around(i, 0) {
                    let near = i + dims[0] * (j + dims[1] * k);
                    if std::mem::take(&mut set[near]) {
                        component.push(near);
                        queue.push_back(near);
                    }
                }
            }
        }
    }
    component
}

fn place(node: usize, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [node % nx, node / nx % ny, node / (nx * ny)]
}

impl Nodes {
    /// Adds nodes; gives by how much the Euler characteristic grows.
    fn fill(&mut self, gap: &[usize]) -> i64 {
        let [nx, ny, _] = self.dims;
        let mut lowest: Vec<usize> = Vec::with_capacity(8 * gap.len());
        for &node in gap {
            let at = place(node, self.dims);
            for corner in 0..8 {
                let bit = |axis: usize| corner >> axis & 1;
                if (0..3).all(|axis| at[axis] >= bit(axis)) {
                    lowest.push(node - bit(0) - nx * (bit(1) + ny * bit(2)));
                }
            }
        }
        lowest.sort_unstable();
        lowest.dedup();
        let count = |set: &Self| -> i64 { lowest.iter().map(|&node| set.simplices(node)).sum() };
        let before = count(self);
        for &node in gap {
            self.is_in[node] = true;
        }
        count(self) - before
    }

    /// The sum over the simplices with this lowest corner and all corners in the set: vertices and triangles count 1,
    /// edges and tetrahedra -1.
    fn simplices(&self, node: usize) -> i64 {
        if !self.is_in[node] {
            return 0;
        }
        let at = place(node, self.dims);
        let [nx, ny, _] = self.dims;
        let is_in: [bool; 8] = std::array::from_fn(|corner| {
            let bit = |axis: usize| corner >> axis & 1;
            (0..3).all(|axis| at[axis] + bit(axis) < self.dims[axis])
                && self.is_in[node + bit(0) + nx * (bit(1) + ny * bit(2))]
        });
        let edges = EDGES.iter().filter(|&&a| is_in[a]).count();
        let triangles = TRIANGLES.iter().filter(|one| one.iter().all(|&a| is_in[a]));
        let tetrahedra = TETRAHEDRA
            .iter()
            .filter(|one| one.iter().all(|&a| is_in[a]));
        1 - edges as i64 + triangles.count() as i64 - tetrahedra.count() as i64
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{NodeGrid, isosurface};
    use graspd_geom::topology;

    const DIMS: [usize; 3] = [24, 22, 20];

    fn values(is_inside: impl Fn([i32; 3]) -> bool) -> Vec<f32> {
        (0..DIMS.iter().product())
            .map(|node| {
                let at = place(node, DIMS).map(|i| i as i32);
                if is_inside(at) { -1.0 } else { 1.0 }
            })
            .collect()
    }

    fn euler_number(values: &[f32]) -> i64 {
        let grid = NodeGrid {
            origin: Point3::origin(),
            spacing: Vector3::repeat(1.0),
            dims: DIMS,
        };
        let at = |[i, j, k]: [usize; 3]| f64::from(values[i + DIMS[0] * (j + DIMS[1] * k)]);
        topology(&isosurface(&grid, 0.0, at).unwrap()).euler_number
    }

    /// A block with a narrow and a wide tunnel through it, and a groove.
    fn block([x, y, z]: [i32; 3]) -> bool {
        let is_block = (3..21).contains(&x) && (3..19).contains(&y) && (5..15).contains(&z);
        let is_narrow = (6..8).contains(&x) && y == 8;
        let is_wide = (12..17).contains(&x) && (6..12).contains(&y);
        let is_groove = y == 15 && z > 10;
        is_block && !is_narrow && !is_wide && !is_groove
    }

    #[test]
    fn narrow_tunnels_are_closed_and_nothing_else() {
        let mut field = values(block);
        assert_eq!(euler_number(&field), -2);
        assert_eq!(close_tunnels(&mut field, DIMS, 1, -0.5), 1);
        assert_eq!(euler_number(&field), 0);
        // The filled nodes are those of the tunnel.
        let filled: Vec<[usize; 3]> = (0..field.len())
            .filter(|&node| field[node] == -0.5)
            .map(|node| place(node, DIMS))
            .collect();
        assert_eq!(filled.len(), 2 * 10);
        assert!(
            filled
                .iter()
                .all(|at| at[1] == 8 && (6..8).contains(&at[0]))
        );
        assert_eq!(close_tunnels(&mut field, DIMS, 1, -0.5), 0);
    }

    #[test]
    fn the_change_of_the_euler_number_is_that_of_the_surface() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20 {
            let is_in: Vec<bool> = (0..DIMS.iter().product())
                .map(|_| rng.random_bool(0.4))
                .collect();
            let mut nodes = Nodes { dims: DIMS, is_in };
            let gap: Vec<usize> = (0..50)
                .map(|_| rng.random_range(0..nodes.is_in.len()))
                .filter(|&node| !nodes.is_in[node])
                .collect();
            let surface = |nodes: &Nodes| {
                let values: Vec<f32> = nodes
                    .is_in
                    .iter()
                    .map(|&is| if is { -1.0 } else { 1.0 })
                    .collect();
                euler_number(&values)
            };
            let before = surface(&nodes);
            let gain = nodes.fill(&gap);
            // A closed surface's Euler number is twice that of the solid within.
            assert_eq!(surface(&nodes) - before, 2 * gain);
        }
    }
}
