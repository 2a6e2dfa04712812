//! A run in a few numbers.

use graspd::{GraspRecord, MetricMeans, Seconds, Summary};
use graspd_eval::GraspMetrics;

use crate::fixtures::{bare_record, judged_record};

/// Means and ratios of these few numbers are off by a rounding or two.
const ROUNDING: f64 = 1e-14;

fn close(value: Option<f64>, expected: f64) -> bool {
    value.is_some_and(|value| (value - expected).abs() <= ROUNDING * expected.abs())
}

/// Grasps as a run leaves them: sorted by displacement, whose values are 1, 2, 4, 8, 16, 32 cm.
fn six_grasps() -> Vec<GraspRecord> {
    (0..6)
        .map(|k| {
            let x = k as f64;
            let metrics = GraspMetrics {
                contact_area_cm2: Some(30.0 - x),
                interpenetration_volume_cm3: Some(1.0 + x),
                ca_over_iv: Some((30.0 - x) / (1.0 + x)),
                epsilon: Some(0.1 * x),
                gws_volume: Some(0.01 * x * x),
                sim_displacement_cm: Some(2f64.powi(k)),
                max_penetration_mm: Some(5.0),
                ..GraspMetrics::default()
            };
            GraspRecord {
                rank: Some(k as usize + 1),
                seconds: Some(Seconds {
                    synthesis: 10.0 * x,
                    evaluation: 1.0,
                }),
                ..judged_record(k as usize, metrics)
            }
        })
        .collect()
}

#[test]
fn means_are_over_the_best_two_the_best_five_and_all() {
    let summary = Summary::of(&six_grasps());
    assert_eq!(
        (summary.object.as_str(), summary.hand.as_str()),
        ("mug", "allegro")
    );
    let counts = [&summary.top_2, &summary.top_5, &summary.all].map(|means| means.grasps);
    assert_eq!(counts, [2, 5, 6]);
    assert!(close(summary.top_2.get("sim_displacement_cm"), 1.5));
    assert!(close(summary.top_5.get("sim_displacement_cm"), 6.2));
    assert!(close(summary.all.get("sim_displacement_cm"), 10.5));
    assert!(close(summary.top_2.get("contact_area_cm2"), 29.5));
    assert!(close(summary.top_5.get("interpenetration_volume_cm3"), 3.0));
    assert!(close(summary.all.get("epsilon"), 0.25));
    assert!(close(summary.top_5.get("gws_volume"), 0.06));
    assert!(close(summary.all.get("max_penetration_mm"), 5.0));
    assert!((summary.mean_synthesis_seconds - 25.0).abs() < ROUNDING * 25.0);
    assert!((summary.mean_evaluation_seconds - 1.0).abs() < ROUNDING);
}

#[test]
fn the_ratio_is_that_of_the_means() {
    // As tables report it; the mean of the ratios would be 8.5 / 2 = 22.25.
    let summary = Summary::of(&six_grasps());
    assert!(close(summary.top_2.get("ca_over_iv"), 29.5 / 1.5));

    let mut without_volume = six_grasps();
    for record in &mut without_volume {
        let metrics = record.metrics.get_or_insert_default();
        metrics.interpenetration_volume_cm3 = Some(0.0);
    }
    assert_eq!(Summary::of(&without_volume).all.get("ca_over_iv"), None);
}

#[test]
fn medians_take_the_middle_or_the_middle_of_two() {
    let grasps = six_grasps();
    let even = Summary::of(&grasps).median;
    assert_eq!(even.grasps, 6);
    assert!(close(even.get("sim_displacement_cm"), 6.0));
    assert!(close(even.get("contact_area_cm2"), 27.5));
    assert!(close(
        Summary::of(&grasps[..5]).median.get("sim_displacement_cm"),
        4.0
    ));
    // Not sorted by this metric.
    let shuffled: Vec<_> = [3, 0, 4, 1, 2].map(|k| grasps[k].clone()).into();
    assert!(close(
        Summary::of(&shuffled).median.get("sim_displacement_cm"),
        4.0
    ));
}

#[test]
fn metrics_that_are_missing_do_not_count() {
    let mut grasps = six_grasps();
    grasps[1]
        .metrics
        .get_or_insert_default()
        .sim_displacement_cm = None;
    grasps[2].metrics = None;
    grasps[3].seconds = None;
    let summary = Summary::of(&grasps);
    assert_eq!(summary.top_2.grasps, 2);
    assert!(close(summary.top_2.get("sim_displacement_cm"), 1.0));
    assert!(close(
        summary.all.get("sim_displacement_cm"),
        (1.0 + 8.0 + 16.0 + 32.0) / 4.0
    ));
    assert!(close(summary.median.get("sim_displacement_cm"), 12.0));
    assert!((summary.mean_synthesis_seconds - 24.0).abs() < 24.0 * ROUNDING);

    let unjudged = Summary::of(&[bare_record(0)]);
    let nothing = Summary::of(&[judged_record(0, GraspMetrics::default())]).all;
    assert_eq!((nothing.grasps, nothing.get("epsilon")), (1, None));
    assert_eq!(
        [
            unjudged.top_2,
            unjudged.top_5,
            unjudged.all,
            unjudged.median
        ],
        [(); 4].map(|()| nothing.clone())
    );
}

#[test]
fn a_summary_of_nothing_is_empty() {
    let summary = Summary::of(&[]);
    assert_eq!(summary.all, MetricMeans::default());
    assert_eq!(summary.median, MetricMeans::default());
    assert_eq!((summary.object.as_str(), summary.hand.as_str()), ("", ""));
    assert_eq!(summary.mean_synthesis_seconds, 0.0);
}

#[test]
fn a_summary_survives_its_file() {
    let summary = Summary::of(&six_grasps());
    let text = serde_json::to_string(&summary).expect("plain numbers");
    let read: Summary = serde_json::from_str(&text).expect("what was just written");
    assert_eq!(read, summary);
}
