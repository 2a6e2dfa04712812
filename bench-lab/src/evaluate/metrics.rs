//! What is measured of a grasp, and which grasps are the best.

use anyhow::{Context, Result, bail};
use graspd::GraspRecord;
use graspd_eval::GraspMetrics;
use serde::{Deserialize, Serialize};

/// A column of the tables.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its heading, with the unit.
    pub(super) title: &'static str,
    /// 1 if more is better, -1 if less is.
    pub(super) better: f64,
    /// Numerator and denominator: a column is the ratio of their means, as the paper has it for CA/IV.
    terms: fn(&Grasp) -> Option<[f64; 2]>,
}

/// All columns, in the order of the tables.
pub(super) const COLUMNS: [Column; 12] = [
    column("contact_area_cm2", "CA cm²", 1.0, |g| {
        mean(g.metrics.contact_area_cm2)
    }),
    column("interpenetration_volume_cm3", "IV cm³", -1.0, |g| {
        mean(g.metrics.interpenetration_volume_cm3)
    }),
    column("ca_over_iv", "CA/IV 1/cm", 1.0, |g| {
        Some([
            g.metrics.contact_area_cm2?,
            g.metrics.interpenetration_volume_cm3?,
        ])
    }),
    column(
        "contact_area_voxel_count_cm2",
        "CA by count cm²",
        1.0,
        |g| mean(g.metrics.contact_area_voxel_count_cm2),
    ),
    column("counted_ca_over_iv", "by count/IV 1/cm", 1.0, |g| {
        Some([
            g.metrics.contact_area_voxel_count_cm2?,
            g.metrics.interpenetration_volume_cm3?,
        ])
    }),
    column("sim_displacement_cm", "SD cm", -1.0, |g| {
        mean(g.metrics.sim_displacement_cm)
    }),
    column("sim_displacement_mean6_cm", "SD6 cm", -1.0, |g| {
        mean(g.metrics.sim_displacement_mean6_cm)
    }),
    column("max_penetration_mm", "deepest mm", -1.0, |g| {
        mean(g.metrics.max_penetration_mm)
    }),
    column("epsilon", "epsilon", 1.0, |g| mean(g.metrics.epsilon)),
    column("shake_success", "shake", 1.0, |g| {
        mean(g.metrics.shake_success.map(f64::from))
    }),
    column("holds", "holds", 1.0, |g| {
        mean(g.metrics.holds().map(f64::from))
    }),
    column("synthesis_seconds", "seconds", -1.0, |g| {
        mean(Some(g.seconds.synthesis))
    }),
];

const fn column(
    key: &'static str,
    title: &'static str,
    better: f64,
    terms: fn(&Grasp) -> Option<[f64; 2]>,
) -> Column {
    Column {
        key,
        title,
        better,
        terms,
    }
}

fn mean(value: Option<f64>) -> Option<[f64; 2]> {
    Some([value?, 1.0])
}

/// What is kept of a grasp record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Grasp {
    /// Which start.
    pub(super) index: usize,
    metrics: GraspMetrics,
    seconds: Seconds,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Seconds {
    synthesis: f64,
}

impl Grasp {
    /// Takes what is needed from a record.
    ///
    /// # Errors
    /// If a column has no value.
    pub(super) fn of(record: &GraspRecord) -> Result<Self> {
        let index = record.index;
        let (metrics, seconds) = (record.metrics.as_ref(), record.seconds.as_ref());
        let grasp = Self {
            index,
            metrics: metrics
                .with_context(|| format!("grasp {index} has no metrics"))?
                .clone(),
            seconds: Seconds {
                synthesis: seconds
                    .with_context(|| format!("grasp {index} has no seconds"))?
                    .synthesis,
            },
        };
        match COLUMNS
            .iter()
            .find(|column| (column.terms)(&grasp).is_none())
        {
            Some(column) => bail!("grasp {index} has no {}", column.key),
            None => Ok(grasp),
        }
    }

    /// Returns numerator and denominator of a column.
    pub(super) fn terms(&self, column: &Column) -> [f64; 2] {
        (column.terms)(self).unwrap_or([f64::NAN; 2])
    }
}

