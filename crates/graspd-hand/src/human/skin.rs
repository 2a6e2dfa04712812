//! The skin of the rest pose, as kept in `skin.bin`.

use graspd_geom::TriangleMesh;
use nalgebra::Point3;

/// Vertices of the skin: as many as MANO has.
pub(crate) const SKIN_VERTICES: usize = 778;

/// What coordinates are kept in multiples of \[m\].
pub(crate) const UNIT: f64 = 1e-5;

/// x, y, z of each vertex as i16 in [`UNIT`]s, then the corners of each face as u16; little-endian.
static SKIN: &[u8] = include_bytes!("skin.bin");

/// Returns the skin \[m\]: closed, with faces that point outwards.
pub(crate) fn skin() -> TriangleMesh {
    let (vertices, faces) = SKIN.split_at(6 * SKIN_VERTICES);
    let triples = |bytes: &'static [u8]| {
        (bytes.chunks_exact(6)).map(|row| [0, 2, 4].map(|at| [row[at], row[at + 1]]))
    };
    TriangleMesh {
        vertices: triples(vertices)
            .map(|row| Point3::from(row.map(|bytes| f64::from(i16::from_le_bytes(bytes)) * UNIT)))
            .collect(),
        faces: triples(faces)
            .map(|row| row.map(|bytes| u32::from(u16::from_le_bytes(bytes))))
            .collect(),
    }
}

/// Returns the bytes of a skin in millimetres.
#[cfg(test)]
pub(crate) fn encoded(skin_mm: &TriangleMesh) -> Vec<u8> {
    let vertices = skin_mm.vertices.iter().flat_map(|p| {
        p.coords
            .iter()
            .flat_map(|x| ((x * 1e-3 / UNIT).round() as i16).to_le_bytes())
            .collect::<Vec<u8>>()
    });
    let faces = (skin_mm.faces.iter().flatten()).flat_map(|&v| (v as u16).to_le_bytes());
    vertices.chain(faces).collect()
}

#[cfg(test)]
mod tests {
    use graspd_geom::{require_closed, signed_volume, topology};
    use nalgebra::Vector3;

    use super::*;
    use crate::human::proportions::{RAYS, chains};

    #[test]
    fn the_skin_is_one_closed_sphere_of_plausible_size() {
        let skin = skin();
        assert_eq!(skin.vertices.len(), SKIN_VERTICES);
        assert_eq!(skin.faces.len(), 2 * SKIN_VERTICES - 4);
        require_closed(&skin, "skin").unwrap();
        let topology = topology(&skin);
        assert_eq!((topology.components, topology.euler_number), (1, 2));
        assert_eq!(
            (topology.boundary_edges, topology.non_manifold_edges),
            (0, 0)
        );
        // Hands hold 300 to 450 cm^3 and have about 2 % of the body's surface.
        assert!((300e-6..450e-6).contains(&signed_volume(&skin)));
        assert!((0.038..0.052).contains(&skin.area()));
    }

    #[test]
    fn no_triangle_is_a_sliver() {
        let skin = skin();
        for face in 0..skin.faces.len() {
            let [a, b, c] = skin.corners(face);
            for [apex, p, q] in [[a, b, c], [b, c, a], [c, a, b]] {
                let angle = (p - apex).angle(&(q - apex)).to_degrees();
                assert!(angle > 15.0, "face {face} has an angle of {angle} degrees");
            }
        }
    }

