//! Model files: MANO's own pickles, and the same arrays from `.npz`.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::anatomy::add_anatomical_pose_space;
use super::archive::Archive;
use super::fingers::Fingers;
use super::model::{JointPlacement, POSE_FEATURES, POSE_VALUES, SKINNED_JOINTS, SkinnedModel};
use super::numpy::{Array, parse_npy};
use super::pickle::{Pickle, Value};
use crate::{HandError, Limit, SkinnedHand, SkinnedHandOptions};

/// MANO's files have 4 MB; models of more vertices a few times that \[bytes\].
const MAX_FILE: u64 = 1 << 26;
/// Coefficients of natural poses lie within this many standard deviations of their mean.
const DEVIATIONS: f64 = 3.0;

/// Reads a model from a `.pkl` as MANO's site offers it, or from an `.npz` with arrays of the same names, and makes a
/// hand of it.
///
/// # Errors
/// As [`load_skinned_model`] and [`SkinnedHand::new`]; the message begins with the file's name.
pub fn load_skinned_hand(
    path: &Path,
    options: &SkinnedHandOptions,
) -> Result<SkinnedHand, HandError> {
    let model = load_skinned_model(path)?;
    SkinnedHand::new(model, options).map_err(|error| in_file(path, error))
}

/// Reads a model from a `.pkl` as MANO's site offers it, or from an `.npz` with arrays of the same names.
///
/// Arrays: `v_template` \[v, 3\], `f` \[t, 3\], `weights` \[v, 16\], `kintree_table` \[2, 16\] or `parents` \[16\];
/// `J_regressor` \[16, v\], or `J` \[16, 3\] with `J_shapedirs` \[16, 3, s\]; and, where there are any, `shapedirs`
/// \[v, 3, s\], `posedirs` \[v, 3, 135\], `hands_components` \[k, 45\], `hands_mean` \[45\] and `hands_coeffs` \[m,
/// k\], the coefficients of natural poses, from which limits of three standard deviations are taken. All in metres
/// and radians. A model without `hands_components` gets a pose space of anatomical joint angles.
///
/// A pickle is never executed: classes are known by name, and names that MANO's files do not have are refused.
/// Memory and time are in proportion to the file.
///
/// # Errors
/// Whatever is wrong with the file or an array in it; the message begins with the file's name.
pub fn load_skinned_model(path: &Path) -> Result<SkinnedModel, HandError> {
    let bytes = read(path)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    parse_skinned_model(&bytes, &name).map_err(|error| in_file(path, error))
}

fn in_file(path: &Path, error: HandError) -> HandError {
    HandError::InFile {
        file: path.to_path_buf(),
        error: Box::new(error),
    }
}

fn read(path: &Path) -> Result<Vec<u8>, HandError> {
    let failed = |error| HandError::Read {
        file: path.to_path_buf(),
        error,
    };
    let file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    let fault = match bytes.len() as u64 {
        0 => HandError::Empty,
        size if size > MAX_FILE => HandError::TooLarge { limit: MAX_FILE },
        _ => return Ok(bytes),
    };
    Err(in_file(path, fault))
}

/// Reads the model in the bytes of a pickle or of an archive, as [`load_skinned_model`] reads them from a file.
///
/// # Errors
/// As [`load_skinned_model`], without a file's name.
pub fn parse_skinned_model(bytes: &[u8], name: &str) -> Result<SkinnedModel, HandError> {
    let mut source = if bytes.starts_with(b"PK") {
        Source::Archive(Archive::open(bytes).map_err(HandError::BadArchive)?)
    } else {
        let pickle = Pickle::parse(bytes)?;
        if !matches!(pickle.value(pickle.root()), Value::Dict(_)) {
            return Err(HandError::BadPickle(
                "it holds no dictionary of arrays".into(),
            ));
        }
        Source::Pickle(pickle)
    };
    let template = triples(&source.needed("v_template")?, "v_template")?;
    let vertices = template.len();
    let weights = source.needed("weights")?;
    shape_is(&weights, "weights", &[vertices, SKINNED_JOINTS])?;
    let shape_directions = match source.array("shapedirs")? {
        Some(array) => with_last_side(array, "shapedirs", &[vertices, 3])?,
        None => Vec::new(),
    };
    let pose_directions = source.array("posedirs")?;
    if let Some(array) = &pose_directions {
        shape_is(array, "posedirs", &[vertices, 3, POSE_FEATURES])?;
    }
    let mut model = SkinnedModel {
        name: name.to_owned(),
        faces: faces(&source.needed("f")?)?,
        parents: parents(&mut source)?,
        weights: weights.values.as_chunks().0.to_vec(),
        joints: joints(&mut source, vertices)?,
        template,
        shape_directions,
        pose_directions: pose_directions.map(|array| array.values),
        // Any one component, until the model is known to be sound.
        pose_components: vec![[1.0; POSE_VALUES]],
        pose_mean: [0.0; POSE_VALUES],
        coefficient_limits: None,
        open_coefficients: None,
        component_names: None,
    };
    let has_space = add_pose_space(&mut source, &mut model)?;
    model.validate()?;
    if !has_space {
        let rest = model.shaped_vertices::<f64>(&[]);
        let joints = model.shaped_joints(&[], &rest);
        let fingers = Fingers::find(&model, &rest, &joints, &mut Vec::new());
        add_anatomical_pose_space(&mut model, &fingers);
    }
    Ok(model)
}