/// All grasps of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ObjectResult {
    #[serde(rename = "object")]
    pub(super) name: String,
    /// What readers of the table should know.
    pub(super) note: Option<String>,
    /// By start.
    pub(super) grasps: Vec<Grasp>,
}

impl ObjectResult {
    /// Takes grasps in any order.
    pub(super) fn new(name: &str, note: Option<&str>, mut grasps: Vec<Grasp>) -> Result<Self> {
        if grasps.is_empty() {
            bail!("there are no grasps of {name}");
        }
        grasps.sort_by_key(|grasp| grasp.index);
        Ok(Self {
            name: name.to_owned(),
            note: note.map(str::to_owned),
            grasps,
        })
    }

    /// Returns the grasps of least displacement, by start where equal; as the paper ranks them.
    pub(super) fn best(&self, count: usize) -> Vec<Grasp> {
        let mut grasps = self.grasps.clone();
        let displacement =
            |grasp: &Grasp| grasp.metrics.sim_displacement_cm.unwrap_or(f64::INFINITY);
        grasps.sort_by(|a, b| {
            displacement(a)
                .total_cmp(&displacement(b))
                .then(a.index.cmp(&b.index))
        });
        grasps.truncate(count);
        grasps
    }
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::json;

    use super::*;

    /// A record whose metrics follow from its area and displacement.
    pub(in crate::evaluate) fn record(index: usize, area: f64, displacement: f64) -> GraspRecord {
        let record = json!({
            "object": "can",
            "hand": "human",
            "index": index,
            "pose": {"translation_m": [0.0, 0.0, 0.0], "rotation_wxyz": [1.0, 0.0, 0.0, 0.0]},
            "metrics": {
                "contact_area_cm2": area,
                "interpenetration_volume_cm3": 2.0,
                "sim_displacement_cm": displacement,
                "sim_displacement_mean6_cm": 2.0 * displacement,
                "max_penetration_mm": 1.0,
                "epsilon": 0.25,
                "shake_success": displacement < 0.1,
                "contact_area_voxel_count_cm2": 1.5 * area,
            },
            "seconds": {"synthesis": 0.5, "evaluation": 0.5},
        });
        serde_json::from_value(record).unwrap()
    }

    pub(in crate::evaluate) fn grasp(index: usize, area: f64, displacement: f64) -> Grasp {
        Grasp::of(&record(index, area, displacement)).unwrap()
    }

    pub(in crate::evaluate) fn column(key: &str) -> &'static Column {
        COLUMNS.iter().find(|column| column.key == key).unwrap()
    }

    #[test]
    fn grasps_are_read_as_they_are_written() {
        let grasp = grasp(3, 12.0, 0.05);
        let text = serde_json::to_string(&grasp).unwrap();
        assert_eq!(serde_json::from_str::<Grasp>(&text).unwrap(), grasp);
        assert_eq!(grasp.terms(column("ca_over_iv")), [12.0, 2.0]);
        assert_eq!(grasp.terms(column("shake_success")), [1.0, 1.0]);
        assert_eq!(grasp.terms(column("holds")), [1.0, 1.0]);
    }

    #[test]
    fn a_record_without_a_metric_is_an_error() {
        let mut record = record(0, 1.0, 1.0);
        record.metrics.as_mut().unwrap().epsilon = None;
        let fault = Grasp::of(&record).unwrap_err().to_string();
        assert_eq!(fault, "grasp 0 has no epsilon");
    }

    #[test]
    fn the_best_are_those_of_least_displacement() {
        let grasps = vec![grasp(2, 1.0, 0.3), grasp(0, 2.0, 0.7), grasp(1, 3.0, 0.3)];
        let object = ObjectResult::new("a", None, grasps).unwrap();
        let indices = |grasps: &[Grasp]| grasps.iter().map(|g| g.index).collect::<Vec<_>>();
        assert_eq!(indices(&object.grasps), [0, 1, 2]);
        assert_eq!(indices(&object.best(2)), [1, 2]);
        assert_eq!(indices(&object.best(9)), [1, 2, 0]);
        assert!(ObjectResult::new("a", None, Vec::new()).is_err());
    }
}
