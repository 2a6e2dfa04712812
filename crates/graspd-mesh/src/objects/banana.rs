//! The banana.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

/// Finer than elsewhere, for the ends are thin.
const EDGE: f64 = 0.7 * super::EDGE;
use graspd_geom::TriangleMesh;
use graspd_geom::{Loft, pieces};

/// Length of the curved middle line, and the radius of the arc that it follows.
const LENGTH: f64 = 0.21;
const BEND_RADIUS: f64 = 0.09;

/// (share of the length, radius of the cross-section): stem, body, tip.
const RADII: [[f64; 2]; 12] = [
    [0.0, 0.0],
    [0.0, 0.0050],
    [0.06, 0.0052],
    [0.12, 0.0062],
    [0.18, 0.0098],
    [0.26, 0.0145],
    [0.38, 0.0174],
    [0.52, 0.0180],
    [0.68, 0.0172],
    [0.84, 0.0138],
    [0.97, 0.0058],
    [1.0, 0.0040],
];

/// A banana of about 210 mm along its curve and 36 mm across: five faint ridges, a stem, and a blunt tip.
pub(super) fn banana() -> TriangleMesh {
    let stations = stations();
    let curve = |k: usize, turn: f64| {
        let [share, radius] = stations[k];
        // Along an arc in the x-y plane, symmetric about the y axis.
        let bend = (share - 0.5) * LENGTH / BEND_RADIUS;
        let (sine, cosine) = bend.sin_cos();
        let center = Point3::new(BEND_RADIUS * sine, -BEND_RADIUS * cosine, 0.0);
        let tangent = Vector3::new(cosine, sine, 0.0);
        let up = Vector3::z();
        let side = up.cross(&tangent);
        let angle = TAU * turn;
        let ridged = radius * (1.0 + 0.04 * ((5.0 * angle).cos() - 1.0) * 0.5);
        center + side * (ridged * angle.cos()) + up * (ridged * angle.sin())
    };
    let mut loft = Loft::default();
    let start = loft.curve(|turn| curve(0, turn), EDGE);
    loft.extend(
        start,
        stations.len() - 1,
        |k, turn| curve(k + 1, turn),
        EDGE,
    );
    loft.mesh
}

/// The radii at steps of at most an edge along the curve, smoothly interpolated, down to a point at both ends.
fn stations() -> Vec<[f64; 2]> {
    let mut stations = vec![RADII[0]];
    for k in 1..RADII.len() - 1 {
        let [[from, _], [to, _]] = [RADII[k], RADII[k + 1]];
        let count = pieces((to - from) * LENGTH, EDGE);
        stations.extend((0..count).map(|i| {
            let t = i as f64 / count as f64;
            [from + t * (to - from), interpolated(k, t)]
        }));
    }
    let [end, radius] = RADII[RADII.len() - 1];
    stations.extend([[end, radius], [end, 0.0]]);
    stations
}

/// Cubic Hermite interpolation of the radius between knots `k` and `k + 1`, at share `t` of the way.
fn interpolated(k: usize, t: f64) -> f64 {
    let slope = |knot: usize| {
        // The first knot repeats the start of the curve, so slopes start after it.
        let (before, after) = ((knot - 1).max(1), (knot + 1).min(RADII.len() - 1));
        (RADII[after][1] - RADII[before][1]) / (RADII[after][0] - RADII[before][0])
    };
    let width = RADII[k + 1][0] - RADII[k][0];
    let (a, b) = (RADII[k][1], RADII[k + 1][1]);
    let (slope_a, slope_b) = (slope(k) * width, slope(k + 1) * width);
    let (t2, t3) = (t * t, t * t * t);
    a * (2.0 * t3 - 3.0 * t2 + 1.0)
        + slope_a * (t3 - 2.0 * t2 + t)
        + b * (3.0 * t2 - 2.0 * t3)
        + slope_b * (t3 - t2)
}
