//! `graspd scan` and `graspd reconstruct`: captures written, read, and those that cannot be.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use graspd_geom::{require_closed, sample_evenly, signed_volume};
use graspd_mesh::{builtin_object, load_mesh};
use graspd_scan::DepthImage;
use serde_json::{Value, json};
use tempfile::{TempDir, tempdir};

use crate::outcome::{graspd, text};

/// A capture of the can that several tests look at, and what the command printed.
static CAPTURE: LazyLock<(PathBuf, Value)> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graspd-capture");
    let _ = std::fs::remove_dir_all(&folder);
    let made = graspd([
        "scan",
        "can",
        "-o",
        text(&folder),
        "--views",
        "9",
        "--seed",
        "3",
        "--json",
        "-q",
    ]);
    assert_eq!(made.stderr, "");
    (folder, made.gives_json())
});

/// The files of a capture, in another folder.
fn copied(from: &Path) -> TempDir {
    let folder = tempdir().unwrap();
    for inner in ["", "poses", "masks"] {
        std::fs::create_dir_all(folder.path().join(inner)).unwrap();
        for entry in std::fs::read_dir(from.join(inner)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                let name = path.file_name().unwrap();
                std::fs::copy(&path, folder.path().join(inner).join(name)).unwrap();
            }
        }
    }
    folder
}

#[test]
fn a_scan_has_the_layout_and_is_reconstructed() {
    let (capture, told) = &*CAPTURE;
    assert_eq!(told["cameras"], json!([1, 3, 5]));
    assert_eq!(told["angles_deg"], json!([0, 120, 240]));
    assert_eq!((&told["noise"], &told["seed"]), (&json!(1.0), &json!(3)));
    for name in [
        "calibration.h5",
        "capture.json",
        "NP3_120.h5",
        "poses/NP5_240_pose.h5",
        "poses/turntable.h5",
        "masks/NP1_0_mask.pbm",
    ] {
        assert!(capture.join(name).is_file(), "{name}");
    }
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (one, two) = (at("one.obj"), at("two.obj"));
    let reconstruct = |output: &Path, threads: &str| {
        let arguments = ["--depth", "5", "--threads", threads, "--json"];
        let made = graspd(
            [
                &["reconstruct", text(capture), "-o", text(output)][..],
                &arguments,
            ]
            .concat(),
        );
        assert_eq!(made.stderr, "", "nothing to warn of");
        made.gives_json()
    };
    let told = reconstruct(&one, "1");
    assert_eq!(told["views"].as_array().unwrap().len(), 9);
    assert_eq!(told["missing"], json!([]));
    assert_eq!(told["frame"], "the scanned mesh");
    assert_eq!(told["depth"], 5);
    assert!(told["trimmed_area_fraction"].as_f64().unwrap() > 0.02);
    reconstruct(&two, "2");
    let same = std::fs::read(&one).unwrap() == std::fs::read(&two).unwrap();
    assert!(same, "threads make no difference");
    let (mesh, can) = (load_mesh(&one).unwrap(), builtin_object("can").unwrap());
    require_closed(&mesh, "one").unwrap();
    // In the can's own frame and of its size, within the noise and a cell of 3.5 mm at the unseen bottom.
    let (low, high) = mesh.bounds().unwrap();
    let (can_low, can_high) = can.bounds().unwrap();
    for axis in 0..3 {
        assert!((low[axis] - can_low[axis]).abs() < 0.004, "{low} {can_low}");
        assert!(
            (high[axis] - can_high[axis]).abs() < 0.004,
            "{high} {can_high}"
        );
    }
    assert!((signed_volume(&mesh) / signed_volume(&can) - 1.0).abs() < 0.05);
    // For people: what was done, in words.
    let ply = at("three.ply");
    let said = graspd(["reconstruct", text(capture), "-o", text(&ply)]).succeeds();
    for part in [
        "three.ply: ",
        "9 views and ",
        "the scanned mesh",
        "was not seen",
    ] {
        assert!(said.contains(part), "no `{part}` in: {said}");
    }
    // What comes out goes in.
    let run = at("run");
    let arguments = ["-n", "1", "--steps", "20", "--resolution", "32", "-q"];
    graspd([&["synth", text(&ply), "-o", text(&run)][..], &arguments].concat()).succeeds();
}

#[test]
fn missing_and_empty_views_are_left_out_with_a_warning() {
    let folder = copied(&CAPTURE.0);
    std::fs::remove_file(folder.path().join("NP3_120.h5")).unwrap();
    std::fs::remove_file(folder.path().join("masks/NP1_0_mask.pbm")).unwrap();
    let output = folder.path().join("can.obj");
    let made = graspd([
        "reconstruct",
        text(folder.path()),
        "-o",
        text(&output),
        "--json",
    ]);
    let warnings: Vec<&str> = made.stderr.lines().collect();
    assert_eq!(warnings.len(), 1, "{made:?}");
    for part in [
        "warning: ",
        "1 of 9 views are missing",
        "NP3_120.h5 is not there",
    ] {
        assert!(warnings[0].contains(part), "{warnings:?}");
    }
    let told = made.gives_json();
    assert_eq!(told["views"].as_array().unwrap().len(), 8);
    assert_eq!(told["missing"].as_array().unwrap().len(), 1);
}

