//! Surfaces out of rings of vertices: bands between rings, closed by single points.

use std::ops::Range;

use nalgebra::Point3;

use crate::TriangleMesh;

/// Vertices of a closed curve in order, or a single vertex where a surface closes.
pub type Ring = Vec<u32>;

/// The fewest and the most vertices of a ring that is not a single point.
const RING_LEN: [usize; 2] = [6, 2048];

/// The most pieces that a length is cut into, so that no edge length asked for costs unbounded memory.
const MAX_PIECES: usize = 2048;

/// How many pieces of at most `edge` a length has; at least 1.
pub fn pieces(length: f64, edge: f64) -> usize {
    // A float-to-integer cast saturates, and turns NaN into 0.
    ((length / edge).ceil() as usize).clamp(1, MAX_PIECES)
}

/// A mesh that grows ring by ring.
///
/// A band between two rings faces outward if both run counter-clockwise as seen by someone who looks back from the
/// second to the first. Rings match at their first vertices.
#[derive(Default)]
pub struct Loft {
    /// The mesh so far.
    pub mesh: TriangleMesh,
}

impl Loft {
    /// Adds vertices.
    pub fn ring(&mut self, points: impl IntoIterator<Item = Point3<f64>>) -> Ring {
        let first = self.mesh.vertices.len() as u32;
        self.mesh.vertices.extend(points);
        (first..self.mesh.vertices.len() as u32).collect()
    }

    /// Adds vertices of a closed curve (parameter 0 to 1), evenly spaced along it and at most about `edge` apart; a
    /// single vertex if the curve is a point.
    pub fn curve(&mut self, curve: impl Fn(f64) -> Point3<f64>, edge: f64) -> Ring {
        const STEPS: usize = 256;
        let parameter = |step: usize| step as f64 / STEPS as f64;
        let mut length_to = vec![0.0];
        for step in 0..STEPS {
            let chord = (curve(parameter(step + 1)) - curve(parameter(step))).norm();
            length_to.push(length_to[step] + chord);
        }
        let length = length_to[STEPS];
        if length < 1e-9 {
            return self.ring([curve(0.0)]);
        }
        let len = pieces(length, edge).clamp(RING_LEN[0], RING_LEN[1]);
        let at_length = |wanted: f64| {
            let step = length_to.partition_point(|&reached| reached <= wanted) - 1;
            let share = (wanted - length_to[step]) / (length_to[step + 1] - length_to[step]);
            curve((step as f64 + share) / STEPS as f64)
        };
        self.ring((0..len).map(|i| at_length(length * i as f64 / len as f64)))
    }

    /// Joins two rings, whose lengths may differ.
    pub fn band(&mut self, lower: &Ring, upper: &Ring) {
        let at = |ring: &Ring, i: usize| ring[i % ring.len()];
        let (mut i, mut j) = (0, 0);
        let lower_steps = if lower.len() == 1 { 0 } else { lower.len() };
        let upper_steps = if upper.len() == 1 { 0 } else { upper.len() };
        while i < lower_steps || j < upper_steps {
            // The ring that lags behind, as a share of its length, takes the next step.
            let lower_lags = (i + 1) * upper.len() <= (j + 1) * lower.len();
            if i < lower_steps && (lower_lags || j == upper_steps) {
                let face = [at(lower, i), at(lower, i + 1), at(upper, j)];
                self.mesh.faces.push(face);
                i += 1;
            } else {
                let face = [at(lower, i), at(upper, j + 1), at(upper, j)];
                self.mesh.faces.push(face);
                j += 1;
            }
        }
    }

    /// Joins two rings of equal length, but for the quadrilaterals that start at the vertices in `gap`.
    pub fn band_with_gap(&mut self, lower: &Ring, upper: &Ring, gap: Range<usize>) {
        let len = lower.len();
        for i in (0..len).filter(|i| !gap.contains(i)) {
            let next = (i + 1) % len;
            self.mesh.faces.push([lower[i], lower[next], upper[i]]);
            self.mesh.faces.push([lower[next], upper[next], upper[i]]);
        }
    }

    /// Continues from `ring` through `count` closed curves `curve(k, turn)`; gives the last one.
    pub fn extend(
        &mut self,
        mut ring: Ring,
        count: usize,
        curve: impl Fn(usize, f64) -> Point3<f64>,
        edge: f64,
    ) -> Ring {
        for k in 0..count {
            let next = self.curve(|turn| curve(k, turn), edge);
            self.band(&ring, &next);
            ring = next;
        }
        ring
    }
}

/// A polyline with further points inserted so that none of its pieces is longer than `edge`.
pub fn refined(polyline: &[[f64; 2]], edge: f64) -> Vec<[f64; 2]> {
    let mut refined = Vec::new();
    for pair in polyline.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let count = pieces((to[0] - from[0]).hypot(to[1] - from[1]), edge);
        refined.extend((0..count).map(|i| {
            let share = i as f64 / count as f64;
            [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
        }));
    }
    refined.extend(polyline.last());
    refined
}

/// The surface that a profile of points (radius, z) sweeps around the z axis.
///
/// The profile starts and ends on the axis and has the outside on its right, so it runs upward along an outer wall.
pub fn revolved(profile: &[[f64; 2]], edge: f64) -> TriangleMesh {
    let stations = refined(profile, edge);
    let mut loft = Loft::default();
    let circle = |k: usize, turn: f64| on_circle(stations[k], turn);
    let start = loft.curve(|turn| circle(0, turn), edge);
    loft.extend(
        start,
        stations.len() - 1,
        |k, turn| circle(k + 1, turn),
        edge,
    );
    loft.mesh
}

/// The point of a profile (radius, z) after a share of a turn about the z axis.
pub fn on_circle([radius, z]: [f64; 2], turn: f64) -> Point3<f64> {
    let (sine, cosine) = (std::f64::consts::TAU * turn).sin_cos();
    Point3::new(radius * cosine, radius * sine, z)
}

/// Points on the arc of a circle about `center` from one angle to another \[rad\], both ends included, at most `edge`
/// apart.
pub fn arc(center: [f64; 2], radius: f64, angles: [f64; 2], edge: f64) -> Vec<[f64; 2]> {
    // Never fewer than a piece every 30 degrees.
    let sweep = angles[1] - angles[0];
    let count = pieces(radius * sweep.abs(), edge).max((sweep.abs() / 0.53).ceil() as usize);
    (0..=count)
        .map(|i| {
            let angle = angles[0] + sweep * i as f64 / count as f64;
            [
                center[0] + radius * angle.cos(),
                center[1] + radius * angle.sin(),
            ]
        })
        .collect()
}
