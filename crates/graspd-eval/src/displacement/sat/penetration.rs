//! The least overlap of a triangle and a convex polyhedron along face normals and across pairs of edges.

use parry3d_f64::math::Vector;

use super::faces::{BLOCKS, FaceClusters};
use super::lanes::{LANES, Lanes, lesser};

/// With at most this many clusters of faces all are tested, without looking at their bounds.
const MAX_UNBOUNDED_CLUSTERS: usize = 2;

/// Least overlap \[m\] along axes tested so far: by how far the polyhedron would have to move to be
/// clear of the triangle.
///
/// Negative where an axis separates them: minus the gap.
#[derive(Clone, Copy)]
pub(super) struct LeastOverlap {
    /// Along directions in front of the triangle.
    pub(super) front: f64,
    /// Along directions behind it.
    pub(super) back: f64,
    /// The second least of all, or a lower bound on it if both differ by more than the tolerance.
    pub(super) second: f64,
}

impl LeastOverlap {
    /// Takes the overlap along one more axis into account.
    #[inline(always)]
    pub(super) fn add(&mut self, overlap: f64, is_behind: bool) {
        let least = self.least();
        let other = if overlap < least { least } else { overlap };
        self.second = lesser(self.second, other);
        let side = if is_behind {
            &mut self.back
        } else {
            &mut self.front
        };
        *side = lesser(overlap, *side);
    }

    /// Returns the least overlap of all.
    pub(super) fn least(&self) -> f64 {
        lesser(self.front, self.back)
    }
}

/// An edge of the polyhedron.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    /// One of its end points.
    pub(super) start: Vector,
    /// Outward normals of the faces beside it.
    normals: [Vector; 2],
}

impl Edge {
    /// Returns its direction, of any length.
    pub(super) fn direction(&self) -> Vector {
        self.normals[0].cross(self.normals[1])
    }
}

/// Result of the test along the polyhedron's face normals.
pub(super) struct FaceAxes {
    /// Normal of the face of least overlap, if that is less than what was known before, and the
    /// triangle's deepest corner.
    pub(super) nearest: Option<[Vector; 2]>,
    /// Whether one of the triangle's corners is inside the polyhedron.
    pub(super) has_corner_inside: bool,
}

/// The pair of edges of least overlap.
pub(super) struct EdgePair {
    /// Unit direction in which the polyhedron would have to move.
    pub(super) direction: Vector,
    /// Start of the triangle's edge, and the vector to its end.
    pub(super) of_triangle: [Vector; 2],
    pub(super) of_polyhedron: Edge,
}

impl FaceClusters {
    /// Tests the axes along the polyhedron's face normals against a triangle with unit normal `normal`.
    ///
    /// Overlaps larger than the least by more than `tie` \[m\] may be left out. A direction is
    /// behind the triangle if its component along the normal is below `-tie`.
    pub(super) fn test_face_normals(
        &self,
        corners: &[Vector; 3],
        normal: Vector,
        tie: f64,
        overlap: &mut LeastOverlap,
    ) -> FaceAxes {
        let points = corners.map(|corner| corner.to_array());
        let across = normal.to_array();
        let mut depths = [f64::MAX; 3];
        let mut nearest = None;
        let clusters = self.faces.len() / BLOCKS;
        for (block, bounds) in self.bounds.iter().enumerate() {
            let first = block * LANES;
            let mut lower = [[f64::MIN; LANES]; 3];
            if clusters > MAX_UNBOUNDED_CLUSTERS {
                for (depth, point) in lower.iter_mut().zip(&points) {
                    *depth = min_depths(bounds, point);
                }
            }
            for cluster in first..clusters.min(first + LANES) {
                let least = lower.map(|depth| depth[cluster - first]);
                if least[0].max(least[1]).max(least[2]) > overlap.least() + tie {
                    for (depth, least) in depths.iter_mut().zip(least) {
                        *depth = lesser(*depth, least);
                    }
                    continue;
                }
                let before = overlap.least();
                self.test_cluster(cluster, &points, &across, tie, overlap, &mut depths);
                if overlap.least() < before {
                    nearest = Some(cluster);
                }
            }
        }
        FaceAxes {
            nearest: nearest.and_then(|c| self.face_of_depth(c, corners, overlap.least())),
            has_corner_inside: depths.iter().any(|depth| *depth >= 0.0),
        }
    }

