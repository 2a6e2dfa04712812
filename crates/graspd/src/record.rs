//! What a grasp looks like on disk: one JSON object a line (schema `graspd.grasp/1`).

use std::collections::BTreeMap;

use graspd_eval::GraspMetrics;
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::HandPose;
use serde::{Deserialize, Serialize};

use crate::{GraspError, SCHEMA};

/// A pose as records give it: it maps hand-base coordinates into the object's mesh coordinates (after scaling).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedPose {
    /// Translation \[m\].
    pub translation_m: [f64; 3],
    /// Unit quaternion, real part first.
    pub rotation_wxyz: [f64; 4],
}

impl From<&HandPose> for RecordedPose {
    fn from(pose: &HandPose) -> Self {
        let (t, q) = (pose.translation, pose.rotation);
        Self {
            translation_m: [t.x, t.y, t.z],
            rotation_wxyz: [q.w, q.x, q.y, q.z],
        }
    }
}

impl RecordedPose {
    /// The hand there with these joints, or what is wrong with it.
    fn with_articulation(&self, articulation: Vec<f64>) -> Result<HandPose, String> {
        let [x, y, z] = self.translation_m;
        let [w, i, j, k] = self.rotation_wxyz;
        let norm = (w * w + i * i + j * j + k * k).sqrt();
        let all_finite = articulation.iter().chain(&[x, y, z]).all(|v| v.is_finite());
        if !all_finite || !norm.is_finite() || norm < 1e-6 {
            return Err("its pose has a number that is not finite, or a zero quaternion".into());
        }
        // A unit quaternion stays as it is, bit for bit: records are read back exactly.
        let rotation = Quaternion {
            w,
            x: i,
            y: j,
            z: k,
        };
        let is_unit = (norm - 1.0).abs() < 1e-9;
        Ok(HandPose {
            translation: Vec3::new(x, y, z),
            rotation: if is_unit {
                rotation
            } else {
                rotation.normalize()
            },
            articulation,
        })
    }
}

/// The joints called `names`, in that order; `field` is where they stand.
fn joints_by_name(
    joints: &BTreeMap<String, f64>,
    names: &[String],
    field: &str,
) -> Result<Vec<f64>, String> {
    let value = |name: &String| {
        let joint = joints.get(name).copied();
        joint.ok_or_else(|| format!("`{field}` lacks the joint `{name}`"))
    };
    names.iter().map(value).collect()
}

/// A pose and joints that come before the grasp itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PreGrasp {
    /// The hand's base.
    pub pose: RecordedPose,
    /// Joint positions \[rad or m\] by name.
    pub joints_rad: BTreeMap<String, f64>,
    /// How to get from there to the grasp: `approach_then_close` (base first, then joints) or `together`.
    pub order: Option<String>,
    /// Least signed distance between hand and object there \[m\].
    pub clearance_m: Option<f64>,
    /// Whether no way point to the grasp is deeper in the object than the grasp.
    pub is_free: Option<bool>,
}

/// What the joints should be told once the hand touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Squeeze {
    /// Where to command position-controlled joints \[rad or m\], by name.
    pub joints_rad: BTreeMap<String, f64>,
    /// Torques \[N m\] (forces \[N\] of sliding joints), by name, that press with `force_n` in total.
    pub torques_nm: Option<BTreeMap<String, f64>>,
    /// Sum of the sizes of the contact forces \[N\].
    pub force_n: Option<f64>,
}

/// Where the optimiser ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OptimizerRecord {
    /// Name of the preset.
    pub preset: String,
    /// Steps taken.
    pub steps: usize,
    /// L_phys \[N^2\] of the last step.
    pub l_phys: f64,
    /// L_task of the last step.
    pub l_task: f64,
    /// L_range \[rad^2\].
    pub l_range: f64,
    /// L_limit \[rad^2\].
    pub l_limit: f64,
    /// L_inter \[m^2\].
    pub l_inter: f64,
    /// Whether the task constraint holds at the last step.
    pub task_satisfied: bool,
}

/// Wall-clock seconds; what several threads shared counts once for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Spent optimising.
    pub synthesis: f64,
    /// Spent evaluating.
    pub evaluation: f64,
}

/// One grasp.
///
/// To be read, a record needs only `object`, `hand`, `pose` and, for the articulation, `joints_rad` or `mano`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspRecord {
    /// [`SCHEMA`].
    #[serde(default = "this_schema")]
    pub schema: String,
    /// Name of the object.
    pub object: String,
    /// The file that the object was read from; `None` for a built-in one.
    pub object_path: Option<String>,
    /// The factor that the file's coordinates were multiplied by.
    #[serde(default = "unscaled")]
    pub object_scale: f64,
    /// How the object's surface was closed before anything else (`mended` or `resurfaced`, see `graspd repair`);
    /// `None` if it is closed as it is. The pose, and the metrics, are about the repaired surface.
    pub object_repair: Option<String>,
    /// Name of the hand.
    pub hand: String,
    /// Seed of the run.
    pub seed: Option<u64>,
    /// Which start of the run; [`read_records`](crate::read_records) numbers records that do not say.
    #[serde(default)]
    pub index: usize,
    /// The hand's base.
    pub pose: RecordedPose,
    /// Joint positions \[rad or m\] or pose coefficients by name; may be missing where `mano` has the coefficients.
    pub joints_rad: Option<BTreeMap<String, f64>>,
    /// `pca`, the pose coefficients of a hand in MANO's layout, and `shape`, its shape parameters.
    pub mano: Option<serde_json::Value>,
    /// Where the hand should be before it closes.
    pub pre_grasp: Option<PreGrasp>,
    /// How the joints press on once the hand touches.
    pub squeeze: Option<Squeeze>,
    /// The judge's findings; `None` before evaluation.
    pub metrics: Option<GraspMetrics>,
    /// How the optimisation ended; `None` for grasps made by annealing or by others.
    pub optimizer: Option<OptimizerRecord>,
    /// 1 for the grasp with the least simulation displacement.
    pub rank: Option<usize>,
    /// Timings; the only part that may differ between identical runs.
    pub seconds: Option<Seconds>,
}

