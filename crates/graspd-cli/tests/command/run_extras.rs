//! What `graspd synth` leaves on request: meshes, trajectories, a picture, fewer grasps.

use std::collections::BTreeSet;
use std::fs;

use graspd::read_records;
use graspd_geom::require_closed;
use graspd_hand::load_hand;
use graspd_mesh::{builtin_object, load_mesh, save_obj};
use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;
use serde_json::Value;
use tempfile::tempdir;

use crate::outcome::{command, graspd, outcome, text};
use crate::shared_run::{GRASPS, RUN, lines};

#[test]
fn meshes_are_closed_and_in_one_frame() {
    let folder = RUN.0.join("meshes");
    let object = load_mesh(folder.join("object.obj")).unwrap();
    assert_eq!(Some(object), builtin_object("box"));
    let hand = load_hand("allegro").unwrap();
    let records = read_records(&RUN.0.join("grasps.jsonl")).unwrap();
    assert_eq!(fs::read_dir(&folder).unwrap().count(), GRASPS + 1);
    for record in records {
        let name = format!("{:03}_hand.obj", record.index);
        let mesh = load_mesh(folder.join(&name)).unwrap();
        require_closed(&mesh, &name).unwrap();
        // The pose maps hand coordinates to the object's.
        let pose = record.hand_pose(hand.articulation_names()).unwrap();
        assert_eq!(mesh, hand.surface(&pose));
    }
}

#[test]
fn trajectories_have_the_documented_shapes() {
    let file = fs::File::open(RUN.0.join("trajectory.npz")).unwrap();
    let mut npz = NpzReader::new(file).unwrap();
    let index: Array1<u64> = npz.by_name("index").unwrap();
    let step: Array1<u64> = npz.by_name("step").unwrap();
    let translation: Array2<f64> = npz.by_name("translation_m").unwrap();
    let rotation: Array2<f64> = npz.by_name("rotation_wxyz").unwrap();
    let articulation: Array2<f64> = npz.by_name("articulation").unwrap();
    let losses: Array2<f64> = npz.by_name("losses").unwrap();
    // Every 20 of 60 steps.
    let rows = 3 * GRASPS;
    assert_eq!((index.len(), translation.dim()), (rows, (rows, 3)));
    assert_eq!(
        (rotation.dim(), articulation.dim(), losses.dim()),
        ((rows, 4), (rows, 16), (rows, 5))
    );
    let records = lines(&RUN.0.join("grasps.jsonl"));
    for row in 0..rows {
        assert_eq!(step[row], 20 * (row as u64 % 3));
        assert_eq!(records[row / 3]["index"], index[row]);
        let q = rotation.row(row);
        assert!((q.dot(&q) - 1.0).abs() < 1e-9);
    }
    // The start: the open hand, not yet moved.
    let hand = load_hand("allegro").unwrap();
    assert_eq!(articulation.row(0).to_vec(), hand.open_articulation());
    assert_ne!(translation.row(0), translation.row(2));
    assert!(losses.iter().all(|loss| loss.is_finite()));
}

#[test]
fn the_picture_shows_something() {
    let file = fs::read(RUN.0.join("best.png")).unwrap();
    assert_eq!(file[..8], *b"\x89PNG\r\n\x1a\n");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&file))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let width = info.width as usize;
    let bytes = info.line_size / width;
    // Below the views stands a caption.
    assert!(width >= 3 * 640 && (641..760).contains(&info.height));
    // Each of the three views, side by side, has the shades of a lit thing.
    for view in 0..3 {
        let colors: BTreeSet<&[u8]> = pixels
            .chunks_exact(bytes)
            .enumerate()
            .filter(|(pixel, _)| 3 * (pixel % width) / width == view)
            .map(|(_, color)| color)
            .collect();
        assert!(
            colors.len() > 50,
            "view {view} has {} colours",
            colors.len()
        );
    }
}

