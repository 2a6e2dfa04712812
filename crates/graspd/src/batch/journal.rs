//! The starts of a run that goes on, one a line, each on the disk before it counts.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use crate::GraspError;
use crate::record::GraspRecord;
use crate::record_file::write_atomically;

/// A start that gave no grasp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartFailure {
    /// Which start; `None` for all of a run's.
    pub index: Option<usize>,
    /// Why.
    pub error: String,
}

/// What became of a start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartOutcome {
    /// A grasp, judged but not ranked.
    Grasp(Box<GraspRecord>),
    /// None.
    Failure(StartFailure),
}

impl StartOutcome {
    /// Which start.
    pub fn index(&self) -> Option<usize> {
        match self {
            Self::Grasp(record) => Some(record.index),
            Self::Failure(failure) => failure.index,
        }
    }
}

/// A file that grows by a line for each start.
#[derive(Debug)]
pub(super) struct Journal {
    path: PathBuf,
    file: Mutex<File>,
}

impl Journal {
    /// Opens a journal, with what it holds already. A line that was cut short, and what comes after it, is cut off.
    ///
    /// # Errors
    /// If the file cannot be read or written.
    pub(super) fn open(path: &Path) -> Result<(Self, Vec<StartOutcome>), GraspError> {
        let (outcomes, kept) = match std::fs::read(path) {
            Ok(bytes) => {
                let (outcomes, length) = whole_lines(&bytes);
                (
                    outcomes,
                    (length < bytes.len()).then(|| bytes[..length].to_vec()),
                )
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => (Vec::new(), None),
            Err(source) => {
                return Err(GraspError::Read {
                    path: path.to_owned(),
                    source,
                });
            }
        };
        if let Some(kept) = kept {
            write_atomically(path, &kept)?;
        }
        let file = OpenOptions::new().create(true).append(true).open(path);
        let file = file.map_err(|source| GraspError::Write {
            path: path.to_owned(),
            source,
        })?;
        let journal = Self {
            path: path.to_owned(),
            file: Mutex::new(file),
        };
        Ok((journal, outcomes))
    }

    /// Adds a start; it is on the disk when this returns.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn append(&self, outcome: &StartOutcome) -> Result<(), GraspError> {
        let failed = |source| GraspError::Write {
            path: self.path.clone(),
            source,
        };
        let mut line = serde_json::to_vec(outcome).map_err(|error| failed(error.into()))?;
        line.push(b'\n');
        // Who panicked while it held the lock has left at worst half a line, as a kill would.
        let mut file = self
            .file
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        file.write_all(&line)
            .and_then(|()| file.sync_data())
            .map_err(failed)
    }
}

/// The outcomes of the leading whole lines, and how many bytes these have.
fn whole_lines(bytes: &[u8]) -> (Vec<StartOutcome>, usize) {
    let (mut outcomes, mut length) = (Vec::new(), 0);
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let Some(text) = line.strip_suffix(b"\n") else {
            break;
        };
        let Ok(outcome) = serde_json::from_slice(text) else {
            break;
        };
        outcomes.push(outcome);
        length += line.len();
    }
    (outcomes, length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failure(index: usize) -> StartOutcome {
        StartOutcome::Failure(StartFailure {
            index: Some(index),
            error: "it \n failed".into(),
        })
    }

    #[test]
    fn what_was_cut_short_is_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        let (journal, before) = Journal::open(&path).unwrap();
        assert!(before.is_empty());
        for index in 0..3 {
            journal.append(&failure(index)).unwrap();
        }
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let line = whole.len() / 3;
        for length in 0..=whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let (journal, outcomes) = Journal::open(&path).unwrap();
            assert_eq!(
                outcomes,
                (0..length / line).map(failure).collect::<Vec<_>>()
            );
            for index in outcomes.len()..3 {
                journal.append(&failure(index)).unwrap();
            }
            assert_eq!(std::fs::read(&path).unwrap(), whole);
        }
        // Zeros, as a disk may leave after a power cut.
        std::fs::write(&path, [&whole[..line], &[0; 100], &whole[line..]].concat()).unwrap();
        assert_eq!(Journal::open(&path).unwrap().1, [failure(0)]);
    }
}