    /// Tests the normals of one cluster; `depths` takes the least depth of each corner below any face.
    #[inline(always)]
    fn test_cluster(
        &self,
        cluster: usize,
        points: &[[f64; 3]; 3],
        normal: &[f64; 3],
        tie: f64,
        overlap: &mut LeastOverlap,
        depths: &mut [f64; 3],
    ) {
        let [mut front, mut back, mut second] = [[f64::MAX; LANES]; 3];
        let mut within = [[f64::MAX; LANES]; 3];
        for [x, y, z, height] in &self.faces[cluster * BLOCKS..(cluster + 1) * BLOCKS] {
            for i in 0..LANES {
                let along = |p: &[f64; 3]| x[i] * p[0] + y[i] * p[1] + z[i] * p[2];
                let heights = [along(&points[0]), along(&points[1]), along(&points[2])];
                for k in 0..3 {
                    within[k][i] = lesser(height[i] - heights[k], within[k][i]);
                }
                let depth = height[i] - lesser(heights[0], lesser(heights[1], heights[2]));
                // The polyhedron moves against its own face's normal.
                let is_behind = along(normal) > tie;
                let known = lesser(front[i], back[i]);
                second[i] = lesser(second[i], if depth < known { known } else { depth });
                front[i] = lesser(if is_behind { f64::MAX } else { depth }, front[i]);
                back[i] = lesser(if is_behind { depth } else { f64::MAX }, back[i]);
            }
        }
        for i in 0..LANES {
            overlap.add(front[i], false);
            overlap.add(back[i], true);
            overlap.second = lesser(overlap.second, second[i]);
            for k in 0..3 {
                depths[k] = lesser(depths[k], within[k][i]);
            }
        }
    }

    /// Returns normal and deepest corner of the first face of a cluster with exactly this overlap.
    fn face_of_depth(
        &self,
        cluster: usize,
        corners: &[Vector; 3],
        depth: f64,
    ) -> Option<[Vector; 2]> {
        for [x, y, z, height] in &self.faces[cluster * BLOCKS..(cluster + 1) * BLOCKS] {
            for i in 0..LANES {
                let heights = corners.map(|p| x[i] * p.x + y[i] * p.y + z[i] * p.z);
                let lowest = lesser(heights[0], lesser(heights[1], heights[2]));
                if height[i] - lowest == depth {
                    let corner = (0..3).find(|corner| heights[*corner] == lowest)?;
                    return Some([Vector::new(x[i], y[i], z[i]), corners[corner]]);
                }
            }
        }
        None
    }

    /// Tests the axes across pairs of an edge of the polyhedron and one of the triangle, and
    /// returns the pair of least overlap if that is less than what was known before.
    ///
    /// `near`: tests only edges within the least overlap of the triangle, which is enough where both overlap.
    pub(super) fn test_edge_pairs(
        &self,
        corners: &[Vector; 3],
        normal: Vector,
        tie: f64,
        near: bool,
        overlap: &mut LeastOverlap,
    ) -> Option<EdgePair> {
        let [a, b, c] = *corners;
        let others = [(a, b - a), (b, c - b), (c, a - c)]
            .map(|(from, along)| (from, along, along.cross(normal)));
        let mut nearest = None;
        if !near {
            for block in &self.edges {
                for other in &others {
                    test_edge_block(block, other, normal, tie, overlap, &mut nearest);
                }
            }
            return nearest;
        }
        let reach = Vector::splat(overlap.least() + 2.0 * tie);
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
                        test_edge_block(
                            &self.edges[block],
                            other,
                            normal,
                            tie,
                            overlap,
                            &mut nearest,
                        );
                    }
                }
            }
        }
        nearest
    }
}

/// Returns lower bounds on the depth of a point below the faces of each of several clusters.
#[inline(always)]
fn min_depths(bounds: &[Lanes; 10], point: &[f64; 3]) -> Lanes {
    let mut lower = bounds[9];
    for i in 0..LANES {
        for k in 0..3 {
            let to_place = bounds[6 + k][i] - point[k];
            lower[i] += lesser(bounds[k][i] * to_place, bounds[3 + k][i] * to_place);
        }
    }
    lower
}

/// Returns which boxes overlap the one from `low` to `high`.
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

/// Tests a block of edges against one edge of the triangle, given by its start, the vector to its
/// end, and the outward direction in the triangle's plane.
#[inline(always)]
fn test_edge_block(
    block: &[Lanes; 9],
    &(from, along, outward): &(Vector, Vector, Vector),
    normal: Vector,
    tie: f64,
    overlap: &mut LeastOverlap,
    nearest: &mut Option<EdgePair>,
) {
    let [mut one, mut other, mut product] = [[0.0; LANES]; 3];
    for i in 0..LANES {
        one[i] = block[3][i] * along.x + block[4][i] * along.y + block[5][i] * along.z;
        other[i] = block[6][i] * along.x + block[7][i] * along.y + block[8][i] * along.z;
        product[i] = one[i] * other[i];
    }
    for i in 0..LANES {
        // The pair spans a face of the Minkowski difference if the arcs of their normals cross on the Gauss map.
        if product[i] >= 0.0 {
            continue;
        }
        let vector = |k: usize| Vector::new(block[k][i], block[k + 1][i], block[k + 2][i]);
        let normals = [vector(3), vector(6)];
        // Negated, since the normals point out of the polyhedron.
        let crossing = normals[0] * -other[i].abs() - normals[1] * one[i].abs();
        if crossing.dot(outward) <= 0.0 {
            continue;
        }
        let start = vector(0);
        let direction = crossing.normalize();
        let depth = direction.dot(from - start);
        if depth < overlap.least() {
            *nearest = Some(EdgePair {
                direction,
                of_triangle: [from, along],
                of_polyhedron: Edge { start, normals },
            });
        }
        overlap.add(depth, direction.dot(normal) < -tie);
    }
}
