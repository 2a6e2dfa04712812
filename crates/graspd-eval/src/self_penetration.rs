//! Self-penetration: how deep a posed hand digs into itself.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use graspd_geom::{SignedDistance, TriangleMesh, connected_parts};
use nalgebra::{Point3, Vector3};

use crate::EvaluationError;

/// Faces are looked at by points this far apart \[m\].
const SPACING: f64 = 2e-3;
/// Where a skin is asked whether it is buried, and rays begin, outside and inside of it \[m\].
const PROBE: f64 = 1e-6;
/// Skin this near along the skin folds at a joint rather than that one finger enters another \[m\].
const FOLD: f64 = 25e-3;
/// Skin this near to where a straight way in comes out at rest is the same finger's other side \[m\].
const OTHER_SIDE: f64 = 10e-3;
/// Surfaces that a ray may enter before it leaves one.
const MAX_HITS: usize = 64;

/// What of a hand may not meet, found once from the hand at rest.
pub struct SelfPenetration {
    rest: TriangleMesh,
    /// The same; asked of skins alone.
    rest_solid: SignedDistance,
    /// How many connected parts there are.
    parts: usize,
    /// For each pair of parts, whether they overlap at rest already, as links do at their joints: `[parts * parts]`.
    are_joined: Vec<bool>,
    /// Neighbours along the edges, for each vertex.
    neighbours: Vec<Vec<u32>>,
}

impl SelfPenetration {
    /// From the hand's surface at rest (open): closed, outward oriented parts.
    ///
    /// # Errors
    /// [`EvaluationError::BadMesh`] for a hand that is not closed.
    pub fn new(rest: &TriangleMesh) -> Result<Self, EvaluationError> {
        check(rest, rest)?;
        let meshes = connected_parts(rest);
        let solids = solids(&meshes)?;
        let count = meshes.len();
        let mut are_joined = vec![false; count * count];
        for (a, b) in pairs(count) {
            let depth = depth_of_pair(&meshes, &solids, a, b);
            are_joined[a * count + b] = depth > 0.0;
        }
        let mut neighbours = vec![Vec::new(); rest.vertices.len()];
        for face in &rest.faces {
            for k in 0..3 {
                neighbours[face[k] as usize].push(face[(k + 1) % 3]);
            }
        }
        Ok(Self {
            rest_solid: SignedDistance::new(rest).map_err(bad)?,
            rest: rest.clone(),
            parts: count,
            are_joined,
            neighbours,
        })
    }

    /// How deep the hand is inside itself at a pose \[mm\]; 0 where it is not.
    ///
    /// * A hand of several parts (links): the deepest surface point of a part inside another, among
    ///   points 2 mm apart and all vertices. Parts that overlap at rest do so by construction, and
    ///   are left out.
    /// * A hand of one part (a skin): among the faces' centres that are buried in the skin, the
    ///   longest way straight in, through the finger that a point belongs to, until the ray comes
    ///   out of the one that it has entered. Skin within 25 mm of itself, measured along the skin
    ///   at rest, folds, and does not count, nor does a way to the finger's own other side.
    ///
    /// `posed`: the same mesh as at rest, at the pose.
    ///
    /// # Errors
    /// [`EvaluationError::BadMesh`] for another mesh, or coordinates that are not finite.
    pub fn depth_mm(&self, posed: &TriangleMesh) -> Result<f64, EvaluationError> {
        check(posed, &self.rest)?;
        let deepest = if self.parts == 1 {
            self.depth_of_skin(posed)?
        } else {
            let meshes = connected_parts(posed);
            let solids = solids(&meshes)?;
            pairs(self.parts)
                .filter(|(a, b)| !self.are_joined[a * self.parts + b])
                .map(|(a, b)| depth_of_pair(&meshes, &solids, a, b))
                .fold(0.0, f64::max)
        };
        Ok(deepest * 1e3)
    }

    fn depth_of_skin(&self, posed: &TriangleMesh) -> Result<f64, EvaluationError> {
        let solid = SignedDistance::new(posed).map_err(bad)?;
        let mut deepest = 0.0_f64;
        for face in 0..posed.faces.len() {
            let Some(outward) = posed.area_vector(face).try_normalize(0.0) else {
                continue;
            };
            let center = centroid(&posed.corners(face));
            if !solid.is_inside(&(center + outward * PROBE)) {
                continue;
            }
            if let Some((length, left)) = way_out(&solid, &center, &-outward)
                && length > deepest
                && !self.is_other_side(face, left)
                && !self.is_fold(face, left)
            {
                deepest = length;
            }
        }
        Ok(deepest)
    }

