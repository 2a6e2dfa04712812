//! Sparse voxels of a posed hand where it is near the object: of its solid, and of its outer surface.
//!
//! Voxel (i, j, k) of size h is the cube from h (i, j, k) to h (i + 1, j + 1, k + 1) of the object's frame.

use std::collections::HashMap;

use graspd_geom::{SignedDistance, TriangleMesh};
use nalgebra::{Point3, Vector3};

use crate::polygon::{area_and_centroid, clip, clip_to_box, extent};

/// Voxels along the side of the blocks that the search for common voxels begins with.
const BLOCK: i64 = 32;

/// How many voxel centres lie inside both solids.
pub(crate) fn count_common_voxels(a: &SignedDistance, b: &SignedDistance, size: f64) -> u64 {
    let mut count = 0;
    for_each_common_block(a, b, size, &mut |_, side| {
        count += (side * side * side) as u64;
    });
    count
}

/// Calls `visit` with blocks of voxels (the first voxel and the side) whose centres all lie inside
/// both solids, and which together hold all such voxels.
///
/// A block of voxels is skipped, or visited at once, as soon as its centre is farther from a surface than its
/// corners are from its centre: a signed distance changes by no more than the distance moved.
pub(crate) fn for_each_common_block(
    a: &SignedDistance,
    b: &SignedDistance,
    size: f64,
    visit: &mut dyn FnMut([i64; 3], i64),
) {
    let ((low_a, high_a), (low_b, high_b)) = (a.bounds(), b.bounds());
    let low = low_a.sup(&low_b).map(|x| (x / size).floor() as i64);
    let high = high_a.inf(&high_b).map(|x| (x / size).ceil() as i64);
    let starts = |axis: usize| (low[axis]..high[axis]).step_by(BLOCK as usize);
    for x in starts(0) {
        for y in starts(1) {
            for z in starts(2) {
                visit_block(&[a, b], [x, y, z], BLOCK, size, visit);
            }
        }
    }
}

/// Within the block of `side`^3 voxels from voxel `first`.
fn visit_block(
    solids: &[&SignedDistance],
    first: [i64; 3],
    side: i64,
    size: f64,
    visit: &mut dyn FnMut([i64; 3], i64),
) {
    let center = Point3::from(first.map(|i| (i as f64 + 0.5 * side as f64) * size));
    let half_diagonal = 0.5 * (side - 1) as f64 * size * 3.0_f64.sqrt();
    // The solids that are still undecided within this block; at most two, so nothing is allocated.
    let mut undecided = [None; 2];
    let mut open = 0;
    for solid in solids {
        let distance = solid.signed_distance(&center);
        if distance >= half_diagonal {
            return;
        }
        if distance > -half_diagonal {
            undecided[open] = Some(*solid);
            open += 1;
        }
    }
    if open == 0 || side == 1 {
        visit(first, side);
        return;
    }
    let rest: [&SignedDistance; 2] = [undecided[0], undecided[1]].map(|s| s.unwrap_or(solids[0]));
    let half = side / 2;
    for octant in 0..8 {
        let corner = [0, 1, 2].map(|axis| first[axis] + half * (octant >> axis & 1));
        visit_block(&rest[..open], corner, half, size, visit);
    }
}

/// A voxel that the hand's outer surface passes through.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceVoxel {
    /// True signed distance of the voxel's centre to the object \[m\].
    pub(crate) distance: f64,
    /// Area of the hand's outer surface within the voxel \[m^2\].
    pub(crate) area: f64,
    /// A point of that surface: the centroid of its largest fragment.
    pub(crate) point: Point3<f64>,
    largest_fragment: f64,
}

