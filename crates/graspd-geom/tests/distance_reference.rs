//! Exact signed distances against values computed independently for real scans.

use std::fs::File;
use std::path::Path;

use graspd_geom::{SignedDistance, TriangleMesh, shared_file};
use nalgebra::Point3;
use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;

/// The reference was computed in double precision from the same triangles: only rounding may differ.
const DISTANCE_TOLERANCE: f64 = 1e-12;
/// The reference winding number is a sum of solid angles over all triangles.
const WINDING_TOLERANCE: f64 = 1e-6;

const SCANS: [&str; 6] = [
    "002_master_chef_can",
    "006_mustard_bottle",
    "019_pitcher_base",
    "024_bowl",
    "025_mug",
    "035_power_drill",
];

/// Vertices and faces of a Wavefront file that holds nothing else of interest.
fn read_obj(path: &Path) -> TriangleMesh {
    let text = std::fs::read_to_string(path).unwrap();
    let mut mesh = TriangleMesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let x: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
                mesh.vertices.push(Point3::new(x[0], x[1], x[2]));
            }
            Some("f") => {
                let corner = |word: &str| word.split('/').next().unwrap().parse::<u32>().unwrap();
                let i: Vec<u32> = words.map(|word| corner(word) - 1).collect();
                mesh.faces.push([i[0], i[1], i[2]]);
            }
            _ => {}
        }
    }
    mesh
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
        let surface = SignedDistance::new(&read_obj(&obj)).unwrap();
        let mut npz = NpzReader::new(File::open(npz).unwrap()).unwrap();
        let points: Array2<f64> = npz.by_name("points").unwrap();
        let distances: Array1<f64> = npz.by_name("signed_distance").unwrap();
        let windings: Array1<f64> = npz.by_name("winding_number").unwrap();
        assert_eq!(points.nrows(), 12000);
        for at in 0..points.nrows() {
            let p = Point3::new(points[[at, 0]], points[[at, 1]], points[[at, 2]]);
            let distance = surface.signed_distance(&p);
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
