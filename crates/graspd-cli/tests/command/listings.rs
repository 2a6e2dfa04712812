//! What is built in, what a hand's file holds, and what each command says of itself.

use graspd_geom::shared_file;
use graspd_hand::BUILTIN_HANDS;
use graspd_mesh::BUILTIN_OBJECTS;

use crate::outcome::{graspd, text};

#[test]
fn objects() {
    let table = graspd(["objects"]).succeeds();
    assert_eq!(table.lines().count(), BUILTIN_OBJECTS.len());
    let json = graspd(["objects", "--json"]).gives_json();
    for ((object, line), entry) in BUILTIN_OBJECTS
        .iter()
        .zip(table.lines())
        .zip(json.as_array().unwrap())
    {
        assert!(
            line.starts_with(object.name) && line.contains(object.description),
            "{line}"
        );
        assert_eq!(entry["name"], object.name);
        let size_mm = entry["size_mm"][0].as_f64().unwrap();
        assert!((size_mm - 1000.0 * object.dimensions[0]).abs() < 1.0);
        assert!(entry["volume_cm3"].as_f64().unwrap() > 10.0);
    }
}

#[test]
fn hands() {
    let table = graspd(["hands"]).succeeds();
    let json = graspd(["hands", "--json"]).gives_json();
    for (hand, entry) in BUILTIN_HANDS.iter().zip(json.as_array().unwrap()) {
        assert!(
            table.contains(hand.name) && table.contains(hand.description),
            "{table}"
        );
        assert_eq!(entry["name"], hand.name);
    }
    assert!(table.contains("URDF"), "{table}");
}

#[test]
fn the_built_in_hand_in_detail() {
    let described = graspd(["hands", "inspect", "allegro"]).succeeds();
    for part in [
        "allegro",
        "joints (16)",
        "joint_0.0",
        "contact points",
        "self-collision",
        "palm normal",
    ] {
        assert!(described.contains(part), "no {part} in {described}");
    }
    let json = graspd(["hands", "inspect", "allegro", "--json"]).gives_json();
    assert_eq!(
        json,
        graspd(["hands", "--json", "inspect", "allegro"]).gives_json()
    );
    let joints = json["joints"].as_array().unwrap();
    assert_eq!(joints.len(), 16);
    for joint in joints {
        let value = |name: &str| joint[name].as_f64().unwrap();
        assert!(
            value("lower") <= value("open") && value("open") <= value("upper"),
            "{joint}"
        );
    }
    let per_body = json["bodies"].as_array().unwrap().iter();
    let sum: u64 = per_body
        .map(|body| body["contact_points"].as_u64().unwrap())
        .sum();
    assert!(sum > 100 && sum <= json["contact_points"].as_u64().unwrap());
}

#[test]
fn hands_from_files_in_detail() {
    for (file, joints) in [
        ("data/hands/allegro_hand/allegro_hand_right.urdf", 16),
        ("data/hands/leap_hand/leap_hand_right.urdf", 16),
    ] {
        let Some(path) = shared_file(file) else {
            return;
        };
        let json = graspd(["hands", "inspect", text(&path), "--json"]).gives_json();
        assert_eq!(json["joints"].as_array().unwrap().len(), joints, "{file}");
        assert!(json["contact_points"].as_u64().unwrap() > 100, "{file}");
        let described = graspd(["hands", "inspect", text(&path)]).succeeds();
        assert!(
            described.contains(json["name"].as_str().unwrap()),
            "{described}"
        );
    }
}

#[test]
fn every_command_explains_its_flags() {
    for (name, flags) in [
        (
            "synth",
            "OBJECT --hand -n --top-k --seed --preset --steps --threads -o --scale --resolution --png --meshes \
             --trajectory --json --quiet",
        ),
        (
            "eval",
            "GRASPS --object --metrics --scale --hand -o --threads --json --quiet",
        ),
        (
            "sdf",
            "OBJECT --resolution --padding -o --scale --threads --json --quiet",
        ),
        (
            "view",
            "GRASPS --output --png --strip --grasp --count --columns --object --hand --no-repair",
        ),
        ("gws", "WRENCHES --per-contact --volume-accuracy --json"),
        ("hands", "inspect --json"),
        ("objects", "--json"),
    ] {
        let help = graspd([name, "--help"]).succeeds();
        for flag in flags.split_whitespace() {
            assert!(help.contains(flag), "{name} --help does not mention {flag}");
        }
        assert_eq!(graspd(["help", name]).succeeds(), help);
        assert!(
            graspd(["help"])
                .succeeds()
                .contains(&format!("\n  {name} ")),
            "{name}"
        );
        assert!(
            graspd([name, "--version"])
                .succeeds()
                .contains(env!("CARGO_PKG_VERSION"))
        );
    }
    let synth = graspd(["synth", "--help"]).succeeds();
    for value in [
        "[default: mug]",
        "[default: 10]",
        "[default: 256]",
        "default, fast, soft, paper",
    ] {
        assert!(synth.contains(value), "no {value} in {synth}");
    }
}

#[test]
fn version() {
    let version = graspd(["--version"]).succeeds();
    assert_eq!(version, format!("graspd {}\n", env!("CARGO_PKG_VERSION")));
}
