//! `graspd export`: what others read.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use graspd::read_records;
use graspd_hand::load_hand;
use graspd_mesh::load_mesh;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, RowAccessor};
use serde_json::Value;

use crate::outcome::{graspd, text};
use crate::shared_run::{GRASPS, RUN, lines};

/// A dataset of two hands, shared by the tests.
static DATASET: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graspd-export");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let manifest = folder.join("manifest.toml");
    let content = "objects = [\"box\", \"can\"]\nhands = [\"allegro\", \"human\"]\nstarts = 2\npreset = \"paper\"\n\
        sdf_resolution = 24\n[settings]\nsteps = 20\n[evaluation]\nmetrics = \"ca,pd\"\n";
    fs::write(&manifest, content).unwrap();
    let dataset = folder.join("dataset");
    graspd([
        "batch",
        text(&manifest),
        "-q",
        "--no-report",
        "-o",
        text(&dataset),
    ])
    .succeeds();
    dataset
});

fn export(grasps: &Path, format: &str, output: &Path, flags: &[&str]) -> Vec<PathBuf> {
    let arguments = [
        "export",
        text(grasps),
        "--format",
        format,
        "--json",
        "-o",
        text(output),
    ];
    let report = graspd([&arguments[..], flags].concat()).gives_json();
    let files = report["files"].as_array().unwrap();
    files
        .iter()
        .map(|file| PathBuf::from(file.as_str().unwrap()))
        .collect()
}

/// A Python interpreter that has a package: `GRASPD_PYTHON`, the one of `target/engines`, or `python3`. Says so where
/// there is none.
pub(crate) fn python_with(package: &str) -> Option<PathBuf> {
    let engines = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/engines/bin/python");
    let named = std::env::var_os("GRASPD_PYTHON").map(PathBuf::from);
    let candidates = [named, Some(engines), Some("python3".into())];
    let has = |python: &PathBuf| {
        let output = Command::new(python)
            .args(["-c", &format!("import {package}")])
            .output();
        output.is_ok_and(|output| output.status.success())
    };
    let found = candidates.into_iter().flatten().find(has);
    if found.is_none() {
        eprintln!("SKIPPED: no Python with {package}; name one that has it with GRASPD_PYTHON");
    }
    found
}

