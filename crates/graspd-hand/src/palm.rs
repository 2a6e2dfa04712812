//! The palm and the open pose of a hand that says nothing about them, from how its fingers move.

use graspd_geom::Vec3;

use nalgebra::{Point3, Vector3};

use crate::body_motion::BodyMotion;
use crate::closing_direction;
use crate::{KinematicTree, PalmFrame, Part};

/// Movement of the finger tips out of their own direction below which no side counts as the palm's \[m\].
const MIN_MOVEMENT: f64 = 1e-6;

/// Fingers whose closing movements add up to less than this share of their lengths close against each other, as
/// grippers do, and not towards a palm.
const PINCHING: f64 = 0.3;
/// A joint at rest is taken to be closed if this share of the movement to its other limit leads away from the focus.
const OPENING_SHARE: f64 = 0.3;
/// Vertices of a part that stand for it where directions are all that counts.
const VERTICES_PER_PART: usize = 24;

/// Returns the open hand and the palm, from the kinematics alone; says in `notes` what had to be guessed.
///
/// Descriptions of hands have 0 where fingers are straight, so every joint starts at 0. Two kinds of joint do not stay
/// there: one at whose rest the hand is closed (it is at a limit, and going to the other leads away from what
/// the fingers close around), which opens to the other limit; and one that cannot reach 0, which opens to its middle.
pub(crate) fn open_and_palm(
    tree: &KinematicTree,
    parts: &[Part],
    notes: &mut Vec<String>,
) -> (Vec<f64>, PalmFrame) {
    let rest: Vec<f64> = tree.limits().iter().map(|limit| limit.clamp(0.0)).collect();
    let mut open = rest.clone();
    let palm = palm_frame(tree, parts, &rest, &mut Vec::new());
    let samples = samples(parts);
    let at_rest = positions(tree, &samples, &rest);
    let on_fingers = samples.iter().map(|(body, _)| *body != 0);
    let fingers: Vec<Point3<f64>> = (at_rest.iter().zip(on_fingers))
        .filter_map(|(point, is_finger)| is_finger.then_some(*point))
        .collect();
    let focus = closing_direction::focus(&palm, &fingers);
    for (joint, limit) in tree.limits().iter().enumerate() {
        let other_end = if rest[joint] == limit.lower {
            limit.upper
        } else if rest[joint] == limit.upper {
            limit.lower
        } else {
            continue;
        };
        let name = &tree.articulation_names()[joint];
        let mut opened = rest.clone();
        opened[joint] = other_end;
        let is_finite = other_end.is_finite();
        let leads_away = is_finite && {
            let moved = positions(tree, &samples, &opened);
            closing_direction::share_towards(&at_rest, &moved, focus) < -OPENING_SHARE
        };
        if leads_away {
            open[joint] = other_end;
            notes.push(format!(
                "joint `{name}` is closed at {}: {other_end} is taken for open",
                rest[joint]
            ));
        } else if rest[joint] != 0.0 && is_finite {
            open[joint] = limit.middle();
        }
    }
    let palm = palm_frame(tree, parts, &open, notes);
    (open, palm)
}

/// Returns a few vertices of each part, with their bodies.
fn samples(parts: &[Part]) -> Vec<(usize, Point3<f64>)> {
    let few = |part: &Part| {
        let vertices = &part.mesh.vertices;
        let step = vertices.len().div_ceil(VERTICES_PER_PART).max(1);
        let chosen = vertices.iter().step_by(step);
        chosen
            .map(|vertex| (part.body, *vertex))
            .collect::<Vec<_>>()
    };
    parts.iter().flat_map(few).collect()
}

fn positions(
    tree: &KinematicTree,
    samples: &[(usize, Point3<f64>)],
    articulation: &[f64],
) -> Vec<Point3<f64>> {
    let poses = tree.body_poses(articulation);
    let place = |(body, point): &(usize, Point3<f64>)| poses[*body].apply((*point).into()).into();
    samples.iter().map(place).collect()
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

/// Returns the palm that fingers close towards, in the frame of the base; says in `notes` what had to be guessed.
///
/// * The normal is the direction in which the finger tips move, on average, when all joints go from the open hand to
///   the middle of their ranges, leaving out each finger's movement along its own outstretched direction.
/// * A single finger, or fingers that close against each other so that their movements cancel, have no such side: the
///   normal is then the fingers' mean direction, and their "finger direction" the one in which they close.
/// * The finger direction is otherwise that of the finger most like all others (so a thumb has no say), made
///   orthogonal to the normal.
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
    let movement: f64 = fingers.iter().map(|finger| finger.closing.norm()).sum();
    let is_pinching = fingers.len() < 2 || closing.norm() < PINCHING * movement;
    if is_pinching && let Some(palm) = pinching_palm(parts, &fingers) {
        notes.push(
            "the fingers close against each other and not towards a palm: it is taken to face along them".into(),
        );
        return palm;
    }
    let normal = closing.try_normalize(MIN_MOVEMENT).unwrap_or_else(|| {
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

/// Returns the palm of a gripper: it faces where the fingers point, and they close along its `fingers`.
fn pinching_palm(parts: &[Part], fingers: &[Finger]) -> Option<PalmFrame> {
    let along: Vector3<f64> = fingers.iter().map(|finger| finger.direction).sum();
    let normal = aligned(along.try_normalize(MIN_MOVEMENT)?);
    let most_moved = fingers
        .iter()
        .max_by(|a, b| a.closing.norm().total_cmp(&b.closing.norm()))?;
    let across = most_moved.closing - normal * normal.dot(&most_moved.closing);
    Some(PalmFrame {
        center: palm_center(parts, normal),
        normal,
        fingers: across.try_normalize(MIN_MOVEMENT)?,
    })
}

/// Returns the axis of the base that a unit vector is nearest to, if it is near.
fn aligned(direction: Vector3<f64>) -> Vector3<f64> {
    let axis = direction.iamax();
    if direction[axis].abs() < ALIGNED_COSINE {
        return direction;
    }
    Vector3::ith(axis, direction[axis].signum())
}

fn fingers(tree: &KinematicTree, parts: &[Part], open: &[f64]) -> Vec<Finger> {
    let bodies = tree.body_count();
    let open_poses = tree.body_poses(open);
    let middle: Vec<f64> = tree.limits().iter().map(crate::Limit::middle).collect();
    let middle_poses = tree.body_poses(&middle);
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
            let direction = length.try_normalize(MIN_MOVEMENT).unwrap_or_default();
            let movement = end - start;
            Finger {
                direction,
                closing: movement - direction * direction.dot(&movement),
            }
        })
        .collect()
}

/// Returns the vertex of a body's parts that is farthest from the body's joint; the joint itself without parts.
fn tip_of(parts: &[Part], body: usize) -> Point3<f64> {
    let own = parts.iter().filter(|part| part.body == body);
    own.flat_map(|part| &part.mesh.vertices)
        .max_by(|a, b| a.coords.norm().total_cmp(&b.coords.norm()))
        .copied()
        .unwrap_or_default()
}

/// Returns where the ray along `normal` from the area centroid of the base's parts leaves the last of them.
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
