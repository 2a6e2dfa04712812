//! What lies inside a closed surface, where it does not belong to the boundary of the solid.

use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use graspd_geom::{SignedDistance, SurfaceSampler, TriangleMesh};

/// Points looked at on each part.
const PROBES: usize = 48;
/// Random points on the whole surface.
const SAMPLES: usize = 2000;
/// How far to either side of the surface the winding number is taken, as a part of the diagonal of its box.
const ASIDE: f64 = 1e-6;

/// Which of some closed, outward oriented parts lie wholly inside another one that is kept.
pub(super) fn inner_parts(parts: &[TriangleMesh], volumes: &[f64]) -> Vec<bool> {
    let mut is_inner = vec![false; parts.len()];
    if parts.len() < 2 {
        return is_inner;
    }
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|&a, &b| volumes[b].total_cmp(&volumes[a]));
    let boxes: Vec<_> = parts.iter().map(TriangleMesh::bounds).collect();
    let encloses = |outer: usize, inner: usize| match (boxes[outer], boxes[inner]) {
        (Some((low, high)), Some((lowest, highest))) => {
            (0..3).all(|axis| low[axis] < lowest[axis] && highest[axis] < high[axis])
        }
        _ => false,
    };
    let mut distances: Vec<Option<SignedDistance>> = vec![None; parts.len()];
    for (rank, &inner) in order.iter().enumerate() {
        for &outer in &order[..rank] {
            if is_inner[outer] || !encloses(outer, inner) {
                continue;
            }
            if distances[outer].is_none() {
                distances[outer] = SignedDistance::new(&parts[outer]).ok();
            }
            let Some(distance) = &distances[outer] else {
                continue;
            };
            let stride = parts[inner].faces.len().div_ceil(PROBES);
            let mut faces = (0..parts[inner].faces.len()).step_by(stride);
            if faces.all(|face| distance.is_inside(&parts[inner].corners(face)[0])) {
                is_inner[inner] = true;
                break;
            }
        }
    }
    is_inner
}

/// Whether a part lies wholly inside a closed surface, by the middles of its faces.
pub(super) fn lies_inside(part: &TriangleMesh, surface: &SignedDistance) -> bool {
    let stride = part.faces.len().div_ceil(PROBES).max(1);
    (0..part.faces.len()).step_by(stride).all(|face| {
        let [a, b, c] = part.corners(face);
        surface.is_inside(&Point3::from((a.coords + b.coords + c.coords) / 3.0))
    })
}

/// The part of a closed surface's area that does not have the outside on one side and the inside, once, on the other:
/// where it overlaps itself or is inside out. Estimated at random points; the same ones every time.
pub(super) fn misplaced_part(mesh: &TriangleMesh) -> f64 {
    let (Ok(distance), Some(sampler), Some((low, high))) = (
        SignedDistance::new(mesh),
        SurfaceSampler::new(mesh),
        mesh.bounds(),
    ) else {
        return 1.0;
    };
    let aside = ASIDE * (high - low).norm();
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let samples: Vec<_> = (0..SAMPLES).map(|_| sampler.sample(&mut rng)).collect();
    let winding = |p: Point3<f64>| distance.winding_number(&p);
    let misplaced = samples
        .par_iter()
        .filter(|sample| {
            let step = sample.normal * aside;
            winding(sample.point + step) != 0 || winding(sample.point - step) != 1
        })
        .count();
    misplaced as f64 / SAMPLES as f64
}
