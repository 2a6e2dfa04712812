//! The outlines of the Allegro hand's links, measured in the maker's meshes.

use std::f64::consts::PI;

use graspd_geom::TriangleMesh;
use nalgebra::Point3;

use crate::swept_solids::{extruded, revolved, rounded_rectangle};

/// Half width of a finger across its bending plane \[m\].
const HALF_WIDTH: f64 = 0.0135;
/// Half depth of a finger in its bending plane \[m\].
const HALF_DEPTH: f64 = 0.0098;
/// Front and back of the palm \[m\].
pub(super) const PALM_X: [f64; 2] = [-0.0295, 0.0113];
/// Radius of the finger tips \[m\].
const TIP_RADIUS: f64 = 0.012;
/// Height of a tip's cylindrical part below its center \[m\].
const TIP_BASE: f64 = 0.011;
/// Segments of a rounded corner, and a quarter of those around a tip.
const CORNER_SEGMENTS: usize = 6;

/// Returns the palm as three convex plates: the knuckles, the heel below them beside the thumb, and the mounting
/// flange.
pub(super) fn base_meshes() -> [TriangleMesh; 3] {
    let plate = |outline: &[[f64; 2]]| {
        // Outlines are in (y, z), extruded along x.
        extruded(outline, PALM_X[0], PALM_X[1], |y, z, x| {
            Point3::new(x, y, z)
        })
    };
    [
        plate(&[
            [-0.0535, -0.0435],
            [0.0535, -0.0435],
            [0.0563, -0.011],
            [0.0563, -0.002],
            [0.054, 0.0],
            [-0.054, 0.0],
            [-0.0563, -0.002],
            [-0.0563, -0.011],
        ]),
        plate(&[
            [-0.031, -0.088],
            [-0.001, -0.088],
            [0.0016, -0.0425],
            [-0.0535, -0.0425],
            [-0.0509, -0.0692],
            [-0.0482, -0.0757],
            [-0.0412, -0.0821],
        ]),
        plate(&[
            [-0.027, -0.095],
            [0.029, -0.095],
            [0.029, -0.086],
            [-0.001, -0.0785],
            [-0.033, -0.08],
            [-0.0295, -0.089],
        ]),
    ]
}

/// Returns the parts of `link_<joint>.0`, with the finger tip where there is one.
pub(super) fn link_meshes(joint: usize) -> Vec<TriangleMesh> {
    // A finger link is its outline in the bending plane (x forwards, z along the finger), rounded where it turns
    // in its neighbour: radii of the corners front top, front bottom, back bottom, back top in mm.
    let link = |low: f64, high: f64, radii_mm: [f64; 4]| {
        let outline = rounded_rectangle(
            [low, high],
            [-HALF_DEPTH, HALF_DEPTH],
            radii_mm.map(|r| 1e-3 * r),
            CORNER_SEGMENTS,
        );
        // (u, v, w) = (z, x, y) is right-handed.
        extruded(&outline, -HALF_WIDTH, HALF_WIDTH, |z, x, y| {
            Point3::new(x, y, z)
        })
    };
    match joint {
        0 | 4 | 8 => vec![link(0.0, 0.022, [14.3, 0.0, 0.0, 3.0])],
        1 | 5 | 9 => vec![link(-0.0088, 0.0628, [5.0; 4])],
        2 | 6 | 10 => vec![link(-0.0063, 0.0472, [5.0, 14.3, 3.0, 5.0])],
        3 | 7 | 11 => vec![link(-0.0063, 0.0157, [0.0, 14.3, 3.0, 0.0]), tip(0.0267)],
        12 => thumb_base_meshes(),
        13 => vec![link(-0.0002, 0.0218, [14.3, 0.0, 0.0, 3.0])],
        14 => vec![link(-0.0088, 0.0577, [14.3, 5.0, 5.0, 3.0])],
        _ => vec![link(-0.0088, 0.0313, [0.0, 5.0, 5.0, 0.0]), tip(0.0423)],
    }
}

/// Returns a cylinder with a hemisphere on it, whose center is at `height`.
fn tip(height: f64) -> TriangleMesh {
    let mut profile = vec![[0.0, height - TIP_BASE], [TIP_RADIUS, height - TIP_BASE]];
    for step in 0..CORNER_SEGMENTS {
        let (sine, cosine) = (0.5 * PI * step as f64 / CORNER_SEGMENTS as f64).sin_cos();
        profile.push([TIP_RADIUS * cosine, height + TIP_RADIUS * sine]);
    }
    profile.push([0.0, height + TIP_RADIUS]);
    revolved(&profile, 4 * CORNER_SEGMENTS as u32)
}

/// Returns the thumb's base: the block that turns about x, its axle, and the column that carries the next joint.
fn thumb_base_meshes() -> Vec<TriangleMesh> {
    let block = |y: [f64; 2], z: [f64; 2], x: [f64; 2], radii_mm: [f64; 4]| {
        let outline = rounded_rectangle(y, z, radii_mm.map(|r| 1e-3 * r), CORNER_SEGMENTS);
        extruded(&outline, x[0], x[1], |y, z, x| Point3::new(x, y, z))
    };
    vec![
        block(
            [-0.008, 0.026],
            [-0.008, 0.013],
            [-0.0358, 0.0],
            [0.0, 0.0, 8.0, 3.0],
        ),
        block(
            [-0.0048, 0.025],
            [0.012, 0.0205],
            [-0.0358, 0.0],
            [3.0, 0.0, 0.0, 0.0],
        ),
        block(
            [-0.006, 0.006],
            [-0.006, 0.006],
            [-0.0392, 0.0055],
            [6.0; 4],
        ),
        block(
            [-0.0048, 0.0148],
            [0.0195, 0.0383],
            [-0.0358, 0.0],
            [0.0; 4],
        ),
    ]
}
