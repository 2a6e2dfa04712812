//! Arrays as NumPy stores them: a type, a shape, an order and bytes.

use super::pickle_literals::readable;
use crate::HandError;

/// NumPy allows 32 (64 since 2.0); models have 3.
pub(crate) const MAX_DIMENSIONS: usize = 8;

/// A numeric type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NumberType {
    kind: Kind,
    size: usize,
    is_big_endian: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Float,
    Signed,
    Unsigned,
}

impl NumberType {
    /// From NumPy's name without byte order, such as `f8` or `u4`.
    pub(crate) fn parse(name: &str, is_big_endian: bool) -> Option<Self> {
        let (kind, size) = match name {
            "f8" => (Kind::Float, 8),
            "f4" => (Kind::Float, 4),
            "i8" => (Kind::Signed, 8),
            "i4" => (Kind::Signed, 4),
            "i2" => (Kind::Signed, 2),
            "i1" => (Kind::Signed, 1),
            "u8" => (Kind::Unsigned, 8),
            "u4" => (Kind::Unsigned, 4),
            "u2" => (Kind::Unsigned, 2),
            "u1" | "b1" => (Kind::Unsigned, 1),
            _ => return None,
        };
        Some(Self {
            kind,
            size,
            is_big_endian,
        })
    }

    fn read(self, bytes: &[u8]) -> f64 {
        let mut little = [0; 8];
        little[..self.size].copy_from_slice(bytes);
        if self.is_big_endian {
            little[..self.size].reverse();
        }
        let unsigned = u64::from_le_bytes(little);
        match (self.kind, self.size) {
            (Kind::Float, 8) => f64::from_bits(unsigned),
            (Kind::Float, _) => f64::from(f32::from_bits(unsigned as u32)),
            (Kind::Unsigned, _) => unsigned as f64,
            (Kind::Signed, size) => {
                let unused = 64 - 8 * size as u32;
                ((unsigned << unused) as i64 >> unused) as f64
            }
        }
    }
}

/// An array whose bytes lie in a file that was read.
#[derive(Clone, Debug)]
pub(crate) struct StoredArray<'a> {
    pub(crate) number: NumberType,
    pub(crate) shape: Vec<usize>,
    pub(crate) is_fortran: bool,
    pub(crate) bytes: &'a [u8],
}

/// Numbers row by row, the last index running fastest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Array {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl StoredArray<'_> {
    /// Decodes the numbers; needs memory in proportion to the bytes, whatever the shape claims.
    pub(crate) fn decode(&self, name: &'static str) -> Result<Array, HandError> {
        let count = self
            .shape
            .iter()
            .try_fold(1_usize, |count, &side| count.checked_mul(side));
        let size = count.and_then(|count| count.checked_mul(self.number.size));
        if size != Some(self.bytes.len()) || self.shape.len() > MAX_DIMENSIONS {
            return Err(HandError::BadModel {
                array: name,
                fault: format!(
                    "has {} bytes, which do not fit the shape that it claims; the file is damaged",
                    self.bytes.len()
                ),
            });
        }
        let stored = self.bytes.chunks_exact(self.number.size);
        let stored: Vec<f64> = stored.map(|bytes| self.number.read(bytes)).collect();
        let values = if self.is_fortran {
            row_by_row(&self.shape, &stored)
        } else {
            stored
        };
        Ok(Array {
            shape: self.shape.clone(),
            values,
        })
    }
}

/// Numbers stored first index fastest, in the other order.
fn row_by_row(shape: &[usize], stored: &[f64]) -> Vec<f64> {
    let mut index = vec![0; shape.len()];
    let mut values = Vec::with_capacity(stored.len());
    for _ in 0..stored.len() {
        let mut at = 0;
        for (side, position) in shape.iter().zip(&index).rev() {
            at = at * side + position;
        }
        values.push(stored[at]);
        for (side, position) in shape.iter().zip(&mut index).rev() {
            *position += 1;
            if *position < *side {
                break;
            }
            *position = 0;
        }
    }
    values
}

const DAMAGED: &str = "is no .npy array, or a damaged one";

/// Splits a `.npy` file, format 1 to 3, into its header and the data behind it.
///
/// # Errors
/// What is wrong, in words.
pub(crate) fn npy_header(bytes: &[u8]) -> Result<(&str, &[u8]), String> {
    let split = || {
        let rest = bytes.strip_prefix(b"\x93NUMPY")?;
        let (&[major, _minor], rest) = rest.split_first_chunk()?;
        let (length, rest) = if major == 1 {
            let (length, rest) = rest.split_first_chunk()?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        } else {
            let (length, rest) = rest.split_first_chunk()?;
            (u32::from_le_bytes(*length) as usize, rest)
        };
        let (header, data) = rest.split_at_checked(length)?;
        Some((std::str::from_utf8(header).ok()?, data))
    };
    split().ok_or_else(|| DAMAGED.to_owned())
}

/// Reads the array in a `.npy` file, format 1 to 3.
///
/// # Errors
/// What is wrong, in words.
pub(crate) fn parse_npy(bytes: &[u8]) -> Result<StoredArray<'_>, String> {
    let (header, data) = npy_header(bytes)?;
    let damaged = || DAMAGED.to_owned();
    let after = |key: &str| {
        let (_, after) = header.split_once(key)?;
        Some(after.trim_start().strip_prefix(':')?.trim_start())
    };
    let name = after("'descr'")
        .and_then(|text| text.strip_prefix('\'')?.split_once('\''))
        .map(|(name, _)| name)
        .ok_or_else(|| "has records or objects instead of numbers".to_owned())?;
    let number = NumberType::parse(
        name.trim_start_matches(['<', '>', '|', '=']),
        name.starts_with('>'),
    )
    .ok_or_else(|| {
        let name = readable(name.as_bytes());
        format!("has the type `{name:.20}`, where real numbers or integers are expected")
    })?;
    let is_fortran = after("'fortran_order'")
        .ok_or_else(damaged)?
        .starts_with("True");
    let (shape, _) = after("'shape'")
        .and_then(|text| text.strip_prefix('(')?.split_once(')'))
        .ok_or_else(damaged)?;
    let sides = shape
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty());
    let shape = sides
        .map(|side| side.trim_end_matches('L').parse())
        .collect::<Result<Vec<usize>, _>>()
        .map_err(|_| damaged())?;
    Ok(StoredArray {
        number,
        shape,
        is_fortran,
        bytes: data,
    })
}
