//! The table of metrics: what each is called, its unit, how it is averaged and shown.
//!
//! A new metric is a field of [`GraspMetrics`], a row of [`METRICS`] and the code that computes it: summaries, tables,
//! exports and pages take the rest from here.

use crate::report::GraspMetrics;

/// A grasp holds if the object moves less than this in the simulation \[cm\].
pub const HOLDS_BELOW_CM: f64 = 0.5;

impl GraspMetrics {
    /// Returns whether the object moves less than [`HOLDS_BELOW_CM`]; `None` without a displacement.
    pub fn holds(&self) -> Option<bool> {
        Some(self.sim_displacement_cm? < HOLDS_BELOW_CM)
    }
}

/// Reads a metric of a grasp as a number: a count as it is, a truth as 0 or 1.
pub type MetricGetter = fn(&GraspMetrics) -> Option<f64>;

/// What the values of a metric are, and so how those of many grasps become one.
#[derive(Clone, Copy, Debug)]
pub enum MetricKind {
    /// A real number, averaged.
    Number,
    /// The ratio of two other metrics; over many grasps, the ratio of their means (or medians), as the paper has it.
    Ratio(MetricGetter, MetricGetter),
    /// A natural number, averaged.
    Count,
    /// True or false; the average is the share of grasps for which it is true.
    Truth,
}

/// A metric's row in [`METRICS`].
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Name in records, summaries and exports.
    pub key: &'static str,
    /// Short name, for headings.
    pub label: &'static str,
    /// What it measures.
    pub about: &'static str,
    /// Unit, empty for pure numbers.
    pub unit: &'static str,
    /// Decimals that are worth showing.
    pub digits: usize,
    /// Which metrics of `--metrics` it is one of, see [`Metrics`](crate::Metrics).
    pub group: &'static str,
    /// Place among the columns of tables for people, from 0; `None` for one that they leave out.
    pub column: Option<usize>,
    /// What its values are.
    pub kind: MetricKind,
    /// Reads it.
    pub get: MetricGetter,
}

impl Metric {
    /// Finds a metric by its key.
    pub fn named(key: &str) -> Option<&'static Self> {
        METRICS.iter().find(|metric| metric.key == key)
    }

    /// Lists the metrics of tables for people, in the order of their columns.
    pub fn columns() -> Vec<&'static Self> {
        let mut columns: Vec<_> = METRICS.iter().filter(|m| m.column.is_some()).collect();
        columns.sort_by_key(|metric| metric.column);
        columns
    }

    /// Lists the metrics but those of these keys in the order of exported columns: real numbers,
    /// then counts and truths.
    pub fn exported(left_out: &[&str]) -> Vec<&'static Self> {
        let kept = METRICS.iter().filter(|m| !left_out.contains(&m.key));
        let (mut numbers, others): (Vec<_>, Vec<_>) =
            kept.partition(|m| matches!(m.kind, MetricKind::Number | MetricKind::Ratio(..)));
        numbers.extend(others);
        numbers
    }

    /// Writes a value with the metric's decimals; a dash for none.
    pub fn format(&self, value: Option<f64>) -> String {
        value.map_or_else(|| "-".into(), |v| format!("{v:.*}", self.digits))
    }

    /// Writes a grasp's value with label and unit, such as `SD 0.12 cm`.
    pub fn describe(&self, metrics: Option<&GraspMetrics>) -> String {
        let value = self.format(metrics.and_then(self.get));
        format!("{} {value} {}", self.label, self.unit)
            .trim_end()
            .into()
    }
}

