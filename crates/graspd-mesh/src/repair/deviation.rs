//! How far one surface is from another.

use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use graspd_geom::{SurfaceSampler, TriangleMesh, TriangleTree};

/// At most about this many vertices, and this many random points, are looked at.
const POINTS: usize = 20_000;

/// The greatest distance to the triangles of `other` from vertices and random points of a mesh \[m\].
pub(super) fn farthest(mesh: &TriangleMesh, other: &TriangleTree) -> f64 {
    let stride = mesh.faces.len().div_ceil(POINTS / 3).max(1);
    let mut points: Vec<Point3<f64>> = (0..mesh.faces.len())
        .step_by(stride)
        .flat_map(|face| mesh.corners(face))
        .collect();
    if let Some(sampler) = SurfaceSampler::new(mesh) {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        points.extend((0..POINTS).map(|_| sampler.sample(&mut rng).point));
    }
    points
        .par_iter()
        .with_min_len(256)
        .map(|p| other.distance(p))
        .reduce(|| 0.0, f64::max)
}
