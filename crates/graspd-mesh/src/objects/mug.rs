//! The mug.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point3, Vector3};

use super::EDGE;
use graspd_geom::TriangleMesh;
use graspd_geom::{Loft, Ring, arc, on_circle, refined};

const RADIUS: f64 = 0.04655;
const HEIGHT: f64 = 0.0813;
const WALL: f64 = 0.0035;
const FLOOR: f64 = 0.0045;
/// How far the handle stands out from the wall.
const REACH: f64 = 0.117 - 2.0 * RADIUS;

/// Vertices around the outer wall, and rows of quadrilaterals up it.
const COLUMNS: usize = 64;
const ROWS: usize = 16;
/// The handle grows out of a square of so many quadrilaterals a side.
const PATCH: usize = 3;
/// The lowest row of the lower and of the upper square.
const LOWER_ROW: usize = 2;
const UPPER_ROW: usize = ROWS - PATCH - 1;

/// A mug of 117.0 x 93.1 x 81.3 mm, open at the top, with a wall of 3.5 mm; its handle is on the side of +x.
pub(super) fn mug() -> TriangleMesh {
    let mut loft = Loft::default();
    // The first column lies so that the patches, which start at it, are centred on +x.
    let turn_of_first = -0.5 * PATCH as f64 / COLUMNS as f64;
    let circle = |station: [f64; 2], turn: f64| on_circle(station, turn + turn_of_first);

    // The bottom, out to a rounded edge.
    let mut below = vec![[0.0, 0.0]];
    below.extend(arc(
        [RADIUS - WALL, WALL],
        WALL,
        [-FRAC_PI_2, 0.0],
        0.4 * EDGE,
    ));
    below.pop();
    let below = refined(&below, EDGE);
    let center = loft.curve(|turn| circle(below[0], turn), EDGE);
    let bottom = loft.extend(
        center,
        below.len() - 1,
        |k, turn| circle(below[k + 1], turn),
        EDGE,
    );

    // The outer wall, with gaps for the handle.
    let rim_z = HEIGHT - 0.5 * WALL;
    let row_z = |row: usize| WALL + (rim_z - WALL) * row as f64 / ROWS as f64;
    let wall: Vec<Ring> = (0..=ROWS)
        .map(|row| {
            loft.ring(
                (0..COLUMNS)
                    .map(|column| circle([RADIUS, row_z(row)], column as f64 / COLUMNS as f64)),
            )
        })
        .collect();
    loft.band(&bottom, &wall[0]);
    for row in 0..ROWS {
        let is_patch = [LOWER_ROW, UPPER_ROW]
            .iter()
            .any(|&first| (first..first + PATCH).contains(&row));
        let gap = if is_patch { 0..PATCH } else { 0..0 };
        loft.band_with_gap(&wall[row], &wall[row + 1], gap);
    }

    // The rim and the inside.
    let mut inside = arc(
        [RADIUS - 0.5 * WALL, rim_z],
        0.5 * WALL,
        [0.0, PI],
        0.4 * EDGE,
    );
    inside.remove(0);
    const FILLET: f64 = 0.006;
    let fillet_center = [RADIUS - WALL - FILLET, FLOOR + FILLET];
    inside.extend(arc(fillet_center, FILLET, [0.0, -FRAC_PI_2], 0.6 * EDGE));
    inside.push([0.0, FLOOR]);
    let inside = refined(&inside, EDGE);
    loft.extend(
        wall[ROWS].clone(),
        inside.len(),
        |k, turn| circle(inside[k], turn),
        EDGE,
    );

    handle(&mut loft, &wall, row_z);
    loft.mesh
}

/// Joins the two squares of the wall by a tube whose rings match the squares' outlines vertex by vertex.
fn handle(loft: &mut Loft, wall: &[Ring], row_z: impl Fn(usize) -> f64) {
    // Outlines by (column, row) within a square, counter-clockwise seen from outside.
    let outline = square_outline(PATCH);
    let upper: Ring = (outline.iter())
        .map(|&[column, row]| wall[UPPER_ROW + row][column])
        .collect();
    // The tube arrives at the lower square upside down.
    let lower: Ring = (outline.iter())
        .map(|&[column, row]| wall[LOWER_ROW + PATCH - row][column])
        .collect();
    let angles: Vec<f64> = (outline.iter())
        .map(|corner| {
            let [column, row] = corner.map(|x| x as f64 - 0.5 * PATCH as f64);
            row.atan2(column)
        })
        .collect();

    const HALF_WIDTH: f64 = 0.0065;
    const HALF_THICKNESS: f64 = 0.004;
    let middle = |first: usize| 0.5 * (row_z(first) + row_z(first + PATCH));
    let (low, high) = (middle(LOWER_ROW), middle(UPPER_ROW));
    const SECTIONS: usize = 22;
    let mut ring = upper;
    for section in 1..SECTIONS {
        // Half an ellipse from the upper square out and down to the lower one.
        let angle = FRAC_PI_2 - PI * section as f64 / SECTIONS as f64;
        let (sine, cosine) = angle.sin_cos();
        let half_height = 0.5 * (high - low);
        let reach = REACH - HALF_THICKNESS;
        let center = Point3::new(
            RADIUS + reach * cosine,
            0.0,
            0.5 * (low + high) + half_height * sine,
        );
        let tangent = Vector3::new(reach * sine, 0.0, -half_height * cosine).normalize();
        let across = Vector3::y();
        let outward = tangent.cross(&across);
        // The ends flare into the wall.
        let end = (2.0 * section as f64 / SECTIONS as f64 - 1.0).abs();
        let flare = 1.0 + 0.25 * ((end - 0.7) / 0.3).max(0.0).powi(2);
        let next = loft.ring(angles.iter().map(|angle| {
            let (sine, cosine) = angle.sin_cos();
            center + flare * (across * (HALF_WIDTH * cosine) + outward * (HALF_THICKNESS * sine))
        }));
        loft.band(&ring, &next);
        ring = next;
    }
    loft.band(&ring, &lower);
}

/// The lattice points around a square of `side` cells, from the lower left corner counter-clockwise.
pub(super) fn square_outline(side: usize) -> Vec<[usize; 2]> {
    let bottom = (0..side).map(|i| [i, 0]);
    let right = (0..side).map(|i| [side, i]);
    let top = (0..side).map(|i| [side - i, side]);
    let left = (0..side).map(|i| [0, side - i]);
    bottom.chain(right).chain(top).chain(left).collect()
}
