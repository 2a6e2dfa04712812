//! A run in a few numbers: means over the best two, the best five and all grasps.

use std::collections::BTreeMap;

use graspd_eval::GraspMetrics;
use serde::{Deserialize, Serialize};

use crate::bootstrap::interval_95;
use crate::diversity::Diversity;
use crate::record::GraspRecord;

/// Means of the metrics over some grasps; `None` where no grasp has the metric.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MetricMeans {
    /// How many grasps.
    pub grasps: usize,
    /// Contact area \[cm^2\].
    pub contact_area_cm2: Option<f64>,
    /// Contact area as a count of voxels \[cm^2\].
    #[serde(default)]
    pub contact_area_voxel_count_cm2: Option<f64>,
    /// Interpenetration volume \[cm^3\].
    pub interpenetration_volume_cm3: Option<f64>,
    /// Mean contact area over mean interpenetration volume \[1/cm\].
    pub ca_over_iv: Option<f64>,
    /// Ferrari-Canny epsilon.
    pub epsilon: Option<f64>,
    /// Volume of the grasp wrench space.
    pub gws_volume: Option<f64>,
    /// Simulation displacement \[cm\].
    pub sim_displacement_cm: Option<f64>,
    /// The same, mean over gravity along the six axis directions \[cm\].
    #[serde(default)]
    pub sim_displacement_mean6_cm: Option<f64>,
    /// How many of the shake test's six forces are withstood.
    pub shake_withstood: Option<f64>,
    /// Share of grasps that withstand all six (in a median: 1 if at least half of them do).
    pub shake_success: Option<f64>,
    /// Deepest penetration \[mm\].
    pub max_penetration_mm: Option<f64>,
    /// Deepest self-penetration \[mm\].
    #[serde(default)]
    pub self_penetration_mm: Option<f64>,
    /// For each of these means, by its name here, a 95 % bootstrap interval over the grasps (of two grasps: both
    /// values). None for medians, and none for a mean over a single grasp.
    #[serde(default)]
    pub interval_95: BTreeMap<String, [f64; 2]>,
}

/// A run in a few numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the object.
    pub object: String,
    /// Name of the hand.
    pub hand: String,
    /// The two grasps of least simulation displacement.
    pub top_2: MetricMeans,
    /// The five of least simulation displacement.
    pub top_5: MetricMeans,
    /// All grasps.
    pub all: MetricMeans,
    /// Median over all grasps, by metric.
    pub median: MetricMeans,
    /// How different the grasps that were kept are; `None` if there are fewer than two, or poses were not looked at.
    #[serde(default)]
    pub diversity: Option<Diversity>,
    /// Mean seconds of a synthesis on its thread; 0 in a batch, whose timings are apart.
    #[serde(default)]
    pub mean_synthesis_seconds: f64,
    /// Mean seconds of an evaluation on its thread.
    #[serde(default)]
    pub mean_evaluation_seconds: f64,
}

/// One column of the metrics: its name in records, and how to read it.
type Column = fn(&GraspMetrics) -> Option<f64>;

const CONTACT_AREA: Column = |m| m.contact_area_cm2;
const VOXEL_COUNT: Column = |m| m.contact_area_voxel_count_cm2;
const INTERPENETRATION: Column = |m| m.interpenetration_volume_cm3;
const EPSILON: Column = |m| m.epsilon;
const VOLUME: Column = |m| m.gws_volume;
const DISPLACEMENT: Column = |m| m.sim_displacement_cm;
const MEAN6: Column = |m| m.sim_displacement_mean6_cm;
const WITHSTOOD: Column = |m| m.shake_withstood.map(|count| count as f64);
const SUCCESS: Column = |m| m.shake_success.map(f64::from);
const PENETRATION: Column = |m| m.max_penetration_mm;
const SELF_PENETRATION: Column = |m| m.self_penetration_mm;

