//! `report.html`: a dataset on one page.

use anyhow::{Context, Result};
use graspd::{
    BatchFolder, BatchPlan, DatasetSummary, GraspRecord, MetricMeans, PlannedRun, write_atomically,
};
use graspd_eval::{GraspMetrics, HOLDS_BELOW_CM, Metric, MetricGetter};
use graspd_hand::Hand;
use rayon::prelude::*;

use super::super::input::{RepairChoice, load_object};
use super::histogram::histogram;
use super::page::{page, picture, table, tiles};
use crate::table::{heading, mean_cells};

/// Cases with a picture in each section.
const CASES: usize = 6;
/// Runs in the table of runs.
const MAX_ROWS: usize = 200;
/// Failures that are told.
const MAX_FAILURES: usize = 50;
/// Width and height of each of the three views \[pixels\].
const PANEL: (usize, usize) = (320, 280);

/// A grasp with the run that it is of.
struct Case<'a> {
    run: &'a PlannedRun,
    record: &'a GraspRecord,
}

/// Writes the page of a batch that is done. It holds no timing: identical batches have identical pages.
pub(super) fn write(
    folder: &BatchFolder,
    plan: &BatchPlan,
    hands: &[Box<dyn Hand>],
    repair: &RepairChoice,
    summary: &DatasetSummary,
) -> Result<()> {
    let runs = (plan.runs.iter())
        .map(|run| Ok((run, lean(folder.records(run)?))))
        .collect::<Result<Vec<_>>>()?;
    let mut body = tiles(&counts(summary));
    body += &format!(
        "<p>A grasp holds if the object moves less than {HOLDS_BELOW_CM} cm in the simulation. Preset \
        <code>{}</code>, {} starts a run.</p>\n",
        plan.configuration.settings.preset, plan.starts
    );
    body += "<h2>Means</h2>\n";
    body += &means_table(summary);
    body += "<h2>Metrics of all grasps</h2>\n<div class=\"plots\">";
    let metrics: Vec<&GraspMetrics> = (runs.iter())
        .flat_map(|(_, records)| records.iter().filter_map(|record| record.metrics.as_ref()))
        .collect();
    for metric in Metric::columns() {
        let values: Vec<f64> = metrics.iter().filter_map(|m| (metric.get)(m)).collect();
        body += &histogram(metric.about, metric.unit, &values);
    }
    body += "</div>\n";
    body += &cases(plan, hands, repair, &runs)?;
    body += &runs_table(plan, &runs);
    body += &failures(folder, plan)?;
    let text = page(&format!("Grasps of {} objects", summary.objects), &body);
    Ok(write_atomically(
        &folder.path().join("report.html"),
        text.as_bytes(),
    )?)
}

/// Without what the page does not show: a large dataset's records would fill the memory.
fn lean(mut records: Vec<GraspRecord>) -> Vec<GraspRecord> {
    for record in &mut records {
        record.pre_grasp = None;
        record.squeeze = None;
    }
    records
}

fn counts(summary: &DatasetSummary) -> Vec<(String, &'static str)> {
    let mut counts = vec![
        (summary.objects.to_string(), "objects"),
        (summary.runs.to_string(), "runs"),
        (summary.grasps.to_string(), "grasps"),
    ];
    if let Some(share) = summary.holding_share {
        counts.push((format!("{:.1} %", 100.0 * share), "of grasps hold"));
    }
    if let Some(share) = summary.all.get("shake_success") {
        counts.push((
            format!("{:.1} %", 100.0 * share),
            "withstand all six forces",
        ));
    }
    counts.push((summary.failed_runs.to_string(), "runs without a grasp"));
    counts.push((summary.failed_starts.to_string(), "starts that failed"));
    counts
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.decimals$}"))
}

fn means_table(summary: &DatasetSummary) -> String {
    let row = |label: &str, means: &MetricMeans| {
        let mut cells = mean_cells(label, |key| means.get(key));
        cells.insert(1, means.grasps.to_string());
        cells
    };
    let mut rows = vec![
        row("all", &summary.all),
        row("best of each run", &summary.best_of_each_run),
    ];
    if summary.by_hand.len() > 1 {
        rows.extend(summary.by_hand.iter().map(|(hand, means)| row(hand, means)));
    }
    let mut header = vec!["".to_owned(), "grasps".into()];
    header.extend(Metric::columns().iter().map(|metric| heading(metric)));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    table(&header, &rows)
}

