//! One process at a time for each part of a batch.
//!
//! The locks are the operating system's: those of a process that was killed are gone with it.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use super::plan::Shard;
use crate::GraspError;

/// The folder of the lock files.
pub(super) const LOCKS: &str = ".locks";

/// Held while a process works on a shard.
#[derive(Debug)]
pub(super) struct ShardLock {
    /// Of this shard alone.
    _shard: File,
    /// Of all that split the batch into as many.
    _split: File,
}

impl ShardLock {
    /// Takes the locks of a shard.
    ///
    /// # Errors
    /// [`GraspError::Locked`] if another process works on the shard, or on a shard of another split.
    pub(super) fn take(folder: &Path, shard: Shard) -> Result<Self, GraspError> {
        let locks = folder.join(LOCKS);
        std::fs::create_dir_all(&locks).map_err(|error| write_error(&locks, error))?;
        let _gate = gate(folder)?;
        let own_split = split_name(shard.count());
        let entries = std::fs::read_dir(&locks).map_err(|error| write_error(&locks, error))?;
        for entry in entries {
            let entry = entry.map_err(|error| write_error(&locks, error))?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let is_other = name.starts_with("split-") && name != own_split;
            if is_other && !try_lock(&open(&entry.path())?, &entry.path(), false)? {
                return Err(locked(
                    folder,
                    "another process works on it, with another --shard I/N",
                ));
            }
        }
        let split_path = locks.join(own_split);
        let split = open(&split_path)?;
        let path = locks.join(format!("shard-{}", shard.to_string().replace('/', "-of-")));
        let own = open(&path)?;
        if !try_lock(&split, &split_path, true)? || !try_lock(&own, &path, false)? {
            let what = if shard == Shard::WHOLE {
                "another process works on it".into()
            } else {
                format!("another process works on its shard {shard}")
            };
            return Err(locked(folder, &what));
        }
        Ok(Self {
            _shard: own,
            _split: split,
        })
    }
}

/// Waits for the lock of what all shards share; held until the file is dropped.
pub(super) fn gate(folder: &Path) -> Result<File, GraspError> {
    let path = folder.join(LOCKS).join("gate");
    let file = open(&path)?;
    file.lock().map_err(|error| write_error(&path, error))?;
    Ok(file)
}

fn split_name(count: usize) -> String {
    format!("split-{count}")
}

fn open(path: &Path) -> Result<File, GraspError> {
    let options = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(path);
    options.map_err(|error| write_error(path, error))
}

fn try_lock(file: &File, path: &Path, is_shared: bool) -> Result<bool, GraspError> {
    let result = if is_shared {
        file.try_lock_shared()
    } else {
        file.try_lock()
    };
    match result {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(write_error(path, error)),
    }
}

fn locked(folder: &Path, what: &str) -> GraspError {
    GraspError::Locked {
        path: folder.to_owned(),
        what: what.to_owned(),
    }
}

fn write_error(path: &Path, source: std::io::Error) -> GraspError {
    GraspError::Write {
        path: PathBuf::from(path),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_has_one_process_and_a_batch_one_split() {
        let folder = tempfile::tempdir().unwrap();
        let take = |text: &str| ShardLock::take(folder.path(), text.parse().unwrap());
        let first = take("1/2").unwrap();
        let again = take("1/2").unwrap_err().to_string();
        assert!(again.contains("shard 1/2"), "{again}");
        let second = take("2/2").unwrap();
        for other in ["1/1", "1/3"] {
            let error = take(other).unwrap_err().to_string();
            assert!(error.contains("another --shard"), "{error}");
        }
        drop(first);
        assert!(take("1/1").is_err());
        drop(second);
        let whole = take("1/1").unwrap();
        assert!(
            take("1/1")
                .unwrap_err()
                .to_string()
                .contains("another process works on it;")
        );
        drop(whole);
        take("2/3").unwrap();
    }
}
