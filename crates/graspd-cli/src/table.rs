//! Tables for people.

use graspd::{GraspRecord, MetricMeans, Summary};

/// The grasps, best first, and the means below.
pub(crate) fn print_grasps(records: &[GraspRecord], summary: &Summary) {
    println!(
        "{:>9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8} {:>9} {:>8}",
        "grasp", "SD cm", "CA cm2", "IV cm3", "CA/IV", "epsilon", "volume", "depth mm", "seconds"
    );
    for record in records {
        let Some(metrics) = &record.metrics else {
            continue;
        };
        println!(
            "{:>9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8} {:>9} {:>8}",
            format!("#{}", record.index),
            number(metrics.sim_displacement_cm, 2),
            number(metrics.contact_area_cm2, 2),
            number(metrics.interpenetration_volume_cm3, 3),
            number(metrics.ca_over_iv, 1),
            number(metrics.epsilon, 4),
            number(metrics.gws_volume, 4),
            number(metrics.max_penetration_mm, 2),
            number(record.seconds.map(|s| s.synthesis + s.evaluation), 2),
        );
    }
    for (label, means) in [
        ("top 2", &summary.top_2),
        ("top 5", &summary.top_5),
        ("all", &summary.all),
    ] {
        print_means(label, means);
    }
}

fn print_means(label: &str, means: &MetricMeans) {
    println!(
        "{:>9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8} {:>9}",
        label,
        number(means.sim_displacement_cm, 2),
        number(means.contact_area_cm2, 2),
        number(means.interpenetration_volume_cm3, 3),
        number(means.ca_over_iv, 1),
        number(means.epsilon, 4),
        number(means.gws_volume, 4),
        number(means.max_penetration_mm, 2),
    );
}

/// A number with a fixed count of decimals, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.decimals$}"))
}
