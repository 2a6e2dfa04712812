//! Hands that cannot be loaded.

use std::fs::File;
use std::path::PathBuf;

use ndarray::Array2;
use ndarray_npy::NpzWriter;
use tempfile::{TempDir, tempdir};

use crate::outcome::{graspd, text};

/// Every command that takes a hand refuses it in the same words.
fn every_command_refuses(hand: &str, parts: &[&str]) {
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    graspd(["synth", "--hand", hand, "-o", text(&run)]).fails_at_once(parts);
    graspd(["hands", "inspect", hand]).fails_at_once(parts);
    assert!(!run.exists(), "a mistake leaves nothing behind");
}

fn written(folder: &TempDir, name: &str, content: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

const BOX: &str = r#"<collision><geometry><box size="0.02 0.02 0.05"/></geometry></collision>"#;

fn joint(name: &str, parent: &str, child: &str) -> String {
    format!(
        r#"<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><axis xyz="1 0 0"/>
        <limit lower="0" upper="1" effort="1" velocity="1"/></joint>"#
    )
}

#[test]
fn no_such_hand() {
    let parts = [
        "claw: ",
        "neither a built-in hand (allegro",
        "nor an existing file",
        ".urdf",
    ];
    every_command_refuses("claw", &parts);
    every_command_refuses(
        "no/such/hand.urdf",
        &["no/such/hand.urdf", "nor an existing file"],
    );
    let folder = tempdir().unwrap();
    let text_file = written(&folder, "hand.txt", "a hand");
    every_command_refuses(
        text(&text_file),
        &["hand.txt", "not a kind of file that describes a hand"],
    );
}

#[test]
fn files_that_hold_no_urdf() {
    let folder = tempdir().unwrap();
    let empty = written(&folder, "empty.urdf", "");
    every_command_refuses(
        text(&empty),
        &[text(&empty), "empty", "export or download it again"],
    );
    let prose = written(&folder, "prose.urdf", "dear robot,\nplease grasp.\n");
    every_command_refuses(text(&prose), &[text(&prose), "not a URDF file", "complete"]);
    let bare = written(&folder, "bare.urdf", r#"<robot name="bare"></robot>"#);
    every_command_refuses(text(&bare), &[text(&bare), "no links"]);
    let macros = concat!(
        r#"<robot name="m" xmlns:xacro="http://www.ros.org/wiki/xacro">"#,
        r#"<xacro:include filename="a.xacro"/></robot>"#
    );
    for name in ["macros.urdf", "macros.xacro"] {
        let macros = written(&folder, name, macros);
        every_command_refuses(
            text(&macros),
            &[text(&macros), "xacro macros", "expand them first"],
        );
    }
}

#[test]
fn files_that_hold_no_model_in_manos_layout() {
    let folder = tempdir().unwrap();
    let prose = written(&folder, "prose.pkl", "a hand, honestly");
    every_command_refuses(
        text(&prose),
        &[text(&prose), "no pickle that a MANO file could be"],
    );
    let ran = folder.path().join("ran");
    let program = format!("cposix\nsystem\n(S'touch {}'\ntR.", text(&ran));
    let program = written(&folder, "program.pkl", &program);
    every_command_refuses(
        text(&program),
        &[text(&program), "`posix.system`", "nothing was run"],
    );
    assert!(!ran.exists());
    let empty = written(&folder, "empty.npz", "");
    every_command_refuses(text(&empty), &[text(&empty), "empty"]);

    let incomplete = folder.path().join("incomplete.npz");
    let mut archive = NpzWriter::new(File::create(&incomplete).unwrap());
    archive
        .add_array("v_template", &Array2::<f64>::zeros((778, 3)))
        .unwrap();
    archive.finish().unwrap();
    let parts = [
        text(&incomplete),
        "has no array `weights`",
        "it has v_template",
    ];
    every_command_refuses(text(&incomplete), &parts);
}

#[test]
fn descriptions_that_make_no_hand() {
    let folder = tempdir().unwrap();
    let mesh = r#"<collision><geometry><mesh filename="meshes/palm.stl"/></geometry></collision>"#;
    let missing = format!(
        r#"<robot name="m"><link name="palm">{mesh}</link><link name="tip">{BOX}</link>{}</robot>"#,
        joint("j", "palm", "tip")
    );
    let missing = written(&folder, "missing_mesh.urdf", &missing);
    let parts = [
        text(&missing),
        "link `palm`",
        "meshes/palm.stl",
        "not found",
        "put it there",
    ];
    every_command_refuses(text(&missing), &parts);

    let cycle = format!(
        r#"<robot name="c"><link name="palm">{BOX}</link><link name="a">{BOX}</link>
<link name="b">{BOX}</link>{}{}</robot>"#,
        joint("j", "a", "b"),
        joint("k", "b", "a")
    );
    let cycle = written(&folder, "cycle.urdf", &cycle);
    every_command_refuses(text(&cycle), &[text(&cycle), "cycle", "cut the cycle"]);

    let roots = format!(
        r#"<robot name="t"><link name="palm">{BOX}</link><link name="a">{BOX}</link>
<link name="lost">{BOX}</link>{}</robot>"#,
        joint("j", "palm", "a")
    );
    let roots = written(&folder, "roots.urdf", &roots);
    every_command_refuses(
        text(&roots),
        &[text(&roots), "several root links (palm, lost)"],
    );
}

#[test]
fn units_other_than_metres_are_noticed() {
    let folder = tempdir().unwrap();
    let finger = r#"<collision><geometry><box size="20 20 6000"/></geometry></collision>"#;
    let hand = format!(
        r#"<robot name="mm"><link name="palm">{BOX}</link><link name="tip">{finger}</link>{}</robot>"#,
        joint("j", "palm", "tip")
    );
    let hand = written(&folder, "mm.urdf", &hand);
    let synth = graspd([
        "synth",
        "--hand",
        text(&hand),
        "-o",
        text(&folder.path().join("run")),
    ]);
    synth.fails_at_once(&[text(&hand), "6000.0", "m across", "metres"]);
}
