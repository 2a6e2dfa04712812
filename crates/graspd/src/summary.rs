//! A run in a few numbers: means over the best two, the best five and all grasps.

use std::collections::BTreeMap;

use graspd_eval::{METRICS, MetricGetter, MetricKind};
use serde::{Deserialize, Serialize, Serializer};

use crate::bootstrap::interval_95;
use crate::diversity::Diversity;
use crate::record::GraspRecord;

/// Means (or medians) of the metrics over some grasps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MetricMeans {
    /// How many grasps.
    pub grasps: usize,
    #[serde(flatten)]
    values: MetricValues,
    /// For each of the means, by its key, a 95 % bootstrap interval over the grasps (of two grasps: both values). None
    /// for medians, and none for a mean over a single grasp.
    #[serde(default)]
    pub interval_95: BTreeMap<String, [f64; 2]>,
}

impl MetricMeans {
    /// Returns the mean of the metric with this key in [`METRICS`]; `None` where no grasp has it.
    ///
    /// That of a truth is the share of grasps for which it is true (in a median: 1 if it is for at
    /// least half of them), that of a ratio the ratio of the means.
    pub fn get(&self, key: &str) -> Option<f64> {
        let place = METRICS.iter().position(|metric| metric.key == key)?;
        self.values.0[place]
    }
}

/// A value for each of [`METRICS`]; in files, a map from keys to values.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(from = "BTreeMap<String, serde_json::Value>")]
struct MetricValues([Option<f64>; METRICS.len()]);

impl From<BTreeMap<String, serde_json::Value>> for MetricValues {
    fn from(map: BTreeMap<String, serde_json::Value>) -> Self {
        let value = |at: usize| map.get(METRICS[at].key).and_then(|value| value.as_f64());
        Self(std::array::from_fn(value))
    }
}

impl Serialize for MetricValues {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(METRICS.iter().map(|metric| metric.key).zip(&self.0))
    }
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

fn values(records: &[GraspRecord], get: MetricGetter) -> Vec<f64> {
    let of = |record: &GraspRecord| record.metrics.as_ref().and_then(get);
    records.iter().filter_map(of).collect()
}

/// Reduces every metric by itself, and ratios by their terms.
fn aggregate(records: &[GraspRecord], reduce: fn(Vec<f64>) -> Option<f64>) -> MetricMeans {
    let of = |get: MetricGetter| reduce(values(records, get));
    MetricMeans {
        grasps: records.len(),
        values: MetricValues(std::array::from_fn(|at| match METRICS[at].kind {
            MetricKind::Ratio(above, below) => ratio(of(above), of(below)),
            _ => of(METRICS[at].get),
        })),
        interval_95: BTreeMap::new(),
    }
}

/// Returns means with their intervals.
fn means(records: &[GraspRecord]) -> MetricMeans {
    let mut means = aggregate(records, mean);
    for metric in &METRICS {
        let interval = match metric.kind {
            MetricKind::Ratio(above, below) => ratio_interval(records, above, below),
            _ => {
                let values = values(records, metric.get);
                let of = |indices: &[usize]| mean(indices.iter().map(|i| values[*i]).collect());
                interval_95(values.len(), of)
            }
        };
        (means.interval_95).extend(interval.map(|interval| (metric.key.into(), interval)));
    }
    means
}

/// Returns the interval of a ratio of means over the grasps that have both.
fn ratio_interval(
    records: &[GraspRecord],
    above: MetricGetter,
    below: MetricGetter,
) -> Option<[f64; 2]> {
    let pairs: Vec<[f64; 2]> = (records.iter().filter_map(|r| r.metrics.as_ref()))
        .filter_map(|m| Some([above(m)?, below(m)?]))
        .collect();
    interval_95(pairs.len(), |indices: &[usize]| {
        let sum = |k: usize| Some(indices.iter().map(|i| pairs[*i][k]).sum());
        ratio(sum(0), sum(1))
    })
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
