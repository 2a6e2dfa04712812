//! A folder of results that can be computed again.
//!
//! An entry is a file named by what it was computed from: a kind, a version, and a hash of the inputs. It holds
//!
//! | bytes | what |
//! |---|---|
//! | 16 | `graspd cache 1\n` and a zero |
//! | 32 | the hash of the inputs |
//! | 8 | length of the content, little-endian |
//! | 32 | hash of the content |
//! | rest | the content |
//!
//! and is written under another name first, so that processes may share a folder. An entry that does not check, be
//! it cut short, altered, or another's, counts as absent and is replaced. Nothing that goes wrong with a cache stops
//! the work: it is done without, and [`DiskCache::fault`] tells.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime};

use crate::GeometryError;
use crate::whole_file::temporary_beside;

const MAGIC: [u8; 16] = *b"graspd cache 1\n\0";
const HASH_LEN: usize = blake3::OUT_LEN;
const HEADER_LEN: usize = MAGIC.len() + HASH_LEN + 8 + HASH_LEN;
/// Ends the name of every entry.
const EXTENSION: &str = "graspd-cache";
/// Ends the name of an entry while it is written.
const UNFINISHED: &str = "part";
/// An unfinished entry that nobody has written to for so long was left by a process that is gone.
const ABANDONED: Duration = Duration::from_secs(3600);

/// What an entry was computed from.
///
/// Two keys are equal only if kind, version and all inputs in their order are.
#[derive(Clone, Debug)]
pub struct CacheKey {
    name: String,
    hasher: blake3::Hasher,
}

impl CacheKey {
    /// `kind` names what is computed, in lower-case letters and hyphens; `version` counts up whenever the same
    /// inputs give another result, or the content is laid out in another way.
    pub fn new(kind: &str, version: u32) -> Self {
        let name = format!("{kind}-{version}");
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(name.len() as u64).to_le_bytes());
        hasher.update(name.as_bytes());
        Self { name, hasher }
    }

    /// Adds a whole number.
    #[must_use]
    pub fn with_count(mut self, count: usize) -> Self {
        self.hasher.update(&(count as u64).to_le_bytes());
        self
    }

    /// Adds numbers, to the last bit, and how many there are.
    #[must_use]
    pub fn with_numbers(self, numbers: impl IntoIterator<Item = f64>) -> Self {
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f64::to_le_bytes).collect();
        let mut counted = self.with_count(bytes.len());
        counted.hasher.update(&bytes);
        counted
    }

    fn hash(&self) -> [u8; HASH_LEN] {
        *self.hasher.finalize().as_bytes()
    }

    fn file_name(&self) -> String {
        format!(
            "{}-{}.{EXTENSION}",
            self.name,
            self.hasher.finalize().to_hex()
        )
    }
}

/// How much a cache holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CacheSize {
    /// Files.
    pub files: usize,
    /// Their length in total \[bytes\].
    pub bytes: u64,
}

/// A folder of results that can be computed again, shared by threads and processes; clones are the same cache.
///
/// ```
/// use graspd_geom::{CacheKey, DiskCache};
///
/// # let folder = tempfile::tempdir().unwrap();
/// let cache = DiskCache::new(folder.path().join("cache"), 1 << 20);
/// let key = CacheKey::new("square", 1).with_numbers([3.0]);
/// assert_eq!(cache.load(&key), None);
/// cache.store(&key, b"9");
/// assert_eq!(cache.load(&key), Some(b"9".to_vec()));
/// assert!(cache.fault().is_none());
/// ```
#[derive(Clone, Debug)]
pub struct DiskCache(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    folder: PathBuf,
    capacity: u64,
    fault: OnceLock<GeometryError>,
}

impl DiskCache {
    /// The most that [`DiskCache::new`] is usually told to hold: some thirty grids of 256^3 samples \[bytes\].
    pub const USUAL_CAPACITY: u64 = 2 << 30;

