//! `graspd gws`: epsilon and volume of wrench sets in files.

use std::io::Write;
use std::process::Stdio;

use serde_json::Value;
use tempfile::tempdir;

use crate::outcome::{command, graspd, outcome, text};

/// The twelve unit wrenches: their hull is the cross-polytope.
const CROSS: &str = "1,0,0,0,0,0\n-1,0,0,0,0,0\n0,1,0,0,0,0\n0,-1,0,0,0,0\n0,0,1,0,0,0\n0,0,-1,0,0,0\n\
0,0,0,1,0,0\n0,0,0,-1,0,0\n0,0,0,0,1,0\n0,0,0,0,-1,0\n0,0,0,0,0,1\n0,0,0,0,0,-1\n";

/// Rounding in depths and volumes of order 1.
const ROUNDING: f64 = 1e-12;

fn report(wrenches: &str, more: &[&str]) -> Value {
    let folder = tempdir().unwrap();
    let file = folder.path().join("w.csv");
    std::fs::write(&file, wrenches).unwrap();
    graspd([&["gws", text(&file), "--json"], more].concat()).gives_json()
}

fn number(report: &Value, key: &str) -> f64 {
    report[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} in {report}"))
}

#[test]
fn the_cross_polytope_has_its_epsilon_and_volume() {
    let plain = report(CROSS, &[]);
    assert_eq!(plain["wrenches"], 12);
    for key in ["epsilon", "epsilon_lower", "epsilon_upper"] {
        assert!((number(&plain, key) - 1.0 / 6f64.sqrt()).abs() < ROUNDING);
    }
    assert!(plain["epsilon_reason"].is_null());
    assert!((number(&plain, "volume") - 64.0 / 720.0).abs() < ROUNDING);
    assert_eq!(plain["volume_method"], "exact");
    // Names, blank lines, spaces, the line ends of Windows and a byte order mark do not matter.
    let dressed = format!(
        "\u{feff}fx,fy,fz,tx,ty,tz\r\n\r\n{}\r\n",
        CROSS.replace('\n', "\r\n").replace(',', " , ")
    );
    assert_eq!(report(&dressed, &[]), plain);
}

/// With a limit for each wrench the hull becomes the cube [-1, 1]^6.
#[test]
fn each_contact_may_have_its_own_limit() {
    let cube = report(CROSS, &["--per-contact", "1"]);
    assert_eq!(cube["force_limit"], "each");
    assert!((number(&cube, "epsilon") - 1.0).abs() < 1e-6);
}

#[test]
fn a_table_is_for_people_and_a_pipe_will_do() {
    let mut child = command(["gws", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(CROSS.as_bytes()).unwrap();
    drop(stdin);
    let told = outcome(child.wait_with_output().unwrap()).succeeds();
    assert!(told.contains("epsilon  0.408248290464"), "{told}");
    assert!(told.contains("volume   0.088888888889  exact"), "{told}");
}

#[test]
fn sets_without_force_closure_say_why() {
    let none = report("", &[]);
    assert_eq!(
        (number(&none, "epsilon"), number(&none, "volume")),
        (0.0, 0.0)
    );
    assert!(
        none["epsilon_reason"]
            .as_str()
            .unwrap()
            .contains("does not touch")
    );
    let six: Vec<_> = CROSS.lines().take(6).collect();
    let flat = report(&six.join("\n"), &[]);
    assert_eq!(
        (number(&flat, "epsilon"), number(&flat, "volume")),
        (0.0, 0.0)
    );
    assert!(
        flat["epsilon_reason"]
            .as_str()
            .unwrap()
            .contains("of 6 dimensions")
    );
    let shifted = CROSS
        .replace("0\n", "2\n")
        .replace(",-1\n", ",2\n")
        .replace(",1\n", ",3\n");
    let outside = report(&shifted, &[]);
    assert_eq!(number(&outside, "epsilon"), 0.0);
    assert!(
        outside["epsilon_reason"]
            .as_str()
            .unwrap()
            .contains("cannot balance")
    );
    assert!(number(&outside, "volume") > 0.0);
}

#[test]
fn a_reference_set_agrees_and_a_large_one_is_estimated() {
    let Some(file) = graspd_geom::shared_file("reference/gws/N8.csv") else {
        return;
    };
    let told = graspd(["gws", text(&file), "--json"]).gives_json();
    assert!((number(&told, "epsilon") / 0.5171636478171653 - 1.0).abs() < 1e-9);
    assert!((number(&told, "volume") / 3.99164186015814 - 1.0).abs() < 1e-9);
    let Some(file) = graspd_geom::shared_file("reference/gws/N64.csv") else {
        return;
    };
    let arguments = ["gws", text(&file), "--json", "--volume-accuracy", "0.05"];
    let told = graspd(arguments).gives_json();
    assert_eq!(told["volume_method"], "sampled");
    let (lower, upper) = (number(&told, "volume_lower"), number(&told, "volume_upper"));
    // Twice the interval: 4 standard deviations.
    let half = upper - lower;
    assert!((number(&told, "volume") - 9.629431936832104).abs() < half);
    assert!(half < 0.101 * number(&told, "volume"));
}

#[test]
fn faults_are_named_with_their_line_and_a_remedy() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("bad.csv");
    for (content, parts) in [
        ("1,2,3,4,5\n", ["line 1: 5 fields", "six numbers"]),
        (
            "fx,fy,fz,tx,ty,tz\n\n1,2,3,4,5,6\n1,2,x3,4,5,6\n",
            ["line 4: `x3`", "finite"],
        ),
        (
            "1,2,3,4,5,6\nfx,fy,fz,tx,ty,tz\n",
            ["line 2: `fx`", "finite"],
        ),
        ("1,2,3,4,5,nan\n", ["line 1: `nan`", "finite"]),
        ("1,2,3,4,5,1e999\n", ["line 1: `1e999`", "finite"]),
        ("1;2;3;4;5;6\n1,2,3,4,5,6\n", ["line 1: 1 fields", "commas"]),
    ] {
        std::fs::write(&file, content).unwrap();
        graspd(["gws", text(&file)]).fails_at_once(&[&["bad.csv"], &parts[..]].concat());
    }
    std::fs::write(&file, b"\xff\xfe1,2").unwrap();
    graspd(["gws", text(&file)]).fails_at_once(&["bad.csv", "text file"]);
    std::fs::write(&file, CROSS).unwrap();
    graspd(["gws", text(&file), "--per-contact", "5"])
        .fails_at_once(&["12 wrenches", "--per-contact"]);
    graspd(["gws", text(&file), "--volume-accuracy", "0"]).fails_at_once(&["--volume-accuracy"]);
    graspd(["gws", "missing.csv"]).fails_at_once(&["missing.csv", "cannot be read"]);
    graspd(["gws", text(folder.path())]).fails_at_once(&["cannot be read"]);
    graspd(["gws", text(&file), "--per-contact", "0"]).fails_as_wrong_usage("--per-contact");
    graspd(["gws"]).fails_as_wrong_usage("WRENCHES");
}
