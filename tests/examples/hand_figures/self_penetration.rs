//! How deep a hand intersects itself, by its meshes and not by the spheres that the optimiser sees.

use std::error::Error;

use graspd_geom::{Quaternion, SignedDistance, TriangleMesh, Vec3, topology};
use graspd_hand::{ArticulatedHand, Hand, HandPose, PointBuffer, SkinnedHand};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::hands::MadeOf;

/// Measures one hand. Pairs of bodies that overlap in the open hand are left out, as they do so by construction.
pub(crate) struct SelfPenetration<'a> {
    hand: &'a MadeOf,
    /// Of a hand of links: its parts. A skin has to be cut up anew for each pose.
    parts: Vec<SignedDistance>,
    at_rest: Vec<f64>,
    digits: Vec<String>,
}

impl<'a> SelfPenetration<'a> {
    pub(crate) fn new(hand: &'a MadeOf) -> Result<Self, Box<dyn Error>> {
        let (parts, open) = match hand {
            MadeOf::Links(hand) => {
                let parts = hand
                    .parts()
                    .iter()
                    .map(|part| SignedDistance::new(&part.mesh));
                (parts.collect::<Result<_, _>>()?, hand.open_articulation())
            }
            MadeOf::Skin(hand) => (Vec::new(), hand.open_articulation()),
        };
        let mut measure = Self {
            hand,
            parts,
            at_rest: Vec::new(),
            digits: DIGITS.map(str::to_owned).to_vec(),
        };
        measure.at_rest = measure.depths(open)?;
        Ok(measure)
    }

    /// The deepest that a surface point of one body is inside another one, its neighbours excepted.
    pub(crate) fn deepest(&self, articulation: &[f64]) -> Result<Overlap, Box<dyn Error>> {
        let depths = self.depths(articulation)?.into_iter().zip(&self.at_rest);
        let allowed = depths
            .enumerate()
            .filter(|(_, (_, at_rest))| **at_rest <= 0.0);
        let deepest = allowed.max_by(|(_, (a, _)), (_, (b, _))| a.total_cmp(b));
        let (pair, depth) = deepest.map_or((0, 0.0), |(pair, (depth, _))| (pair, depth));
        let (hand, names): (&dyn Hand, &[String]) = match self.hand {
            MadeOf::Links(hand) => (&**hand, hand.body_names()),
            MadeOf::Skin(hand) => (&**hand, &self.digits),
        };
        Ok(Overlap {
            depth,
            bodies: [pair / names.len(), pair % names.len()].map(|body| names[body].clone()),
            of_spheres: overlap_of_spheres(hand, &at_origin(articulation)),
        })
    }

    fn depths(&self, articulation: &[f64]) -> Result<Vec<f64>, Box<dyn Error>> {
        let pose = at_origin(articulation);
        match self.hand {
            MadeOf::Links(hand) => Ok(between_links(hand, &self.parts, &pose)),
            MadeOf::Skin(hand) => between_fingers(hand, &pose),
        }
    }
}

/// How deep a hand intersects itself.
pub(crate) struct Overlap {
    /// By its meshes \[m\].
    pub(crate) depth: f64,
    /// Where that is.
    pub(crate) bodies: [String; 2],
    /// By the spheres that the optimiser sees \[m\].
    pub(crate) of_spheres: f64,
}

fn at_origin(articulation: &[f64]) -> HandPose {
    HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: articulation.to_vec(),
    }
}

/// How far two spheres overlap at most that must not \[m\].
fn overlap_of_spheres(hand: &dyn Hand, pose: &HandPose) -> f64 {
    let (_, centers) = points_and_spheres(hand, pose);
    let spheres = hand.collision_spheres();
    let overlap = |&[a, b]: &[u32; 2]| {
        let (a, b) = (a as usize, b as usize);
        spheres.radius[a] + spheres.radius[b] - (centers.get(a) - centers.get(b)).norm()
    };
    spheres.pairs.iter().map(overlap).fold(0.0, f64::max)
}

fn points_and_spheres(hand: &dyn Hand, pose: &HandPose) -> (PointBuffer<f64>, PointBuffer<f64>) {
    let mut points = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    hand.forward(pose, &mut hand.new_scratch(), &mut points, &mut spheres);
    (points, spheres)
}

fn contact_points(hand: &dyn Hand, pose: &HandPose) -> Vec<Point3<f64>> {
    let (points, _) = points_and_spheres(hand, pose);
    (0..points.len()).map(|i| points.get(i).into()).collect()
}