    /// A cache in `folder`, which is made when something is first stored; at most `capacity` bytes are kept, those
    /// used last.
    pub fn new(folder: impl Into<PathBuf>, capacity: u64) -> Self {
        Self(Arc::new(Inner {
            folder: folder.into(),
            capacity,
            fault: OnceLock::new(),
        }))
    }

    /// Where this user's caches belong: `$GRASPD_CACHE_DIR`; else `graspd` in `$XDG_CACHE_HOME`, if that is
    /// absolute; else in `~/.cache`, on macOS in `~/Library/Caches` and on Windows in `%LOCALAPPDATA%`. `None` where
    /// none of these is set.
    pub fn user_folder() -> Option<PathBuf> {
        let variable = |name| {
            let value = std::env::var_os(name)?;
            (!value.is_empty()).then(|| PathBuf::from(value))
        };
        if let Some(folder) = variable("GRASPD_CACHE_DIR") {
            return Some(folder);
        }
        let home = || {
            if cfg!(windows) {
                variable("LOCALAPPDATA")
            } else if cfg!(target_os = "macos") {
                Some(variable("HOME")?.join("Library/Caches"))
            } else {
                Some(variable("HOME")?.join(".cache"))
            }
        };
        let folder = variable("XDG_CACHE_HOME").filter(|folder| folder.is_absolute());
        Some(folder.or_else(home)?.join("graspd"))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.0.folder
    }

    /// The first thing that went wrong, if anything did: a folder or file that cannot be read or written.
    pub fn fault(&self) -> Option<&GeometryError> {
        self.0.fault.get()
    }

    /// The content stored under `key`; `None` if there is none, or none that is whole.
    pub fn load(&self, key: &CacheKey) -> Option<Vec<u8>> {
        let path = self.0.folder.join(key.file_name());
        match read_checked(&path, key) {
            Ok(content) => content,
            Err(error) if is_absence(&error) => None,
            Err(source) => {
                self.note(GeometryError::Read { path, source });
                None
            }
        }
    }

    /// Stores `content` under `key`, in place of what was there.
    ///
    /// What is larger than the whole cache may be is not stored.
    pub fn store(&self, key: &CacheKey, content: &[u8]) {
        if (HEADER_LEN + content.len()) as u64 > self.0.capacity {
            return;
        }
        let path = self.0.folder.join(key.file_name());
        match self.write(&path, key, content) {
            Ok(()) => self.keep_within_capacity(),
            Err(source) => self.note(GeometryError::Write { path, source }),
        }
    }

    /// How much there is, unfinished entries included; nothing if the folder does not exist.
    ///
    /// # Errors
    /// [`GeometryError::Read`] if the folder cannot be listed.
    pub fn size(&self) -> Result<CacheSize, GeometryError> {
        Ok(self
            .entries()?
            .iter()
            .fold(CacheSize::default(), |size, entry| CacheSize {
                files: size.files + 1,
                bytes: size.bytes + entry.len,
            }))
    }

    /// Removes every entry, unfinished ones included, and nothing else; gives what was removed.
    ///
    /// # Errors
    /// [`GeometryError::Read`] if the folder cannot be listed, [`GeometryError::Write`] if a file cannot be removed.
    pub fn clear(&self) -> Result<CacheSize, GeometryError> {
        let mut removed = CacheSize::default();
        for Entry { path, len, .. } in self.entries()? {
            match fs::remove_file(&path) {
                Err(source) if !is_absence(&source) => {
                    return Err(GeometryError::Write { path, source });
                }
                _ => {}
            }
            removed.files += 1;
            removed.bytes += len;
        }
        Ok(removed)
    }

    fn note(&self, fault: GeometryError) {
        // Only the first is kept: the others likely have the same cause.
        let _ = self.0.fault.set(fault);
    }

