//! A reader of pickles that runs nothing: it builds plain values, and knows by name the few classes that MANO's files
//! name.
//!
//! Values lie in one list and refer to each other by number, so that neither cycles nor nesting cost anything to read
//! or to drop. Strings and arrays stay in the file's own bytes.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::pickle_literals::{bad, decimal, long, readable, unquoted};
use crate::HandError;

/// More values than any hand's file has.
const MAX_VALUES: usize = 1 << 20;
/// What Python 2 wrote, and so MANO's files are of.
const PROTOCOL_OF_PYTHON_2: u8 = 2;
/// The newest protocol; NumPy writes 3 or 4.
const NEWEST_PROTOCOL: u8 = 5;

/// A value's number.
pub(crate) type Id = u32;

/// The classes and functions that a file may name. None of them is ever called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Global {
    Reconstruct,
    Array,
    DataType,
    Set,
    Chumpy,
    Select,
    SparseColumns,
    Scalar,
}

impl Global {
    fn named(module: &[u8], name: &[u8]) -> Option<Self> {
        Some(match (module, name) {
            (b"numpy.core.multiarray" | b"numpy._core.multiarray", b"_reconstruct") => {
                Self::Reconstruct
            }
            (b"numpy.core.multiarray" | b"numpy._core.multiarray", b"scalar") => Self::Scalar,
            (b"numpy", b"ndarray") => Self::Array,
            (b"numpy", b"dtype") => Self::DataType,
            (b"__builtin__", b"set") => Self::Set,
            (b"chumpy.ch", b"Ch") => Self::Chumpy,
            (b"chumpy.reordering", b"Select") => Self::Select,
            (b"scipy.sparse.csc", b"csc_matrix") => Self::SparseColumns,
            _ => return None,
        })
    }
}

/// What a pickle holds.
#[derive(Clone, Debug)]
pub(crate) enum Value<'a> {
    None,
    Bool(bool),
    Integer(i64),
    Float(f64),
    /// A string of either kind.
    Bytes(Cow<'a, [u8]>),
    Tuple(Vec<Id>),
    List(Vec<Id>),
    Dict(Vec<(Id, Id)>),
    Global(Global),
    /// What a class or function would have made of its arguments, and the state that it was given.
    Object {
        class: Global,
        arguments: Id,
        state: Option<Id>,
    },
}

/// A pickle that was read.
#[derive(Debug)]
pub(crate) struct Pickle<'a> {
    values: Vec<Value<'a>>,
    root: Id,
}

impl<'a> Pickle<'a> {
    /// Reads a pickle of protocol 0, 1 or 2.
    ///
    /// Time and memory are in proportion to `bytes`.
    ///
    /// # Errors
    /// [`HandError::BadPickle`], or [`HandError::RefusedGlobal`] for a class or function that MANO files do not name.
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Self, HandError> {
        Self::parse_up_to(PROTOCOL_OF_PYTHON_2, bytes)
    }

    /// Reads a pickle of any protocol, as NumPy puts one into an `.npy` file of objects.
    ///
    /// # Errors
    /// As for [`Self::parse`].
    pub(crate) fn parse_any_protocol(bytes: &'a [u8]) -> Result<Self, HandError> {
        Self::parse_up_to(NEWEST_PROTOCOL, bytes)
    }

    fn parse_up_to(protocol: u8, bytes: &'a [u8]) -> Result<Self, HandError> {
        let mut machine = Machine {
            newest: protocol,
            rest: bytes,
            values: Vec::new(),
            stack: Vec::new(),
            marks: Vec::new(),
            memo: BTreeMap::new(),
        };
        loop {
            if let Some(root) = machine.step()? {
                return Ok(Self {
                    values: machine.values,
                    root,
                });
            }
        }
    }

    pub(crate) fn root(&self) -> Id {
        self.root
    }