/// Where arrays come from.
enum Source<'a> {
    Archive(Archive<'a>),
    Pickle(Pickle<'a>),
}

impl Source<'_> {
    fn array(&mut self, name: &'static str) -> Result<Option<Array>, HandError> {
        match self {
            Self::Pickle(pickle) => {
                let id = pickle.entry(pickle.root(), name);
                id.map(|id| pickle.array(id, name)).transpose()
            }
            Self::Archive(archive) => {
                let faulty = |fault| HandError::BadModel { array: name, fault };
                let Some(bytes) = archive.entry(name) else {
                    return Ok(None);
                };
                let bytes = bytes.map_err(faulty)?;
                let stored = parse_npy(&bytes).map_err(faulty)?;
                stored.decode(name).map(Some)
            }
        }
    }

    fn needed(&mut self, name: &'static str) -> Result<Array, HandError> {
        let found = self.array(name)?;
        found.ok_or_else(|| HandError::MissingArray {
            array: name,
            found: self.names(),
        })
    }

    /// Returns the names of what is there, as far as they fit a line.
    fn names(&self) -> String {
        const MOST: usize = 20;
        let names: Vec<String> = match self {
            Self::Archive(archive) => archive.names(),
            Self::Pickle(pickle) => pickle.keys(),
        };
        let clip = |name: &String| name.chars().filter(|c| !c.is_control()).take(30).collect();
        let shown: Vec<String> = names.iter().take(MOST).map(clip).collect();
        match names.len() {
            0 => "none".into(),
            count if count > MOST => format!("{} and {} more", shown.join(", "), count - MOST),
            _ => shown.join(", "),
        }
    }
}

fn joints(source: &mut Source<'_>, vertices: usize) -> Result<JointPlacement, HandError> {
    const NAME: &str = "J_regressor";
    let mut rows = vec![Vec::new(); SKINNED_JOINTS];
    if let Source::Pickle(pickle) = source
        && let Some(id) = pickle
            .entry(pickle.root(), NAME)
            .filter(|&id| pickle.is_sparse(id))
    {
        let matrix = pickle.sparse(id, NAME)?;
        shape_fits(
            NAME,
            &[matrix.rows, matrix.columns],
            &[SKINNED_JOINTS, vertices],
        )?;
        for (row, column, value) in matrix.entries {
            rows[row].push((column as u32, value));
        }
        return Ok(JointPlacement::Regressed(rows));
    }
    if let Some(array) = source.array(NAME)? {
        shape_is(&array, NAME, &[SKINNED_JOINTS, vertices])?;
        for (row, values) in rows.iter_mut().zip(array.values.chunks_exact(vertices)) {
            let entries = values
                .iter()
                .enumerate()
                .filter(|(_, value)| **value != 0.0);
            row.extend(entries.map(|(column, &value)| (column as u32, value)));
        }
        return Ok(JointPlacement::Regressed(rows));
    }
    let template = source.needed("J")?;
    shape_is(&template, "J", &[SKINNED_JOINTS, 3])?;
    let shape_directions = match source.array("J_shapedirs")? {
        Some(array) => with_last_side(array, "J_shapedirs", &[SKINNED_JOINTS, 3])?,
        None => Vec::new(),
    };
    Ok(JointPlacement::Given {
        template: template.values.as_chunks().0.to_vec(),
        shape_directions,
    })
}