/// Runs a script; gives what it printed as JSON.
fn run_python(python: &Path, script: &str, arguments: &[&str]) -> Value {
    let output = Command::new(python)
        .args(["-W", "error", "-c", script])
        .args(arguments)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn parquet_has_a_row_for_each_grasp() {
    let folder = tempfile::tempdir().unwrap();
    let files = export(&DATASET, "parquet", folder.path(), &[]);
    assert_eq!(files, [folder.path().join("grasps.parquet")]);
    let reader = SerializedFileReader::new(fs::File::open(&files[0]).unwrap()).unwrap();
    let rows: Vec<_> = reader
        .get_row_iter(None)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(rows.len(), 8);
    let names: Vec<String> = rows[0]
        .get_column_iter()
        .map(|(name, _)| name.clone())
        .collect();
    let column = |name: &str| names.iter().position(|other| other == name).unwrap();
    let mut row = rows.iter();
    for run in lines(&DATASET.join("runs.jsonl")) {
        let run = run["run"].as_str().unwrap();
        for record in read_records(&DATASET.join("runs").join(run).join("grasps.jsonl")).unwrap() {
            let row = row.next().unwrap();
            assert_eq!(row.get_string(column("run")).unwrap(), run);
            assert_eq!(row.get_string(column("hand")).unwrap(), &record.hand);
            assert_eq!(row.get_long(column("index")).unwrap(), record.index as i64);
            let area = record.metrics.as_ref().unwrap().contact_area_cm2.unwrap();
            assert_eq!(row.get_double(column("contact_area_cm2")).unwrap(), area);
            // Not asked for, and not 0.
            assert!(row.get_double(column("epsilon")).is_err());
            let numbers = |name: &str| {
                let list = row.get_list(column(name)).unwrap();
                list.elements()
                    .iter()
                    .map(|field| match field {
                        Field::Double(number) => *number,
                        other => panic!("{other:?} is no number"),
                    })
                    .collect::<Vec<_>>()
            };
            assert_eq!(numbers("translation_m"), record.pose.translation_m);
            let hand = load_hand(&record.hand).unwrap();
            let pose = record.hand_pose(hand.articulation_names()).unwrap();
            assert_eq!(numbers("joints"), pose.articulation);
        }
    }
    assert!(row.next().is_none());
}

#[test]
fn parquet_is_read_by_others() {
    let Some(python) = python_with("pyarrow.parquet") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let files = export(&RUN.0, "parquet", folder.path(), &[]);
    let script = "import sys, json, pyarrow.parquet as pq\n\
        t = pq.read_table(sys.argv[1]).to_pylist()\n\
        print(json.dumps(t))";
    let table = run_python(&python, script, &[text(&files[0])]);
    let records = lines(&RUN.0.join("grasps.jsonl"));
    assert_eq!(table.as_array().unwrap().len(), GRASPS);
    for (row, record) in table.as_array().unwrap().iter().zip(&records) {
        assert_eq!(
            (&row["index"], &row["object"]),
            (&record["index"], &record["object"])
        );
        assert_eq!(row["epsilon"], record["metrics"]["epsilon"]);
        assert_eq!(row["rotation_wxyz"], record["pose"]["rotation_wxyz"]);
        for (name, value) in row["joint_names"]
            .as_array()
            .unwrap()
            .iter()
            .zip(row["joints"].as_array().unwrap())
        {
            assert_eq!(*value, record["joints_rad"][name.as_str().unwrap()]);
        }
        assert_eq!(
            (&row["run"], &row["object_path"]),
            (&Value::Null, &Value::Null)
        );
        assert_eq!(row["squeeze_torques_nm"].as_array().unwrap().len(), 16);
    }
}

#[test]
fn joints_come_in_the_order_of_the_hand() {
    let folder = tempfile::tempdir().unwrap();
    let files = export(&DATASET, "csv", folder.path(), &["--top-k", "1"]);
    let names: Vec<_> = files
        .iter()
        .map(|file| file.file_name().unwrap().to_str().unwrap())
        .collect();
    assert_eq!(names, ["joints_allegro.csv", "joints_human.csv"]);
    for (file, hand) in files.iter().zip(["allegro", "human"]) {
        let table = fs::read_to_string(file).unwrap();
        let mut rows = table.lines();
        let header: Vec<&str> = rows.next().unwrap().split(',').collect();
        assert_eq!(
            header[..15].join(","),
            "run,object,object_scale,hand,seed,index,rank,stage,x_m,y_m,z_m,qw,qx,qy,qz"
        );
        assert_eq!(header[15..], *load_hand(hand).unwrap().articulation_names());
        let rows: Vec<Vec<&str>> = rows.map(|row| row.split(',').collect()).collect();
        assert_eq!(rows.len(), 2 * 3);
        for (row, stage) in rows
            .iter()
            .zip(["pre_grasp", "grasp", "squeeze"].iter().cycle())
        {
            assert_eq!((row.len(), row[7]), (header.len(), *stage));
            assert!(
                row[8..]
                    .iter()
                    .all(|cell| cell.parse::<f64>().unwrap().is_finite())
            );
        }
        let records =
            read_records(&DATASET.join("runs").join(rows[0][0]).join("grasps.jsonl")).unwrap();
        let joints = records[0].joints_rad.as_ref().unwrap();
        for (name, cell) in header[15..].iter().zip(&rows[1][15..]) {
            assert_eq!(joints[*name], cell.parse::<f64>().unwrap());
        }
    }
}

#[test]
fn gltf_shows_hand_and_object_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let files = export(&DATASET, "gltf", folder.path(), &[]);
    // The best of each run.
    assert_eq!(files.len(), 4);
    let run = "00001_can_allegro_0";
    let records = read_records(&DATASET.join("runs").join(run).join("grasps.jsonl")).unwrap();
    let file = folder
        .path()
        .join(format!("{run}_{:03}.glb", records[0].index));
    let read = load_mesh(&file).unwrap();
    let hand = load_hand("allegro").unwrap();
    let mut both = graspd_mesh::builtin_object("can").unwrap();
    both.append(&hand.surface(&records[0].hand_pose(hand.articulation_names()).unwrap()));
    let ((low, high), (read_low, read_high)) = (both.bounds().unwrap(), read.bounds().unwrap());
    assert!((low - read_low).norm() < 1e-6 && (high - read_high).norm() < 1e-6);
}

