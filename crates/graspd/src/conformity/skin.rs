//! Points spread evenly over a hand's surface, which follow the hand as it moves.

use graspd_geom::{SignedDistance, TriangleMesh, sample_evenly};
use graspd_hand::Hand;
use nalgebra::{Point3, Vector3};

use crate::GraspError;
use crate::run::surface_at_rest;

/// Seed of the pattern; any would do.
const SEED: u64 = 7;
/// Where a surface is tested for being buried in another part of the hand: this far outside it \[m\].
const BURIED_PROBE: f64 = 1e-6;

/// One point, by its place in a face.
#[derive(Clone, Copy, Debug)]
struct Place {
    corners: [u32; 3],
    shares: [f64; 3],
}

/// Points spread evenly over the outer surface of a hand: each stands for the same area of the open hand.
#[derive(Clone, Debug)]
pub struct SkinSamples {
    places: Vec<Place>,
    /// The area that each point stands for \[m^2\].
    area: f64,
}

impl SkinSamples {
    /// About `count` points on the hand's surface. Those inside another part of the open hand are left out, as links
    /// overlap at the joints.
    ///
    /// # Errors
    /// If the hand's surface is not closed.
    pub fn new(hand: &dyn Hand, count: usize) -> Result<Self, GraspError> {
        let surface = surface_at_rest(hand);
        let solid = SignedDistance::new(&surface)?;
        let points = sample_evenly(&surface, count, SEED);
        let area = surface.area() / points.len().max(1) as f64;
        let outer = points
            .iter()
            .filter(|p| !solid.is_inside(&(p.point + p.normal * BURIED_PROBE)));
        let places = outer.map(|p| Place {
            corners: surface.faces[p.face],
            shares: shares(&surface.corners(p.face), &p.point),
        });
        Ok(Self {
            places: places.collect(),
            area,
        })
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.places.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }
    /// The area that each point stands for \[m^2\].
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Where a point is on the posed surface.
    #[inline]
    pub(super) fn position(&self, surface: &TriangleMesh, point: usize) -> Vector3<f64> {
        let place = &self.places[point];
        let [a, b, c] = place.corners.map(|v| surface.vertices[v as usize].coords);
        a * place.shares[0] + b * place.shares[1] + c * place.shares[2]
    }

    /// Where a point is, and the outward unit normal of its face; 0 for a face without an area, which faces nowhere.
    pub(super) fn point_and_normal(
        &self,
        surface: &TriangleMesh,
        point: usize,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let [a, b, c] = self.places[point]
            .corners
            .map(|v| surface.vertices[v as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0);
        (self.position(surface, point), normal.unwrap_or_default())
    }

    /// Leaves out all points but those of these numbers.
    pub(super) fn keep(&mut self, is_kept: impl Fn(usize) -> bool) {
        let mut number = 0..;
        self.places.retain(|_| number.next().is_some_and(&is_kept));
    }
}

/// Barycentric coordinates of a point of a triangle with an area.
fn shares([a, b, c]: &[Point3<f64>; 3], p: &Point3<f64>) -> [f64; 3] {
    let normal = (b - a).cross(&(c - a));
    let part = |from: &Point3<f64>, to: &Point3<f64>| {
        (to - from).cross(&(p - from)).dot(&normal) / normal.norm_squared()
    };
    let (first, second) = (part(b, c), part(c, a));
    [first, second, 1.0 - first - second]
}