/// Pictures of the grasps at the ends of the scale.
fn cases(
    plan: &BatchPlan,
    hands: &[Box<dyn Hand>],
    repair: &RepairChoice,
    runs: &[(&PlannedRun, Vec<GraspRecord>)],
) -> Result<String> {
    let all = || {
        (runs.iter()).flat_map(|(run, records)| records.iter().map(|record| Case { run, record }))
    };
    let mut html = String::new();
    let displacement: MetricGetter = |m| m.sim_displacement_cm;
    for (title, column, is_worst) in [
        ("Worst: the object moves most", displacement, true),
        ("Worst: deepest penetration", |m| m.max_penetration_mm, true),
        ("Best: the object moves least", displacement, false),
    ] {
        let mut ranked: Vec<(f64, Case<'_>)> = all()
            .filter_map(|case| Some((column(case.record.metrics.as_ref()?)?, case)))
            .collect();
        ranked.sort_by(|(a, _), (b, _)| {
            if is_worst {
                b.total_cmp(a)
            } else {
                a.total_cmp(b)
            }
        });
        let is_shown_as_worst = !is_worst && ranked.len() <= 2 * CASES;
        ranked.truncate(CASES);
        if ranked.is_empty() || is_shown_as_worst {
            continue;
        }
        let pictures = (ranked.par_iter())
            .map(|(_, case)| case_picture(plan, hands, repair, case))
            .collect::<Result<Vec<_>>>()?;
        html += &format!(
            "<h2>{title}</h2>\n<div class=\"cases\">{}</div>\n",
            pictures.concat()
        );
    }
    Ok(html)
}

fn case_picture(
    plan: &BatchPlan,
    hands: &[Box<dyn Hand>],
    repair: &RepairChoice,
    case: &Case<'_>,
) -> Result<String> {
    let Case { run, record } = case;
    let mut caption = format!("{}, start {}", run.name, record.index);
    for key in [
        "sim_displacement_cm",
        "contact_area_cm2",
        "max_penetration_mm",
    ] {
        let metric = Metric::named(key).into_iter();
        caption.extend(metric.map(|m| format!(", {}", m.describe(record.metrics.as_ref()))));
    }
    let hand = hands[run.hand].as_ref();
    let object = &plan.objects[run.object].name_or_path;
    // A mesh that has gone since costs the picture, not the report.
    let Ok(source) = load_object(object, plan.object_scale, repair, true) else {
        return Ok(format!(
            "<p>{}: no picture, its mesh cannot be read any more</p>",
            super::page::escaped(&caption)
        ));
    };
    let pose = record.hand_pose(hand.articulation_names())?;
    let image = graspd_view::render_hand_pose(&source.mesh, hand, &pose, &[], PANEL)?;
    let png = image.to_png().context("a picture of the report")?;
    Ok(picture(&png, &caption))
}

/// The runs, those of the worst best grasp first.
fn runs_table(plan: &BatchPlan, runs: &[(&PlannedRun, Vec<GraspRecord>)]) -> String {
    let best = |records: &[GraspRecord]| {
        records
            .first()
            .and_then(|r| r.metrics.as_ref()?.sim_displacement_cm)
    };
    let mut order: Vec<usize> = (0..runs.len()).collect();
    let key = |run: usize| best(&runs[run].1).unwrap_or(f64::INFINITY);
    order.sort_by(|a, b| key(*b).total_cmp(&key(*a)));
    let rows: Vec<Vec<String>> = (order.iter().take(MAX_ROWS))
        .map(|run| {
            let (run, records) = &runs[*run];
            let metrics = || records.iter().filter_map(|record| record.metrics.as_ref());
            let holding = metrics().filter(|m| m.holds() == Some(true));
            let widest = metrics()
                .filter_map(|m| m.contact_area_cm2)
                .fold(None, |most: Option<f64>, area| {
                    Some(most.map_or(area, |most| most.max(area)))
                });
            vec![
                run.name.clone(),
                plan.objects[run.object].name_or_path.clone(),
                records.len().to_string(),
                holding.count().to_string(),
                number(best(records), 2),
                number(widest, 2),
            ]
        })
        .collect();
    let header = [
        "run",
        "object",
        "grasps",
        "hold",
        "least SD cm",
        "most CA cm²",
    ];
    let mut html = format!("<h2>Runs</h2>\n{}", table(&header, &rows));
    if runs.len() > MAX_ROWS {
        html += &format!(
            "<p>The {MAX_ROWS} worst of {}; all are in runs.jsonl.</p>\n",
            runs.len()
        );
    }
    html
}

fn failures(folder: &BatchFolder, plan: &BatchPlan) -> Result<String> {
    let mut rows = Vec::new();
    for run in &plan.runs {
        for failure in folder.failures(run)? {
            let start = failure
                .index
                .map_or_else(|| "all".into(), |index| index.to_string());
            rows.push(vec![run.name.clone(), start, failure.error]);
        }
    }
    if rows.is_empty() {
        return Ok(String::new());
    }
    let count = rows.len();
    rows.truncate(MAX_FAILURES);
    let mut html = format!(
        "<h2>Failures</h2>\n{}",
        table(&["run", "start", "why"], &rows)
    );
    if count > MAX_FAILURES {
        html +=
            &format!("<p>The first {MAX_FAILURES} of {count}; all are in failures.jsonl.</p>\n");
    }
    Ok(html)
}
