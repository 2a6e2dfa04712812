//! What is measured of a grasp, and which grasps are the best.

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// How a column is made from what is known of single grasps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// The mean of one value.
    Mean(usize),
    /// The mean of one value over the mean of another, as the paper has it for CA/IV.
    Ratio(usize, usize),
}

/// A column of the tables.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its heading, with the unit.
    pub(super) title: &'static str,
    pub(super) kind: Kind,
    /// 1 if more is better, -1 if less is.
    pub(super) better: f64,
}

const AREA: usize = 0;
const VOLUME: usize = 1;
const DISPLACEMENT: usize = 2;
const MEAN6: usize = 3;
const DEPTH: usize = 4;
const EPSILON: usize = 5;
const SHAKE: usize = 6;
const HOLDS: usize = 7;
const SECONDS: usize = 8;
const COUNTED_AREA: usize = 9;
/// How many values are kept of a grasp.
const VALUES: usize = 10;

/// Displacements below this count as holding \[cm\].
const HOLDING_CM: f64 = 0.5;

/// All columns, in the order of the tables.
pub(super) const COLUMNS: [Column; 12] = [
    column("contact_area_cm2", "CA cm²", Kind::Mean(AREA), 1.0),
    column(
        "interpenetration_volume_cm3",
        "IV cm³",
        Kind::Mean(VOLUME),
        -1.0,
    ),
    column("ca_over_iv", "CA/IV 1/cm", Kind::Ratio(AREA, VOLUME), 1.0),
    column(
        "contact_area_voxel_count_cm2",
        "CA by count cm²",
        Kind::Mean(COUNTED_AREA),
        1.0,
    ),
    column(
        "counted_ca_over_iv",
        "by count/IV 1/cm",
        Kind::Ratio(COUNTED_AREA, VOLUME),
        1.0,
    ),
    column(
        "sim_displacement_cm",
        "SD cm",
        Kind::Mean(DISPLACEMENT),
        -1.0,
    ),
    column(
        "sim_displacement_mean6_cm",
        "SD6 cm",
        Kind::Mean(MEAN6),
        -1.0,
    ),
    column("max_penetration_mm", "deepest mm", Kind::Mean(DEPTH), -1.0),
    column("epsilon", "epsilon", Kind::Mean(EPSILON), 1.0),
    column("shake_success", "shake", Kind::Mean(SHAKE), 1.0),
    column("holds", "holds", Kind::Mean(HOLDS), 1.0),
    column("synthesis_seconds", "seconds", Kind::Mean(SECONDS), -1.0),
];

const fn column(key: &'static str, title: &'static str, kind: Kind, better: f64) -> Column {
    Column {
        key,
        title,
        kind,
        better,
    }
}

/// What is kept of a grasp.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grasp {
    /// Which start.
    pub(super) index: u64,
    values: [f64; VALUES],
}

impl Grasp {
    /// From a grasp record, or from what [`Grasp::json`] made of one.
    pub(super) fn of(record: &Value) -> Result<Self> {
        let index = (record["index"].as_u64()).context("the record has no index")?;
        let metric = |key: &str| -> Result<f64> {
            match &record["metrics"][key] {
                Value::Bool(is_so) => Ok(f64::from(u8::from(*is_so))),
                value => value
                    .as_f64()
                    .with_context(|| format!("grasp {index} has no {key}")),
            }
        };
        let displacement = metric("sim_displacement_cm")?;
        let seconds = (record["seconds"]["synthesis"].as_f64())
            .with_context(|| format!("grasp {index} has no seconds"))?;
        let mut values = [0.0; VALUES];
        values[AREA] = metric("contact_area_cm2")?;
        values[VOLUME] = metric("interpenetration_volume_cm3")?;
        values[DISPLACEMENT] = displacement;
        values[MEAN6] = metric("sim_displacement_mean6_cm")?;
        values[DEPTH] = metric("max_penetration_mm")?;
        values[EPSILON] = metric("epsilon")?;
        values[SHAKE] = metric("shake_success")?;
        values[HOLDS] = f64::from(u8::from(displacement < HOLDING_CM));
        values[SECONDS] = seconds;
        values[COUNTED_AREA] = metric("contact_area_voxel_count_cm2")?;
        Ok(Self { index, values })
    }

    /// The part of the record that [`Grasp::of`] reads.
    pub(super) fn json(&self) -> Value {
        let value = |k: usize| self.values[k];
        serde_json::json!({
            "index": self.index,
            "metrics": {
                "contact_area_cm2": value(AREA),
                "interpenetration_volume_cm3": value(VOLUME),
                "sim_displacement_cm": value(DISPLACEMENT),
                "sim_displacement_mean6_cm": value(MEAN6),
                "max_penetration_mm": value(DEPTH),
                "epsilon": value(EPSILON),
                "shake_success": value(SHAKE) > 0.5,
                "contact_area_voxel_count_cm2": value(COUNTED_AREA),
            },
            "seconds": {"synthesis": value(SECONDS)},
        })
    }

    /// Numerator and denominator of a column.
    pub(super) fn terms(&self, kind: Kind) -> [f64; 2] {
        match kind {
            Kind::Mean(value) => [self.values[value], 1.0],
            Kind::Ratio(over, under) => [self.values[over], self.values[under]],
        }
    }

    fn displacement(&self) -> f64 {
        self.values[DISPLACEMENT]
    }
}

/// All grasps of one object.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ObjectResult {
    pub(super) name: String,
    /// What readers of the table should know.
    pub(super) note: Option<String>,
    /// By start.
    pub(super) grasps: Vec<Grasp>,
}

impl ObjectResult {
    /// From records in any order.
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

    /// The grasps of least displacement, by start where equal; as the paper ranks them.
    pub(super) fn best(&self, count: usize) -> Vec<Grasp> {
        let mut grasps = self.grasps.clone();
        grasps.sort_by(|a, b| {
            (a.displacement().total_cmp(&b.displacement())).then(a.index.cmp(&b.index))
        });
        grasps.truncate(count);
        grasps
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A grasp whose other values follow from its area and displacement.
    pub(in crate::evaluate) fn grasp(index: u64, area: f64, displacement: f64) -> Grasp {
        Grasp::of(&serde_json::json!({
            "index": index,
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
            "seconds": {"synthesis": 0.5},
        }))
        .unwrap()
    }

    #[test]
    fn grasps_are_read_as_they_are_written() {
        let grasp = grasp(3, 12.0, 0.05);
        assert_eq!(Grasp::of(&grasp.json()).unwrap(), grasp);
        assert_eq!(grasp.terms(Kind::Ratio(AREA, VOLUME)), [12.0, 2.0]);
        assert_eq!(grasp.terms(Kind::Mean(SHAKE)), [1.0, 1.0]);
        assert_eq!(grasp.terms(Kind::Mean(HOLDS)), [1.0, 1.0]);
    }

    #[test]
    fn a_record_without_a_metric_is_an_error() {
        let mut record = grasp(0, 1.0, 1.0).json();
        record["metrics"]["epsilon"] = Value::Null;
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