#[test]
fn numpy_reads_what_dexgraspnet_reads() {
    let folder = tempfile::tempdir().unwrap();
    let files = export(&DATASET, "npy", folder.path(), &[]);
    assert_eq!(files.len(), 4);
    let Some(python) = python_with("numpy") else {
        return;
    };
    // The rotation as DexGraspNet's own scripts take it: fixed axes x, y, z.
    let script = "import sys, json, numpy as np\n\
        data = np.load(sys.argv[1], allow_pickle=True)\n\
        assert data.dtype == object and data.shape == (2,), (data.dtype, data.shape)\n\
        def about(axis, angle):\n\
        \x20   c, s = np.cos(angle), np.sin(angle); m = np.eye(3); i, j = [(1, 2), (2, 0), (0, 1)][axis]\n\
        \x20   m[i, i] = m[j, j] = c; m[i, j] = -s; m[j, i] = s; return m\n\
        out = []\n\
        for grasp in data.tolist():\n\
        \x20   q = grasp['qpos']\n\
        \x20   r = about(2, q['WRJRz']) @ about(1, q['WRJRy']) @ about(0, q['WRJRx'])\n\
        \x20   out.append(dict(grasp, rotation=r.tolist()))\n\
        print(json.dumps(out))";
    let file = folder.path().join("allegro/can.npy");
    let grasps = run_python(&python, script, &[text(&file)]);
    let records = read_records(&DATASET.join("runs/00001_can_allegro_0/grasps.jsonl")).unwrap();
    let hand = load_hand("allegro").unwrap();
    for (grasp, record) in grasps.as_array().unwrap().iter().zip(&records) {
        assert_eq!(
            (&grasp["scale"], &grasp["index"]),
            (&1.0.into(), &record.index.into())
        );
        let qpos = &grasp["qpos"];
        for (name, value) in record.joints_rad.as_ref().unwrap() {
            assert_eq!(qpos[name].as_f64().unwrap(), *value);
        }
        assert_eq!(
            qpos["WRJTz"].as_f64().unwrap(),
            record.pose.translation_m[2]
        );
        let pose = record.hand_pose(hand.articulation_names()).unwrap();
        let rotation = nalgebra::UnitQuaternion::from(pose.rotation).to_rotation_matrix();
        for row in 0..3 {
            for column in 0..3 {
                let found = grasp["rotation"][row][column].as_f64().unwrap();
                assert!((found - rotation[(row, column)]).abs() < 1e-12);
            }
        }
        let area = record.metrics.as_ref().unwrap().contact_area_cm2.unwrap();
        assert_eq!(grasp["metrics"]["contact_area_cm2"].as_f64().unwrap(), area);
        assert_eq!(grasp["metrics"]["epsilon"], Value::Null);
    }
}

#[test]
fn a_mujoco_scene_loads_and_holds() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let flags = [
        "-n",
        "2",
        "--preset",
        "fast",
        "--resolution",
        "64",
        "--set",
        "evaluation.metrics=sd",
        "-q",
    ];
    graspd([&["synth", "box", "-o", text(&run)][..], &flags].concat()).succeeds();
    let files = export(&run, "mjcf", &folder.path().join("scenes"), &[]);
    assert_eq!(files.len(), 1);
    let best = &lines(&run.join("grasps.jsonl"))[0];
    let moved = best["metrics"]["sim_displacement_cm"].as_f64().unwrap();
    assert!(moved < 0.5, "the grasp itself does not hold: {moved} cm");
    let Some(python) = python_with("mujoco") else {
        return;
    };
    // As long as the simulation displacement, and without the hand for comparison.
    let script = "import sys, json, mujoco, numpy as np\n\
        def fall(hold):\n\
        \x20   model = mujoco.MjModel.from_xml_path(sys.argv[1]); data = mujoco.MjData(model)\n\
        \x20   if not hold: model.geom_contype[:] = 0; model.geom_conaffinity[:] = 0\n\
        \x20   body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, 'object')\n\
        \x20   mujoco.mj_forward(model, data); start = data.xipos[body].copy()\n\
        \x20   for _ in range(35): mujoco.mj_step(model, data)\n\
        \x20   mujoco.mj_forward(model, data)\n\
        \x20   return 100 * float(np.linalg.norm(data.xipos[body] - start)), float(model.body_mass[body])\n\
        print(json.dumps([fall(True), fall(False)]))";
    let answer = run_python(&python, script, &[text(&files[0])]);
    let number = |i: usize, j: usize| answer[i][j].as_f64().unwrap();
    println!("held {} cm, free {} cm", number(0, 0), number(1, 0));
    assert!((number(0, 1) - 1.0).abs() < 1e-6, "1 kg");
    assert!(number(0, 0) < 0.5, "it moves {} cm", number(0, 0));
    assert!(
        (number(1, 0) - 10.4).abs() < 0.5,
        "free fall of {} cm",
        number(1, 0)
    );
}

#[test]
fn exports_tell_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = text(folder.path());
    graspd(["export", path, "--format", "csv"])
        .fails_at_once(&[path, "neither grasps.jsonl nor runs"]);
    graspd(["export", path, "--format", "xls"]).fails_as_wrong_usage("parquet");
    graspd(["export", path]).fails_as_wrong_usage("--format");
    let run = text(&RUN.0);
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let into = graspd(["export", run, "--format", "csv", "-o", text(&file)]);
    into.fails_at_once(&[text(&file), "-o"]);
    graspd(["export", run, "--format", "csv", "--top-k", "0", "-o", path])
        .fails_at_once(&["--top-k"]);
}