/// The voxels of the hand's outer surface whose centres are within `reach` \[m\] of the object or inside it.
///
/// Outer means not inside another part of the hand: a robot's links overlap at the joints, and what is buried
/// there cannot touch anything. `hand_solid` is the same mesh, for that test.
pub(crate) fn surface_voxels(
    hand: &TriangleMesh,
    hand_solid: &SignedDistance,
    object: &SignedDistance,
    size: f64,
    reach: f64,
) -> Vec<SurfaceVoxel> {
    let (low, high) = object.bounds();
    let margin = Vector3::repeat(reach + size);
    let (low, high) = (low - margin, high + margin);
    let half_diagonal = 0.5 * 3.0_f64.sqrt() * size;
    let mut voxels: Vec<SurfaceVoxel> = Vec::new();
    let mut index_of = HashMap::new();
    for face in 0..hand.faces.len() {
        let corners = hand.corners(face);
        let Some(outward) = hand.area_vector(face).try_normalize(0.0) else {
            continue;
        };
        let Some(polygon) = clip_to_box(&corners, &low, &high) else {
            continue;
        };
        let is_near = |polygon: &[Point3<f64>]| {
            let (_, middle) = area_and_centroid(polygon);
            let radius = (polygon.iter().map(|p| (p - middle).norm())).fold(0.0, f64::max);
            let bound = radius + half_diagonal + reach;
            object.closest_within(&middle, bound).is_some() || object.is_inside(&middle)
        };
        for_each_voxel(polygon, size, &is_near, &mut |voxel, fragment| {
            let (area, point) = area_and_centroid(fragment);
            let index = *index_of.entry(voxel).or_insert_with(|| {
                let center = Point3::from(voxel.map(|i| (i as f64 + 0.5) * size));
                voxels.push(SurfaceVoxel {
                    distance: object.signed_distance(&center),
                    area: 0.0,
                    point,
                    largest_fragment: 0.0,
                });
                voxels.len() - 1
            });
            let voxel = &mut voxels[index];
            if voxel.distance > reach || hand_solid.is_inside(&(point + outward * BURIED_PROBE)) {
                return;
            }
            voxel.area += area;
            if area > voxel.largest_fragment {
                voxel.largest_fragment = area;
                voxel.point = point;
            }
        });
    }
    voxels.retain(|voxel| voxel.area > 0.0);
    voxels
}

/// Where a surface is tested for being buried: this far outside it \[m\].
const BURIED_PROBE: f64 = 1e-6;

/// Longest side of a piece of a face that is cut into voxels without asking first whether it is near \[voxels\].
const COARSE: f64 = 6.0;

/// Calls `visit` with each voxel that a convex polygon passes through and the part of the polygon within it, but
/// for what lies in larger parts that are not `is_near`. The parts make up the polygon: one in a plane between
/// voxels belongs to those above it.
fn for_each_voxel(
    polygon: Vec<Point3<f64>>,
    size: f64,
    is_near: &impl Fn(&[Point3<f64>]) -> bool,
    visit: &mut impl FnMut([i64; 3], &[Point3<f64>]),
) {
    if !is_near(&polygon) {
        return;
    }
    let sides = [0, 1, 2].map(|axis| extent(&polygon, axis));
    let length = |axis: &usize| sides[*axis].1 - sides[*axis].0;
    if let Some(axis) = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))
        && length(&axis) > COARSE * size
    {
        // Between voxels, so that none is cut in two.
        let middle = (0.5 * (sides[axis].0 + sides[axis].1) / size).round() * size;
        let (below, above) = clip(&polygon, axis, middle);
        for half in [below, above].into_iter().flatten() {
            for_each_voxel(half, size, is_near, visit);
        }
        return;
    }
    for_each_slab(polygon, 0, size, &mut |x, slab| {
        for_each_slab(slab, 1, size, &mut |y, column| {
            for_each_slab(column, 2, size, &mut |z, fragment| {
                visit([x, y, z], &fragment);
            });
        });
    });
}

fn for_each_slab(
    polygon: Vec<Point3<f64>>,
    axis: usize,
    size: f64,
    visit: &mut impl FnMut(i64, Vec<Point3<f64>>),
) {
    let (low, high) = extent(&polygon, axis);
    let (first, last) = ((low / size).floor() as i64, (high / size).floor() as i64);
    let mut rest = polygon;
    for slab in first..last {
        let (below, above) = clip(&rest, axis, (slab + 1) as f64 * size);
        if let Some(below) = below {
            visit(slab, below);
        }
        let Some(above) = above else { return };
        rest = above;
    }
    visit(last, rest);
}
