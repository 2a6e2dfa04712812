//! Scans and defective meshes from elsewhere, against facts measured with other programs.

use graspd_geom::{
    ClosedSurface, GeometryError, Topology, TriangleMesh, require_closed, shared_file,
    signed_volume, topology,
};
use graspd_mesh::load_mesh;

/// The facts are given in mm and cm^3, rounded; volumes of thin shells to two digits only.
const EXTENT_TOLERANCE_MM: f64 = 0.051;
const VOLUME_TOLERANCE: f64 = 0.01;

fn extents_mm(mesh: &TriangleMesh) -> [f64; 3] {
    let (low, high) = mesh.bounds().unwrap();
    [0, 1, 2].map(|axis| 1000.0 * (high[axis] - low[axis]))
}

#[test]
fn ycb_scans_are_closed_and_have_their_known_size() {
    for (name, extents, volume_cm3) in [
        ("002_master_chef_can", [102.5, 102.4, 140.2], 1055.0),
        ("003_cracker_box", [71.8, 164.0, 213.4], 2173.0),
        ("004_sugar_box", [49.5, 94.2, 176.0], 638.0),
        ("005_tomato_soup_can", [67.9, 67.7, 101.9], 319.0),
        ("006_mustard_bottle", [97.2, 66.6, 191.3], 612.0),
        ("008_pudding_box", [137.9, 128.8, 38.9], 342.0),
        ("010_potted_meat_can", [102.1, 60.1, 83.5], 354.0),
        ("011_banana", [108.9, 178.4, 36.7], 172.0),
        ("019_pitcher_base", [149.1, 144.8, 242.4], 2549.0),
        ("021_bleach_cleanser", [102.4, 67.7, 250.6], 972.0),
        ("024_bowl", [161.5, 161.2, 55.0], 33.0),
        ("025_mug", [117.0, 93.1, 81.3], 138.0),
        ("035_power_drill", [184.2, 187.5, 57.3], 581.0),
    ] {
        let Some(path) = shared_file(&format!("data/ycb/{name}.obj")) else {
            return;
        };
        let mesh = load_mesh(&path).unwrap();
        require_closed(&mesh, name).unwrap();
        let volume = 1e6 * signed_volume(&mesh);
        assert!(
            (volume - volume_cm3).abs() < VOLUME_TOLERANCE * volume_cm3 + 0.5,
            "{name}: {volume}"
        );
        for (measured, expected) in extents_mm(&mesh).into_iter().zip(extents) {
            assert!(
                (measured - expected).abs() < EXTENT_TOLERANCE_MM,
                "{name}: {measured} {expected}"
            );
        }
        let surface = ClosedSurface::new(&mesh, name).unwrap();
        assert!(!surface.was_welded && !surface.was_flipped, "{name}");
        assert_eq!(surface.mesh, mesh);
        assert_eq!(topology(&mesh).components, 1, "{name}");
    }
}

fn load(name: &str) -> Option<(TriangleMesh, Topology)> {
    let mesh = load_mesh(shared_file(&format!("data/meshes_to_repair/{name}"))?).unwrap();
    let topology = topology(&mesh);
    Some((mesh, topology))
}

#[test]
fn defects_are_counted_as_other_programs_count_them() {
    for (name, vertices, faces, boundary_edges, non_manifold_edges, components) in [
        ("bunny_stanford_holes.obj", 35947, 69451, 223, 0, 1),
        ("camera_gopro.stl", 4077, 8150, 0, 0, 2),
        ("remote_oculusgo_soup.obj", 8724, 3494, 8610, 0, 2677),
        ("teapot_utah.obj", 3644, 6320, 1036, 0, 4),
        ("trofast_box_double_faces.stl", 180, 712, 0, 534, 1),
    ] {
        let Some((mesh, topology)) = load(name) else {
            return;
        };
        assert_eq!(mesh.vertices.len(), vertices, "{name}");
        assert_eq!(mesh.faces.len(), faces, "{name}");
        assert_eq!(topology.boundary_edges, boundary_edges, "{name}");
        assert_eq!(topology.non_manifold_edges, non_manifold_edges, "{name}");
        assert_eq!(topology.components, components, "{name}");
        let is_watertight = boundary_edges == 0 && non_manifold_edges == 0;
        assert_eq!(topology.is_closed(), is_watertight, "{name}");
        match require_closed(&mesh, name) {
            Ok(()) => assert!(is_watertight),
            Err(GeometryError::Open { boundary_edges, .. }) => {
                assert_eq!(boundary_edges, topology.boundary_edges);
            }
            Err(error) => assert!(matches!(
                error,
                GeometryError::DuplicateFaces { faces: 356, .. }
            )),
        }
    }
}

#[test]
fn the_bunny_has_its_five_holes() {
    let Some((mesh, topology)) = load("bunny_stanford_holes.obj") else {
        return;
    };
    assert_eq!(topology.boundary_loops.len(), 5);
    assert_eq!(topology.euler_number, 2 - 5);
    let error = require_closed(&mesh, "bunny").unwrap_err().to_string();
    assert!(error.contains("223 boundary edges in 5 loops"), "{error}");
}

#[test]
fn doubled_faces_are_dropped() {
    let Some((mesh, _)) = load("trofast_box_double_faces.stl") else {
        return;
    };
    let surface = ClosedSurface::new(&mesh, "trofast").unwrap();
    assert_eq!(surface.duplicates_dropped, 356);
    assert_eq!(topology(&surface.mesh).euler_number, 2);
    let doubled = signed_volume(&mesh);
    assert!((signed_volume(&surface.mesh) / doubled - 0.5).abs() < 1e-9);
}