#[test]
fn the_best_k_are_kept_and_nothing_of_an_earlier_run() {
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    let meshes = run.join("meshes");
    fs::create_dir_all(&meshes).unwrap();
    let stale = [meshes.join("004_hand.obj"), run.join("trajectory.npz")];
    let mine = [meshes.join("my_hand.obj"), run.join("notes.txt")];
    for file in stale.iter().chain(&mine) {
        fs::write(file, "").unwrap();
    }
    let arguments = [
        "synth",
        "box",
        "--steps",
        "30",
        "--resolution",
        "24",
        "-n",
        "3",
        "--top-k",
        "2",
        "--meshes",
    ];
    let quiet = graspd([&arguments[..], &["--quiet", "-o", text(&run)]].concat());
    assert_eq!(quiet.stderr, "");
    let table = quiet.succeeds();
    assert!(
        table.contains("SD cm") && table.contains("3 grasps in"),
        "{table}"
    );

    let records = lines(&run.join("grasps.jsonl"));
    assert_eq!(
        records
            .iter()
            .map(|r| r["rank"].as_u64().unwrap())
            .collect::<Vec<_>>(),
        [1, 2]
    );
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(run.join("summary.json")).unwrap()).unwrap();
    assert_eq!(
        (&summary["all"]["grasps"], &summary["top_2"]["grasps"]),
        (&3.into(), &2.into())
    );
    let hands = fs::read_dir(&meshes).unwrap().filter(|entry| {
        let name = entry.as_ref().unwrap().file_name();
        name.to_str().unwrap().starts_with('0')
    });
    assert_eq!(hands.count(), 2);
    assert!(stale.iter().all(|file| !file.exists()));
    assert!(mine.iter().all(|file| file.exists()));
}

#[test]
fn files_are_objects_too_and_dir_is_grasps_by_default() {
    let folder = tempdir().unwrap();
    let mesh = builtin_object("can").unwrap().scaled(1000.0);
    save_obj(&mesh, folder.path().join("tin.v2.obj")).unwrap();
    let arguments = [
        "synth",
        "tin.v2.obj",
        "--scale",
        "1e-3",
        "-n",
        "1",
        "--steps",
        "30",
        "--resolution",
        "24",
        "--meshes",
    ];
    let run = command(arguments)
        .current_dir(folder.path())
        .output()
        .unwrap();
    let table = outcome(run).succeeds();
    assert!(table.contains("1 grasp in"), "{table}");
    let run = folder.path().join("grasps");
    let records = lines(&run.join("grasps.jsonl"));
    assert_eq!(
        (&records[0]["object"], &records[0]["object_path"]),
        (&"tin.v2".into(), &"tin.v2.obj".into())
    );
    assert_eq!(records[0]["object_scale"], 0.001);
    // The object's frame is the mesh's own, after scaling.
    let object = load_mesh(run.join("meshes/object.obj")).unwrap();
    assert_eq!(object.vertices, mesh.scaled(1e-3).vertices);
}

#[test]
fn settings_from_a_file_and_parts_left_out_are_in_the_run() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("soft.toml");
    fs::write(&file, "[settings]\ntask_limit = 2e-4\nwarmup_steps = 10\n").unwrap();
    let run = folder.path().join("run");
    let flags = ["--steps", "30", "--resolution", "32", "-n", "3", "-q"];
    let more = ["--without", "mdmm", "--without", "leaky-gradient"];
    let kept = ["--top-k", "2", "--diverse"];
    let arguments = [
        &["synth", "can", "--preset", "paper"][..],
        &flags,
        &more,
        &kept,
    ]
    .concat();
    let paths = ["--config", text(&file), "-o", text(&run)];
    graspd([&arguments[..], &paths].concat()).succeeds();
    let written: toml::Table = fs::read_to_string(run.join("run.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let settings = &written["settings"];
    assert_eq!(settings["task_limit"].as_float(), Some(2e-4));
    // Stretched with the preset's schedules from 7000 steps to 30.
    assert_eq!(settings["warmup_steps"].as_integer(), Some(0));
    assert_eq!(settings["leak"].as_float(), Some(0.0));
    let weight = settings["constraint_method"]["penalty"]["weight"].as_float();
    assert_eq!(weight, Some(1.0));
    let name = "paper-without-mdmm-without-leaky-gradient";
    assert_eq!(settings["preset"].as_str(), Some(name));

    let records = lines(&run.join("grasps.jsonl"));
    assert_eq!(records.len(), 2);
    assert_eq!(records[0]["rank"], 1);
    assert_eq!(records[0]["optimizer"]["preset"], name);
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(run.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["all"]["grasps"], 3);
    // Of two grasps there is one distance.
    let diversity = &summary["diversity"];
    assert!(diversity["least_distance_mm"].as_f64().unwrap() > 1.0);
    assert_eq!(
        diversity["least_distance_mm"],
        diversity["mean_distance_mm"]
    );
}

#[test]
fn annealing_makes_records_like_any_other() {
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    let flags = [
        "--steps",
        "100",
        "--resolution",
        "32",
        "-n",
        "1",
        "-q",
        "--trajectory",
    ];
    let arguments = [
        &["synth", "can", "--preset", "annealing", "-o", text(&run)][..],
        &flags,
    ];
    graspd(arguments.concat()).succeeds();
    let records = lines(&run.join("grasps.jsonl"));
    assert!(records[0]["metrics"]["sim_displacement_cm"].is_number());
    assert!(records[0]["optimizer"].is_null());
}
