//! Grasps in the files of DexGraspNet and of its descendants.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use graspd_hand::{Hand, NumpyValue, read_npy};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use crate::GraspError;
use crate::record::{GraspRecord, RecordedPose};

/// A larger file is refused \[bytes\]; all grasps of an object take a megabyte.
const LARGEST_FILE: u64 = 1 << 28;
/// Columns of a rotation matrix may be off unit length and right angles by this.
const ROTATION_TOLERANCE: f64 = 1e-3;
/// Where `qpos` has the position of the wrist \[m\], and its angles \[rad\].
const TRANSLATION: [&str; 3] = ["WRJTx", "WRJTy", "WRJTz"];
const ROTATION: [&str; 3] = ["WRJRx", "WRJRy", "WRJRz"];

/// Reads the grasps of an `.npy` file as DexGraspNet saves them, for the hand that they were made for.
///
/// Either an array of dictionaries, each with `qpos`, a number for each joint by name beside the wrist's `WRJTx`,
/// `WRJTy`, `WRJTz` \[m\] and `WRJRx`, `WRJRy`, `WRJRz` \[rad\], and `scale`, by which the object's coordinates are
/// multiplied; the angles turn about the object's fixed axes, first x, then y, then z. Or one dictionary of arrays
/// `trans` `[n, 3]`, `rot` `[n, 3, 3]` and `joint_angles` `[n, joints]` in the hand's own order of joints, with the
/// scale left to the caller.
///
/// A joint's name may have a prefix that ends in a colon (`robot0:FFJ3`). The object is called as the file is. What
/// the hand has no joint for is ignored. Nothing in the file is run.
///
/// # Errors
/// If the file cannot be read, or has something else in it; names the file and the grasp.
///
/// # Source
/// R. Wang et al., "DexGraspNet: a large-scale robotic dexterous grasp dataset for general objects based on
/// simulation", ICRA 2023, and the formats that its repositories document.
pub fn read_dexgraspnet(path: &Path, hand: &dyn Hand) -> Result<Vec<GraspRecord>, GraspError> {
    let failed = |source| GraspError::Read {
        path: path.to_owned(),
        source,
    };
    let fault = |fault: String| GraspError::ParseGrasps {
        path: path.to_owned(),
        fault,
    };
    let file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    let limited = file.take(LARGEST_FILE + 1).read_to_end(&mut bytes);
    limited.map_err(failed)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(fault(format!("is larger than {} MiB", LARGEST_FILE >> 20)));
    }
    let object = path
        .file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let grasps = match read_npy(&bytes).map_err(fault)? {
        NumpyValue::List(grasps) => {
            let numbered = grasps.iter().enumerate();
            numbered
                .map(|(index, grasp)| {
                    of_dictionary(grasp, hand).map_err(|e| format!("grasp {index} {e}"))
                })
                .collect::<Result<Vec<_>, _>>()
                .map_err(fault)?
        }
        whole @ NumpyValue::Dict(_) => of_arrays(&whole, hand).map_err(fault)?,
        _ => return Err(fault("holds numbers instead of dictionaries".into())),
    };
    if grasps.is_empty() {
        return Err(fault("has no grasps".into()));
    }
    let records = grasps.into_iter().enumerate();
    Ok(records
        .map(|(index, grasp)| grasp.into_record(index, &object, hand.name()))
        .collect())
}

/// One grasp, read.
struct ForeignGrasp {
    translation: [f64; 3],
    rotation: UnitQuaternion<f64>,
    joints: BTreeMap<String, f64>,
    scale: f64,
}

impl ForeignGrasp {
    fn into_record(self, index: usize, object: &str, hand: &str) -> GraspRecord {
        let q = self.rotation;
        let pose = RecordedPose {
            translation_m: self.translation,
            rotation_wxyz: [q.w, q.i, q.j, q.k],
        };
        GraspRecord::bare(object, hand, index, pose, self.joints, self.scale)
    }
}

