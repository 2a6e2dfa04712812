//! A run in a few numbers: means over the best two, the best five and all grasps.

use graspd_eval::GraspMetrics;
use serde::{Deserialize, Serialize};

use crate::record::GraspRecord;

/// Means of the metrics over some grasps; `None` where no grasp has the metric.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MetricMeans {
    /// How many grasps.
    pub grasps: usize,
    /// Contact area \[cm^2\].
    pub contact_area_cm2: Option<f64>,
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
    /// Deepest penetration \[mm\].
    pub max_penetration_mm: Option<f64>,
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
    /// Mean seconds of a synthesis on its thread.
    pub mean_synthesis_seconds: f64,
    /// Mean seconds of an evaluation on its thread.
    pub mean_evaluation_seconds: f64,
}

/// One column of the metrics: its name in records, and how to read it.
type Column = fn(&GraspMetrics) -> Option<f64>;

const CONTACT_AREA: Column = |m| m.contact_area_cm2;
const INTERPENETRATION: Column = |m| m.interpenetration_volume_cm3;
const EPSILON: Column = |m| m.epsilon;
const VOLUME: Column = |m| m.gws_volume;
const DISPLACEMENT: Column = |m| m.sim_displacement_cm;
const PENETRATION: Column = |m| m.max_penetration_mm;

impl Summary {
    /// Summarises grasps that are sorted by rank.
    pub fn of(records: &[GraspRecord]) -> Self {
        let first = records.first();
        let name = |pick: fn(&GraspRecord) -> &String| first.map(pick).cloned().unwrap_or_default();
        let seconds = |pick: fn(&crate::Seconds) -> f64| {
            mean(Box::new(
                records.iter().filter_map(|r| r.seconds.as_ref().map(pick)),
            ))
            .unwrap_or(0.0)
        };
        let best = |count: usize| aggregate(&records[..count.min(records.len())], mean);
        Self {
            object: name(|r| &r.object),
            hand: name(|r| &r.hand),
            top_2: best(2),
            top_5: best(5),
            all: best(records.len()),
            median: aggregate(records, median),
            mean_synthesis_seconds: seconds(|s| s.synthesis),
            mean_evaluation_seconds: seconds(|s| s.evaluation),
        }
    }
}

type Values<'a> = Box<dyn Iterator<Item = f64> + 'a>;

fn aggregate(records: &[GraspRecord], reduce: fn(Values<'_>) -> Option<f64>) -> MetricMeans {
    let of = |column: Column| {
        reduce(Box::new(
            records
                .iter()
                .filter_map(move |r| r.metrics.as_ref().and_then(column)),
        ))
    };
    let (area, volume) = (of(CONTACT_AREA), of(INTERPENETRATION));
    MetricMeans {
        grasps: records.len(),
        contact_area_cm2: area,
        interpenetration_volume_cm3: volume,
        ca_over_iv: match (area, volume) {
            (Some(area), Some(volume)) if volume > 0.0 => Some(area / volume),
            _ => None,
        },
        epsilon: of(EPSILON),
        gws_volume: of(VOLUME),
        sim_displacement_cm: of(DISPLACEMENT),
        max_penetration_mm: of(PENETRATION),
    }
}

fn mean(values: Values<'_>) -> Option<f64> {
    let (count, sum) = values.fold((0usize, 0.0), |(count, sum), v| (count + 1, sum + v));
    (count > 0).then(|| sum / count as f64)
}

fn median(values: Values<'_>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2).copied()?;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    Some(0.5 * (upper + values[values.len() / 2 - 1]))
}