fn this_schema() -> String {
    SCHEMA.into()
}

fn unscaled() -> f64 {
    1.0
}

impl GraspRecord {
    /// A grasp made by others: its pose and joints, and nothing known beyond.
    pub(crate) fn bare(
        object: &str,
        hand: &str,
        index: usize,
        pose: RecordedPose,
        joints: BTreeMap<String, f64>,
        object_scale: f64,
    ) -> Self {
        Self {
            schema: this_schema(),
            object: object.to_owned(),
            object_path: None,
            object_scale,
            object_repair: None,
            hand: hand.to_owned(),
            seed: None,
            index,
            pose,
            joints_rad: Some(joints),
            mano: None,
            pre_grasp: None,
            squeeze: None,
            metrics: None,
            optimizer: None,
            rank: None,
            seconds: None,
        }
    }

    /// The pose of a hand whose articulation parameters are called `names`; a joint that the record does not
    /// name is an error.
    ///
    /// # Errors
    /// If a joint is missing, or a number is not finite, or the quaternion is zero.
    pub fn hand_pose(&self, names: &[String]) -> Result<HandPose, GraspError> {
        let articulation = match &self.joints_rad {
            Some(joints) => joints_by_name(joints, names, "joints_rad"),
            None => self.mano_coefficients(names.len()),
        };
        articulation
            .and_then(|articulation| self.pose.with_articulation(articulation))
            .map_err(|fault| self.invalid(fault))
    }

    /// The pose of the pre-grasp, for a hand as in [`GraspRecord::hand_pose`]; `None` if the record has none.
    ///
    /// # Errors
    /// As [`GraspRecord::hand_pose`].
    pub fn pre_grasp_pose(&self, names: &[String]) -> Result<Option<HandPose>, GraspError> {
        let of = |before: &PreGrasp| {
            let articulation = joints_by_name(&before.joints_rad, names, "pre_grasp.joints_rad")?;
            before.pose.with_articulation(articulation)
        };
        (self.pre_grasp.as_ref().map(of).transpose()).map_err(|fault| self.invalid(fault))
    }

    /// The pose of the grasp with the joints of the squeeze, for a hand as in [`GraspRecord::hand_pose`]; `None` if
    /// the record has none.
    ///
    /// # Errors
    /// As [`GraspRecord::hand_pose`].
    pub fn squeeze_pose(&self, names: &[String]) -> Result<Option<HandPose>, GraspError> {
        let of = |after: &Squeeze| {
            let articulation = joints_by_name(&after.joints_rad, names, "squeeze.joints_rad")?;
            self.pose.with_articulation(articulation)
        };
        (self.squeeze.as_ref().map(of).transpose()).map_err(|fault| self.invalid(fault))
    }

    fn invalid(&self, fault: String) -> GraspError {
        GraspError::InvalidRecord {
            index: self.index,
            fault,
        }
    }

    /// The first `count` pose coefficients of a MANO hand; those that the record leaves out are 0.
    fn mano_coefficients(&self, count: usize) -> Result<Vec<f64>, String> {
        let given = self.mano.as_ref().and_then(|mano| mano.get("pca"));
        let given = given
            .and_then(serde_json::Value::as_array)
            .ok_or("it has neither `joints_rad` nor `mano` with a list `pca`")?;
        if given.len() > count {
            return Err(format!(
                "its `pca` has {} coefficients, the hand has {count}",
                given.len()
            ));
        }
        let numbers = given.iter().map(|value| value.as_f64());
        let mut numbers: Vec<f64> = numbers
            .collect::<Option<_>>()
            .ok_or("its `pca` has something that is not a number")?;
        numbers.resize(count, 0.0);
        Ok(numbers)
    }

    /// Whether every number that must be there is one.
    pub(crate) fn is_finite(&self) -> bool {
        let of_pose =
            |pose: &RecordedPose| [&pose.translation_m[..], &pose.rotation_wxyz[..]].concat();
        let mut numbers = of_pose(&self.pose);
        numbers.push(self.object_scale);
        numbers.extend(self.joints_rad.iter().flat_map(BTreeMap::values));
        if let Some(before) = &self.pre_grasp {
            numbers.extend(of_pose(&before.pose));
            numbers.extend(before.joints_rad.values());
            numbers.extend(before.clearance_m);
        }
        if let Some(after) = &self.squeeze {
            numbers.extend(after.joints_rad.values());
            numbers.extend(after.torques_nm.iter().flat_map(BTreeMap::values));
            numbers.extend(after.force_n);
        }
        if let Some(end) = &self.optimizer {
            numbers.extend([
                end.l_phys,
                end.l_task,
                end.l_range,
                end.l_limit,
                end.l_inter,
            ]);
        }
        if let Some(seconds) = &self.seconds {
            numbers.extend([seconds.synthesis, seconds.evaluation]);
        }
        numbers.iter().all(|number| number.is_finite())
    }
}

/// Joint positions by name.
pub fn named_joints(names: &[String], articulation: &[f64]) -> BTreeMap<String, f64> {
    names
        .iter()
        .cloned()
        .zip(articulation.iter().copied())
        .collect()
}
