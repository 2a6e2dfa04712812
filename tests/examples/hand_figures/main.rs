//! The figures and pictures of every hand in `lab/hands.md`: one object, as `graspd synth OBJECT --hand HAND -n
//! COUNT` grasps it.
//!
//! `cargo run --release -p graspd-tests --example hand_figures -- OBJECT FOLDER [COUNT] [PRESET] [HAND]...`
//!
//! Prints two tables in Markdown, and writes `hand-HAND-OBJECT.png`, the best grasp of each hand, and
//! `hand-HAND-OBJECT.jsonl`, all its grasps, to FOLDER. By default 10 grasps of the preset `default` with all hands
//! (named as in the first column of what is printed while it runs). Public files of hands are found as the tests
//! find them.

mod hands;

use std::error::Error;
use std::fs;
use std::path::Path;

use graspd::{
    ExecutionSettings, Grasp, GraspObject, GraspRecord, NamedMesh, PAPER_RESOLUTION, RunSettings,
    Summary, SynthesisSettings, synthesize_grasps, write_records,
};
use graspd_eval::EvaluationSettings;
use graspd_view::render_hand_pose;

use hands::{ROWS, Row};

/// Of each of a picture's three panels \[pixels\].
const PANEL: (usize, usize) = (450, 450);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(object), Some(folder)) = (arguments.next(), arguments.next()) else {
        return Err("give OBJECT FOLDER [COUNT] [PRESET] [HAND]...".into());
    };
    let count = arguments.next().map_or(Ok(10), |count| count.parse())?;
    let preset = arguments.next().unwrap_or_else(|| "default".into());
    let wanted: Vec<String> = arguments.collect();
    if let Some(unknown) = wanted
        .iter()
        .find(|name| ROWS.iter().all(|row| row.name != **name))
    {
        let known: Vec<&str> = ROWS.iter().map(|row| row.name).collect();
        return Err(format!("there is no hand {unknown}; there are {}", known.join(" ")).into());
    }

    let settings = SynthesisSettings::preset(&preset)?;
    let source = NamedMesh::load(&object, 1.0)?;
    let object = GraspObject::prepare(source, PAPER_RESOLUTION, settings.density, &|_| {})?;
    let run = RunSettings {
        seed: 0,
        count,
        trajectory_every: None,
        execution: ExecutionSettings::default(),
        evaluation: EvaluationSettings::default(),
    };
    fs::create_dir_all(&folder)?;
    let (mut figures, mut overlaps) = (String::new(), String::new());
    for row in ROWS {
        if !wanted.is_empty() && !wanted.iter().any(|name| name == row.name) {
            continue;
        }
        let Some(hand) = row.load()? else {
            continue;
        };
        let grasps = synthesize_grasps(&object, hand.as_ref(), &settings, &run, &())?;
        let records: Vec<GraspRecord> = grasps.iter().map(|grasp| grasp.record.clone()).collect();
        eprintln!("{}", row.name);
        for record in &records {
            eprintln!("{}", line(record));
        }
        figures += &figures_of(&row, &records);
        overlaps += &overlaps_of(&row, &records);

        let stem = format!("hand-{}-{}", row.name, object.source.name);
        let at = |ending: &str| Path::new(&folder).join(format!("{stem}.{ending}"));
        write_records(&at("jsonl"), &records)?;
        if let Some(Grasp { pose, .. }) = grasps.first() {
            let picture = render_hand_pose(&object.source.mesh, hand.as_ref(), pose, &[], PANEL)?;
            picture.write_png(at("png"))?;
        }
    }
    println!(
        "| hand | SD cm | CA cm2 | IV cm3 | epsilon | deepest mm | hold | free | s a grasp |\n\
         |---|---|---|---|---|---|---|---|---|\n{figures}"
    );
    println!(
        "| hand | of the best two, mm | mean, mm | deepest, mm |\n|---|---|---|---|\n{overlaps}"
    );
    Ok(())
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.digits$}"))
}

/// One grasp as it is printed while the example runs.
fn line(record: &GraspRecord) -> String {
    let metrics = record.metrics.as_ref();
    let of = |pick: fn(&graspd_eval::GraspMetrics) -> Option<f64>| metrics.and_then(pick);
    format!(
        "  #{}: SD {} CA {} IV {} epsilon {} deepest {} mm, itself {} mm, pre-grasp {}",
        record.index,
        number(of(|m| m.sim_displacement_cm), 2),
        number(of(|m| m.contact_area_cm2), 1),
        number(of(|m| m.interpenetration_volume_cm3), 2),
        number(of(|m| m.epsilon), 2),
        number(of(|m| m.max_penetration_mm), 1),
        number(of(|m| m.self_penetration_mm), 1),
        if is_free(record) { "free" } else { "not free" },
    )
}

fn is_free(record: &GraspRecord) -> bool {
    let before = record.pre_grasp.as_ref();
    before.and_then(|before| before.is_free) == Some(true)
}

/// A row of the first table: both of the best two, then counts over all.
fn figures_of(row: &Row, records: &[GraspRecord]) -> String {
    let both = |pick: fn(&graspd_eval::GraspMetrics) -> Option<f64>, digits: usize| {
        let two = records.iter().take(2);
        let values = two.map(|record| number(record.metrics.as_ref().and_then(pick), digits));
        values.collect::<Vec<_>>().join(", ")
    };
    let holds = |record: &&GraspRecord| {
        let metrics = record.metrics.as_ref();
        metrics.and_then(graspd_eval::GraspMetrics::holds) == Some(true)
    };
    let seconds = Summary::of(records);
    format!(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {:.1} |\n",
        row.title,
        both(|m| m.sim_displacement_cm, 2),
        both(|m| m.contact_area_cm2, 1),
        both(|m| m.interpenetration_volume_cm3, 2),
        both(|m| m.epsilon, 2),
        both(|m| m.max_penetration_mm, 1),
        records.iter().filter(holds).count(),
        records.iter().filter(|record| is_free(record)).count(),
        seconds.mean_synthesis_seconds,
    )
}

/// A row of the second table.
fn overlaps_of(row: &Row, records: &[GraspRecord]) -> String {
    let depth = |record: &GraspRecord| {
        record
            .metrics
            .as_ref()
            .and_then(|metrics| metrics.self_penetration_mm)
    };
    let depths: Vec<f64> = records.iter().filter_map(depth).collect();
    let of_best: Vec<String> = depths
        .iter()
        .take(2)
        .map(|depth| format!("{depth:.1}"))
        .collect();
    let mean = depths.iter().sum::<f64>() / depths.len() as f64;
    let deepest = depths
        .iter()
        .fold(0.0_f64, |deepest, depth| deepest.max(*depth));
    format!(
        "| {} | {} | {mean:.1} | {deepest:.1} |\n",
        row.title,
        of_best.join(", ")
    )
}
