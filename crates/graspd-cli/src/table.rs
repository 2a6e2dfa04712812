//! Tables for people.

use graspd::{GraspRecord, MetricMeans, Summary};

/// The grasps, best first, and the means below.
pub(crate) fn grasps_table(records: &[GraspRecord], summary: &Summary) -> String {
    let header = [
        "grasp", "SD cm", "shake", "CA cm2", "IV cm3", "CA/IV", "epsilon", "volume", "depth mm",
        "seconds",
    ];
    let mut table = row(&header.map(String::from));
    for record in records {
        let Some(metrics) = &record.metrics else {
            continue;
        };
        table += &row(&[
            format!("#{}", record.index),
            number(metrics.sim_displacement_cm, 2),
            (metrics.shake_withstood).map_or_else(|| "-".into(), |count| format!("{count}/6")),
            number(metrics.contact_area_cm2, 2),
            number(metrics.interpenetration_volume_cm3, 3),
            number(metrics.ca_over_iv, 1),
            number(metrics.epsilon, 4),
            number(metrics.gws_volume, 4),
            number(metrics.max_penetration_mm, 2),
            number(record.seconds.map(|s| s.synthesis + s.evaluation), 2),
        ]);
    }
    for (label, means) in [
        ("top 2", &summary.top_2),
        ("top 5", &summary.top_5),
        ("all", &summary.all),
    ] {
        table += &means_row(label, means);
    }
    table + &half_widths_row(&summary.all)
}

/// Half the width of the 95 % intervals of the means over all grasps.
fn half_widths_row(means: &MetricMeans) -> String {
    let half = |name: &str| {
        let interval = means.interval_95.get(name);
        interval.map(|[low, high]| 0.5 * (high - low))
    };
    if means.interval_95.is_empty() {
        return String::new();
    }
    row(&[
        "+- (95 %)".into(),
        number(half("sim_displacement_cm"), 2),
        percentage(half("shake_success")),
        number(half("contact_area_cm2"), 2),
        number(half("interpenetration_volume_cm3"), 3),
        number(half("ca_over_iv"), 1),
        number(half("epsilon"), 4),
        number(half("gws_volume"), 4),
        number(half("max_penetration_mm"), 2),
    ])
}

fn percentage(share: Option<f64>) -> String {
    share.map_or_else(|| "-".into(), |share| format!("{:.0} %", 100.0 * share))
}

fn means_row(label: &str, means: &MetricMeans) -> String {
    row(&[
        label.into(),
        number(means.sim_displacement_cm, 2),
        percentage(means.shake_success),
        number(means.contact_area_cm2, 2),
        number(means.interpenetration_volume_cm3, 3),
        number(means.ca_over_iv, 1),
        number(means.epsilon, 4),
        number(means.gws_volume, 4),
        number(means.max_penetration_mm, 2),
    ])
}

/// Right-aligned cells and a line end.
fn row(cells: &[String]) -> String {
    const WIDTHS: [usize; 10] = [9, 8, 6, 8, 8, 8, 9, 8, 9, 8];
    let cells = cells.iter().zip(WIDTHS);
    let cells: Vec<_> = cells
        .map(|(cell, width)| format!("{cell:>width$}"))
        .collect();
    cells.join(" ") + "\n"
}

/// A number with a fixed count of decimals, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.decimals$}"))
}
