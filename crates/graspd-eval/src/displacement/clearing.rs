//! The shortest way by which a convex polyhedron and a triangle part.
//!
//! Of two polyhedra that is along a normal of a face, or across two edges that make a face of their Minkowski difference. A box about the
//! normals of a cluster of faces bounds the way along all of them. Where both overlap, the shortest way leads from one of the deepest
//! points to the other, so that only edges near the triangle count.

use parry3d_f64::math::Vector;

use super::sides::{BLOCKS, LANES, Lanes, Sides, lesser};

/// Of pieces with so few clusters of sides all are looked at.
const FEW: usize = 2;

/// How far a body would have to move to be clear of a triangle, along directions in front of the triangle and behind it \[m\];
/// negative where it is clear already.
#[derive(Clone, Copy)]
pub(super) struct Clearing {
    pub(super) front: f64,
    pub(super) back: f64,
    /// The second least of all ways, or less than it if both differ by more than was asked for.
    pub(super) second: f64,
}

impl Clearing {
    /// Takes a way into account.
    #[inline(always)]
    pub(super) fn add(&mut self, way: f64, is_behind: bool) {
        let least = self.least();
        let other = if way < least { least } else { way };
        self.second = lesser(self.second, other);
        let side = if is_behind {
            &mut self.back
        } else {
            &mut self.front
        };
        *side = lesser(way, *side);
    }

    /// The least of all ways.
    pub(super) fn least(&self) -> f64 {
        lesser(self.front, self.back)
    }
}

/// Where two sides meet.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    /// One of its ends.
    pub(super) start: Vector,
    /// The normals of both sides.
    normals: [Vector; 2],
}

impl Edge {
    /// Its direction, of any length.
    pub(super) fn along(&self) -> Vector {
        self.normals[0].cross(self.normals[1])
    }
}

/// What the sides say of a triangle.
pub(super) struct BySides {
    /// The side of the least way, if that is less than what was known before: its normal, and the deepest corner.
    pub(super) nearest: Option<[Vector; 2]>,
    /// Whether one of the triangle's corners is inside.
    pub(super) has_corner_inside: bool,
}

/// An edge of the triangle and one of the body that make the least way.
pub(super) struct CrossingEdges {
    /// Of length one: where the body would have to move.
    pub(super) direction: Vector,
    /// Where the triangle's edge begins and what leads to its end.
    pub(super) of_triangle: [Vector; 2],
    pub(super) of_body: Edge,
}

impl Sides {
    /// Takes into account how far the body would have to move to be clear of a triangle with this unit normal, along the normals
    /// of its own sides; ways that are longer than the least by `tie` may be left out, and directions of a smaller component than that along
    /// the normal are neither behind nor in front.
    pub(super) fn clear_by_sides(
        &self,
        corners: &[Vector; 3],
        normal: Vector,
        tie: f64,
        clearing: &mut Clearing,
    ) -> BySides {
        let points = corners.map(|corner| corner.to_array());
        let across = normal.to_array();
        let mut depths = [f64::MAX; 3];
        let mut nearest = None;
        let clusters = self.sides.len() / BLOCKS;
        for (block, bounds) in self.bounds.iter().enumerate() {
            let first = block * LANES;
            let mut ways = [[f64::MIN; LANES]; 3];
            if clusters > FEW {
                for (way, point) in ways.iter_mut().zip(&points) {
                    *way = least_ways(bounds, point);
                }
            }
            for cluster in first..clusters.min(first + LANES) {
                let least = ways.map(|way| way[cluster - first]);
                if least[0].max(least[1]).max(least[2]) > clearing.least() + tie {
                    for (depth, least) in depths.iter_mut().zip(least) {
                        *depth = lesser(*depth, least);
                    }
                    continue;
                }
                let before = clearing.least();
                self.clear_by_cluster(cluster, &points, &across, tie, clearing, &mut depths);
                if clearing.least() < before {
                    nearest = Some(cluster);
                }
            }
        }
        BySides {
            nearest: nearest.and_then(|c| self.side_to_clear_by(c, corners, clearing.least())),
            has_corner_inside: depths.iter().any(|depth| *depth >= 0.0),
        }
    }

    /// The same along the normals of one cluster; `depths` become the least that each corner is within any side.
    #[inline(always)]
    fn clear_by_cluster(
        &self,
        cluster: usize,
        points: &[[f64; 3]; 3],
        normal: &[f64; 3],
        tie: f64,
        clearing: &mut Clearing,
        depths: &mut [f64; 3],
    ) {
        let [mut front, mut back, mut second] = [[f64::MAX; LANES]; 3];
        let mut within = [[f64::MAX; LANES]; 3];
        for [x, y, z, height] in &self.sides[cluster * BLOCKS..(cluster + 1) * BLOCKS] {
            for i in 0..LANES {
                let along = |p: &[f64; 3]| x[i] * p[0] + y[i] * p[1] + z[i] * p[2];
                let heights = [along(&points[0]), along(&points[1]), along(&points[2])];
                for k in 0..3 {
                    within[k][i] = lesser(height[i] - heights[k], within[k][i]);
                }
                let way = height[i] - lesser(heights[0], lesser(heights[1], heights[2]));
                // It moves against its own side's normal.
                let is_behind = along(normal) > tie;
                let known = lesser(front[i], back[i]);
                second[i] = lesser(second[i], if way < known { known } else { way });
                front[i] = lesser(if is_behind { f64::MAX } else { way }, front[i]);
                back[i] = lesser(if is_behind { way } else { f64::MAX }, back[i]);
            }
        }
        for i in 0..LANES {
            clearing.add(front[i], false);
            clearing.add(back[i], true);
            clearing.second = lesser(clearing.second, second[i]);
            for k in 0..3 {
                depths[k] = lesser(depths[k], within[k][i]);
            }
        }
    }

