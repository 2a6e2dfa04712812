//! Grasps that cannot be judged.

use std::path::PathBuf;

use graspd_geom::box_mesh;
use serde_json::{Value, json};
use tempfile::{TempDir, tempdir};

use crate::judging::{bare, line};
use crate::outcome::{graspd, text};

fn records(folder: &TempDir, content: &str) -> PathBuf {
    let path = folder.path().join("grasps.jsonl");
    std::fs::write(&path, content).unwrap();
    path
}

/// `content` in a file, judged without progress lines, fails with a line that has `parts` and the file's name.
fn refused(content: &str, flags: &[&str], parts: &[&str]) {
    let folder = tempdir().unwrap();
    let path = records(&folder, content);
    let mut arguments = vec!["eval", text(&path), "--quiet", "--metrics", "ca"];
    arguments.extend(flags);
    let mut parts = parts.to_vec();
    parts.push(text(&path));
    graspd(arguments).fails_at_once(&parts);
}

#[test]
fn files_without_records() {
    let folder = tempdir().unwrap();
    let missing = folder.path().join("grasps.jsonl");
    let parts = [text(&missing), "No such file", "check the path"];
    graspd(["eval", text(&missing)]).fails_at_once(&parts);
    graspd(["eval", text(folder.path())]).fails_at_once(&parts);
    refused("", &[], &["no grasp", "graspd.grasp/1"]);
    refused("\n\n", &[], &["no grasp"]);
}

#[test]
fn malformed_lines_are_numbered() {
    let good = line(&[]);
    for (bad, fault) in [
        ("{\"object\": \"mug\",", "EOF while parsing"),
        ("grasp", "expected value"),
        ("[]", "no JSON object"),
        ("{}", "missing field `object`"),
        (
            "{\"schema\": \"graspd.grasp/9\"}",
            "schema `graspd.grasp/9`",
        ),
        ("{\"object\": 1e999}", "number out of range"),
    ] {
        refused(
            &format!("{good}\n\n{bad}\n"),
            &[],
            &["line 3", fault, "graspd.grasp/1 record"],
        );
    }
    let bytes = [good.as_bytes(), b"\n\"\xff\xfe\"\n"].concat();
    let folder = tempdir().unwrap();
    let path = folder.path().join("binary.jsonl");
    std::fs::write(&path, bytes).unwrap();
    graspd(["eval", text(&path)]).fails_at_once(&["binary.jsonl", "line 2 is not text"]);
}

#[test]
fn poses_that_are_none() {
    let pose = |t: Value, q: Value| ("pose", json!({"translation_m": t, "rotation_wxyz": q}));
    let short = line(&[pose(json!([0, 0]), json!([1, 0, 0, 0]))]);
    refused(
        &short,
        &[],
        &["line 1", "invalid length 2", "array of length 3"],
    );
    let zero = line(&[pose(json!([0, 0, 0]), json!([0, 0, 0, 0]))]);
    refused(
        &zero,
        &[],
        &["grasp 0", "zero quaternion", "correct the record"],
    );
    // So far away that no number is left of the hand.
    let far = line(&[pose(json!([1e300, 0, 0]), json!([1, 0, 0, 0]))]);
    refused(&far, &[], &["grasp 0", "hand"]);
}

#[test]
fn joints_that_do_not_fit() {
    let no_joints = line(&[("joints_rad", Value::Null)]);
    refused(
        &no_joints,
        &[],
        &["grasp 0", "neither `joints_rad` nor `mano`"],
    );
    let mut joints = bare()["joints_rad"].clone();
    joints.as_object_mut().unwrap().remove("joint_7.0");
    let second = format!("{}\n{}", line(&[]), line(&[("joints_rad", joints)]));
    refused(&second, &[], &["grasp 1", "lacks the joint `joint_7.0`"]);
}

/// A slider that can be drawn out to any length.
const SLIDER: &str = r#"<robot name="slider">
    <link name="base"><collision><geometry><box size="0.02 0.02 0.05"/></geometry></collision></link>
    <link name="tip"><collision><geometry><box size="0.02 0.02 0.05"/></geometry></collision></link>
    <joint name="slide" type="prismatic"><parent link="base"/><child link="tip"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/></joint></robot>"#;

#[test]
fn another_hand() {
    let folder = tempdir().unwrap();
    let slider = folder.path().join("slider.urdf");
    std::fs::write(&slider, SLIDER).unwrap();
    refused(
        &line(&[]),
        &["--hand", text(&slider)],
        &["grasp 0", "lacks the joint `slide`"],
    );
    refused(
        &line(&[("hand", json!("claw"))]),
        &[],
        &["claw", "neither a built-in hand", "--hand"],
    );
    let two = format!("{}\n{}", line(&[]), line(&[("hand", json!("claw"))]));
    refused(
        &two,
        &[],
        &["more than one hand", "allegro, claw", "--hand"],
    );
    // A joint in millimetres rather than metres, and then some: this must not fill the memory with voxels.
    let drawn = line(&[
        ("hand", json!("slider")),
        ("joints_rad", json!({"slide": 1e9})),
    ]);
    refused(
        &drawn,
        &["--hand", text(&slider)],
        &["grasp 0", "m across", "must be in metres"],
    );
}

#[test]
fn another_object() {
    refused(
        &line(&[("object", json!("teapot"))]),
        &[],
        &["teapot", "--object"],
    );
    refused(
        &line(&[("object_path", json!("gone/cup.obj"))]),
        &[],
        &["gone/cup.obj", "--object"],
    );
    let two = format!("{}\n{}", line(&[]), line(&[("object", json!("can"))]));
    refused(&two, &[], &["more than one object", "mug, can", "--object"]);
    let scales = (0..40).map(|k| line(&[("object_scale", json!(1.0 + 0.01 * f64::from(k)))]));
    let scales: Vec<_> = scales.collect();
    refused(&scales.join("\n"), &[], &["40 scales", "--scale"]);
    let zero = line(&[("object_scale", json!(0))]);
    refused(&zero, &[], &["`scale` is 0", "positive"]);

    let folder = tempdir().unwrap();
    let open = folder.path().join("open.obj");
    let mut mesh = box_mesh([0.05; 3].into(), 2.0);
    mesh.faces.pop();
    graspd_mesh::save_obj(&mesh, &open).unwrap();
    let records = records(&folder, &line(&[]));
    let eval = graspd([
        "eval",
        text(&records),
        "--object",
        text(&open),
        "--no-repair",
    ]);
    eval.fails_at_once(&[text(&open), "the surface is open"]);
}
