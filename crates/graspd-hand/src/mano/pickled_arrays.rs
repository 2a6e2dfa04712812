//! The arrays in a pickle of MANO: NumPy arrays, Chumpy's wrappers of them, SciPy's sparse matrices.

use super::numpy::{Array, MAX_DIMENSIONS, NumberType, StoredArray};
use super::pickle::{Global, Id, Pickle, Value};
use crate::HandError;

/// Wrappers about wrappers about an array: MANO has two, and a cycle of them has no end.
const MAX_DEPTH: usize = 8;

/// A sparse matrix by columns, as SciPy stores it.
#[derive(Clone, Debug)]
pub(crate) struct SparseColumns {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    /// Row, column, value.
    pub(crate) entries: Vec<(usize, usize, f64)>,
}

impl Pickle<'_> {
    /// Returns the array under `id`, which the file calls `name`.
    ///
    /// # Errors
    /// [`HandError::BadModel`] naming the array.
    pub(crate) fn array(&self, id: Id, name: &'static str) -> Result<Array, HandError> {
        self.wrapped_array(id, name, MAX_DEPTH)
    }

    /// Tells whether the value is a sparse matrix.
    pub(crate) fn is_sparse(&self, id: Id) -> bool {
        matches!(
            self.value(id),
            Value::Object {
                class: Global::SparseColumns,
                ..
            }
        )
    }

    /// Returns the sparse matrix under `id`.
    ///
    /// # Errors
    /// [`HandError::BadModel`] naming the array.
    pub(crate) fn sparse(&self, id: Id, name: &'static str) -> Result<SparseColumns, HandError> {
        let (data, indices, starts) = (
            self.part(id, "data", name)?,
            self.part(id, "indices", name)?,
            self.part(id, "indptr", name)?,
        );
        let data = self.array(data, name)?.values;
        let indices = self.array(indices, name)?.values;
        let starts = self.array(starts, name)?.values;
        let shape = self.part(id, "_shape", name)?;
        let Some([rows, columns]) = self
            .sizes(shape)
            .and_then(|s| <[usize; 2]>::try_from(s).ok())
        else {
            return Err(fault(
                name,
                "is a sparse matrix without a shape of two sides",
            ));
        };
        let is_sound = starts.len() == columns.saturating_add(1)
            && starts.first() == Some(&0.0)
            && starts.is_sorted()
            && starts.last() == Some(&(data.len() as f64))
            && indices.len() == data.len()
            && indices.iter().all(|&row| row >= 0.0 && row < rows as f64);
        if !is_sound {
            return Err(fault(
                name,
                "is a sparse matrix whose parts do not fit each other; the file is damaged",
            ));
        }
        let mut entries = Vec::with_capacity(data.len());
        for column in 0..columns {
            for at in starts[column] as usize..starts[column + 1] as usize {
                entries.push((indices[at] as usize, column, data[at]));
            }
        }
        Ok(SparseColumns {
            rows,
            columns,
            entries,
        })
    }

    fn wrapped_array(&self, id: Id, name: &'static str, depth: usize) -> Result<Array, HandError> {
        if depth == 0 {
            return Err(fault(
                name,
                "is wrapped too many times; the file is damaged",
            ));
        }
        match self.value(id) {
            Value::Object {
                class: Global::Reconstruct,
                state: Some(state),
                ..
            } => self.numpy_array(*state, name),
            Value::Object {
                class: Global::Chumpy,
                ..
            } => self.wrapped_array(self.part(id, "x", name)?, name, depth - 1),
            Value::Object {
                class: Global::Select,
                ..
            } => self.selected(id, name, depth - 1),
            _ => Err(fault(name, "is not an array of numbers")),
        }
    }

    /// x.ravel()\[idxs\].reshape(preferred_shape)
    fn selected(&self, id: Id, name: &'static str, depth: usize) -> Result<Array, HandError> {
        let from = self
            .wrapped_array(self.part(id, "a", name)?, name, depth)?
            .values;
        let places = self
            .wrapped_array(self.part(id, "idxs", name)?, name, depth)?
            .values;
        let shape = self.part(id, "preferred_shape", name)?;
        let shape = self
            .sizes(shape)
            .ok_or_else(|| fault(name, "is a selection without a shape"))?;
        let count = shape
            .iter()
            .try_fold(1_usize, |count, &side| count.checked_mul(side));
        if count != Some(places.len()) || shape.len() > MAX_DIMENSIONS {
            return Err(fault(
                name,
                "is a selection whose shape does not fit it; the file is damaged",
            ));
        }
        let pick = |&place: &f64| {
            let is_place = place >= 0.0 && place < from.len() as f64;
            is_place.then(|| from[place as usize])
        };
        let values: Option<Vec<f64>> = places.iter().map(pick).collect();
        let values = values.ok_or_else(|| {
            fault(
                name,
                "selects numbers that are not there; the file is damaged",
            )
        })?;
        Ok(Array { shape, values })
    }

    /// State of an array: version, shape, type, whether first index fastest, bytes.
    fn numpy_array(&self, state: Id, name: &'static str) -> Result<Array, HandError> {
        let damaged = || {
            fault(
                name,
                "is no array that NumPy would write; the file is damaged",
            )
        };
        let Value::Tuple(parts) = self.value(state) else {
            return Err(damaged());
        };
        let &[_version, shape, number, order, bytes] = parts.as_slice() else {
            return Err(damaged());
        };
        let Value::Bytes(bytes) = self.value(bytes) else {
            return Err(fault(name, "holds objects instead of numbers"));
        };
        let is_fortran = match self.value(order) {
            Value::Bool(order) => *order,
            Value::Integer(order) => *order != 0,
            _ => return Err(damaged()),
        };
        let stored = StoredArray {
            number: self.number_type(number, name)?,
            shape: self.sizes(shape).ok_or_else(damaged)?,
            is_fortran,
            bytes,
        };
        stored.decode(name)
    }

    /// dtype('f8', ...) with state (3, '<', ...).
    fn number_type(&self, id: Id, name: &'static str) -> Result<NumberType, HandError> {
        let parsed = || {
            let Value::Object {
                class: Global::DataType,
                arguments,
                state,
            } = self.value(id)
            else {
                return None;
            };
            let Value::Tuple(arguments) = self.value(*arguments) else {
                return None;
            };
            let code = self.text(*arguments.first()?)?;
            let is_big_endian = state.is_some_and(|state| match self.value(state) {
                Value::Tuple(state) => state.get(1).and_then(|&id| self.text(id)) == Some(">"),
                _ => false,
            });
            NumberType::parse(code, is_big_endian)
        };
        parsed().ok_or_else(|| fault(name, "has a type that is neither real numbers nor integers"))
    }

    /// Returns a number of one of NumPy's own types, from the type and the bytes that it is made of.
    ///
    /// # Errors
    /// [`HandError::BadModel`].
    pub(crate) fn scalar(&self, arguments: Id) -> Result<f64, HandError> {
        const NAME: &str = "number";
        let damaged = || fault(NAME, "is none that NumPy would write; the file is damaged");
        let Value::Tuple(arguments) = self.value(arguments) else {
            return Err(damaged());
        };
        let &[number, bytes] = arguments.as_slice() else {
            return Err(damaged());
        };
        let Value::Bytes(bytes) = self.value(bytes) else {
            return Err(damaged());
        };
        let stored = StoredArray {
            number: self.number_type(number, NAME)?,
            shape: Vec::new(),
            is_fortran: false,
            bytes,
        };
        stored
            .decode(NAME)?
            .values
            .first()
            .copied()
            .ok_or_else(damaged)
    }

    /// Returns the sides and the members of an array of objects, given its state; `None` if it is none.
    pub(crate) fn objects(&self, state: Id) -> Option<(Vec<usize>, &[Id])> {
        let Value::Tuple(parts) = self.value(state) else {
            return None;
        };
        let &[_version, shape, _type, _order, members] = parts.as_slice() else {
            return None;
        };
        let Value::List(members) = self.value(members) else {
            return None;
        };
        let shape = self.sizes(shape)?;
        let count = (shape.iter()).try_fold(1_usize, |count, &side| count.checked_mul(side));
        (count == Some(members.len())).then_some((shape, members.as_slice()))
    }

    fn text(&self, id: Id) -> Option<&str> {
        match self.value(id) {
            Value::Bytes(bytes) => std::str::from_utf8(bytes).ok(),
            _ => None,
        }
    }

    /// Returns a tuple of sizes.
    fn sizes(&self, id: Id) -> Option<Vec<usize>> {
        let (Value::Tuple(sides) | Value::List(sides)) = self.value(id) else {
            return None;
        };
        let size = |&side: &Id| match self.value(side) {
            Value::Integer(size) => usize::try_from(*size).ok(),
            _ => None,
        };
        sides.iter().map(size).collect()
    }

    /// Returns an attribute of an object.
    fn part(&self, id: Id, part: &str, name: &'static str) -> Result<Id, HandError> {
        let state = match self.value(id) {
            Value::Object { state, .. } => *state,
            _ => None,
        };
        state
            .and_then(|state| self.entry(state, part))
            .ok_or_else(|| {
                fault(
                    name,
                    &format!("lacks its part `{part}`; the file is damaged"),
                )
            })
    }
}

fn fault(array: &'static str, fault: &str) -> HandError {
    HandError::BadModel {
        array,
        fault: fault.to_owned(),
    }
}
