//! The cordless drill.

use std::f64::consts::TAU;

use nalgebra::Point3;

use super::EDGE;
use super::mug::square_outline;
use graspd_geom::TriangleMesh;
use graspd_geom::{Loft, Ring, pieces, refined};

/// Half width of the battery, the drill's widest part.
const HALF_WIDTH: f64 = 0.02865;
/// Vertices around the motor housing, and the side of the square of cells that the grip grows out of.
const COLUMNS: usize = 44;
const PATCH: usize = 8;
/// Finer than elsewhere, for the flare above the battery slants.
const GRIP_EDGE: f64 = 0.85 * EDGE;

/// A drill of 184 x 57.3 x 187 mm: housing and chuck along x, and below the housing a grip that ends in a battery.
pub(super) fn drill() -> TriangleMesh {
    let mut loft = Loft::default();
    let grip_outline = housing(&mut loft);
    grip(&mut loft, grip_outline);
    loft.mesh
}

/// A point of the curve |y / a|^p + |z / b|^p = 1 in the direction of an angle.
fn superellipse([a, b]: [f64; 2], power: f64, angle: f64) -> [f64; 2] {
    let (sine, cosine) = angle.sin_cos();
    let norm = ((cosine / a).abs().powf(power) + (sine / b).abs().powf(power)).powf(1.0 / power);
    match a * b {
        0.0 => [0.0, 0.0],
        _ => [cosine / norm, sine / norm],
    }
}

/// Housing and chuck along x, with a gap at the bottom, whose outline is given counter-clockwise seen from below.
fn housing(loft: &mut Loft) -> Ring {
    const HALF_SIZE: [f64; 2] = [0.0265, 0.0300];
    const POWER: f64 = 2.6;
    const BACK: f64 = -0.070;
    const GAP: [f64; 2] = [-0.046, -0.010];
    const FRONT: f64 = 0.038;
    // The gap's columns are the first ones and straddle the lowest line.
    let first_angle = -0.25 * TAU - 0.5 * PATCH as f64 / COLUMNS as f64 * TAU;
    let section = |x: f64, scale: f64, power: f64, turn: f64| {
        let [y, z] = superellipse(
            HALF_SIZE.map(|half| half * scale),
            power,
            first_angle + TAU * turn,
        );
        Point3::new(x, y, z)
    };
    let columns = |x: f64| {
        (0..COLUMNS).map(move |column| section(x, 1.0, POWER, column as f64 / COLUMNS as f64))
    };

    let back = refined(
        &[
            [0.0, BACK],
            [0.70, BACK],
            [0.86, BACK + 0.0015],
            [0.96, BACK + 0.0055],
        ]
        .map(|[scale, x]| [0.03 * scale, x]),
        EDGE,
    );
    let center = loft.curve(|turn| section(back[0][1], 0.0, POWER, turn), EDGE);
    let mut ring = loft.extend(
        center,
        back.len() - 1,
        |k, turn| section(back[k + 1][1], back[k + 1][0] / 0.03, POWER, turn),
        EDGE,
    );

    let rows = |from: f64, to: f64, count: usize| {
        (0..count).map(move |row| from + (to - from) * row as f64 / count as f64)
    };
    let stations: Vec<f64> = rows(BACK + 0.010, GAP[0], 3)
        .chain(rows(GAP[0], GAP[1], PATCH))
        .chain(rows(GAP[1], FRONT, 10))
        .chain([FRONT])
        .collect();
    let walls: Vec<Ring> = stations.iter().map(|&x| loft.ring(columns(x))).collect();
    loft.band(&ring, &walls[0]);
    const GAP_ROW: usize = 3;
    for row in 0..walls.len() - 1 {
        let is_gap = (GAP_ROW..GAP_ROW + PATCH).contains(&row);
        let gap = if is_gap { 0..PATCH } else { 0..0 };
        loft.band_with_gap(&walls[row], &walls[row + 1], gap);
    }

    // Gear case, clutch ring, chuck: (radius, x), round from here on.
    let front = refined(
        &[
            [0.0262, 0.042],
            [0.0235, 0.046],
            [0.0225, 0.058],
            [0.0185, 0.060],
            [0.0175, 0.062],
            [0.0205, 0.064],
            [0.0205, 0.078],
            [0.0195, 0.079],
            [0.0185, 0.098],
            [0.0120, 0.108],
            [0.0070, 0.110],
            [0.0060, 0.114],
            [0.0, 0.114],
        ],
        EDGE,
    );
    ring = walls[walls.len() - 1].clone();
    loft.extend(
        ring,
        front.len(),
        |k, turn| {
            let (sine, cosine) = (first_angle + TAU * turn).sin_cos();
            Point3::new(front[k][1], front[k][0] * cosine, front[k][0] * sine)
        },
        EDGE,
    );
    square_outline(PATCH)
        .into_iter()
        .map(|[column, row]| walls[GAP_ROW + row][column])
        .collect()
}

/// From the housing's gap down: grip, then battery. Curves run from y towards x, counter-clockwise seen from below.
fn grip(loft: &mut Loft, outline: Ring) {
    // z, middle in x, half sizes along y and x, squareness.
    let knots = [
        [-0.0300, -0.0280, 0.0158, 0.0185, 6.0],
        [-0.0340, -0.0280, 0.0158, 0.0187, 3.5],
        [-0.0420, -0.0285, 0.0155, 0.0185, 2.4],
        [-0.0600, -0.0300, 0.0160, 0.0200, 2.3],
        [-0.0850, -0.0330, 0.0160, 0.0195, 2.3],
        [-0.1020, -0.0340, 0.0165, 0.0205, 2.5],
        [-0.1100, -0.0300, 0.0210, 0.0300, 3.5],
        [-0.1140, -0.0240, HALF_WIDTH - 0.0015, 0.0435, 6.0],
        [-0.1180, -0.0230, HALF_WIDTH, 0.0455, 7.0],
        [-0.1540, -0.0230, HALF_WIDTH, 0.0455, 7.0],
        [-0.1570, -0.0230, HALF_WIDTH - 0.0025, 0.0430, 7.0],
        [-0.1570, -0.0230, 0.0, 0.0, 7.0],
    ];
    let mut sections = Vec::new();
    for pair in knots.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let length = (0..4)
            .map(|i| (to[i] - from[i]).powi(2))
            .sum::<f64>()
            .sqrt();
        let count = pieces(length, GRIP_EDGE);
        sections.extend((0..count).map(|i| {
            let share = i as f64 / count as f64;
            [0, 1, 2, 3, 4].map(|n| from[n] + share * (to[n] - from[n]))
        }));
    }
    sections.push(knots[knots.len() - 1]);
    let at_angle = |[z, x, half_y, half_x, power]: [f64; 5], angle: f64| {
        let [dy, dx] = superellipse([half_y, half_x], power, angle);
        Point3::new(x + dx, dy, z)
    };
    // The outline starts at its corner of least y and x.
    let curve = |section: [f64; 5], turn: f64| at_angle(section, TAU * (turn - 0.375));
    let first = loft.ring(square_outline(PATCH).into_iter().map(|corner| {
        let [column, row] = corner.map(|x| x as f64 - 0.5 * PATCH as f64);
        at_angle(sections[0], row.atan2(column))
    }));
    loft.band(&outline, &first);
    loft.extend(
        first,
        sections.len() - 1,
        |k, turn| curve(sections[k + 1], turn),
        GRIP_EDGE,
    );
}
