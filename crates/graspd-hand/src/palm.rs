//! The palm and the open pose of a hand that says nothing about them, from how its fingers move.

use graspd_geom::{Rigid, Vec3};
use nalgebra::{Point3, Vector3};

use crate::part::Part;
use crate::{KinematicTree, PalmFrame};

/// Movement of the finger tips out of their own direction below which no side counts as the palm's \[m\].
const LEAST_MOVEMENT: f64 = 1e-6;

/// The open hand: every joint at the allowed value that is nearest to 0, where URDFs of hands have their fingers
/// straight.
pub(crate) fn open_articulation(tree: &KinematicTree) -> Vec<f64> {
    tree.limits().iter().map(|limit| limit.clamp(0.0)).collect()
}

/// Descriptions align the base with the palm; directions this near to an axis of the base are taken to be it.
const ALIGNED_COSINE: f64 = 0.966; // 15 degrees

/// A finger: a chain of bodies from the base to a body on which nothing hangs.
struct Finger {
    /// Direction from its first joint to its tip in the open hand.
    direction: Vector3<f64>,
    /// Movement of its tip from the open hand to the middle of all joint ranges, orthogonal to the direction.
    closing: Vector3<f64>,
}

/// The palm that fingers close towards, in the frame of the base; says in `notes` what had to be guessed.
///
/// * The normal is the direction in which the finger tips move, on average, when all joints go from the open hand to
///   the middle of their ranges, leaving out each finger's movement along its own outstretched direction.
/// * The finger direction is that of the finger most like all others (so a thumb has no say), made orthogonal to the
///   normal.
/// * Both are turned to the nearest axis of the base where that is within 15 degrees.
/// * The center is where the ray along the normal from the middle of the base's surface leaves the base.
pub(crate) fn palm_frame(
    tree: &KinematicTree,
    parts: &[Part],
    open: &[f64],
    notes: &mut Vec<String>,
) -> PalmFrame {
    let fingers = fingers(tree, parts, open);
    let closing: Vector3<f64> = fingers.iter().map(|finger| finger.closing).sum();
    let normal = closing.try_normalize(LEAST_MOVEMENT).unwrap_or_else(|| {
        notes.push("no side towards which the fingers close was found: +z is taken".into());
        Vector3::z()
    });
    let normal = aligned(normal);
    let unlike = |direction: &Vector3<f64>| -> f64 {
        let others = fingers.iter();
        others
            .map(|other| (other.direction - direction).norm())
            .sum()
    };
    let directions = fingers.iter().map(|finger| finger.direction);
    let typical = directions
        .min_by(|a, b| unlike(a).total_cmp(&unlike(b)))
        .unwrap_or_default();
    let in_palm = typical - normal * normal.dot(&typical);
    // A hand whose fingers point along the normal has no direction of its own: any will do.
    let fingers = in_palm.try_normalize(0.1).unwrap_or_else(|| {
        let axis = Vector3::ith(normal.iamin(), 1.0);
        (axis - normal * normal.dot(&axis)).normalize()
    });
    // An axis of the base is orthogonal to the normal only if that is one too.
    let snapped = aligned(fingers);
    let fingers = if snapped.dot(&normal) == 0.0 {
        snapped
    } else {
        fingers
    };
    PalmFrame {
        center: palm_center(parts, normal),
        normal,
        fingers,
    }
}

/// The axis of the base that a unit vector is nearest to, if it is near.
fn aligned(direction: Vector3<f64>) -> Vector3<f64> {
    let axis = direction.iamax();
    if direction[axis].abs() < ALIGNED_COSINE {
        return direction;
    }
    Vector3::ith(axis, direction[axis].signum())
}

fn fingers(tree: &KinematicTree, parts: &[Part], open: &[f64]) -> Vec<Finger> {
    let bodies = tree.body_count();
    let posed = |articulation: &[f64]| {
        let mut poses = vec![Rigid::identity(); bodies];
        tree.forward(&Rigid::identity(), articulation, &mut poses);
        poses
    };
    let open_poses = posed(open);
    let middle: Vec<f64> = tree.limits().iter().map(crate::Limit::middle).collect();
    let middle_poses = posed(&middle);
    let is_leaf = |body: usize| (1..bodies).all(|other| tree.parent(other) != Some(body));
    (1..bodies)
        .filter(|&body| is_leaf(body))
        .map(|leaf| {
            let tip = Vec3::from(tip_of(parts, leaf));
            let mut root = leaf;
            while let Some(parent) = tree.parent(root).filter(|&parent| parent != 0) {
                root = parent;
            }
            let start = Vector3::from(open_poses[leaf].apply(tip));
            let end = Vector3::from(middle_poses[leaf].apply(tip));
            let length = start - Vector3::from(open_poses[root].translation);
            let direction = length.try_normalize(LEAST_MOVEMENT).unwrap_or_default();
            let movement = end - start;
            Finger {
                direction,
                closing: movement - direction * direction.dot(&movement),
            }
        })
        .collect()
}

/// The vertex of a body's parts that is farthest from the body's joint; the joint itself without parts.
fn tip_of(parts: &[Part], body: usize) -> Point3<f64> {
    let own = parts.iter().filter(|part| part.body == body);
    own.flat_map(|part| &part.mesh.vertices)
        .max_by(|a, b| a.coords.norm().total_cmp(&b.coords.norm()))
        .copied()
        .unwrap_or_default()
}

/// Where the ray along `normal` from the area centroid of the base's parts leaves the last of them.
fn palm_center(parts: &[Part], normal: Vector3<f64>) -> Point3<f64> {
    let base = || parts.iter().filter(|part| part.body == 0);
    let (mut area, mut moment) = (0.0, Vector3::zeros());
    for part in base() {
        for face in 0..part.mesh.faces.len() {
            let weight = part.mesh.area_vector(face).norm();
            let [a, b, c] = part.mesh.corners(face);
            area += weight;
            moment += weight * (a.coords + b.coords + c.coords) / 3.0;
        }
    }
    if area <= 0.0 {
        return Point3::origin();
    }
    let start = Point3::from(moment / area);
    let hits = base().flat_map(|part| {
        (0..part.mesh.faces.len())
            .filter_map(|face| ray_hit(start, normal, part.mesh.corners(face)))
    });
    start + normal * hits.fold(0.0, f64::max)
}

/// Distance along the ray to the triangle, if it is hit.
pub(crate) fn ray_hit(
    start: Point3<f64>,
    direction: Vector3<f64>,
    corners: [Point3<f64>; 3],
) -> Option<f64> {
    let [a, b, c] = corners;
    let (u, v) = (b - a, c - a);
    let cross = direction.cross(&v);
    let determinant = u.dot(&cross);
    if determinant == 0.0 {
        return None;
    }
    let offset = start - a;
    let beta = offset.dot(&cross) / determinant;
    let other = offset.cross(&u);
    let gamma = direction.dot(&other) / determinant;
    // A ray that runs along an edge may count for both sides: only the farthest hit is wanted.
    let inside = beta >= -1e-9 && gamma >= -1e-9 && beta + gamma <= 1.0 + 1e-9;
    inside.then(|| v.dot(&other) / determinant)
}