    pub(crate) fn value(&self, id: Id) -> &Value<'a> {
        // Numbers are handed out by the machine alone.
        &self.values[id as usize]
    }

    /// Returns the string keys of the root.
    pub(crate) fn keys(&self) -> Vec<String> {
        let Value::Dict(entries) = self.value(self.root) else {
            return Vec::new();
        };
        let names = entries
            .iter()
            .filter_map(|&(key, _)| match self.value(key) {
                Value::Bytes(bytes) => Some(readable(bytes)),
                _ => None,
            });
        names.collect()
    }

    /// Returns the value under a string key of a dictionary: the last one, as Python has it.
    pub(crate) fn entry(&self, dict: Id, key: &str) -> Option<Id> {
        let Value::Dict(entries) = self.value(dict) else {
            return None;
        };
        let is_key =
            |id: Id| matches!(self.value(id), Value::Bytes(bytes) if **bytes == *key.as_bytes());
        entries
            .iter()
            .rev()
            .find(|(name, _)| is_key(*name))
            .map(|(_, value)| *value)
    }
}

struct Machine<'a> {
    /// The newest protocol whose files are taken.
    newest: u8,
    rest: &'a [u8],
    values: Vec<Value<'a>>,
    stack: Vec<Id>,
    /// Heights of the stack.
    marks: Vec<usize>,
    /// By number; numbers may leave gaps, so that a list of them could outgrow the file.
    memo: BTreeMap<usize, Id>,
}

impl<'a> Machine<'a> {
    /// Obeys one instruction; gives the root at the last.
    fn step(&mut self) -> Result<Option<Id>, HandError> {
        let [code] = *self.take::<1>()?;
        match code {
            b'.' => return self.pop().map(Some),
            0x80 => {
                let [protocol] = *self.take::<1>()?;
                if protocol > self.newest {
                    let newest = self.newest;
                    return bad(if newest == PROTOCOL_OF_PYTHON_2 {
                        format!(
                            "it is of protocol {protocol}, MANO's own files are of protocol {newest} or less"
                        )
                    } else {
                        format!("it is of protocol {protocol}; protocols up to {newest} are known")
                    });
                }
            }
            b'(' => self.mark()?,
            b'0' => {
                // Python's POP takes a mark if there is nothing above it.
                if self.marks.last() == Some(&self.stack.len()) {
                    self.marks.pop();
                } else {
                    self.pop()?;
                }
            }
            b'1' => {
                self.above_mark()?;
            }
            b'2' => {
                let top = self.top()?;
                self.push_id(top)?;
            }
            b'q' => {
                let [index] = *self.take::<1>()?;
                self.put(index.into())?;
            }
            b'r' => {
                let index = u32::from_le_bytes(*self.take()?);
                self.put(index as usize)?;
            }
            b'p' => {
                let index = self.decimal_line()?;
                self.put(usize::try_from(index).unwrap_or(usize::MAX))?;
            }
            b'h' => {
                let [index] = *self.take::<1>()?;
                self.get(index.into())?;
            }
            b'j' => {
                let index = u32::from_le_bytes(*self.take()?);
                self.get(index as usize)?;
            }
            b'g' => {
                let index = self.decimal_line()?;
                self.get(usize::try_from(index).unwrap_or(usize::MAX))?;
            }
            // Protocol 4: a frame's length, which nothing here depends on, and the next free number of the memo.
            0x95 => {
                self.take::<8>()?;
            }
            0x94 => self.put(self.memo.len())?,
            0x93 => self.global_from_stack()?,
            b'c' => self.global()?,
            b'R' | 0x81 => self.object()?,
            b'b' => self.build()?,
            b']' | b')' | b'}' | b'l' | b't' | b'd' | 0x85..=0x87 | b'a' | b'e' | b's' | b'u' => {
                self.collect(code)?;
            }
            _ => {
                let value = self.plain_value(code)?;
                self.push(value)?;
            }
        }
        Ok(None)
    }

