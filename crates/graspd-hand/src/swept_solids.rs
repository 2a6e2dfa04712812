//! Solids from outlines: extruded polygons and solids of revolution, as closed meshes.

use std::f64::consts::{PI, TAU};

use graspd_geom::TriangleMesh;
use nalgebra::Point3;

/// Extrudes the convex polygon `outline`, given as (u, v) in counter-clockwise order seen against w, from
/// w = `low` to w = `high`. `place` turns (u, v, w) into a point and must keep the handedness.
pub(crate) fn extruded(
    outline: &[[f64; 2]],
    low: f64,
    high: f64,
    place: impl Fn(f64, f64, f64) -> Point3<f64>,
) -> TriangleMesh {
    let count = outline.len() as u32;
    let level = |w: f64| outline.iter().map(move |&[u, v]| (u, v, w));
    let vertices = level(low)
        .chain(level(high))
        .map(|(u, v, w)| place(u, v, w))
        .collect();
    let mut faces = Vec::with_capacity(4 * outline.len() - 4);
    for i in 1..count - 1 {
        faces.push([0, i + 1, i]);
        faces.push([count, count + i, count + i + 1]);
    }
    for i in 0..count {
        let next = (i + 1) % count;
        faces.push([i, next, count + next]);
        faces.push([i, count + next, count + i]);
    }
    TriangleMesh { vertices, faces }
}

/// Returns a rectangle with rounded corners, counter-clockwise, as an outline for [`extruded`].
///
/// `radii`: of the corners (high u, high v), (low u, high v), (low u, low v), (high u, low v).
pub(crate) fn rounded_rectangle(
    u: [f64; 2],
    v: [f64; 2],
    radii: [f64; 4],
    segments_per_corner: usize,
) -> Vec<[f64; 2]> {
    let corners = [[u[1], v[1]], [u[0], v[1]], [u[0], v[0]], [u[1], v[0]]];
    let inward = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut outline = Vec::new();
    for corner in 0..4 {
        let radius = radii[corner];
        if radius <= 0.0 {
            outline.push(corners[corner]);
            continue;
        }
        let center = [0, 1].map(|axis| corners[corner][axis] + radius * inward[corner][axis]);
        for step in 0..=segments_per_corner {
            let angle = 0.5 * PI * (corner as f64 + step as f64 / segments_per_corner as f64);
            outline.push([
                center[0] + radius * angle.cos(),
                center[1] + radius * angle.sin(),
            ]);
        }
    }
    // Full half circles meet at a point that both corners give.
    let is_same = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
    outline.dedup_by(|a, b| is_same(*a, *b));
    while outline.len() > 1 && is_same(outline[0], outline[outline.len() - 1]) {
        outline.pop();
    }
    outline
}

/// Makes the solid that `profile`, points (radius, height) from the lower to the upper end, sweeps around the z
/// axis. The first and the last radius must be 0, all others positive.
pub(crate) fn revolved(profile: &[[f64; 2]], segments: u32) -> TriangleMesh {
    let rings = profile.len() as u32 - 2;
    let mut vertices = vec![Point3::new(0.0, 0.0, profile[0][1])];
    for &[radius, height] in &profile[1..profile.len() - 1] {
        vertices.extend((0..segments).map(|k| {
            let (sine, cosine) = (TAU * f64::from(k) / f64::from(segments)).sin_cos();
            Point3::new(radius * cosine, radius * sine, height)
        }));
    }
    vertices.push(Point3::new(0.0, 0.0, profile[profile.len() - 1][1]));
    let top = vertices.len() as u32 - 1;
    let at = |ring: u32, k: u32| 1 + ring * segments + k % segments;
    let mut faces = Vec::new();
    for k in 0..segments {
        faces.push([0, at(0, k + 1), at(0, k)]);
        faces.push([top, at(rings - 1, k), at(rings - 1, k + 1)]);
        for ring in 0..rings - 1 {
            faces.push([at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)]);
            faces.push([at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    TriangleMesh { vertices, faces }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Computes the volume by the divergence theorem; positive only if the faces point outwards.
    fn volume(mesh: &TriangleMesh) -> f64 {
        (0..mesh.faces.len())
            .map(|face| mesh.corners(face)[0].coords.dot(&mesh.area_vector(face)) / 6.0)
            .sum()
    }

    fn is_closed(mesh: &TriangleMesh) -> bool {
        let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
        for [a, b, c] in &mesh.faces {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((*from.min(to), *from.max(to))).or_default() +=
                    if from < to { 1 } else { -1 };
            }
        }
        balance.values().all(|&sum| sum == 0)
    }

    #[test]
    fn a_rounded_prism_is_closed_and_has_its_volume() {
        let outline = rounded_rectangle([-1.0, 3.0], [0.0, 2.0], [1.0, 0.5, 0.0, 0.25], 64);
        let mesh = extruded(&outline, -0.5, 1.0, Point3::new);
        let missing = (1.0 - PI / 4.0) * (1.0 + 0.25 + 0.0625);
        assert!(is_closed(&mesh));
        assert!((volume(&mesh) - 1.5 * (8.0 - missing)).abs() < 1e-3);
    }

    #[test]
    fn a_revolved_profile_is_closed_and_has_its_volume() {
        let mesh = revolved(&[[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 3.0]], 256);
        assert!(is_closed(&mesh));
        // A cylinder and a cone.
        assert!((volume(&mesh) - PI * (2.0 + 1.0 / 3.0)).abs() < 2e-3);
    }
}