    /// Whether the straight way in from a face comes out by the other at rest already: then it is
    /// the finger's own other side, and a fold has buried the face.
    fn is_other_side(&self, from: usize, to: usize) -> bool {
        let center = centroid(&self.rest.corners(from));
        let Some(outward) = self.rest.area_vector(from).try_normalize(0.0) else {
            return true;
        };
        let Some((length, _)) = way_out(&self.rest_solid, &center, &-outward) else {
            return true;
        };
        let out = center - outward * length;
        (out - centroid(&self.rest.corners(to))).norm() < OTHER_SIDE
    }

    /// Whether two faces are near each other along the skin at rest.
    fn is_fold(&self, from: usize, to: usize) -> bool {
        let [start, goal] = [from, to].map(|face| self.rest.faces[face]);
        let [a, b] = [from, to].map(|face| centroid(&self.rest.corners(face)));
        if (a - b).norm() > FOLD {
            return false;
        }
        // Dijkstra along edges, as far as a fold goes; lengths in whole nanometres have an order.
        let nanometres = |length: f64| (length * 1e9) as u64;
        let vertex = |index: u32| self.rest.vertices[index as usize];
        let mut best: HashMap<u32, u64> = HashMap::new();
        let mut queue: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
        for index in start {
            queue.push(Reverse((nanometres((vertex(index) - a).norm()), index)));
        }
        while let Some(Reverse((length, index))) = queue.pop() {
            if best.get(&index).is_some_and(|known| *known <= length) {
                continue;
            }
            if length > nanometres(FOLD) {
                return false;
            }
            if goal.contains(&index) {
                return true;
            }
            best.insert(index, length);
            for &next in &self.neighbours[index as usize] {
                let step = nanometres((vertex(next) - vertex(index)).norm());
                queue.push(Reverse((length + step, next)));
            }
        }
        false
    }
}

fn bad(error: impl std::fmt::Display) -> EvaluationError {
    EvaluationError::BadMesh {
        mesh: "hand",
        fault: error.to_string(),
    }
}

/// Whether a mesh is the one at rest but for its vertices' places.
fn check(posed: &TriangleMesh, rest: &TriangleMesh) -> Result<(), EvaluationError> {
    let is_same = posed.faces == rest.faces && posed.vertices.len() == rest.vertices.len();
    let is_sound = (posed.faces.iter().flatten())
        .all(|&index| (index as usize) < posed.vertices.len())
        && posed.vertices.iter().all(|p| p.coords.sum().is_finite());
    if posed.faces.is_empty() {
        return Err(bad("it has no faces"));
    }
    if !is_same {
        return Err(bad("it is not the hand that was looked at at rest"));
    }
    if !is_sound {
        return Err(bad("a coordinate or an index is not sound"));
    }
    Ok(())
}

fn solids(parts: &[TriangleMesh]) -> Result<Vec<SignedDistance>, EvaluationError> {
    let solid = |part| SignedDistance::new(part).map_err(bad);
    parts.iter().map(solid).collect()
}

fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
}

fn centroid(corners: &[Point3<f64>; 3]) -> Point3<f64> {
    let [a, b, c] = corners;
    Point3::from((a.coords + b.coords + c.coords) / 3.0)
}