    /// The first side of a cluster along whose normal it has this way to be clear of a triangle: the normal, and the corner in question.
    fn side_to_clear_by(
        &self,
        cluster: usize,
        corners: &[Vector; 3],
        way: f64,
    ) -> Option<[Vector; 2]> {
        for [x, y, z, height] in &self.sides[cluster * BLOCKS..(cluster + 1) * BLOCKS] {
            for i in 0..LANES {
                let heights = corners.map(|p| x[i] * p.x + y[i] * p.y + z[i] * p.z);
                let lowest = lesser(heights[0], lesser(heights[1], heights[2]));
                if height[i] - lowest == way {
                    let corner = (0..3).find(|corner| heights[*corner] == lowest)?;
                    return Some([Vector::new(x[i], y[i], z[i]), corners[corner]]);
                }
            }
        }
        None
    }

    /// The same across its own edges and those of the triangle. Where both overlap, `near` may be set, and only edges are looked at that
    /// are as near as the least way. Returns the edges of the least way, if it has become less.
    pub(super) fn clear_by_edges(
        &self,
        corners: &[Vector; 3],
        normal: Vector,
        tie: f64,
        near: bool,
        clearing: &mut Clearing,
    ) -> Option<CrossingEdges> {
        let [a, b, c] = *corners;
        let others = [(a, b - a), (b, c - b), (c, a - c)]
            .map(|(from, along)| (from, along, along.cross(normal)));
        let mut nearest = None;
        if !near {
            for block in &self.edges {
                for other in &others {
                    clear_by_block(block, other, normal, tie, clearing, &mut nearest);
                }
            }
            return nearest;
        }
        let reach = Vector::splat(clearing.least() + 2.0 * tie);
        let low = (a.min(b).min(c) - reach).to_array();
        let high = (a.max(b).max(c) + reach).to_array();
        for (group, boxes) in self.cluster_boxes.iter().enumerate() {
            let is_near = overlaps(boxes, &low, &high);
            for (i, is_near) in is_near.into_iter().enumerate() {
                if !is_near {
                    continue;
                }
                let cluster = group * LANES + i;
                for block in cluster * BLOCKS..(cluster + 1) * BLOCKS {
                    if overlaps(&self.edge_boxes[block], &low, &high) == [false; LANES] {
                        continue;
                    }
                    for other in &others {
                        clear_by_block(
                            &self.edges[block],
                            other,
                            normal,
                            tie,
                            clearing,
                            &mut nearest,
                        );
                    }
                }
            }
        }
        nearest
    }
}

/// By how much a point is at least within the planes of each of several clusters.
#[inline(always)]
fn least_ways(bounds: &[Lanes; 10], point: &[f64; 3]) -> Lanes {
    let mut ways = bounds[9];
    for i in 0..LANES {
        for k in 0..3 {
            let to_place = bounds[6 + k][i] - point[k];
            ways[i] += lesser(bounds[k][i] * to_place, bounds[3 + k][i] * to_place);
        }
    }
    ways
}

/// Which boxes overlap the one from `low` to `high`.
#[inline(always)]
fn overlaps(boxes: &[Lanes; 6], low: &[f64; 3], high: &[f64; 3]) -> [bool; LANES] {
    let mut outside = [f64::MIN; LANES];
    for i in 0..LANES {
        for k in 0..3 {
            let gap = -lesser(-(boxes[k][i] - high[k]), -(low[k] - boxes[3 + k][i]));
            outside[i] = -lesser(-outside[i], -gap);
        }
    }
    outside.map(|gap| gap <= 0.0)
}

/// Takes into account the edges of a block with an edge of a triangle, given by its start, the way to its end, and what is outward of it
/// in the triangle's plane.
#[inline(always)]
fn clear_by_block(
    block: &[Lanes; 9],
    &(from, along, outward): &(Vector, Vector, Vector),
    normal: Vector,
    tie: f64,
    clearing: &mut Clearing,
    nearest: &mut Option<CrossingEdges>,
) {
    let [mut one, mut other, mut product] = [[0.0; LANES]; 3];
    for i in 0..LANES {
        one[i] = block[3][i] * along.x + block[4][i] * along.y + block[5][i] * along.z;
        other[i] = block[6][i] * along.x + block[7][i] * along.y + block[8][i] * along.z;
        product[i] = one[i] * other[i];
    }
    for i in 0..LANES {
        // An edge makes a face of the Minkowski difference where the arc between its sides' normals crosses that of the other edge.
        if product[i] >= 0.0 {
            continue;
        }
        let vector = |k: usize| Vector::new(block[k][i], block[k + 1][i], block[k + 2][i]);
        let normals = [vector(3), vector(6)];
        // Negated, since the arc is outward of the body.
        let crossing = normals[0] * -other[i].abs() - normals[1] * one[i].abs();
        if crossing.dot(outward) <= 0.0 {
            continue;
        }
        let start = vector(0);
        let direction = crossing.normalize();
        let way = direction.dot(from - start);
        if way < clearing.least() {
            *nearest = Some(CrossingEdges {
                direction,
                of_triangle: [from, along],
                of_body: Edge { start, normals },
            });
        }
        clearing.add(way, direction.dot(normal) < -tie);
    }
}
