//! Captures written and read.

use std::path::{Path, PathBuf};

use graspd_geom::{SignedDistance, TriangleMesh};
use graspd_mesh::builtin_object;
use graspd_scan::{
    DepthImage, DepthIntrinsics, DepthNoise, FusionSettings, ScanSettings, TurntableViews, fuse,
    read_capture, read_simple_capture, read_ycb_capture, scan_on_turntable,
};
use nalgebra::{Point3, Vector3};
use tempfile::{TempDir, tempdir};

/// Depths are rounded to 0.1 mm, half of it up or down, and rays are not perpendicular to what they meet.
const ROUNDING: f64 = 0.0002;

/// What is seen of the table where the colour camera's view past the object's edge differs from the depth camera's:
/// they are 25 mm apart and 0.7 m away, and what is up to 15 mm behind an edge is not taken for hidden.
const PAST_THE_EDGE: f64 = 0.001;

pub(crate) fn scanned(mesh: &TriangleMesh, views: usize, noise: f64) -> TempDir {
    let folder = tempdir().unwrap();
    let settings = ScanSettings {
        views: TurntableViews::spread(views).unwrap(),
        noise: DepthNoise {
            scale: noise,
            seed: 1,
        },
    };
    scan_on_turntable(mesh, "object", &settings, folder.path(), &|_| ()).unwrap();
    folder
}

/// Written by h5py 3.16 (HDF5 2.0, `libver="earliest"`, as files of 2014 are), not by the crate that reads it.
fn written_by_h5py() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rgbd/h5py")
}

#[test]
fn files_of_the_hdf5_library_are_read() {
    let views = TurntableViews {
        cameras: vec![1],
        angles: vec![0],
    };
    let read = |intrinsics| read_ycb_capture(&written_by_h5py(), Some(&views), intrinsics).unwrap();
    let capture = read(DepthIntrinsics::Infrared);
    let view = &capture.views[0];
    assert_eq!(view.name, "NP1_0");
    assert_eq!(
        (view.camera.focal, view.camera.center),
        ([580.0, 581.0], [314.0, 252.0])
    );
    assert_eq!(
        read(DepthIntrinsics::Depth).views[0].camera.focal,
        [570.0, 570.0]
    );
    // Row r holds 6000 + r; the calibration's factor is 1.01.
    assert!((view.depth.depth(7 * 640 + 3).unwrap() - 0.6007 * 1.01).abs() < 1e-12);
    assert_eq!(view.depth.valid(), 640 * 480);
    // table_from_depth = table_from_reference inv(depth_from_reference): a quarter turn after a shift.
    let eye = view.eye();
    let expected = Point3::new(0.4 + 0.2, 0.5 - 0.1, 0.6 - 0.3);
    assert!((eye - expected).norm() < 1e-12, "{eye}");
    assert!(view.mask.is_none() && capture.table.is_none() && capture.missing.is_empty());
}

#[test]
fn views_are_spread_over_three_cameras() {
    let paper = TurntableViews::default();
    assert_eq!(paper.cameras, [1, 3, 5]);
    assert_eq!(paper.angles, [0, 72, 144, 216, 288]);
    assert_eq!(TurntableViews::spread(21).unwrap().angles.len(), 7);
    assert!(
        TurntableViews::spread(21)
            .unwrap()
            .angles
            .iter()
            .all(|a| a % 3 == 0)
    );
    assert_eq!(TurntableViews::spread(14), None);
    assert_eq!(TurntableViews::spread(0), None);
    assert_eq!(TurntableViews::spread(363), None);
}

#[test]
fn points_of_a_rendered_capture_lie_on_the_mesh() {
    let drill = builtin_object("drill").unwrap();
    let folder = scanned(&drill, 6, 0.0);
    let capture = read_capture(folder.path(), None, DepthIntrinsics::default()).unwrap();
    assert_eq!(capture.views.len(), 6);
    let distance = SignedDistance::new(&drill).unwrap();
    let motion = capture.object_from_world.unwrap();
    for view in &capture.views {
        let points = view.points(1, 0.015);
        assert!(
            points.len() > 1000,
            "{} has {} points",
            view.name,
            points.len()
        );
        for p in &points {
            // The mask keeps the table out, every transformation and both lenses are undone.
            let d = distance.signed_distance(&(motion * p));
            let beside_the_foot = p.z.abs() < ROUNDING && d < PAST_THE_EDGE;
            assert!(
                d.abs() < ROUNDING || beside_the_foot,
                "{}: {d} at {p}",
                view.name
            );
        }
    }
    // The table is in the images, but not in the masks.
    let mut without = capture.clone();
    for view in &mut without.views {
        view.mask = None;
    }
    let points = without.views[0].points(1, 0.015);
    assert!(
        points
            .iter()
            .any(|p| p.z.abs() < 0.001 && p.coords.xy().norm() > 0.15)
    );
    // With masks it is found where it is not told.
    let mut untold = capture.clone();
    untold.table = None;
    let table = fuse(&untold, &FusionSettings::default())
        .unwrap()
        .table
        .unwrap();
    assert!((table.normal - Vector3::z()).norm() < 1e-4 && table.offset.abs() < 1e-4);
    // Without masks the table is found, and what stands on it is the object.
    let fused = fuse(&without, &FusionSettings::default()).unwrap();
    assert!(fused.cloud.points.len() > 2000);
    let strays = (fused.cloud.points.iter())
        .filter(|p| distance.signed_distance(&(motion * **p)).abs() > 0.002)
        .count();
    assert!(strays * 100 < fused.cloud.points.len(), "{strays} strays");
}

