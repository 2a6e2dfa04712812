//! `graspd view`: its files, and what it refuses.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use graspd_mesh::{builtin_object, save_obj};
use serde_json::{Value, json};
use tempfile::tempdir;

use crate::outcome::{graspd, text};
use crate::shared_run::{GRASPS, RUN};

/// Width, height and number of colours of a PNG file.
fn picture(file: &Path) -> (usize, usize, usize) {
    let bytes = fs::read(file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let colors: BTreeSet<&[u8]> = pixels.chunks_exact(3).collect();
    (info.width as usize, info.height as usize, colors.len())
}

/// The description that a page holds.
fn description(html: &str) -> Value {
    let (_, after) = html.split_once("id=\"description\">").unwrap();
    let (json, _) = after.split_once("</script>").unwrap();
    serde_json::from_str(json).unwrap()
}

#[test]
fn the_page_holds_the_run_and_loads_nothing() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("page.html");
    let told = graspd(["view", text(&RUN.0), "-o", text(&file)]).succeeds();
    assert!(
        told.contains("page of 6 grasps") && told.contains("page.html"),
        "{told}"
    );
    let html = fs::read_to_string(&file).unwrap();
    // Addresses of namespaces and licences are text; nothing is fetched from them.
    for sign in [" src=", "<link rel=\"stylesheet\"", "@import", "url(http"] {
        assert!(!html.contains(sign), "{sign}");
    }
    assert!(html.contains("default-src 'none'"));
    assert!(
        html.contains("Copyright © 2010-2026 three.js authors"),
        "its licence comes along"
    );

    let page = description(&html);
    let grasps = page["grasps"].as_array().unwrap();
    assert_eq!(grasps.len(), GRASPS);
    assert_eq!(
        (&page["object_name"], &page["hand_name"]),
        (&json!("box"), &json!("allegro"))
    );
    for (place, grasp) in grasps.iter().enumerate() {
        assert_eq!(grasp["rank"], place + 1);
        let times = grasp["times"].as_array().unwrap();
        assert_eq!(
            (&times[0], times.last().unwrap()),
            (&json!(0.0), &json!(2.0))
        );
        // Three poses of 60 steps, and the grasp that came of them.
        assert_eq!(grasp["optimization"]["steps"], json!([0, 20, 40, 60]));
        let losses = &grasp["optimization"]["losses"]["values"];
        assert_eq!(
            (
                losses.as_array().unwrap().len(),
                losses[0].as_array().unwrap().len()
            ),
            (5, 3)
        );
    }
    // The contacts of a grasp share the squeeze's force.
    let contacts = grasps[0]["contacts"].as_array().unwrap();
    let size = |c: &Value| {
        (3..6)
            .map(|k| c[k].as_f64().unwrap().powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let total: f64 = contacts.iter().map(size).sum();
    assert!((total - 10.0).abs() < 0.1, "{total}");

    // By default, the page stands beside the records.
    let copy = folder.path().join("run");
    fs::create_dir(&copy).unwrap();
    fs::copy(RUN.0.join("grasps.jsonl"), copy.join("grasps.jsonl")).unwrap();
    graspd(["view", text(&copy), "-n", "2"]).succeeds();
    let page = description(&fs::read_to_string(copy.join("view.html")).unwrap());
    assert_eq!(page["grasps"].as_array().unwrap().len(), 2);
    assert_eq!(page["grasps"][0]["optimization"], Value::Null);
    assert_eq!(
        fs::read_dir(&copy).unwrap().count(),
        2,
        "nothing else is left"
    );
}

#[test]
fn sheets_and_strips_are_pictures() {
    let folder = tempdir().unwrap();
    let [sheet, strip, way] = ["sheet.png", "strip.png", "way.png"].map(|n| folder.path().join(n));
    let arguments = [
        "view",
        text(&RUN.0),
        "--png",
        text(&sheet),
        "-n",
        "4",
        "--columns",
        "2",
    ];
    let told = graspd([&arguments[..], &["--strip", text(&strip), "--grasp", "3"]].concat());
    let told = told.succeeds();
    assert!(
        told.contains("the best 4 of 6") && told.contains("grasp #3"),
        "{told}"
    );
    let (width, height, colors) = picture(&sheet);
    assert!(
        width > 2 * 380 && width < 3 * 380 && height > 2 * 320,
        "{width} {height}"
    );
    assert!(colors > 1000, "{colors}");
    // Four poses of 60 steps.
    let (width, height, colors) = picture(&strip);
    assert!(
        width > 4 * 300 && width < 5 * 300 && height > 300,
        "{width} {height}"
    );
    assert!(colors > 1000, "{colors}");
    assert!(!RUN.0.join("view.html").exists(), "a picture is not a page");

    // Without a trajectory, the way to the grasp.
    let records = folder.path().join("grasps.jsonl");
    fs::copy(RUN.0.join("grasps.jsonl"), &records).unwrap();
    graspd(["view", text(&records), "--strip", text(&way)]).succeeds();
    assert!(picture(&way).0 > 7 * 300);
}

#[test]
fn records_of_others_are_shown_as_far_as_they_go() {
    let folder = tempdir().unwrap();
    let first = fs::read_to_string(RUN.0.join("grasps.jsonl")).unwrap();
    let mut record: Value = serde_json::from_str(first.lines().next().unwrap()).unwrap();
    for field in [
        "pre_grasp",
        "squeeze",
        "metrics",
        "optimizer",
        "rank",
        "seconds",
        "seed",
    ] {
        record[field] = Value::Null;
    }
    let file = folder.path().join("theirs.jsonl");
    fs::write(&file, record.to_string()).unwrap();
    let sheet = folder.path().join("sheet.png");
    let page = folder.path().join("theirs.html");
    graspd([
        "view",
        text(&file),
        "--png",
        text(&sheet),
        "-o",
        text(&page),
    ])
    .succeeds();
    let page = description(&fs::read_to_string(page).unwrap());
    assert_eq!(page["grasps"][0]["times"], json!([1.0]));
    assert_eq!(page["columns"], json!([]));
    assert_eq!(page["grasps"][0]["rank"], Value::Null);
}

#[test]
fn what_cannot_be_shown_is_one_error() {
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    graspd(["view", text(&at("gone"))]).fails_at_once(&["gone", "no such folder", "graspd synth"]);
    graspd(["view", text(folder.path())]).fails_at_once(&["grasps.jsonl", "No such file"]);
    fs::write(at("grasps.jsonl"), "\n").unwrap();
    graspd(["view", text(folder.path())]).fails_at_once(&["it holds no grasp"]);

    let records = fs::read_to_string(RUN.0.join("grasps.jsonl")).unwrap();
    let first: Value = serde_json::from_str(records.lines().next().unwrap()).unwrap();
    let refused = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let mut record = first.clone();
        change(&mut record);
        fs::write(at("grasps.jsonl"), record.to_string()).unwrap();
        graspd(["view", text(folder.path())]).fails_at_once(parts);
        assert!(!at("view.html").exists());
    };
    refused(
        &|r| r["schema"] = json!("graspd.grasp/9"),
        &["graspd.grasp/9", "not known"],
    );
    let moved = at("moved.obj");
    refused(
        &|r| r["object_path"] = json!(text(&moved)),
        &["moved.obj", "--object"],
    );
    refused(&|r| r["hand"] = json!("claw"), &["claw", "--hand"]);
    refused(
        &|r| r["pre_grasp"]["joints_rad"] = json!({}),
        &["`pre_grasp.joints_rad` lacks the joint"],
    );
    refused(
        &|r| r["pose"]["rotation_wxyz"] = json!([0, 0, 0, 0]),
        &["zero quaternion"],
    );
    refused(
        &|r| r["pose"]["translation_m"] = json!([0, 0, 1e9]),
        &["grasp", "m away"],
    );

    fs::write(at("grasps.jsonl"), first.to_string()).unwrap();
    fs::write(at("trajectory.npz"), "no archive").unwrap();
    graspd(["view", text(folder.path())]).fails_at_once(&["trajectory.npz", "remove it"]);
    fs::remove_file(at("trajectory.npz")).unwrap();
    let output = at("gone").join("page.html");
    graspd(["view", text(folder.path()), "-o", text(&output)]).fails_at_once(&["page.html", "-o"]);
    let strip = at("strip.png");
    graspd([
        "view",
        text(folder.path()),
        "--strip",
        text(&strip),
        "--grasp",
        "77",
    ])
    .fails_at_once(&["no grasp has the index 77", "--grasp"]);
    graspd(["view", text(folder.path()), "-n", "0"]).fails_as_wrong_usage("0");
    graspd(["view", text(folder.path()), "--grasp", "1"]).fails_as_wrong_usage("--strip");

    // The trajectory of another hand.
    let mesh = at("box.obj");
    save_obj(&builtin_object("box").unwrap(), &mesh).unwrap();
    fs::copy(RUN.0.join("trajectory.npz"), at("trajectory.npz")).unwrap();
    let mut record = first.clone();
    record["hand"] = json!("barrett");
    record["joints_rad"] = Value::Null;
    record["mano"] = json!({"pca": []});
    record["pre_grasp"] = Value::Null;
    record["squeeze"] = Value::Null;
    fs::write(at("grasps.jsonl"), record.to_string()).unwrap();
    graspd(["view", text(folder.path())]).fails_at_once(&["trajectory.npz", "`articulation`"]);
}
