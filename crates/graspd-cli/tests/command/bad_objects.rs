//! Objects that cannot be grasped, or not as they stand.

use std::path::{Path, PathBuf};

use graspd_geom::{TriangleMesh, box_mesh};
use graspd_mesh::{BUILTIN_OBJECTS, builtin_object, save_obj};
use tempfile::{TempDir, tempdir};

use crate::outcome::{graspd, text};

/// Every command that takes an object refuses it in the same words, and makes no output.
fn every_command_refuses(object: &str, parts: &[&str]) {
    let folder = tempdir().unwrap();
    let (run, grid) = (folder.path().join("run"), folder.path().join("grid.npz"));
    graspd(["synth", object, "-o", text(&run)]).fails_at_once(parts);
    graspd(["sdf", object, "-o", text(&grid)]).fails_at_once(parts);
    assert!(
        !run.exists() && !grid.exists(),
        "a mistake leaves nothing behind"
    );
}

fn written(folder: &TempDir, name: &str, content: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

fn saved(folder: &TempDir, name: &str, mesh: &TriangleMesh) -> PathBuf {
    let path = folder.path().join(name);
    save_obj(mesh, &path).unwrap();
    path
}

#[test]
fn no_such_object() {
    every_command_refuses(
        "no/such/cup.obj",
        &["no/such/cup.obj", "no such file", "check the path"],
    );
    // A misspelt or merely hoped-for name: say which there are.
    let mut parts: Vec<&str> = BUILTIN_OBJECTS.iter().map(|object| object.name).collect();
    parts.extend([
        "teapot: ",
        "neither a built-in object",
        "nor an existing file",
        ".obj",
    ]);
    every_command_refuses("teapot", &parts);
    let folder = tempdir().unwrap();
    every_command_refuses(text(folder.path()), &[text(folder.path())]);
}

#[test]
fn files_that_hold_no_mesh() {
    let folder = tempdir().unwrap();
    let empty = written(&folder, "empty.obj", "");
    every_command_refuses(
        text(&empty),
        &[text(&empty), "empty", "export or download it again"],
    );
    let picture = written(&folder, "cup.jpg", "JFIF");
    every_command_refuses(
        text(&picture),
        &[text(&picture), ".jpg is not a supported", ".obj, .stl"],
    );
    let points = written(&folder, "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    every_command_refuses(text(&points), &[text(&points), "no faces", "surface mesh"]);
    // The line end in the name must not break the message in two.
    let odd = written(&folder, "two\nlines.obj", "v 0 0 zero\n");
    let parts = ["two lines.obj, line 1", "\"zero\" is not a number"];
    every_command_refuses(text(&odd), &parts);
}

#[test]
fn vertices_and_faces_that_cannot_be() {
    let folder = tempdir().unwrap();
    let nan = written(&folder, "nan.obj", "v 0 0 0\nv 1 0 NaN\nv 0 1 0\nf 1 2 3\n");
    every_command_refuses(
        text(&nan),
        &["nan.obj, line 2", "vertex 1 is not finite", "export"],
    );
    let beyond = written(
        &folder,
        "beyond.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
    );
    let parts = [
        "beyond.obj, line 4",
        "vertex 4",
        "has 3 vertices",
        "export it again",
    ];
    every_command_refuses(text(&beyond), &parts);
}

#[test]
fn holes_are_measured() {
    let folder = tempdir().unwrap();
    let mut open = box_mesh([0.05; 3].into(), 2.0);
    open.faces.pop();
    let path = saved(&folder, "open.obj", &open);
    // Half a side of a 50 mm cube is missing: two edges and a diagonal of 70.7 mm.
    let parts = [
        text(&path),
        "the surface is open",
        "3 boundary edges in 1 loop",
        "170.7 mm of boundary",
        "70.7 mm across",
        "close it with `graspd repair`",
    ];
    let run = folder.path().join("run");
    graspd(["synth", text(&path), "--no-repair", "-o", text(&run)]).fails_at_once(&parts);
    graspd(["sdf", text(&path), "--no-repair", "-o", text(&run)]).fails_at_once(&parts);
    assert!(!run.exists(), "a mistake leaves nothing behind");
    let mut flat = box_mesh([0.05; 3].into(), 2.0);
    for vertex in &mut flat.vertices {
        vertex.z = 0.0;
    }
    let flat = saved(&folder, "flat.obj", &flat);
    every_command_refuses(text(&flat), &[text(&flat), "no volume", "solid"]);
}

/// The grid of `object`, coarse and quick, with more arguments.
fn coarse_grid(object: &Path, more: &[&str]) -> crate::outcome::Outcome {
    let output = object.with_extension("npz");
    let mut arguments = vec![
        "sdf",
        text(object),
        "--resolution",
        "8",
        "-o",
        text(&output),
    ];
    arguments.extend(more);
    graspd(arguments)
}

#[test]
fn units_other_than_metres_are_noticed() {
    let folder = tempdir().unwrap();
    let mug = builtin_object("mug").unwrap();
    let millimetres = saved(&folder, "mm.obj", &mug.scaled(1000.0));
    let parts = [
        text(&millimetres),
        "its largest side is 116.74 m",
        "--scale 0.001",
    ];
    every_command_refuses(text(&millimetres), &parts);
    // The remedy works, and then there is nothing to warn of.
    let scaled = coarse_grid(&millimetres, &["--scale", "0.001"]);
    assert!(!scaled.stderr.contains("warning"), "{scaled:?}");
    scaled.succeeds();

    let large = saved(&folder, "large.obj", &box_mesh([0.2, 0.3, 1.5].into(), 2.0));
    let small = saved(
        &folder,
        "small.obj",
        &box_mesh([0.001, 0.002, 0.004].into(), 2.0),
    );
    for (path, size) in [(large, "1.50 m"), (small, "4.000 mm")] {
        let warned = coarse_grid(&path, &[]);
        let warnings: Vec<&str> = warned
            .stderr
            .lines()
            .filter(|l| l.starts_with("warning: "))
            .collect();
        assert_eq!(warnings.len(), 1, "{warned:?}");
        for part in [text(&path), size, "--scale"] {
            assert!(warnings[0].contains(part), "{warned:?}");
        }
        warned.succeeds();
        let quiet = coarse_grid(&path, &["--quiet"]);
        assert_eq!(quiet.stderr, "");
        quiet.succeeds();
    }
    // Smaller than anything that can be grasped.
    let speck = saved(&folder, "speck.obj", &box_mesh([0.0001; 3].into(), 2.0));
    every_command_refuses(text(&speck), &["speck.obj", "0.100 mm", "--scale"]);
}