/// How far straight on the first surface is that is left, and its face.
fn way_out(
    solid: &SignedDistance,
    from: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<(f64, usize)> {
    let mut length = PROBE;
    for _ in 0..MAX_HITS {
        let hit = (solid.tree()).first_hit(&(from + direction * length), direction)?;
        length += hit.length;
        if hit.normal.dot(direction) > 0.0 {
            return Some((length, hit.face));
        }
        length += PROBE;
    }
    None
}

/// The deepest point of either part's surface inside the other \[m\].
fn depth_of_pair(meshes: &[TriangleMesh], solids: &[SignedDistance], a: usize, b: usize) -> f64 {
    let into = |surface: usize, solid: usize| depth_inside(&meshes[surface], &solids[solid]);
    into(a, b).max(into(b, a))
}

fn depth_inside(surface: &TriangleMesh, solid: &SignedDistance) -> f64 {
    let (low, high) = solid.bounds();
    let is_outside = |points: &[Point3<f64>]| {
        (0..3).any(|axis| {
            points.iter().all(|p| p[axis] <= low[axis])
                || points.iter().all(|p| p[axis] >= high[axis])
        })
    };
    let mut deepest = 0.0_f64;
    let mut look = |point: &Point3<f64>| {
        if !is_outside(&[*point]) {
            deepest = deepest.max(-solid.signed_distance(point));
        }
    };
    surface.vertices.iter().for_each(&mut look);
    let mut rest: Vec<[Point3<f64>; 3]> = (0..surface.faces.len())
        .map(|face| surface.corners(face))
        .collect();
    while let Some(corners) = rest.pop() {
        if is_outside(&corners) {
            continue;
        }
        let [a, b, c] = corners;
        let longest = [(b - a), (c - b), (a - c)].map(|edge| edge.norm());
        if longest.iter().all(|length| *length <= SPACING) {
            look(&centroid(&corners));
            continue;
        }
        // The longest edge is cut in half.
        let at = (0..3).max_by(|&i, &j| longest[i].total_cmp(&longest[j]));
        let at = at.unwrap_or(0);
        let (a, b, c) = (corners[at], corners[(at + 1) % 3], corners[(at + 2) % 3]);
        let middle = nalgebra::center(&a, &b);
        rest.extend([[a, middle, c], [middle, b, c]]);
    }
    deepest
}

#[cfg(test)]
mod tests {
    use graspd_geom::capsule_mesh;
    use nalgebra::Isometry3;

    use super::*;
    use crate::test_shapes::{box_mesh, together};

    #[test]
    fn links_that_meet_at_a_joint_are_left_out() {
        // Two links that overlap at a joint, and a third apart from both.
        let at = |x: f64| {
            together(&[
                box_mesh([0.0; 3], [0.04, 0.02, 0.02]),
                box_mesh([0.03, 0.0, 0.0], [0.04, 0.01, 0.01]),
                box_mesh([x, 0.0, 0.0], [0.02, 0.05, 0.05]),
            ])
        };
        let hand = SelfPenetration::new(&at(0.1)).unwrap();
        assert_eq!(hand.depth_mm(&at(0.1)).unwrap(), 0.0);
        // The second link ends at 0.05; the third begins 3 mm before.
        assert!((hand.depth_mm(&at(0.057)).unwrap() - 3.0).abs() < 1e-9);
        // Corners and edges alone would see nothing of a plate's large face that a rod dents.
        let dented = |depth: f64| {
            let tip = capsule_mesh(0.005, 0.03, 0.001);
            let lifted = Isometry3::translation(0.0, 0.0, 0.01 + 0.02 - depth);
            together(&[
                box_mesh([0.0; 3], [0.1, 0.1, 0.02]),
                tip.transformed(&lifted),
            ])
        };
        let hand = SelfPenetration::new(&dented(-0.02)).unwrap();
        assert!((hand.depth_mm(&dented(0.002)).unwrap() - 2.0).abs() < 0.05);
    }

    /// A skin of one piece: a long capsule, bent into a hairpin whose halves come together and enter each other by
    /// `depth` \[m\].
    fn hairpin(depth: f64) -> TriangleMesh {
        const BEND: f64 = 0.012;
        const QUARTER: f64 = 0.5 * std::f64::consts::PI;
        let mut bent = capsule_mesh(0.008, 0.16, 0.002);
        for p in &mut bent.vertices {
            // The middle of the axis, along z, becomes a half circle about (-BEND, 0, 0).
            let rest = p.z - p.z.clamp(-BEND * QUARTER, BEND * QUARTER);
            let (sine, cosine) = (p.z / BEND).clamp(-QUARTER, QUARTER).sin_cos();
            // From 1 to 4 cm behind it the halves draw near.
            let share = ((rest.abs() - 0.01) / 0.03).clamp(0.0, 1.0);
            let nearer = (BEND - 0.008 + 0.5 * depth) * share * rest.signum();
            let arm = p.x + BEND;
            (p.x, p.z) = (arm * cosine - rest.abs(), arm * sine - nearer);
        }
        bent
    }

    #[test]
    fn a_skin_that_enters_itself_is_measured_straight_in() {
        let rest = capsule_mesh(0.008, 0.16, 0.002);
        let hand = SelfPenetration::new(&rest).unwrap();
        assert_eq!(hand.parts, 1);
        assert_eq!(hand.depth_mm(&rest).unwrap(), 0.0);
        for depth in [0.001, 0.002, 0.004] {
            let found = hand.depth_mm(&hairpin(depth)).unwrap();
            // Facets of 2 mm on a radius of 8 mm lie up to 0.07 mm inside on either side, and
            // centres beside the middle less deep.
            assert!((found - 1e3 * depth).abs() < 0.3, "{depth}: {found}");
        }
        assert_eq!(hand.depth_mm(&hairpin(-0.002)).unwrap(), 0.0);
    }

    #[test]
    fn another_mesh_is_refused() {
        let rest = capsule_mesh(0.008, 0.05, 0.004);
        let hand = SelfPenetration::new(&rest).unwrap();
        let mut broken = rest.clone();
        broken.vertices[3].x = f64::NAN;
        assert!(hand.depth_mm(&broken).is_err());
        assert!(hand.depth_mm(&box_mesh([0.0; 3], [0.1; 3])).is_err());
        assert!(SelfPenetration::new(&TriangleMesh::default()).is_err());
    }
}
