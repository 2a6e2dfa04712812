//! JSON files beside depth images.

use std::path::{Path, PathBuf};

use nalgebra::Matrix4;
use serde_json::Value;

use graspd_geom::GeometryError;
use graspd_mesh::file_bytes;

/// A parsed file that knows its name.
pub(super) struct JsonFile {
    path: PathBuf,
    pub(super) value: Value,
}

impl JsonFile {
    pub(super) fn open(path: &Path) -> Result<Self, GeometryError> {
        let bytes = file_bytes(path)?;
        let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
        let value = serde_json::from_slice(text).map_err(|error| fault(path, error.to_string()))?;
        Ok(Self {
            path: path.into(),
            value,
        })
    }

    pub(super) fn fault(&self, what: String) -> GeometryError {
        fault(&self.path, what)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.value.get(key).is_some_and(|value| !value.is_null())
    }

    pub(super) fn number(&self, key: &str) -> Result<f64, GeometryError> {
        self.value[key]
            .as_f64()
            .ok_or_else(|| self.fault(format!("`{key}` is missing or not a number")))
    }

    /// A list of `count` numbers.
    pub(super) fn numbers(&self, key: &str, count: usize) -> Result<Vec<f64>, GeometryError> {
        numbers(&self.value[key], count).ok_or_else(|| {
            self.fault(format!(
                "`{key}` is missing or not a list of {count} numbers"
            ))
        })
    }

    /// A list of `rows` lists of `columns` numbers, row by row.
    pub(super) fn matrix(
        &self,
        key: &str,
        rows: usize,
        columns: usize,
    ) -> Result<Vec<f64>, GeometryError> {
        let list = self.value[key].as_array().filter(|list| list.len() == rows);
        let values: Option<Vec<Vec<f64>>> =
            list.and_then(|list| list.iter().map(|row| numbers(row, columns)).collect());
        let values = values.ok_or_else(|| {
            self.fault(format!(
                "`{key}` is missing or not a matrix of {rows} x {columns} numbers"
            ))
        })?;
        Ok(values.concat())
    }
}

/// A homogeneous matrix as a list of rows.
pub(super) fn matrix_json(matrix: &Matrix4<f64>) -> Value {
    let row = |i: usize| -> Vec<f64> { matrix.row(i).iter().copied().collect() };
    (0..4).map(row).collect()
}

fn numbers(value: &Value, count: usize) -> Option<Vec<f64>> {
    let list = value.as_array().filter(|list| list.len() == count)?;
    list.iter().map(Value::as_f64).collect()
}

fn fault(path: &Path, fault: String) -> GeometryError {
    GeometryError::Parse {
        path: path.into(),
        line: None,
        fault,
        remedy: "see docs/rgbd.md for what the file must hold",
    }
}