/// All metrics, in the order of summaries.
pub static METRICS: [Metric; 12] = [
    Metric {
        key: "contact_area_cm2",
        label: "CA",
        about: "contact area",
        unit: "cm²",
        digits: 2,
        group: "ca",
        column: Some(2),
        kind: MetricKind::Number,
        get: |m| m.contact_area_cm2,
    },
    Metric {
        key: "contact_area_voxel_count_cm2",
        label: "CA by count",
        about: "contact area as a count of voxels",
        unit: "cm²",
        digits: 2,
        group: "ca",
        column: None,
        kind: MetricKind::Number,
        get: |m| m.contact_area_voxel_count_cm2,
    },
    Metric {
        key: "interpenetration_volume_cm3",
        label: "IV",
        about: "interpenetration volume",
        unit: "cm³",
        digits: 3,
        group: "iv",
        column: Some(3),
        kind: MetricKind::Number,
        get: |m| m.interpenetration_volume_cm3,
    },
    Metric {
        key: "ca_over_iv",
        label: "CA/IV",
        about: "contact area by interpenetration volume",
        unit: "1/cm",
        digits: 1,
        group: "ca,iv",
        column: Some(4),
        kind: MetricKind::Ratio(|m| m.contact_area_cm2, |m| m.interpenetration_volume_cm3),
        get: |m| m.ca_over_iv,
    },
    Metric {
        key: "epsilon",
        label: "epsilon",
        about: "Ferrari and Canny's epsilon",
        unit: "",
        digits: 4,
        group: "gws",
        column: Some(5),
        kind: MetricKind::Number,
        get: |m| m.epsilon,
    },
    Metric {
        key: "gws_volume",
        label: "volume",
        about: "volume of the grasp wrench space",
        unit: "",
        digits: 4,
        group: "gws",
        column: Some(6),
        kind: MetricKind::Number,
        get: |m| m.gws_volume,
    },
    Metric {
        key: "sim_displacement_cm",
        label: "SD",
        about: "simulation displacement: how far the object moves under gravity while the hand is fixed",
        unit: "cm",
        digits: 2,
        group: "sd",
        column: Some(0),
        kind: MetricKind::Number,
        get: |m| m.sim_displacement_cm,
    },
    Metric {
        key: "sim_displacement_mean6_cm",
        label: "SD, mean of 6",
        about: "simulation displacement, mean over gravity along the six axis directions",
        unit: "cm",
        digits: 2,
        group: "sd6",
        column: None,
        kind: MetricKind::Number,
        get: |m| m.sim_displacement_mean6_cm,
    },
    Metric {
        key: "shake_withstood",
        label: "shake",
        about: "forces of the shake test that the grasp withstands",
        unit: "of 6",
        digits: 0,
        group: "shake",
        column: Some(1),
        kind: MetricKind::Count,
        get: |m| m.shake_withstood.map(|count| count as f64),
    },
    Metric {
        key: "shake_success",
        label: "shake success",
        about: "whether the grasp withstands all forces of the shake test",
        unit: "",
        digits: 0,
        group: "shake",
        column: None,
        kind: MetricKind::Truth,
        get: |m| m.shake_success.map(f64::from),
    },
    Metric {
        key: "max_penetration_mm",
        label: "depth",
        about: "largest depth of the hand inside the object",
        unit: "mm",
        digits: 2,
        group: "pd",
        column: Some(7),
        kind: MetricKind::Number,
        get: |m| m.max_penetration_mm,
    },
    Metric {
        key: "self_penetration_mm",
        label: "self-penetration",
        about: "largest depth of the hand inside itself",
        unit: "mm",
        digits: 2,
        group: "spd",
        column: None,
        kind: MetricKind::Number,
        get: |m| m.self_penetration_mm,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_is_a_field_of_records_and_of_a_group() {
        let record = serde_json::to_value(GraspMetrics::default()).unwrap();
        for metric in &METRICS {
            assert!(record.get(metric.key).is_some(), "{}", metric.key);
            assert!(metric.group.parse::<crate::Metrics>().is_ok());
        }
        let columns = Metric::columns();
        let labels: Vec<_> = columns.iter().map(|metric| metric.label).collect();
        assert_eq!(labels[..3], ["SD", "shake", "CA"]);
    }

    #[test]
    fn values_are_written_with_label_and_unit() {
        let metrics = GraspMetrics {
            sim_displacement_cm: Some(0.123),
            ..GraspMetrics::default()
        };
        let write = |key: &str| Metric::named(key).unwrap().describe(Some(&metrics));
        assert_eq!(write("sim_displacement_cm"), "SD 0.12 cm");
        assert_eq!(write("epsilon"), "epsilon -");
        assert_eq!((metrics.holds(), HOLDS_BELOW_CM), (Some(true), 0.5));
    }
}