#[test]
fn damaged_captures_are_refused_by_name() {
    let folder = copied(&CAPTURE.0);
    let output = folder.path().join("can.obj");
    let refused = |parts: &[&str]| {
        graspd(["reconstruct", text(folder.path()), "-o", text(&output)]).fails_at_once(parts);
        assert!(!output.exists());
    };
    let depth = folder.path().join("NP1_120.h5");
    let bytes = std::fs::read(&depth).unwrap();
    std::fs::write(&depth, &bytes[..bytes.len() / 2]).unwrap();
    refused(&["NP1_120.h5", "HDF5", "download"]);
    std::fs::write(&depth, bytes).unwrap();
    std::fs::remove_file(folder.path().join("calibration.h5")).unwrap();
    refused(&["calibration.h5", "intrinsics are not known"]);
}

/// A picture of 160 x 120 depths \[m\], told for each pixel from the middle, and its camera.
fn simple_capture(folder: &Path, raw: impl Fn(f64, f64) -> f64) -> Value {
    let (width, height) = (160, 120);
    let pixels = (0..width * height).map(|i| {
        let (u, v) = ((i % width) as f64 - 79.5, (i / width) as f64 - 59.5);
        (raw(u, v) / 1e-4).round() as u16
    });
    let image = DepthImage {
        width,
        height,
        raw: pixels.collect(),
        unit: 1e-4,
    };
    std::fs::write(folder.join("depth.png"), image.to_png().unwrap()).unwrap();
    let camera = json!({
        "width": width, "height": height, "depth_scale_m": 1e-4,
        "K": [[200.0, 0.0, 79.5], [0.0, 200.0, 59.5], [0.0, 0.0, 1.0]],
    });
    std::fs::write(folder.join("camera.json"), camera.to_string()).unwrap();
    camera
}

#[test]
fn single_pictures_that_cannot_be() {
    let folder = tempdir().unwrap();
    let output = folder.path().join("mesh.obj");
    let reconstruct = |more: &[&str]| {
        let arguments = ["reconstruct", text(folder.path()), "-o", text(&output)];
        graspd([&arguments[..], more].concat())
    };
    // A cone of 5 cm that stands on the floor: no jump in depth, and sides that are seen.
    let cone_on_floor = |u: f64, v: f64| 0.45 - 0.05 * (1.0 - u.hypot(v) / 40.0).max(0.0);
    let camera = simple_capture(folder.path(), cone_on_floor);
    let with = |key: &str, value: Value| {
        let mut other = camera.clone();
        other[key] = value;
        std::fs::write(folder.path().join("camera.json"), other.to_string()).unwrap();
        reconstruct(&[])
    };
    with("K", Value::Null).fails_at_once(&["camera.json", "no `K`", "intrinsics"]);
    with("K", json!([[200.0, 0.0], [0.0, 200.0]])).fails_at_once(&["`K`", "3 x 3"]);
    with("width", json!(161)).fails_at_once(&["depth.png", "160 x 120", "161 x 120"]);
    // Tenths of millimetres taken for millimetres are still an object; centimetres are a room.
    with("depth_scale_m", json!(0.01)).fails_at_once(&["m across", "millimetres", "0.001"]);
    with("depth_scale_m", json!(0.1)).fails_at_once(&["depth_scale_m", "metres"]);
    with("width", json!(160)).succeeds();
    std::fs::remove_file(&output).unwrap();

    reconstruct(&["--depth", "13"]).fails_at_once(&["depth 13", "MiB are allowed"]);
    reconstruct(&["--depth", "14"]).fails_at_once(&["`depth` is 14", "2 to 13"]);
    reconstruct(&["--views", "15"]).succeeds();
    std::fs::remove_file(&output).unwrap();
    simple_capture(folder.path(), |_, _| 0.0);
    reconstruct(&[]).fails_at_once(&["depth.png", "no pixel has a depth"]);
    // A box of two dozen pixels.
    simple_capture(folder.path(), |u, v| {
        if u.abs().max(v.abs()) < 3.0 {
            0.4
        } else {
            0.45
        }
    });
    reconstruct(&[]).fails_at_once(&["points", "at least 100"]);
    let png = std::fs::read(folder.path().join("depth.png")).unwrap();
    std::fs::write(folder.path().join("depth.png"), &png[..png.len() / 2]).unwrap();
    reconstruct(&[]).fails_at_once(&["depth.png", "not a whole PNG"]);
    assert!(!output.exists());
}

