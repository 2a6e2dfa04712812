//! Inspected, mirrored and packaged hands.

use std::fs;

use tempfile::tempdir;

use crate::outcome::{graspd, text};
use crate::shared_run::lines;

#[test]
fn an_inspected_hand_has_a_picture_followers_and_pairs() {
    let folder = tempdir().unwrap();
    let picture = folder.path().join("barrett.png");
    let described = graspd(["hands", "inspect", "barrett", "--png", text(&picture)]).succeeds();
    for part in [
        "closes up",
        "joint of finger_1_dist_link = 0.3333 finger_1",
        "pairs of bodies",
        "finger_1_dist_link - finger_3_dist_link",
        "picture: ",
    ] {
        assert!(described.contains(part), "no {part} in {described}");
    }
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&picture).unwrap()));
    let reader = decoder.read_info().unwrap();
    assert!(reader.info().width > reader.info().height);
    let json = graspd(["hands", "inspect", "barrett", "--json", "--mirror"]).gives_json();
    assert_eq!(json["name"], "barrett_mirrored");
    assert_eq!(json["followers"].as_array().unwrap().len(), 4);
    assert_eq!(json["joints"][0]["closes"], 1.0);
}

#[test]
fn a_run_with_a_mirrored_hand_is_judged_with_it_again() {
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    let arguments = [
        "synth",
        "can",
        "--hand",
        "barrett",
        "--mirror",
        "-n",
        "1",
        "--steps",
        "20",
        "--resolution",
        "32",
        "--retreat",
        "0.08",
        "--squeeze",
        "0.002",
        "--squeeze-force",
        "3",
        "--json",
        "-q",
        "-o",
        text(&run),
    ];
    graspd(arguments).gives_json();
    let record = &lines(&run.join("grasps.jsonl"))[0];
    assert_eq!(record["hand"], "barrett_mirrored");
    assert_eq!(record["squeeze"]["force_n"], 3.0);
    let settings: toml::Table = fs::read_to_string(run.join("run.toml"))
        .unwrap()
        .parse()
        .unwrap();
    assert_eq!(settings["hand_mirrored"].as_bool(), Some(true));
    assert_eq!(settings["execution"]["retreat"].as_float(), Some(0.08));
    let again = graspd(["eval", text(&run), "--metrics", "ca,iv", "--json", "-q"]).gives_json();
    let metric = "interpenetration_volume_cm3";
    assert_eq!(
        again["grasps"][0]["metrics"][metric],
        record["metrics"][metric]
    );
}

#[test]
fn a_run_with_another_human_hand_is_judged_with_it_again() {
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    let arguments = [
        "synth",
        "can",
        "--hand",
        "human",
        "--hand-shape",
        "-2,1",
        "--pose-components",
        "6",
        "-n",
        "1",
        "--preset",
        "soft",
        "--steps",
        "20",
        "--resolution",
        "32",
        "--json",
        "-q",
        "-o",
        text(&run),
    ];
    graspd(arguments).gives_json();
    let record = &lines(&run.join("grasps.jsonl"))[0];
    assert_eq!(record["mano"]["pca"].as_array().unwrap().len(), 6);
    assert_eq!(record["mano"]["shape"][0], -2.0);
    let again = graspd(["eval", text(&run), "--metrics", "ca,iv,sd", "--json", "-q"]).gives_json();
    for metric in ["interpenetration_volume_cm3", "simulation_displacement_cm"] {
        assert_eq!(
            again["grasps"][0]["metrics"][metric],
            record["metrics"][metric]
        );
    }
    // Without the run's description, the records alone tell that it is another hand.
    let alone = folder.path().join("alone.jsonl");
    fs::copy(run.join("grasps.jsonl"), &alone).unwrap();
    let judged = |flags: &[&str]| {
        let all = [
            "eval",
            text(&alone),
            "--pose-components",
            "6",
            "--metrics",
            "ca",
        ];
        let hand = ["--hand", "human"];
        graspd(
            all.iter()
                .chain(&hand)
                .chain(flags)
                .copied()
                .collect::<Vec<_>>(),
        )
    };
    let warned = judged(&[]);
    assert!(warned.stderr.contains("--hand-shape"), "{}", warned.stderr);
    let same = judged(&["--hand-shape", "-2,1"]);
    assert!(!same.stderr.contains("--hand-shape"), "{}", same.stderr);
}

#[test]
fn hands_that_have_no_skin_refuse_its_options() {
    let inspect = |arguments: &[&str]| {
        let all = ["hands", "inspect"].iter().chain(arguments);
        graspd(all.copied().collect::<Vec<_>>())
    };
    inspect(&["allegro", "--hand-shape", "1"]).fails_at_once(&["`shape`", "only skinned hands"]);
    inspect(&["human", "--hand-shape", "1,1,1,1,1,1,1,1,1,1,1"])
        .fails_at_once(&["`shape`", "0 to 10 (parameters)"]);
    inspect(&["human", "--pose-components", "0"]).fails_at_once(&["`components`", "at least 1"]);
    let json = inspect(&["human", "--pose-components", "9", "--json"]).gives_json();
    assert_eq!(json["joints"].as_array().unwrap().len(), 9);
}

#[test]
fn packages_are_found_where_the_flag_says() {
    let folder = tempdir().unwrap();
    let (robot, elsewhere) = (folder.path().join("robot"), folder.path().join("elsewhere"));
    fs::create_dir_all(&robot).unwrap();
    fs::create_dir_all(elsewhere.join("claw_description/meshes")).unwrap();
    let cube = graspd_geom::box_mesh(nalgebra::Vector3::repeat(0.03), 0.03);
    graspd_mesh::save_mesh(&cube, elsewhere.join("claw_description/meshes/cube.stl")).unwrap();
    let shape = concat!(
        r#"<collision><geometry><mesh filename="package://claw_description/meshes/cube.stl"/>"#,
        "</geometry></collision>"
    );
    let joint = concat!(
        r#"<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.05"/>"#,
        r#"<axis xyz="1 0 0"/><limit lower="0" upper="1"/></joint>"#
    );
    let urdf = robot.join("claw.urdf");
    let text_of = format!(
        r#"<robot name="claw"><link name="a">{shape}</link><link name="b">{shape}</link>{joint}</robot>"#
    );
    fs::write(&urdf, text_of).unwrap();
    graspd(["hands", "inspect", text(&urdf)]).fails_at_once(&["cube.stl", "--package-path"]);
    let found = graspd([
        "hands",
        "inspect",
        text(&urdf),
        "--package-path",
        text(&elsewhere),
    ]);
    assert!(found.succeeds().contains("claw"));
    graspd(["hands", "inspect", text(&urdf), "--package-path", "no/such"])
        .fails_at_once(&["no/such", "no such folder"]);
    fs::write(robot.join("claw.toml"), "[plam]").unwrap();
    graspd(["hands", "inspect", text(&urdf)]).fails_at_once(&["claw.toml", "did you mean `palm`?"]);
}

#[test]
fn squeezes_and_retreats_out_of_range_are_refused_at_once() {
    for (flag, value, word) in [
        ("--retreat", "-1", "retreat"),
        ("--squeeze", "nan", "squeeze"),
        ("--squeeze-force", "1e9", "squeeze_force"),
    ] {
        graspd(["synth", flag, value]).fails_at_once(&[word]);
    }
}