impl Summary {
    /// Summarises grasps that are sorted by rank.
    pub fn of(records: &[GraspRecord]) -> Self {
        let first = records.first();
        let name = |pick: fn(&GraspRecord) -> &String| first.map(pick).cloned().unwrap_or_default();
        let seconds = |pick: fn(&crate::Seconds) -> f64| {
            let seconds = records.iter().filter_map(|r| r.seconds.as_ref());
            mean(seconds.map(pick).collect()).unwrap_or(0.0)
        };
        let best = |count: usize| means(&records[..count.min(records.len())]);
        Self {
            object: name(|r| &r.object),
            hand: name(|r| &r.hand),
            top_2: best(2),
            top_5: best(5),
            all: best(records.len()),
            median: aggregate(records, median),
            diversity: None,
            mean_synthesis_seconds: seconds(|s| s.synthesis),
            mean_evaluation_seconds: seconds(|s| s.evaluation),
        }
    }
}

fn values(records: &[GraspRecord], column: Column) -> Vec<f64> {
    let of = |record: &GraspRecord| record.metrics.as_ref().and_then(column);
    records.iter().filter_map(of).collect()
}

/// Every metric reduced by itself.
fn aggregate(records: &[GraspRecord], reduce: fn(Vec<f64>) -> Option<f64>) -> MetricMeans {
    let of = |column: Column| reduce(values(records, column));
    let (area, volume) = (of(CONTACT_AREA), of(INTERPENETRATION));
    MetricMeans {
        grasps: records.len(),
        contact_area_cm2: area,
        contact_area_voxel_count_cm2: of(VOXEL_COUNT),
        interpenetration_volume_cm3: volume,
        ca_over_iv: ratio(area, volume),
        epsilon: of(EPSILON),
        gws_volume: of(VOLUME),
        sim_displacement_cm: of(DISPLACEMENT),
        sim_displacement_mean6_cm: of(MEAN6),
        shake_withstood: of(WITHSTOOD),
        shake_success: of(SUCCESS),
        max_penetration_mm: of(PENETRATION),
        self_penetration_mm: of(SELF_PENETRATION),
        interval_95: BTreeMap::new(),
    }
}

/// Means with their intervals.
fn means(records: &[GraspRecord]) -> MetricMeans {
    let mut means = aggregate(records, mean);
    for (name, column) in [
        ("contact_area_cm2", CONTACT_AREA),
        ("contact_area_voxel_count_cm2", VOXEL_COUNT),
        ("interpenetration_volume_cm3", INTERPENETRATION),
        ("epsilon", EPSILON),
        ("gws_volume", VOLUME),
        ("sim_displacement_cm", DISPLACEMENT),
        ("sim_displacement_mean6_cm", MEAN6),
        ("shake_withstood", WITHSTOOD),
        ("shake_success", SUCCESS),
        ("max_penetration_mm", PENETRATION),
        ("self_penetration_mm", SELF_PENETRATION),
    ] {
        let values = values(records, column);
        let of = |indices: &[usize]| mean(indices.iter().map(|i| values[*i]).collect());
        let interval = interval_95(values.len(), of);
        means.interval_95.extend(interval.map(|i| (name.into(), i)));
    }
    let pairs: Vec<[f64; 2]> = (records.iter().filter_map(|r| r.metrics.as_ref()))
        .filter_map(|m| Some([CONTACT_AREA(m)?, INTERPENETRATION(m)?]))
        .collect();
    let of = |indices: &[usize]| {
        let sum = |k: usize| Some(indices.iter().map(|i| pairs[*i][k]).sum());
        ratio(sum(0), sum(1))
    };
    let interval = interval_95(pairs.len(), of);
    (means.interval_95).extend(interval.map(|i| ("ca_over_iv".into(), i)));
    means
}

fn ratio(area: Option<f64>, volume: Option<f64>) -> Option<f64> {
    let volume = volume.filter(|volume| *volume > 0.0)?;
    Some(area? / volume)
}

fn mean(values: Vec<f64>) -> Option<f64> {
    let count = values.len();
    (count > 0).then(|| values.iter().fold(0.0, |sum, v| sum + v) / count as f64)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2).copied()?;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    Some(0.5 * (upper + values[values.len() / 2 - 1]))
}
