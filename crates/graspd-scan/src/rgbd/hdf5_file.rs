//! HDF5 files as YCB captures have them: arrays of numbers by name, no more.

use std::path::{Path, PathBuf};

use hdf5_pure::{DType, Dataset, File, FileBuilder};
use nalgebra::{Isometry3, Matrix3, Matrix4};

use super::capture::rigid;
use graspd_geom::GeometryError;
use graspd_mesh::{file_bytes, write_whole};

const REMEDY: &str = "download the file again, or leave it out if it is one of many views";
/// A dataset of more values is none of ours; a damaged file may promise any number.
const MAX_VALUES: u64 = 1 << 24;

/// An open file, for reading.
pub(super) struct Arrays {
    path: PathBuf,
    file: File,
}

impl Arrays {
    pub(super) fn open(path: &Path) -> Result<Self, GeometryError> {
        let file = File::from_bytes(file_bytes(path)?).map_err(|error| {
            fault(
                path,
                format!("not a whole HDF5 file: {}", one_line(&error.to_string())),
            )
        })?;
        Ok(Self {
            path: path.into(),
            file,
        })
    }

    /// The values under `key`, which must be of `shape`.
    pub(super) fn values(&self, key: &str, shape: &[u64]) -> Result<Vec<f64>, GeometryError> {
        let dataset = self.dataset(key, shape)?;
        let values = dataset.read_f64().map_err(|e| self.unreadable(key, &e))?;
        self.check_count(key, shape, values.len())?;
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(fault(&self.path, format!("`{key}` holds {value}")));
        }
        Ok(values)
    }

    /// The one number under `key`, as a scalar or an array of one.
    pub(super) fn number(&self, key: &str) -> Result<f64, GeometryError> {
        let is_array =
            matches!(self.file.dataset(key).and_then(|d| d.shape()), Ok(shape) if shape == [1]);
        let shape: &[u64] = if is_array { &[1] } else { &[] };
        Ok(self.values(key, shape)?[0])
    }

    pub(super) fn matrix3(&self, key: &str) -> Result<Matrix3<f64>, GeometryError> {
        Ok(Matrix3::from_row_slice(&self.values(key, &[3, 3])?))
    }

    /// A homogeneous matrix that moves rigidly.
    pub(super) fn motion(&self, key: &str) -> Result<Isometry3<f64>, GeometryError> {
        let matrix = Matrix4::from_row_slice(&self.values(key, &[4, 4])?);
        rigid(&matrix).map_err(|what| fault(&self.path, format!("`{key}` {what}")))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.file.dataset(key).is_ok()
    }

    /// An image of unsigned 16-bit numbers.
    pub(super) fn image(
        &self,
        key: &str,
        width: usize,
        height: usize,
    ) -> Result<Vec<u16>, GeometryError> {
        let shape = [height as u64, width as u64];
        let dataset = self.dataset(key, &shape)?;
        let kind = dataset.dtype().map_err(|e| self.unreadable(key, &e))?;
        if kind != DType::U16 {
            return Err(fault(
                &self.path,
                format!("`{key}` holds {kind:?}, not 16-bit unsigned integers"),
            ));
        }
        let values = dataset.read_u16().map_err(|e| self.unreadable(key, &e))?;
        self.check_count(key, &shape, values.len())?;
        Ok(values)
    }

    pub(super) fn fault(&self, what: String) -> GeometryError {
        fault(&self.path, what)
    }

    fn dataset(&self, key: &str, wanted: &[u64]) -> Result<Dataset, GeometryError> {
        let dataset = (self.file.dataset(key))
            .map_err(|_| fault(&self.path, format!("there is no array `{key}`")))?;
        let shape = dataset.shape().map_err(|e| self.unreadable(key, &e))?;
        let count = shape.iter().try_fold(1_u64, |n, side| n.checked_mul(*side));
        if shape != wanted || count.is_none_or(|n| n > MAX_VALUES) {
            return Err(fault(
                &self.path,
                format!("`{key}` is {}, not {}", sides(&shape), sides(wanted)),
            ));
        }
        Ok(dataset)
    }

    fn check_count(&self, key: &str, shape: &[u64], count: usize) -> Result<(), GeometryError> {
        let wanted: u64 = shape.iter().product();
        if wanted == count as u64 {
            return Ok(());
        }
        Err(fault(
            &self.path,
            format!("`{key}` holds {count} values, not {wanted}"),
        ))
    }

    fn unreadable(&self, key: &str, error: &hdf5_pure::Error) -> GeometryError {
        let error = one_line(&error.to_string());
        fault(&self.path, format!("`{key}` cannot be read: {error}"))
    }
}

/// Writes what `fill` puts into a file, whole or not at all.
pub(super) fn write(path: &Path, fill: impl FnOnce(&mut FileBuilder)) -> Result<(), GeometryError> {
    let mut builder = FileBuilder::new();
    fill(&mut builder);
    let bytes = builder.finish().map_err(|error| GeometryError::Write {
        path: path.into(),
        source: std::io::Error::other(error.to_string()),
    })?;
    write_whole(path, |out| out.write_all(&bytes))
}

/// Puts a matrix into a file that is being written.
pub(super) fn put(builder: &mut FileBuilder, key: &str, rows: usize, matrix: &[f64]) {
    let columns = matrix.len() / rows;
    builder
        .create_dataset(key)
        .with_f64_data(matrix)
        .with_shape(&[rows as u64, columns as u64]);
}

fn fault(path: &Path, fault: String) -> GeometryError {
    GeometryError::Parse {
        path: path.into(),
        line: None,
        fault,
        remedy: REMEDY,
    }
}

fn sides(shape: &[u64]) -> String {
    if shape.is_empty() {
        return "a single number".into();
    }
    let sides: Vec<String> = shape.iter().map(u64::to_string).collect();
    format!("{} values", sides.join(" x "))
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