fn parents(source: &mut Source<'_>) -> Result<Vec<Option<usize>>, HandError> {
    let row = match source.array("kintree_table")? {
        Some(array) => {
            shape_is(&array, "kintree_table", &[2, SKINNED_JOINTS])?;
            array.values[..SKINNED_JOINTS].to_vec()
        }
        None => {
            let array = source.needed("parents")?;
            shape_is(&array, "parents", &[SKINNED_JOINTS])?;
            array.values
        }
    };
    // The wrist's entry is -1 or that taken for unsigned.
    let parent = |(joint, &value): (usize, &f64)| {
        (joint > 0 && value >= 0.0 && value.fract() == 0.0).then_some(value as usize)
    };
    Ok(row.iter().enumerate().map(parent).collect())
}

/// Tells whether the source has a pose space.
fn add_pose_space(source: &mut Source<'_>, model: &mut SkinnedModel) -> Result<bool, HandError> {
    let Some(components) = source.array("hands_components")? else {
        return Ok(false);
    };
    let count = components.shape.first().copied().unwrap_or(0);
    shape_is(&components, "hands_components", &[count, POSE_VALUES])?;
    model.pose_components = components.values.as_chunks().0.to_vec();
    if let Some(mean) = source.array("hands_mean")? {
        shape_is(&mean, "hands_mean", &[POSE_VALUES])?;
        model.pose_mean.copy_from_slice(&mean.values);
    }
    if let Some(poses) = source.array("hands_coeffs")? {
        let rows = poses.shape.first().copied().unwrap_or(0);
        shape_is(&poses, "hands_coeffs", &[rows, count])?;
        model.coefficient_limits = limits(&poses.values, count);
    }
    Ok(true)
}

/// Computes mean and three standard deviations of each column; `None` for fewer than two rows.
fn limits(poses: &[f64], count: usize) -> Option<Vec<Limit>> {
    let rows = poses.len().checked_div(count)?;
    if rows < 2 {
        return None;
    }
    let limit = |column: usize| {
        let values = || poses.iter().skip(column).step_by(count);
        let mean = values().sum::<f64>() / rows as f64;
        let variance = values().map(|x| (x - mean).powi(2)).sum::<f64>() / (rows - 1) as f64;
        let reach = DEVIATIONS * variance.sqrt();
        Limit {
            lower: mean - reach,
            upper: mean + reach,
        }
    };
    Some((0..count).map(limit).collect())
}

fn faces(array: &Array) -> Result<Vec<[u32; 3]>, HandError> {
    let corners = triples(array, "f")?;
    let mut faces = Vec::with_capacity(corners.len());
    for (row, corners) in corners.iter().enumerate() {
        let is_index = |x: &f64| *x >= 0.0 && *x <= f64::from(u32::MAX) && x.fract() == 0.0;
        if !corners.iter().all(is_index) {
            return Err(HandError::BadModel {
                array: "f",
                fault: format!("row {row} is no triangle of vertex numbers"),
            });
        }
        faces.push(corners.map(|x| x as u32));
    }
    Ok(faces)
}

fn triples(array: &Array, name: &'static str) -> Result<Vec<[f64; 3]>, HandError> {
    let count = array.shape.first().copied().unwrap_or(0);
    shape_is(array, name, &[count, 3])?;
    Ok(array.values.as_chunks().0.to_vec())
}

fn shape_is(array: &Array, name: &'static str, wanted: &[usize]) -> Result<(), HandError> {
    shape_fits(name, &array.shape, wanted)
}

fn shape_fits(name: &'static str, shape: &[usize], wanted: &[usize]) -> Result<(), HandError> {
    if shape == wanted {
        return Ok(());
    }
    Err(HandError::BadModel {
        array: name,
        fault: format!("has the shape {shape:?}, where {wanted:?} is expected"),
    })
}

/// Returns the values of an array of shape `sides` with one more side of any length.
fn with_last_side(
    array: Array,
    name: &'static str,
    sides: &[usize],
) -> Result<Vec<f64>, HandError> {
    match array.shape.split_last() {
        Some((_, first)) if first == sides => Ok(array.values),
        _ => Err(HandError::BadModel {
            array: name,
            fault: format!(
                "has the shape {:?}, where {sides:?} with one more side is expected",
                array.shape
            ),
        }),
    }
}
