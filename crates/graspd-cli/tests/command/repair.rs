//! `graspd repair`, and objects that are repaired on the way.

use std::path::PathBuf;

use graspd_geom::{TriangleMesh, box_mesh, require_closed, signed_volume};
use graspd_mesh::{builtin_object, load_mesh, save_obj};
use serde_json::{Value, json};
use tempfile::{TempDir, tempdir};

use crate::judging::line;
use crate::outcome::{graspd, text};

/// A box of 5 cm without half a side.
fn open_box() -> TriangleMesh {
    let mut mesh = box_mesh([0.05; 3].into(), 2.0);
    mesh.faces.pop();
    mesh
}

fn saved(folder: &TempDir, name: &str, mesh: &TriangleMesh) -> PathBuf {
    let path = folder.path().join(name);
    save_obj(mesh, &path).unwrap();
    path
}

#[test]
fn a_hole_is_filled_and_reported() {
    let folder = tempdir().unwrap();
    let open = saved(&folder, "open.obj", &open_box());
    for name in ["closed.obj", "closed.ply", "closed.stl", "closed.off"] {
        let closed = folder.path().join(name);
        let report = graspd(["repair", text(&open), "-o", text(&closed), "--json", "-q"]);
        assert_eq!(report.stderr, "");
        let report = report.gives_json();
        assert_eq!(
            (&report["tier"], &report["holes_filled"]),
            (&json!("mended"), &json!(1))
        );
        let hole = &report["holes"][0];
        let near = |value: &Value, wanted: f64| (value.as_f64().unwrap() - wanted).abs() < 1e-9;
        assert_eq!(hole["edges"], 3);
        assert!(near(&hole["diameter_m"], 0.05 * 2.0_f64.sqrt()), "{hole}");
        assert!(near(&hole["patch_area_m2"], 0.5 * 0.05 * 0.05), "{hole}");
        assert_eq!(
            (&report["before"]["faces"], &report["after"]["faces"]),
            (&json!(11), &json!(12))
        );
        assert_eq!(report["after"]["euler_number"], 2);
        let mesh = load_mesh(&closed).unwrap();
        require_closed(&mesh, name).unwrap();
        // STL keeps single precision.
        assert!((signed_volume(&mesh) / 0.05_f64.powi(3) - 1.0).abs() < 1e-6);
    }
    let closed = folder.path().join("closed.obj");
    let told = graspd(["repair", text(&open), "-o", text(&closed)]).succeeds();
    for part in ["mended", "1 hole filled", "70.7", "11 -> 12", "125.00 cm3"] {
        assert!(told.contains(part), "no `{part}` in: {told}");
    }
    // What is closed stays as it is.
    let again = folder.path().join("again.obj");
    let told = graspd(["repair", text(&closed), "-o", text(&again)]).succeeds();
    assert!(told.contains("untouched"), "{told}");
    assert_eq!(load_mesh(&again).unwrap(), load_mesh(&closed).unwrap());
}