/// The deepest point inside a part of another link, for each pair of links that are not neighbours \[m\].
fn between_links(hand: &ArticulatedHand, parts: &[SignedDistance], pose: &HandPose) -> Vec<f64> {
    let points = contact_points(hand, pose);
    let tree = hand.tree();
    let bodies = tree.body_count();
    let mut deepest = vec![0.0_f64; bodies * bodies];
    for (part, solid) in hand.parts().iter().zip(parts) {
        let frame = hand.link_pose(pose, &hand.body_names()[part.body]);
        let into_part = Isometry3::from(frame.expect("every body is named after a link")).inverse();
        for (point, &body) in points.iter().zip(&hand.contact_points().body) {
            let body = body as usize;
            let is_neighbour =
                tree.parent(body) == Some(part.body) || tree.parent(part.body) == Some(body);
            if body != part.body && !is_neighbour {
                let entry = &mut deepest[body.min(part.body) * bodies + body.max(part.body)];
                *entry = entry.max(depth_in(solid, &(into_part * point)));
            }
        }
    }
    deepest
}

fn depth_in(solid: &SignedDistance, point: &Point3<f64>) -> f64 {
    let (low, high) = solid.bounds();
    let is_outside = (low - point).sup(&(point - high)).max() > 0.0;
    if is_outside {
        return 0.0;
    }
    (-solid.signed_distance(point)).max(0.0)
}

/// By the joints in MANO's order.
const DIGITS: [&str; 6] = [
    "palm",
    "index",
    "middle",
    "little finger",
    "ring finger",
    "thumb",
];

/// The digit that a joint in MANO's order belongs to; 0 is the palm.
fn digit(body: u32) -> usize {
    body.div_ceil(3) as usize
}

/// The deepest vertex of each digit inside each other one \[m\]. A digit is the skin that follows its bones most,
/// closed by fans where it was cut off; a digit's first bone is not compared with the palm, which it grows out of.
fn between_fingers(hand: &SkinnedHand, pose: &HandPose) -> Result<Vec<f64>, Box<dyn Error>> {
    let points = contact_points(hand, pose);
    let count = hand.model().template.len();
    let (mut bodies, mut vertices) = (vec![0; count], vec![Point3::origin(); count]);
    let slots = hand.contact_vertices().iter();
    for ((&vertex, point), &body) in slots.zip(&points).zip(&hand.contact_points().body) {
        bodies[vertex as usize] = body;
        vertices[vertex as usize] = *point;
    }
    let mut deepest = vec![0.0_f64; DIGITS.len() * DIGITS.len()];
    for of in 0..DIGITS.len() {
        let is_own = |face: &&[u32; 3]| {
            let own = face.iter().filter(|&&v| digit(bodies[v as usize]) == of);
            own.count() >= 2
        };
        let solid = SignedDistance::new(&closed_by_fans(TriangleMesh {
            vertices: vertices.clone(),
            faces: hand.model().faces.iter().filter(is_own).copied().collect(),
        }))?;
        for (point, &body) in vertices.iter().zip(&bodies) {
            let own = digit(body);
            let is_root = (own == 0 && of != 0) || (of == 0 && body % 3 == 1);
            if own != of && !is_root {
                let entry = &mut deepest[own * DIGITS.len() + of];
                *entry = entry.max(depth_in(&solid, point));
            }
        }
    }
    Ok(deepest)
}

/// Each loop of the boundary closed by triangles about its middle.
fn closed_by_fans(mut mesh: TriangleMesh) -> TriangleMesh {
    for boundary in topology(&mesh).boundary_loops {
        let corners = &boundary.vertices;
        let sum = (corners.iter()).fold(Vector3::zeros(), |sum, &v| {
            sum + mesh.vertices[v as usize].coords
        });
        let middle = mesh.vertices.len() as u32;
        mesh.vertices.push(Point3::from(sum / corners.len() as f64));
        let edges = corners.iter().zip(corners.iter().cycle().skip(1));
        let forward: Vec<[u32; 3]> = edges.map(|(&a, &b)| [a, b, middle]).collect();
        let is_along = |face: &[u32; 3], [a, b, _]: [u32; 3]| {
            let [p, q, r] = *face;
            [[p, q], [q, r], [r, p]].contains(&[a, b])
        };
        // A fan runs against the faces that it meets.
        let turn = mesh.faces.iter().any(|face| is_along(face, forward[0]));
        let fan = forward
            .into_iter()
            .map(|[a, b, c]| if turn { [b, a, c] } else { [a, b, c] });
        mesh.faces.extend(fan);
    }
    mesh
}