    /// Tells whether the segment from `p` to `q` passes through the triangle.
    fn pierces(p: Point3<f64>, q: Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> bool {
        let volume = |a: Point3<f64>, b: Point3<f64>, c: Point3<f64>, d: Point3<f64>| {
            (b - a).cross(&(c - a)).dot(&(d - a)) > 0.0
        };
        volume(a, b, c, p) != volume(a, b, c, q)
            && volume(p, q, a, b) == volume(p, q, b, c)
            && volume(p, q, b, c) == volume(p, q, c, a)
    }

    #[test]
    fn the_skin_does_not_cross_itself() {
        let skin = skin();
        let boxes: Vec<_> = (0..skin.faces.len())
            .map(|face| {
                let [a, b, c] = skin.corners(face);
                (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
            })
            .collect();
        for &[a, b, c] in &skin.faces {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let (p, q) = (skin.vertices[from as usize], skin.vertices[to as usize]);
                let (low, high) = (p.inf(&q), p.sup(&q));
                for (face, (face_low, face_high)) in boxes.iter().enumerate() {
                    let corners = skin.faces[face];
                    let is_far = (0..3).any(|k| high[k] < face_low[k] || low[k] > face_high[k]);
                    if from > to || is_far || corners.contains(&from) || corners.contains(&to) {
                        continue;
                    }
                    assert!(
                        !pierces(p, q, skin.corners(face)),
                        "{from}-{to} pierces {face}"
                    );
                }
            }
        }
    }

    /// Extent of the skin along a direction, of the vertices within `reach` of the plane through `at` across `along`.
    fn extent(at: Point3<f64>, along: Vector3<f64>, across: Vector3<f64>, reach: f64) -> f64 {
        let skin = skin();
        let near = (skin.vertices.iter())
            .map(|p| p - at)
            .filter(|d| d.dot(&along).abs() < reach && d.norm() < 0.06)
            .map(|d| d.dot(&across));
        let (low, high) = near.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        high - low
    }

    #[test]
    fn breadths_and_depths_are_those_of_hands() {
        // Breadth across the knuckles about 79 to 90 mm, wrist about 55 to 63 mm
        // (means of women and men, Greiner 1991).
        let knuckles = Point3::new(-0.085, 0.0, -0.006);
        let breadth = extent(knuckles, Vector3::x(), Vector3::z(), 0.008);
        assert!((0.079..0.091).contains(&breadth), "hand breadth {breadth}");
        // All of the arch of the knuckles; at one of them it is about 28 mm.
        let depth = extent(knuckles, Vector3::x(), Vector3::y(), 0.008);
        assert!((0.028..0.034).contains(&depth), "hand depth {depth}");
        let wrist = extent(Point3::origin(), Vector3::x(), Vector3::z(), 0.008);
        assert!((0.054..0.064).contains(&wrist), "wrist breadth {wrist}");
        for (ray, chain) in RAYS.iter().zip(chains()).take(4) {
            let along = chain.along[1];
            let across = chain.flexion_axes[1];
            let middle = chain.joints[1] * 1e-3;
            // Only this finger: its neighbours are farther than 14 mm.
            let near = skin();
            let half = (near.vertices.iter())
                .map(|p| p - middle)
                .filter(|d| d.dot(&along).abs() < 0.005 && d.norm() < 0.014)
                .map(|d| d.dot(&across).abs())
                .fold(0.0, f64::max);
            let wanted = ray.half_breadths[1] * 1e-3;
            assert!((half - wanted).abs() < 0.0018, "{} {half}", ray.name);
        }
    }

    #[test]
    fn palm_and_fingers_are_as_broad_as_hands_are() {
        let skin = skin();
        let (mut outline, mut area) = (0.0, 0.0);
        for face in 0..skin.faces.len() {
            let facing = 0.5 * skin.area_vector(face);
            let beyond_wrist = skin.corners(face).iter().map(|p| p.x).sum::<f64>() < 0.0;
            if beyond_wrist && facing.y < 0.0 {
                outline -= facing.y;
                area += facing.norm();
            }
        }
        // Outlines of palm and fingers are 0.7 % (women) to 0.8 % (men) of the body's surface (Rossiter, Chapman and
        // Haywood, Burns 22, 1996): 120 to 150 cm^2 of 1.7 and 1.9 m^2.
        assert!((135e-4..155e-4).contains(&outline), "{outline}");
        assert!((180e-4..200e-4).contains(&area), "{area}");
    }

    #[test]
    fn vertices_are_denser_on_the_pads_than_on_the_back() {
        let skin = skin();
        // Mean area of the faces that look down and up, on the fingers and on the palm.
        let mean = |down: f64, low: f64, high: f64| {
            let areas: Vec<f64> = (0..skin.faces.len())
                .filter(|&face| {
                    let normal = skin.area_vector(face).normalize();
                    let x = skin.corners(face)[0].x;
                    normal.y * down < -0.7 && (low..high).contains(&x)
                })
                .map(|face| 0.5 * skin.area_vector(face).norm())
                .collect();
            areas.iter().sum::<f64>() / areas.len() as f64
        };
        assert!(mean(1.0, -0.2, -0.125) < 0.8 * mean(-1.0, -0.2, -0.125));
        assert!(mean(1.0, -0.2, -0.125) < 0.5 * mean(1.0, -0.09, -0.03));
    }
}