/// A dictionary with `qpos` and `scale`.
fn of_dictionary(grasp: &NumpyValue, hand: &dyn Hand) -> Result<ForeignGrasp, String> {
    let qpos = grasp.get("qpos").ok_or("has no dictionary `qpos`")?;
    let NumpyValue::Dict(entries) = qpos else {
        return Err("has a `qpos` that is no dictionary of joints".into());
    };
    let number = |name: &str| {
        let value = qpos.get(name).and_then(NumpyValue::number);
        value.filter(|x| x.is_finite()).ok_or_else(|| {
            format!("has no finite number `{name}` in its `qpos`, which holds the wrist's position and angles too")
        })
    };
    let three = |names: [&str; 3]| -> Result<[f64; 3], String> {
        Ok([number(names[0])?, number(names[1])?, number(names[2])?])
    };
    let [x, y, z] = three(ROTATION)?;
    let mut joints = BTreeMap::new();
    for (name, value) in entries {
        if TRANSLATION.contains(&name.as_str()) || ROTATION.contains(&name.as_str()) {
            continue;
        }
        let value = (value.number().filter(|x| x.is_finite()))
            .ok_or_else(|| format!("has no finite number for the joint `{name}`"))?;
        joints.insert(name_of_joint(name, hand).to_owned(), value);
    }
    let scale = match grasp.get("scale") {
        None => 1.0,
        Some(scale) => (scale.number().filter(|x| x.is_finite()))
            .ok_or("has a `scale` that is no finite number")?,
    };
    Ok(ForeignGrasp {
        translation: three(TRANSLATION)?,
        rotation: UnitQuaternion::from_euler_angles(x, y, z),
        joints,
        scale,
    })
}

/// The hand's name for a joint of the file.
fn name_of_joint<'a>(name: &'a str, hand: &dyn Hand) -> &'a str {
    let is_known = |name: &str| hand.articulation_names().iter().any(|known| known == name);
    match name.rsplit_once(':') {
        Some((_, bare)) if !is_known(name) => bare,
        _ => name,
    }
}

/// A dictionary of arrays over all grasps.
fn of_arrays(whole: &NumpyValue, hand: &dyn Hand) -> Result<Vec<ForeignGrasp>, String> {
    let names = hand.articulation_names();
    let array = |name: &str, sides: &[usize]| {
        let Some(NumpyValue::Array { shape, values }) = whole.get(name) else {
            return Err(format!("is one dictionary, but has no array `{name}`"));
        };
        if shape.get(1..) != Some(sides) || values.iter().any(|x| !x.is_finite()) {
            return Err(format!(
                "has a `{name}` of shape {shape:?}, where finite numbers of shape [n, {}] are expected",
                sides
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(", ")
            ));
        }
        Ok(values)
    };
    let (translations, rotations) = (array("trans", &[3])?, array("rot", &[3, 3])?);
    let joints = array("joint_angles", &[names.len()])?;
    let count = translations.len() / 3;
    if rotations.len() != 9 * count || joints.len() != names.len() * count {
        return Err("has arrays of different numbers of grasps".into());
    }
    (0..count)
        .map(|index| {
            let matrix = Matrix3::from_row_slice(&rotations[9 * index..9 * index + 9]);
            let error = (matrix * matrix.transpose() - Matrix3::identity())
                .abs()
                .max();
            if error > ROTATION_TOLERANCE || matrix.determinant() < 0.0 {
                return Err(format!("grasp {index} has a `rot` that is no rotation"));
            }
            let angles = &joints[names.len() * index..names.len() * (index + 1)];
            let translation = &translations[3 * index..3 * index + 3];
            Ok(ForeignGrasp {
                translation: [translation[0], translation[1], translation[2]],
                rotation: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix)),
                joints: crate::record::named_joints(names, angles),
                scale: 1.0,
            })
        })
        .collect()
}
