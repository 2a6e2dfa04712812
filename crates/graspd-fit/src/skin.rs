//! Points spread evenly over a hand's surface, which follow the hand as it moves.

use graspd_geom::{
    SignedDistance, SurfacePoint, TriangleMesh, Vec3, sample_by_sequence, sample_evenly,
};
use graspd_hand::{Hand, HandPoint, PointForces};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::FitError;

/// Seed of the pattern; any would do.
const SEED: u64 = 7;
/// Where a surface is tested for being buried in another part of the hand: this far outside it \[m\].
const BURIED_PROBE: f64 = 1e-6;

/// One point, by its place in a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) corners: [u32; 3],
    pub(crate) shares: [f64; 3],
}

impl Place {
    /// Where it is, of the surface's vertices as posed.
    #[inline]
    pub(crate) fn at(&self, vertices: &[Point3<f64>]) -> Vector3<f64> {
        let [a, b, c] = self.corners.map(|v| vertices[v as usize].coords);
        a * self.shares[0] + b * self.shares[1] + c * self.shares[2]
    }
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
    pub fn new(hand: &dyn Hand, count: usize) -> Result<Self, FitError> {
        let surface = hand.surface_at_rest();
        let solid = SignedDistance::new(&surface)?;
        Ok(Self::on(&surface, &solid, count))
    }

    /// The same on the surface of the open hand, of which `solid` is the distance.
    pub(crate) fn on(surface: &TriangleMesh, solid: &SignedDistance, count: usize) -> Self {
        Self::of(surface, &sample_evenly(surface, count, SEED), |p| {
            !solid.is_inside(&(p.point + p.normal * BURIED_PROBE))
        })
    }

    /// About `count` points, less even, and all vertices: where a hand digs in first. None is left
    /// out, as what is buried in another part of the open hand may come out of it when the hand
    /// closes.
    pub(crate) fn dense_on(surface: &TriangleMesh, count: usize) -> Self {
        let mut skin = Self::of(surface, &sample_by_sequence(surface, count), |_| true);
        skin.add_vertices(surface);
        skin
    }

    /// Those of `points` that count; each stands for the same part of the area of them all.
    fn of(
        surface: &TriangleMesh,
        points: &[SurfacePoint],
        counts: impl Fn(&SurfacePoint) -> bool + Sync,
    ) -> Self {
        let places = (points.par_iter().filter(|point| counts(point))).map(|p| Place {
            corners: surface.faces[p.face],
            shares: shares(&surface.corners(p.face), &p.point),
        });
        Self {
            places: places.collect(),
            area: surface.area() / points.len().max(1) as f64,
        }
    }

    /// Adds the vertices, each as a corner of its first face that has an area.
    fn add_vertices(&mut self, surface: &TriangleMesh) {
        let mut is_new = vec![true; surface.vertices.len()];
        for (index, face) in surface.faces.iter().enumerate() {
            if surface.area_vector(index).try_normalize(0.0).is_none() {
                continue;
            }
            for (corner, &vertex) in face.iter().enumerate() {
                if std::mem::replace(&mut is_new[vertex as usize], false) {
                    let mut shares = [0.0; 3];
                    shares[corner] = 1.0;
                    self.places.push(Place {
                        corners: *face,
                        shares,
                    });
                }
            }
        }
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

    /// Where a point is, of the surface's vertices as posed.
    #[inline]
    pub(crate) fn position(&self, vertices: &[Point3<f64>], point: usize) -> Vector3<f64> {
        self.places[point].at(vertices)
    }

    /// The outward unit normal at a point: that of its face, and 0 for a face without an area, which faces nowhere.
    #[inline]
    pub(crate) fn outward(&self, vertices: &[Point3<f64>], point: usize) -> Vector3<f64> {
        let [a, b, c] = self.places[point].corners.map(|v| vertices[v as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0);
        normal.unwrap_or_default()
    }

    /// A point's movement along a direction.
    pub(crate) fn pull(&self, point: usize, direction: &Vector3<f64>) -> PointForces {
        let Place { corners, shares } = self.places[point];
        let direction = Vec3::from(*direction);
        PointForces {
            points: [0, 1, 2].map(|k| (HandPoint::Vertex(corners[k]), direction * shares[k])),
        }
    }

    /// The movement along a direction of what is at some height \[m\] above a point, along its outward normal.
    pub(crate) fn pull_above(
        &self,
        vertices: &[Point3<f64>],
        point: usize,
        height: f64,
        direction: &Vector3<f64>,
    ) -> PointForces {
        let mut pull = self.pull(point, direction);
        let [a, b, c] = self.places[point].corners.map(|v| vertices[v as usize]);
        let (along, across) = (b - a, c - a);
        let area = along.cross(&across);
        let Some(normal) = area.try_normalize(0.0) else {
            return pull;
        };
        // d normal = (I - n n^T) (d along x across + along x d across) / |area|.
        let lever = (direction - normal * normal.dot(direction)) * (height / area.norm());
        let (at_b, at_c) = (across.cross(&lever), lever.cross(&along));
        for ((_, force), more) in (pull.points.iter_mut()).zip([-at_b - at_c, at_b, at_c]) {
            *force += more.into();
        }
        pull
    }

    /// The points of these numbers alone.
    pub(crate) fn only(&self, points: &[usize]) -> Self {
        Self {
            places: points.iter().map(|point| self.places[*point]).collect(),
            area: self.area,
        }
    }

    /// Every k-th point, such that there are at most `count`, each of which stands for as much more area.
    pub(crate) fn thinned(self, count: usize) -> Self {
        let step = self.len().div_ceil(count).max(1);
        Self {
            places: self.places.into_iter().step_by(step).collect(),
            area: self.area * step as f64,
        }
    }

    /// The places, in an order that may be changed.
    pub(crate) fn places_mut(&mut self) -> &mut [Place] {
        &mut self.places
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