#[test]
fn missing_views_are_left_out_and_named() {
    let can = builtin_object("can").unwrap();
    let folder = scanned(&can, 6, 0.0);
    std::fs::remove_file(folder.path().join("NP3_180.h5")).unwrap();
    // Without masks, too: the views are used all the same.
    std::fs::remove_file(folder.path().join("masks/NP1_0_mask.pbm")).unwrap();
    let capture = read_capture(folder.path(), None, DepthIntrinsics::default()).unwrap();
    assert_eq!(capture.views.len(), 5);
    assert_eq!(capture.missing.len(), 1);
    assert!(
        capture.missing[0].starts_with("NP3_180: "),
        "{:?}",
        capture.missing
    );
    assert!(capture.missing[0].contains("NP3_180.h5 is not there"));
    // A pose serves all cameras of its angle.
    std::fs::remove_file(folder.path().join("poses/NP5_180_pose.h5")).unwrap();
    let capture = read_capture(folder.path(), None, DepthIntrinsics::default()).unwrap();
    assert_eq!((capture.views.len(), capture.missing.len()), (3, 3));
    fuse(&capture, &FusionSettings::default()).unwrap();
}

/// A ball of 50 mm on a floor, seen from 0.4 m above its middle.
pub(crate) fn simple_capture(folder: &Path) -> serde_json::Value {
    let (width, height, focal) = (160, 120, 200.0);
    let raw = (0..width * height).map(|i| {
        let x = ((i % width) as f64 - 79.5) / focal;
        let y = ((i / width) as f64 - 59.5) / focal;
        let ray = Vector3::new(x, y, 1.0);
        let center = Vector3::new(0.0, 0.0, 0.4);
        let closest = center.cross(&ray).norm() / ray.norm();
        let z = if closest < 0.05 {
            (ray.normalize().dot(&center) - (0.0025 - closest * closest).sqrt()) / ray.norm()
        } else {
            0.45
        };
        (z / 1e-4).round() as u16
    });
    let image = DepthImage {
        width,
        height,
        raw: raw.collect(),
        unit: 1e-4,
    };
    std::fs::write(folder.join("depth.png"), image.to_png().unwrap()).unwrap();
    let camera = serde_json::json!({
        "width": width, "height": height,
        "K": [[focal, 0.0, 79.5], [0.0, focal, 59.5], [0.0, 0.0, 1.0]],
        "depth_scale_m": 1e-4,
        "T_world_from_camera": [[1, 0, 0, 0.1], [0, -1, 0, 0.2], [0, 0, -1, 0.45], [0, 0, 0, 1]],
    });
    write_camera(folder, &camera);
    camera
}

pub(crate) fn write_camera(folder: &Path, camera: &serde_json::Value) {
    std::fs::write(folder.join("camera.json"), camera.to_string()).unwrap();
}

#[test]
fn the_simple_layout_gives_what_stands_on_the_table() {
    let folder = tempdir().unwrap();
    let mut camera = simple_capture(folder.path());
    let center = Point3::new(0.1, 0.2, 0.05);
    // The table is found, or told: n . p + d = 0 in the camera's frame, the normal towards the camera.
    for plane in [None, Some([0.0, 0.0, -1.0, 0.45])] {
        if let Some(plane) = plane {
            camera["table_plane_cam"] = serde_json::json!(plane);
            write_camera(folder.path(), &camera);
        }
        let capture = read_simple_capture(folder.path()).unwrap();
        if plane.is_some() {
            let table = capture.table.unwrap();
            assert!((table.normal - Vector3::z()).norm() < 1e-9 && table.offset.abs() < 1e-9);
        }
        let cloud = fuse(&capture, &FusionSettings::default()).unwrap().cloud;
        assert!(cloud.points.len() > 1000, "{}", cloud.points.len());
        for (p, normal) in cloud.points.iter().zip(&cloud.normals) {
            let away = p - center;
            // Averages over 1.5 mm lie within the ball by 0.02 mm.
            assert!((away.norm() - 0.05).abs() < 0.0003, "{p}");
            // The plane through 24 points near the rim of what is seen leans a little.
            assert!(normal.angle(&away) < 0.2, "{normal} {away}");
        }
    }
}
