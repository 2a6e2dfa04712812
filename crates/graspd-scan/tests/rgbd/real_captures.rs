//! Captures of a real camera.

use graspd_geom::{TriangleTree, require_closed, shared_file, topology};
use graspd_mesh::load_mesh;
use graspd_scan::{
    DepthIntrinsics, FusionSettings, ReconstructionSettings, fuse, read_capture, reconstruct,
};
use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion};

/// Root mean square distance of what was seen from the scan, at a pose that was found by registration itself [m].
const WITHIN: f64 = 0.003;
/// What is reconstructed this near to a measured point was seen [m].
const SEEN: f64 = 0.004;

/// The pose in a `camera.json`, by a matrix whose rotation part is one but for rounding.
fn pose(camera: &serde_json::Value) -> Isometry3<f64> {
    let rows = camera["T_cam_from_object_icp"].as_array().unwrap();
    let at = |i: usize, j: usize| rows[i][j].as_f64().unwrap();
    let matrix = Matrix4::from_fn(at);
    let turn = nalgebra::Rotation3::from_matrix(&matrix.fixed_view::<3, 3>(0, 0).into_owned());
    let shift = Translation3::new(at(0, 3), at(1, 3), at(2, 3));
    Isometry3::from_parts(shift, UnitQuaternion::from_rotation_matrix(&turn))
}

#[test]
fn objects_on_a_table_become_closed_meshes_where_the_scans_are() {
    for (name, scan) in [
        ("mustard", Some("006_mustard_bottle")),
        ("sugar", Some("004_sugar_box")),
        ("cylinder", None),
        ("white_mug", None),
    ] {
        let Some(folder) = shared_file(&format!("data/rgbd/{name}")) else {
            return;
        };
        let capture = read_capture(&folder, None, DepthIntrinsics::default()).unwrap();
        let fused = fuse(&capture, &FusionSettings::default()).unwrap();
        // The camera is at the origin: every normal looks towards it.
        for (p, normal) in fused.cloud.points.iter().zip(&fused.cloud.normals) {
            assert!(normal.dot(&p.coords) <= 0.0);
        }
        let result = reconstruct(
            &fused.cloud,
            fused.table.as_ref(),
            &ReconstructionSettings::default(),
            name,
        )
        .unwrap();
        require_closed(&result.mesh, name).unwrap();
        assert_eq!(topology(&result.mesh).components, 1, "{name}");
        let (low, high) = result.mesh.bounds().unwrap();
        assert!(
            (0.05..0.25).contains(&(high - low).max()),
            "{name}: {}",
            high - low
        );
        let Some(scan) = scan else {
            continue;
        };
        let Some(path) = shared_file(&format!("data/ycb/{scan}.obj")) else {
            return;
        };
        let text = std::fs::read_to_string(folder.join("camera.json")).unwrap();
        let camera_from_object = pose(&serde_json::from_str(&text).unwrap());
        let scan = load_mesh(path).unwrap().transformed(&camera_from_object);
        let tree = TriangleTree::new(&scan).unwrap();
        let rms = |points: &mut dyn Iterator<Item = nalgebra::Point3<f64>>| {
            let (sum, count) = points.fold((0.0, 0), |(sum, count), p| {
                (sum + tree.distance(&p).powi(2), count + 1)
            });
            assert!(count > 300, "{name}: {count} points");
            (sum / f64::from(count)).sqrt()
        };
        let cloud = rms(&mut fused.cloud.points.iter().copied());
        let measured = graspd_scan::KdTree::new(&fused.cloud.points);
        let is_seen = |p: &nalgebra::Point3<f64>| {
            let mut found = Vec::new();
            measured.nearest(p, 1, &mut found);
            found[0].0 < SEEN * SEEN
        };
        let surface = rms(&mut result.mesh.vertices.iter().copied().filter(is_seen));
        println!(
            "{name}: cloud {:.2} mm, surface {:.2} mm",
            1e3 * cloud,
            1e3 * surface
        );
        assert!(
            cloud < WITHIN && surface < WITHIN,
            "{name}: {cloud} {surface}"
        );
    }
}
