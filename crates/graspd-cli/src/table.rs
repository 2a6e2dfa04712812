//! Tables for people.

use graspd::{GraspRecord, Summary};
use graspd_eval::{Metric, MetricKind};

/// Writes the grasps, best first, and the means below.
pub(crate) fn grasps_table(records: &[GraspRecord], summary: &Summary) -> String {
    let columns = Metric::columns();
    let mut header = vec!["grasp".to_owned()];
    header.extend(columns.iter().map(|metric| heading(metric)));
    header.push("seconds".into());
    let mut table = row(&header);
    for record in records {
        let Some(metrics) = &record.metrics else {
            continue;
        };
        let mut cells = vec![format!("#{}", record.index)];
        cells.extend(columns.iter().map(|metric| {
            let value = (metric.get)(metrics);
            match metric.kind {
                MetricKind::Count => value.map_or_else(|| "-".into(), |count| format!("{count}/6")),
                _ => metric.format(value),
            }
        }));
        let seconds = record.seconds.map(|s| s.synthesis + s.evaluation);
        cells.push(seconds.map_or_else(|| "-".into(), |seconds| format!("{seconds:.2}")));
        table += &row(&cells);
    }
    for (label, means) in [
        ("top 2", &summary.top_2),
        ("top 5", &summary.top_5),
        ("all", &summary.all),
    ] {
        table += &row(&mean_cells(label, |key| means.get(key)));
    }
    let intervals = &summary.all.interval_95;
    if intervals.is_empty() {
        return table;
    }
    // Half the width of the intervals of the means over all grasps.
    let half = |key: &str| intervals.get(key).map(|[low, high]| 0.5 * (high - low));
    table + &row(&mean_cells("+- (95 %)", half))
}

/// Returns a label and a value, by its key, for each column; of the shake test, the share of grasps
/// that withstand all.
pub(crate) fn mean_cells(label: &str, value: impl Fn(&str) -> Option<f64>) -> Vec<String> {
    let cell = |metric: &Metric| match metric.kind {
        MetricKind::Count => {
            let share = value("shake_success");
            share.map_or_else(|| "-".into(), |share| format!("{:.0} %", 100.0 * share))
        }
        _ => metric.format(value(metric.key)),
    };
    let cells = Metric::columns().into_iter().map(cell);
    std::iter::once(label.to_owned()).chain(cells).collect()
}

/// Returns a heading in ASCII; cells of counts and ratios tell the rest.
pub(crate) fn heading(metric: &Metric) -> String {
    match metric.kind {
        MetricKind::Count | MetricKind::Ratio(..) => metric.label.into(),
        _ => {
            let unit = metric.unit.replace('²', "2").replace('³', "3");
            format!("{} {unit}", metric.label).trim_end().into()
        }
    }
}

/// Aligns cells to the right and ends the line.
fn row(cells: &[String]) -> String {
    let cells: Vec<_> = cells.iter().map(|cell| format!("{cell:>9}")).collect();
    cells.join(" ") + "\n"
}