#[test]
fn scale_resurfacing_and_sheets() {
    let folder = tempdir().unwrap();
    let sheet = TriangleMesh {
        vertices: [[0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [80.0, 60.0, 0.0]]
            .map(Into::into)
            .to_vec(),
        faces: vec![[0, 1, 2]],
    };
    let sheet = saved(&folder, "sheet.obj", &sheet);
    let shell = folder.path().join("shell.obj");
    let flags = ["--scale", "0.001", "--sheet-thickness", "0.01"];
    let arguments = [
        &["repair", text(&sheet), "-o", text(&shell), "--json", "-q"][..],
        &flags,
        &["--resolution", "32"],
    ];
    let report = graspd(arguments.concat()).gives_json();
    assert_eq!(report["tier"], "resurfaced");
    assert!(report["thickened_fraction"].as_f64().unwrap() > 0.99);
    assert!(
        report["spacing_m"]
            .as_f64()
            .is_some_and(|spacing| spacing > 0.002)
    );
    let mesh = load_mesh(&shell).unwrap();
    require_closed(&mesh, "shell").unwrap();
    let volume = 0.5 * 0.08 * 0.06 * 0.01;
    assert!((0.8..1.6).contains(&(signed_volume(&mesh) / volume)));

    let mug = saved(&folder, "mug.obj", &builtin_object("mug").unwrap());
    let new = folder.path().join("new.obj");
    let flags = ["--resurface", "--resolution", "48", "--json", "-q"];
    let arguments = [&["repair", text(&mug), "-o", text(&new)][..], &flags];
    let report = graspd(arguments.concat()).gives_json();
    assert_eq!(report["tier"], "resurfaced");
    assert_eq!(report["after"]["components"], 1);
}

#[test]
fn mistakes_are_told_before_the_work() {
    let folder = tempdir().unwrap();
    let open = saved(&folder, "open.obj", &open_box());
    let out = folder.path().join("out.obj");
    let repair =
        |more: &[&str]| graspd([&["repair", text(&open), "-o", text(&out)], more].concat());
    repair(&["--scale", "0"]).fails_at_once(&["--scale", "positive"]);
    repair(&["--resolution", "4"]).fails_at_once(&["resolution", "8 to 512"]);
    repair(&["--sheet-thickness", "-1"]).fails_at_once(&["sheet_thickness", "at least 0 (m)"]);
    let glb = folder.path().join("out.glb");
    graspd(["repair", text(&open), "-o", text(&glb)]).fails_at_once(&["out.glb", ".obj, .stl"]);
    let nowhere = folder.path().join("none/out.obj");
    graspd(["repair", text(&open), "-o", text(&nowhere)]).fails_at_once(&["none/out.obj", "-o"]);
    let missing = folder.path().join("missing.obj");
    graspd(["repair", text(&missing), "-o", text(&out)]).fails_at_once(&["missing.obj"]);
    let points = folder.path().join("points.obj");
    std::fs::write(&points, "v 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap();
    graspd(["repair", text(&points), "-o", text(&out)]).fails_at_once(&["no faces"]);
    let line = folder.path().join("line.obj");
    std::fs::write(&line, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").unwrap();
    graspd(["repair", text(&line), "-o", text(&out)]).fails(&["line.obj", "no volume"]);
    graspd(["repair", text(&open)]).fails_as_wrong_usage("--output");
    assert!(!out.exists());
}

/// The only warning on stderr.
fn warning(stderr: &str) -> &str {
    let warnings: Vec<&str> = stderr
        .lines()
        .filter(|line| line.starts_with("warning: "))
        .collect();
    assert_eq!(warnings.len(), 1, "{stderr}");
    warnings[0]
}

#[test]
fn open_objects_are_repaired_with_a_warning_and_it_is_recorded() {
    let folder = tempdir().unwrap();
    let mut mug = builtin_object("mug").unwrap();
    // 40 faces of the outside.
    mug.faces.drain(100..140);
    let open = saved(&folder, "open_mug.obj", &mug);
    let run = folder.path().join("run");
    let arguments = ["-n", "1", "--steps", "20", "--resolution", "32", "--meshes"];
    let made = graspd([&["synth", text(&open), "-o", text(&run)][..], &arguments].concat());
    let told = warning(&made.stderr).to_owned();
    for part in [
        text(&open),
        "not closed",
        "filled",
        "mm across",
        "--no-repair",
    ] {
        assert!(told.contains(part), "no `{part}` in: {told}");
    }
    made.succeeds();
    let grasps = std::fs::read_to_string(run.join("grasps.jsonl")).unwrap();
    let record: Value = serde_json::from_str(grasps.lines().next().unwrap()).unwrap();
    assert_eq!(record["object_repair"], "mended");
    let described: toml::Table = std::fs::read_to_string(run.join("run.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let repair = described["object_repair"].as_table().unwrap();
    assert_eq!(repair["tier"].as_str(), Some("mended"));
    assert!(repair["holes_filled"].as_integer() >= Some(1));
    assert!(repair["largest_hole_m"].as_float() > Some(0.001));
    // The surface that was grasped is the closed one.
    let object = load_mesh(run.join("meshes/object.obj")).unwrap();
    require_closed(&object, "object").unwrap();

    // The judge repairs it alike, and finds the same.
    let judged = graspd(["eval", text(&run), "--json"]);
    warning(&judged.stderr);
    let judged = judged.gives_json();
    assert_eq!(judged["grasps"][0]["metrics"], record["metrics"]);
    assert_eq!(judged["grasps"][0]["object_repair"], "mended");
    graspd(["eval", text(&run), "--no-repair"]).fails(&["open_mug.obj", "is open"]);
}

#[test]
fn grids_of_open_objects_tell_of_the_repair() {
    let folder = tempdir().unwrap();
    let open = saved(&folder, "open.obj", &open_box());
    let grid = folder.path().join("grid.npz");
    let arguments = ["sdf", text(&open), "--resolution", "8", "-o", text(&grid)];
    let made = graspd([&arguments[..], &["--json"]].concat());
    assert!(warning(&made.stderr).contains("70.7 mm across"), "{made:?}");
    assert_eq!(made.gives_json()["object_repair"], "mended");
    let quiet = graspd([&arguments[..], &["--quiet"]].concat());
    assert_eq!(quiet.stderr, "");
    quiet.succeeds();

    // A mesh of its own for the judge: the record then tells what was done to that.
    let file = folder.path().join("mine.jsonl");
    std::fs::write(&file, line(&[])).unwrap();
    let arguments = ["eval", text(&file), "--metrics", "ca", "--json", "-q"];
    let judge = |more: &[&str]| graspd([&arguments[..], more].concat()).gives_json();
    let judged = judge(&["--object", text(&open)]);
    assert_eq!(judged["grasps"][0]["object_repair"], "mended");
    assert_eq!(judge(&[])["grasps"][0]["object_repair"], Value::Null);
}
