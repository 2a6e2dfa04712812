//! Distances of real scans against values computed independently, and grids of them.

use std::collections::HashSet;
use std::fs::File;
use std::sync::Mutex;

use graspd_geom::{SdfGrid, SignedDistance, TriangleMesh, parry_signed_distance, shared_file};
use graspd_mesh::load_mesh;
use nalgebra::{Point3, Vector3};
use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;

/// The reference was computed in double precision from the same triangles: only rounding may differ.
const DISTANCE_TOLERANCE: f64 = 1e-12;
/// The reference winding number is a sum of solid angles over all triangles.
const WINDING_TOLERANCE: f64 = 1e-6;
/// Parry, too, computes in double precision, in another order.
const PARRY_TOLERANCE: f64 = 1e-9;

const SCANS: [&str; 6] = [
    "002_master_chef_can",
    "006_mustard_bottle",
    "019_pitcher_base",
    "024_bowl",
    "025_mug",
    "035_power_drill",
];

fn scan(name: &str) -> Option<TriangleMesh> {
    let file = shared_file(&format!("data/ycb/{name}.obj"))?;
    Some(load_mesh(&file).unwrap())
}

#[test]
fn distances_and_signs_of_scans_equal_the_reference() {
    for scan in SCANS {
        let Some(obj) = shared_file(&format!("data/ycb/{scan}.obj")) else {
            return;
        };
        let Some(npz) = shared_file(&format!("reference/sdf/{scan}.npz")) else {
            return;
        };
        let surface = SignedDistance::new(&load_mesh(&obj).unwrap()).unwrap();
        let mut npz = NpzReader::new(File::open(npz).unwrap()).unwrap();
        let points: Array2<f64> = npz.by_name("points").unwrap();
        let distances: Array1<f64> = npz.by_name("signed_distance").unwrap();
        let windings: Array1<f64> = npz.by_name("winding_number").unwrap();
        assert_eq!(points.nrows(), 12000);
        let points: Vec<Point3<f64>> = points
            .rows()
            .into_iter()
            .map(|p| Point3::new(p[0], p[1], p[2]))
            .collect();
        let all_at_once = surface.signed_distances(&points);
        for at in 0..points.len() {
            let p = points[at];
            let distance = surface.signed_distance(&p);
            assert_eq!(distance.to_bits(), all_at_once[at].to_bits());
            let error = (distance - distances[at]).abs();
            assert!(
                error <= DISTANCE_TOLERANCE,
                "{scan}, point {at}: {distance} instead of {}",
                distances[at]
            );
            let winding = f64::from(surface.winding_number(&p));
            assert!(
                (winding - windings[at]).abs() <= WINDING_TOLERANCE,
                "{scan}, point {at}: winding number {winding} instead of {}",
                windings[at]
            );
        }
    }
}

#[test]
fn grid_of_a_scan_equals_direct_queries_and_does_not_depend_on_threads() {
    let Some(mesh) = scan("002_master_chef_can") else {
        return;
    };
    let surface = SignedDistance::new(&mesh).unwrap();
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let shares = Mutex::new(Vec::new());
        let grid = pool
            .install(|| {
                SdfGrid::build(&surface, 33, 0.01, &|share| {
                    shares.lock().unwrap().push(share);
                })
            })
            .unwrap();
        let shares = shares.into_inner().unwrap();
        assert_eq!(shares.iter().copied().fold(0.0, f64::max), 1.0);
        grid
    };
    let serial = build(1);
    assert!(serial == build(3));
    let (low, high) = mesh.bounds().unwrap();
    let padding = Vector3::repeat(0.01);
    assert!((serial.bounds().0 - (low - padding)).norm() < DISTANCE_TOLERANCE);
    assert!((serial.bounds().1 - (high + padding)).norm() < DISTANCE_TOLERANCE);
    for (at, value) in serial.to_values().iter().enumerate() {
        let p = serial.node([at % 33, at / 33 % 33, at / (33 * 33)]);
        assert_eq!(*value, surface.signed_distance(&p) as f32);
    }
}

#[test]
fn parry_agrees_on_a_scan_that_does_not_intersect_itself() {
    let Some(mesh) = scan("006_mustard_bottle") else {
        return;
    };
    let surface = SignedDistance::new(&mesh).unwrap();
    let parry = parry_signed_distance(&mesh).unwrap();
    let grid = SdfGrid::build(&surface, 12, 0.01, &|_| {}).unwrap();
    let mut signs = HashSet::new();
    for at in 0..12 * 12 * 12 {
        let p = grid.node([at % 12, at / 12 % 12, at / 144]);
        let distance = surface.signed_distance(&p);
        assert!((distance - parry(&p)).abs() < PARRY_TOLERANCE, "{p:?}");
        signs.insert(distance > 0.0);
    }
    assert_eq!(signs.len(), 2);
}
