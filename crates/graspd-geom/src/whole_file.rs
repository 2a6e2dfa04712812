//! Files written wholly or not at all.

use std::fs::File;
use std::io::{BufWriter, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes a file under another name beside `path`, flushes it to the disk and renames it into place, so that no reader
/// and no interruption ever meets half a file.
///
/// # Errors
/// What the operating system said; `path` is then as it was.
pub fn write_atomically(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> Result<()>,
) -> Result<()> {
    let temporary = temporary_beside(path);
    let write = || {
        let mut out = BufWriter::new(File::create_new(&temporary)?);
        content(&mut out)?;
        out.into_inner()?.sync_all()?;
        std::fs::rename(&temporary, path)
    };
    write().inspect_err(|_| {
        // What was written so far is of no use; the error that matters is the one being reported.
        let _ = std::fs::remove_file(&temporary);
    })
}

/// A name in the same folder, hence on the same file system, that no other thread or process uses.
pub(crate) fn temporary_beside(path: &Path) -> PathBuf {
    static SERIAL: AtomicU64 = AtomicU64::new(0);
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}-{serial}.part", std::process::id()))
}
