//! Many points on a mesh at once, by a sequence instead of at random.

use crate::{SurfacePoint, TriangleMesh};

/// About `count` points by a sequence that leaves no large gaps: less even than
/// [`sample_evenly`](crate::sample_evenly), for a small part of its time.
///
/// One point for every `area / count` of the faces in their order; each face's points are the next of the R2 sequence,
/// folded onto the triangle. Empty if the mesh has no area.
///
/// # Source
/// M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
pub fn sample_by_sequence(mesh: &TriangleMesh, count: usize) -> Vec<SurfacePoint> {
    // The powers of 1 / g, g^3 = g + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];
    let share = mesh.area() / count.max(1) as f64;
    let mut points = Vec::new();
    if !(share > 0.0 && share.is_finite()) || count == 0 {
        return points;
    }
    // The distance, in points, from the start of a face to its first.
    let mut next = 0.5;
    for face in 0..mesh.faces.len() {
        let area_vector = mesh.area_vector(face);
        let Some(normal) = area_vector.try_normalize(0.0) else {
            continue;
        };
        let [a, b, c] = mesh.corners(face);
        let length = 0.5 * area_vector.norm() / share;
        while next < length {
            let [mut u, mut v] = STEPS.map(|step| (0.5 + step * points.len() as f64).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            points.push(SurfacePoint {
                point: a + (b - a) * u + (c - a) * v,
                normal,
                face,
            });
            next += 1.0;
        }
        next -= length;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SurfaceSampler;
    use crate::sampling::hexagonal_spacing;
    use crate::shapes::{box_mesh, sphere_mesh};
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_sequence_leaves_no_large_gap() {
        // One mesh of large faces, one of faces with less than a point each.
        let large = box_mesh(Vector3::new(0.1, 0.04, 0.2), 1.0);
        let small = sphere_mesh(0.05, 0.004);
        for (mesh, count) in [(large, 4000), (small, 1000)] {
            let points = sample_by_sequence(&mesh, count);
            assert!(points.len().abs_diff(count) <= 1, "{}", points.len());
            let sampler = SurfaceSampler::new(&mesh).unwrap();
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let gap = (0..2000)
                .map(|_| sampler.sample(&mut rng).point)
                .map(|p| {
                    (points.iter().map(|q| (q.point - p).norm())).fold(f64::INFINITY, f64::min)
                })
                .fold(0.0, f64::max);
            // In a hexagonal pattern the largest is 0.58.
            assert!(gap < 1.6 * hexagonal_spacing(mesh.area(), count), "{gap}");
        }
        assert!(sample_by_sequence(&TriangleMesh::default(), 10).is_empty());
        assert!(sample_by_sequence(&box_mesh(Vector3::repeat(0.1), 1.0), 0).is_empty());
    }
}
