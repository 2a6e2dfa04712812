//! Things with a profile: can, carton, bottle, bowl.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;

use super::EDGE;
use graspd_geom::TriangleMesh;
use graspd_geom::box_mesh;
use graspd_geom::{Loft, arc, on_circle, refined, revolved};

/// A can of 67.8 x 101.9 mm: a body between two seams, and ends set in by 2.5 mm.
pub(super) fn can() -> TriangleMesh {
    const HEIGHT: f64 = 0.1019;
    let lower_half = [
        [0.0, 0.0025],
        [0.0305, 0.0025],
        [0.0310, 0.0004],
        [0.0315, 0.0],
        [0.0334, 0.0],
        [0.0339, 0.0005],
        [0.0339, 0.0028],
        [0.0331, 0.0036],
    ];
    let upper_half = lower_half.iter().rev().map(|&[r, z]| [r, HEIGHT - z]);
    let profile: Vec<_> = lower_half.into_iter().chain(upper_half).collect();
    revolved(&profile, EDGE)
}

/// A carton of 49.5 x 94.2 x 176.0 mm.
pub(super) fn carton() -> TriangleMesh {
    box_mesh(Vector3::new(0.0495, 0.0942, 0.176), EDGE)
}

/// A bowl of 161 x 55 mm: a quarter ellipse on a flat foot, 3 mm thick, with a rounded lip.
pub(super) fn bowl() -> TriangleMesh {
    const WALL: f64 = 0.003;
    const FOOT: f64 = 0.035;
    const LIP_Z: f64 = 0.055 - 0.5 * WALL;
    const REACH: f64 = 0.0805 - FOOT;
    const STEPS: usize = 24;
    // Outer wall by angle, and the inward normal of the ellipse there.
    let outer = |step: usize| {
        let (sine, cosine) = (FRAC_PI_2 * step as f64 / STEPS as f64).sin_cos();
        let point = [FOOT + REACH * sine, LIP_Z * (1.0 - cosine)];
        let normal = [-LIP_Z * sine, REACH * cosine];
        (point, normal.map(|x| x / normal[0].hypot(normal[1])))
    };
    let mut profile = vec![[0.0, 0.0]];
    profile.extend((0..STEPS).map(|step| outer(step).0));
    profile.extend(arc(
        [FOOT + REACH - 0.5 * WALL, LIP_Z],
        0.5 * WALL,
        [0.0, PI],
        EDGE,
    ));
    profile.extend((0..STEPS).rev().map(|step| {
        let (point, normal) = outer(step);
        [0, 1].map(|axis| point[axis] + WALL * normal[axis])
    }));
    profile.push([0.0, WALL]);
    revolved(&profile, EDGE)
}

/// A bottle of 97.2 x 66.6 x 191.3 mm: an oval body that narrows to a round neck, a cap and a nozzle.
pub(super) fn bottle() -> TriangleMesh {
    // (half depth along y, z); the ratio of half width to half depth falls from the body's to 1 over the shoulders.
    let body = [
        [0.0, 0.0],
        [0.0290, 0.0],
        [0.0318, 0.0012],
        [0.0333, 0.0045],
        [0.0333, 0.0700],
        [0.0330, 0.0800],
        [0.0320, 0.0920],
        [0.0302, 0.1040],
        [0.0276, 0.1150],
        [0.0244, 0.1250],
        [0.0208, 0.1340],
        [0.0182, 0.1400],
        [0.0165, 0.1440],
        [0.0160, 0.1480],
    ];
    let cap = [
        [0.0180, 0.1485],
        [0.0180, 0.1600],
        [0.0165, 0.1625],
        [0.0080, 0.1660],
        [0.0055, 0.1700],
        [0.0040, 0.1890],
        [0.0030, 0.1913],
        [0.0, 0.1913],
    ];
    const BODY_RATIO: f64 = 0.0972 / 0.0666;
    let profile: Vec<_> = body.into_iter().chain(cap).collect();
    // Closer than elsewhere, because half depths are stretched to half widths.
    let stations = refined(&profile, 0.75 * EDGE);
    let oval = |k: usize, turn: f64| {
        let share = ((stations[k][1] - 0.085) / (0.144 - 0.085)).clamp(0.0, 1.0);
        let smooth = share * share * (3.0 - 2.0 * share);
        let mut point = on_circle(stations[k], turn);
        point.x *= BODY_RATIO + smooth * (1.0 - BODY_RATIO);
        point
    };
    let mut loft = Loft::default();
    let start = loft.curve(|turn| oval(0, turn), EDGE);
    loft.extend(start, stations.len() - 1, |k, turn| oval(k + 1, turn), EDGE);
    loft.mesh
}
