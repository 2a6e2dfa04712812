//! Simple meshes for this crate's tests.

use graspd_geom::TriangleMesh;
use nalgebra::{Point3, Vector3};

/// An axis-aligned box.
pub(crate) fn box_mesh(center: [f64; 3], size: [f64; 3]) -> TriangleMesh {
    let (center, half) = (Point3::from(center), Vector3::from(size) * 0.5);
    let vertices = (0..8)
        .map(|bits| {
            let sign = |axis: usize| f64::from(bits >> axis & 1) * 2.0 - 1.0;
            center + Vector3::new(sign(0), sign(1), sign(2)).component_mul(&half)
        })
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    TriangleMesh {
        vertices,
        faces: quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    }
}

/// A sphere of `rings` rings of twice as many segments.
pub(crate) fn sphere_mesh(center: [f64; 3], radius: f64, rings: u32) -> TriangleMesh {
    let segments = 2 * rings;
    let mut vertices = vec![Vector3::z(), -Vector3::z()];
    for ring in 1..rings {
        let (sine, height) = (f64::from(ring) / f64::from(rings) * std::f64::consts::PI).sin_cos();
        for segment in 0..segments {
            let (s, c) =
                (f64::from(segment) / f64::from(segments) * std::f64::consts::TAU).sin_cos();
            vertices.push(Vector3::new(sine * c, sine * s, height));
        }
    }
    let at = |ring: u32, segment: u32| 2 + (ring - 1) * segments + segment % segments;
    let mut faces = Vec::new();
    for segment in 0..segments {
        faces.push([0, at(1, segment), at(1, segment + 1)]);
        faces.push([1, at(rings - 1, segment + 1), at(rings - 1, segment)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
            faces.push([a, c, d]);
            faces.push([a, d, b]);
        }
    }
    TriangleMesh {
        vertices: vertices
            .iter()
            .map(|v| Point3::from(center) + v * radius)
            .collect(),
        faces,
    }
}

/// Several meshes as one.
pub(crate) fn together(parts: &[TriangleMesh]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for part in parts {
        mesh.append(part);
    }
    mesh
}
