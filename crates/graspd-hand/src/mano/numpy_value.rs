//! What NumPy saved in an `.npy` file, of numbers or of Python's objects; nothing in it is run.

use super::numpy::{npy_header, parse_npy};
use super::pickle::{Global, Id, Pickle, Value};
use crate::HandError;

/// Lists in dictionaries in lists ...: no file of data is nested deeper, and a cycle has no end.
const MAX_DEPTH: usize = 16;
/// What is referred to twice is copied, so that a small file could fill the memory: copies may take this much
/// \[bytes\].
const MAX_BYTES: usize = 1 << 27;

/// A plain value of an `.npy` file.
#[derive(Clone, Debug, PartialEq)]
pub enum NumpyValue {
    /// `None`.
    Null,
    /// A number of any type; `True` is 1.
    Number(f64),
    /// A string (or bytes that are UTF-8).
    Text(String),
    /// A list, a tuple, or an array of objects.
    List(Vec<NumpyValue>),
    /// A dictionary; keys that are no strings are left out.
    Dict(Vec<(String, NumpyValue)>),
    /// An array of numbers, the last index running fastest.
    Array {
        /// Its sides; none for a single number.
        shape: Vec<usize>,
        /// As many as the product of the sides.
        values: Vec<f64>,
    },
}

impl NumpyValue {
    /// Returns the value under a key of a dictionary, the last one as Python has it; `None` for other values.
    pub fn get(&self, key: &str) -> Option<&Self> {
        let Self::Dict(entries) = self else {
            return None;
        };
        let found = entries.iter().rev().find(|(name, _)| name == key);
        found.map(|(_, value)| value)
    }

    /// Returns the number that this is, or that an array of one number holds.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Array { values, .. } if values.len() == 1 => values.first().copied(),
            _ => None,
        }
    }
}

/// Reads an `.npy` file: an array of numbers, or objects as `numpy.save` pickles them (numbers, strings, lists,
/// tuples, dictionaries and arrays of any protocol).
///
/// Nothing is run: classes and functions other than those of NumPy's arrays are refused, and those are known by name,
/// not called. An object array without sides is the object itself.
///
/// # Errors
/// What is wrong with the file, in words.
pub fn read_npy(bytes: &[u8]) -> Result<NumpyValue, String> {
    if let Some(pickle) = object_pickle(bytes)? {
        let pickle = Pickle::parse_any_protocol(pickle).map_err(in_words)?;
        let mut left = MAX_BYTES;
        return plain(&pickle, pickle.root(), MAX_DEPTH, &mut left);
    }
    let array = parse_npy(bytes)?.decode("array").map_err(in_words)?;
    Ok(NumpyValue::Array {
        shape: array.shape,
        values: array.values,
    })
}

/// Returns the pickle of an array of objects; `None` if the array is of another type.
fn object_pickle(bytes: &[u8]) -> Result<Option<&[u8]>, String> {
    let (header, data) = npy_header(bytes)?;
    let is_object = header.contains("'|O'") || header.contains("'O'");
    Ok(is_object.then_some(data))
}

fn in_words(error: HandError) -> String {
    match error {
        HandError::BadPickle(fault) => format!("is damaged, or no file of NumPy's: {fault}"),
        HandError::RefusedGlobal { name } => format!(
            "names `{name}`: refused, and nothing was run; save numbers, strings, lists, dictionaries and arrays only"
        ),
        HandError::BadModel { array, fault } => format!("{array} {fault}"),
        other => other.to_string(),
    }
}

fn spend(left: &mut usize, bytes: usize) -> Result<(), String> {
    *left = (left.checked_sub(bytes))
        .ok_or_else(|| format!("holds more than {} MiB of data", MAX_BYTES >> 20))?;
    Ok(())
}

fn text(bytes: &[u8], left: &mut usize) -> Result<String, String> {
    spend(left, bytes.len())?;
    Ok(String::from_utf8_lossy(bytes).into_owned())
}

fn plain(
    pickle: &Pickle<'_>,
    id: Id,
    deepest: usize,
    left: &mut usize,
) -> Result<NumpyValue, String> {
    if deepest == 0 {
        return Err(format!("is nested deeper than {MAX_DEPTH} levels"));
    }
    spend(left, size_of::<NumpyValue>())?;
    let list = |items: &[Id], left: &mut usize| -> Result<Vec<NumpyValue>, String> {
        let item = |&item: &Id| plain(pickle, item, deepest - 1, left);
        items.iter().map(item).collect()
    };
    Ok(match pickle.value(id) {
        Value::None => NumpyValue::Null,
        Value::Bool(value) => NumpyValue::Number(f64::from(u8::from(*value))),
        Value::Integer(value) => NumpyValue::Number(*value as f64),
        Value::Float(value) => NumpyValue::Number(*value),
        Value::Bytes(bytes) => NumpyValue::Text(text(bytes, left)?),
        Value::Tuple(items) | Value::List(items) => NumpyValue::List(list(items, left)?),
        Value::Dict(entries) => {
            let mut plain_entries = Vec::new();
            for &(key, value) in entries {
                if let Value::Bytes(key) = pickle.value(key) {
                    let value = plain(pickle, value, deepest - 1, left)?;
                    plain_entries.push((text(key, left)?, value));
                }
            }
            NumpyValue::Dict(plain_entries)
        }
        Value::Object {
            class: Global::Scalar,
            arguments,
            ..
        } => NumpyValue::Number(pickle.scalar(*arguments).map_err(in_words)?),
        Value::Object {
            class: Global::Reconstruct,
            state: Some(state),
            ..
        } => match pickle.objects(*state) {
            // Without sides: the one object that it holds.
            Some((shape, &[only])) if shape.is_empty() => plain(pickle, only, deepest - 1, left)?,
            Some((_, items)) => NumpyValue::List(list(items, left)?),
            None => {
                let array = pickle.array(id, "array").map_err(in_words)?;
                spend(left, size_of_val(array.values.as_slice()))?;
                NumpyValue::Array {
                    shape: array.shape,
                    values: array.values,
                }
            }
        },
        Value::Global(_) | Value::Object { .. } => {
            return Err("holds an object that is no array of NumPy's".into());
        }
    })
}