    fn write(&self, path: &Path, key: &CacheKey, content: &[u8]) -> io::Result<()> {
        fs::create_dir_all(&self.0.folder)?;
        let temporary = temporary_beside(path);
        // Not flushed to the disk: what a crash leaves half written does not check, and is made again.
        let write = || {
            let mut file = File::create_new(&temporary)?;
            file.write_all(&MAGIC)?;
            file.write_all(&key.hash())?;
            file.write_all(&(content.len() as u64).to_le_bytes())?;
            file.write_all(blake3::hash(content).as_bytes())?;
            file.write_all(content)?;
            drop(file);
            fs::rename(&temporary, path)
        };
        write().inspect_err(|_| {
            // Best effort: the error that matters is the one being reported.
            let _ = fs::remove_file(&temporary);
        })
    }

    /// Removes what was not used for longest. Another process may do the same at the same time.
    fn keep_within_capacity(&self) {
        let Ok(mut entries) = self.entries() else {
            return;
        };
        let now = SystemTime::now();
        let mut total: u64 = entries.iter().map(|entry| entry.len).sum();
        entries.sort_by_key(|entry| entry.used);
        for entry in entries {
            let age = now.duration_since(entry.used).unwrap_or_default();
            let is_left_over = entry.is_unfinished && age > ABANDONED;
            if is_left_over || (total > self.0.capacity && !entry.is_unfinished) {
                // On some systems a file that is being read stays; so be it.
                let _ = fs::remove_file(&entry.path);
                total = total.saturating_sub(entry.len);
            }
        }
    }

    /// The files that are ours.
    fn entries(&self) -> Result<Vec<Entry>, GeometryError> {
        let failed = |source| GeometryError::Read {
            path: self.0.folder.clone(),
            source,
        };
        let files = match fs::read_dir(&self.0.folder) {
            Err(error) if is_absence(&error) => return Ok(Vec::new()),
            files => files.map_err(failed)?,
        };
        let mut entries = Vec::new();
        for file in files {
            let path = file.map_err(failed)?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let is_unfinished = name.ends_with(UNFINISHED) && name.contains(EXTENSION);
            if !(is_unfinished || name.ends_with(EXTENSION)) {
                continue;
            }
            // One that is gone by now is none.
            if let Ok(data) = fs::metadata(&path)
                && data.is_file()
            {
                entries.push(Entry {
                    len: data.len(),
                    used: data.modified().unwrap_or(SystemTime::UNIX_EPOCH),
                    is_unfinished,
                    path,
                });
            }
        }
        Ok(entries)
    }
}

struct Entry {
    path: PathBuf,
    len: u64,
    /// When it was last written or loaded.
    used: SystemTime,
    is_unfinished: bool,
}

fn is_absence(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound)
}

/// The content of an entry; `None` if it is not whole.
fn read_checked(path: &Path, key: &CacheKey) -> io::Result<Option<Vec<u8>>> {
    let mut file = File::open(path)?;
    let data = file.metadata()?;
    if !data.is_file() || data.len() < HEADER_LEN as u64 {
        return Ok(None);
    }
    let mut header = [0; HEADER_LEN];
    file.read_exact(&mut header)?;
    let (magic, rest) = header.split_at(MAGIC.len());
    let (inputs, rest) = rest.split_at(HASH_LEN);
    let (len, checksum) = rest.split_at(8);
    let content_len = data.len() - HEADER_LEN as u64;
    if magic != MAGIC || inputs != key.hash() || len != content_len.to_le_bytes() {
        return Ok(None);
    }
    let mut content = Vec::new();
    if usize::try_from(content_len).is_ok_and(|len| content.try_reserve_exact(len).is_ok()) {
        file.read_to_end(&mut content)?;
    }
    if blake3::hash(&content).as_bytes() != checksum {
        return Ok(None);
    }
    // It was used now; where that cannot be noted, it will be forgotten sooner.
    let _ = file.set_modified(SystemTime::now());
    Ok(Some(content))
}