/// A point cloud of a built-in object as a text PLY.
fn cloud(path: &Path, object: &str, count: usize, scale: f64, has_normals: bool) {
    let object = builtin_object(object).unwrap();
    let names: &[&str] = if has_normals {
        &["x", "y", "z", "nx", "ny", "nz"]
    } else {
        &["x", "y", "z"]
    };
    let properties: String = names
        .iter()
        .map(|name| format!("property float {name}\n"))
        .collect();
    let mut text =
        format!("ply\nformat ascii 1.0\nelement vertex {count}\n{properties}end_header\n");
    for sample in sample_evenly(&object, count, 1) {
        let (p, n) = (sample.point * scale, sample.normal);
        let numbers = [p.x, p.y, p.z, n.x, n.y, n.z];
        let words: Vec<String> = numbers[..names.len()].iter().map(f64::to_string).collect();
        text += &(words.join(" ") + "\n");
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn point_clouds_become_meshes_or_one_clear_error() {
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (points, output) = (at("points.ply"), at("mesh.obj"));
    let reconstruct = || graspd(["reconstruct", text(&points), "-o", text(&output), "--json"]);
    // Without normals the two sides of a thin wall cannot be told apart (docs/rgbd.md).
    for (object, has_normals) in [("mug", true), ("can", true), ("can", false)] {
        cloud(&points, object, 20_000, 1.0, has_normals);
        let told = reconstruct().gives_json();
        assert_eq!(told["views"], json!([]));
        assert_eq!(told["points"], 20_000);
        let mesh = load_mesh(&output).unwrap();
        require_closed(&mesh, "mesh").unwrap();
        let ratio = signed_volume(&mesh) / signed_volume(&builtin_object(object).unwrap());
        // Walls of 4 mm in cells as large: within a third.
        assert!(
            (0.67..1.5).contains(&ratio),
            "{object} {has_normals} {ratio}"
        );
        std::fs::remove_file(&output).unwrap();
    }
    cloud(&points, "mug", 1000, 1000.0, true);
    reconstruct().fails_at_once(&["points.ply", "m across", "millimetres", "0.001"]);
    cloud(&points, "mug", 99, 1.0, true);
    reconstruct().fails_at_once(&["points.ply", "at least 100"]);
    cloud(&points, "mug", 1000, 1.0, true);
    let whole = std::fs::read(&points).unwrap();
    std::fs::write(&points, &whole[..whole.len() / 2]).unwrap();
    reconstruct().fails_at_once(&["points.ply", "PLY"]);
    let other = at("points.xyz");
    std::fs::write(&other, "0 0 0\n").unwrap();
    graspd(["reconstruct", text(&other), "-o", text(&output)]).fails_at_once(&[
        "points.xyz",
        "no point cloud",
        ".ply",
    ]);
    std::fs::write(&points, whole).unwrap();
    graspd([
        "reconstruct",
        text(&points),
        "-o",
        text(&output),
        "--views",
        "6",
    ])
    .fails_at_once(&["points.ply", "no views"]);
    assert!(!output.exists());
}

#[test]
fn mistakes_are_told_before_the_work() {
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (capture, mesh) = (at("capture"), at("mesh.obj"));
    let scan = |more: &[&str]| graspd([&["scan", "can", "-o", text(&capture)], more].concat());
    scan(&["--views", "14"]).fails_at_once(&["--views is 14", "multiple of 3"]);
    scan(&["--noise", "-1"]).fails_at_once(&["`--noise` is -1", "at least 0"]);
    scan(&["--noise", "nan"]).fails_at_once(&["--noise", "at least 0"]);
    scan(&["--scale", "5"]).fails(&["can", "reach", "0.25"]);
    graspd(["scan", "no.obj", "-o", text(&capture)]).fails_at_once(&["no.obj", "no such file"]);
    graspd(["scan", "can"]).fails_as_wrong_usage("--output");
    assert!(!capture.exists() || std::fs::read_dir(&capture).unwrap().count() == 0);

    std::fs::create_dir_all(&capture).unwrap();
    let reconstruct = |more: &[&str]| {
        graspd([&["reconstruct", text(&capture), "-o", text(&mesh)], more].concat())
    };
    reconstruct(&[]).fails_at_once(&["holds no capture", "calibration.h5", "camera.json"]);
    reconstruct(&["--depth", "1"]).fails_at_once(&["`depth` is 1", "2 to 13"]);
    reconstruct(&["--views", "4"]).fails_at_once(&["--views is 4", "multiple of 3"]);
    reconstruct(&["--intrinsics", "rgb"]).fails_as_wrong_usage("ir, depth");
    let glb = at("mesh.glb");
    graspd(["reconstruct", text(&capture), "-o", text(&glb)])
        .fails_at_once(&["mesh.glb", ".obj, .stl"]);
    let nowhere = at("none/mesh.obj");
    graspd(["reconstruct", text(&capture), "-o", text(&nowhere)])
        .fails_at_once(&["none/mesh.obj", "-o"]);
    let missing = at("missing");
    graspd(["reconstruct", text(&missing), "-o", text(&mesh)])
        .fails_at_once(&["missing", "no such file"]);
    assert!(!mesh.exists());
}