    /// Numbers and strings.
    fn plain_value(&mut self, code: u8) -> Result<Value<'a>, HandError> {
        Ok(match code {
            b'N' => Value::None,
            0x88 => Value::Bool(true),
            0x89 => Value::Bool(false),
            b'K' => Value::Integer(self.take::<1>()?[0].into()),
            b'M' => Value::Integer(u16::from_le_bytes(*self.take()?).into()),
            b'J' => Value::Integer(i32::from_le_bytes(*self.take()?).into()),
            b'I' => match self.line()? {
                b"00" => Value::Bool(false),
                b"01" => Value::Bool(true),
                digits => Value::Integer(decimal(digits)?),
            },
            b'L' => Value::Integer(self.decimal_line()?),
            0x8a => {
                let [length] = *self.take::<1>()?;
                Value::Integer(long(self.bytes(length.into())?)?)
            }
            0x8b => {
                let length = self.length()?;
                Value::Integer(long(self.bytes(length)?)?)
            }
            b'F' => {
                let text = std::str::from_utf8(self.line()?).unwrap_or_default();
                match text.trim().parse() {
                    Ok(number) => Value::Float(number),
                    Err(_) => return bad("it has something else where a number is due"),
                }
            }
            b'G' => Value::Float(f64::from_be_bytes(*self.take()?)),
            b'U' | b'C' | 0x8c => {
                let [length] = *self.take::<1>()?;
                Value::Bytes(Cow::Borrowed(self.bytes(length.into())?))
            }
            b'T' | b'X' | b'B' => {
                let length = self.length()?;
                Value::Bytes(Cow::Borrowed(self.bytes(length)?))
            }
            0x8d | 0x8e => {
                let length = u64::from_le_bytes(*self.take()?);
                let length = usize::try_from(length).unwrap_or(usize::MAX);
                Value::Bytes(Cow::Borrowed(self.bytes(length)?))
            }
            b'S' => Value::Bytes(Cow::Owned(unquoted(self.line()?)?)),
            b'V' => Value::Bytes(Cow::Borrowed(self.line()?)),
            _ => return bad(format!("it has the unknown instruction 0x{code:02x}")),
        })
    }

    /// Tuples, lists and dictionaries.
    fn collect(&mut self, code: u8) -> Result<(), HandError> {
        let value = match code {
            b']' => Value::List(Vec::new()),
            b')' => Value::Tuple(Vec::new()),
            b'}' => Value::Dict(Vec::new()),
            b'l' => Value::List(self.above_mark()?),
            b't' => Value::Tuple(self.above_mark()?),
            b'd' => Value::Dict(pairs(&self.above_mark()?)?),
            0x85..=0x87 => {
                let count = usize::from(code - 0x84);
                let Some(start) = self.stack.len().checked_sub(count) else {
                    return bad("it takes values that are not there");
                };
                Value::Tuple(self.stack.split_off(start))
            }
            _ => return self.extend(code),
        };
        self.push(value)
    }

    /// Adds to the list or the dictionary that is on top.
    fn extend(&mut self, code: u8) -> Result<(), HandError> {
        let added = match code {
            b'a' => vec![self.pop()?],
            b's' => {
                let value = self.pop()?;
                vec![self.pop()?, value]
            }
            _ => self.above_mark()?,
        };
        let top = self.top()? as usize;
        match (&mut self.values[top], code) {
            (Value::List(list), b'a' | b'e') => list.extend(added),
            (Value::Dict(dict), b's' | b'u') => dict.extend(pairs(&added)?),
            _ => return bad("it adds to something that is neither list nor dictionary"),
        }
        Ok(())
    }

    fn global(&mut self) -> Result<(), HandError> {
        let (module, name) = (self.line()?, self.line()?);
        self.push_global(module, name)
    }

    /// Module and name as strings.
    fn global_from_stack(&mut self) -> Result<(), HandError> {
        let (name, module) = (self.pop()?, self.pop()?);
        let text = |id: Id| match &self.values[id as usize] {
            Value::Bytes(bytes) => Ok(bytes.to_vec()),
            _ => bad("it names a class by something that is no string"),
        };
        let (module, name) = (text(module)?, text(name)?);
        self.push_global(&module, &name)
    }

    fn push_global(&mut self, module: &[u8], name: &[u8]) -> Result<(), HandError> {
        match Global::named(module, name) {
            Some(global) => self.push(Value::Global(global)),
            None => Err(HandError::RefusedGlobal {
                name: format!("{}.{}", readable(module), readable(name)),
            }),
        }
    }

    fn object(&mut self) -> Result<(), HandError> {
        let arguments = self.pop()?;
        let class = self.pop()?;
        let Value::Global(class) = self.values[class as usize] else {
            return bad("it calls something that is no class");
        };
        self.push(Value::Object {
            class,
            arguments,
            state: None,
        })
    }

    fn build(&mut self) -> Result<(), HandError> {
        let given = self.pop()?;
        let top = self.top()? as usize;
        let Value::Object { state, .. } = &mut self.values[top] else {
            return bad("it gives a state to something that is no object");
        };
        *state = Some(given);
        Ok(())
    }

    fn push(&mut self, value: Value<'a>) -> Result<(), HandError> {
        if self.values.len() >= MAX_VALUES {
            return bad(format!("it has over {MAX_VALUES} values"));
        }
        self.values.push(value);
        self.push_id(self.values.len() as Id - 1)
    }
    fn push_id(&mut self, id: Id) -> Result<(), HandError> {
        if self.stack.len() >= MAX_VALUES {
            return bad(format!("it stacks over {MAX_VALUES} values"));
        }
        self.stack.push(id);
        Ok(())
    }
    /// Returns the top of the stack, which must lie above the last mark.
    fn top(&self) -> Result<Id, HandError> {
        let floor = self.marks.last().copied().unwrap_or(0);
        match self.stack.get(floor..).and_then(<[Id]>::last) {
            Some(&top) => Ok(top),
            None => bad("it takes a value that is not there"),
        }
    }
    fn pop(&mut self) -> Result<Id, HandError> {
        let top = self.top()?;
        self.stack.pop();
        Ok(top)
    }
    fn mark(&mut self) -> Result<(), HandError> {
        if self.marks.len() >= MAX_VALUES {
            return bad(format!("it sets over {MAX_VALUES} marks"));
        }
        self.marks.push(self.stack.len());
        Ok(())
    }
    fn above_mark(&mut self) -> Result<Vec<Id>, HandError> {
        match self.marks.pop() {
            Some(mark) if mark <= self.stack.len() => Ok(self.stack.split_off(mark)),
            _ => bad("it looks for a mark that is not there"),
        }
    }
    fn put(&mut self, index: usize) -> Result<(), HandError> {
        if index >= MAX_VALUES {
            return bad(format!("it remembers a value under the number {index}"));
        }
        self.memo.insert(index, self.top()?);
        Ok(())
    }
    fn get(&mut self, index: usize) -> Result<(), HandError> {
        match self.memo.get(&index) {
            Some(&id) => self.push_id(id),
            _ => bad(format!("it recalls a value {index} that it has not named")),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<&'a [u8; N], HandError> {
        match self.rest.split_first_chunk() {
            Some((bytes, rest)) => {
                self.rest = rest;
                Ok(bytes)
            }
            None => bad(ENDS),
        }
    }
    fn length(&mut self) -> Result<usize, HandError> {
        let length = u32::from_le_bytes(*self.take()?);
        Ok(length as usize)
    }
    fn bytes(&mut self, length: usize) -> Result<&'a [u8], HandError> {
        match self.rest.split_at_checked(length) {
            Some((bytes, rest)) => {
                self.rest = rest;
                Ok(bytes)
            }
            None => bad(ENDS),
        }
    }
    fn line(&mut self) -> Result<&'a [u8], HandError> {
        let Some(end) = self.rest.iter().position(|&byte| byte == b'\n') else {
            return bad(ENDS);
        };
        let line = &self.rest[..end];
        self.rest = &self.rest[end + 1..];
        Ok(line.strip_suffix(b"\r").unwrap_or(line))
    }
    fn decimal_line(&mut self) -> Result<i64, HandError> {
        decimal(self.line()?)
    }
}

const ENDS: &str = "it ends in the middle";

fn pairs(ids: &[Id]) -> Result<Vec<(Id, Id)>, HandError> {
    let (pairs, rest) = ids.as_chunks::<2>();
    if !rest.is_empty() {
        return bad("it has a key without a value");
    }
    Ok(pairs.iter().map(|&[key, value]| (key, value)).collect())
}
