//! The arrays of an `.npz` archive.

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::pickle_literals::readable;

/// An archive's entry may not be larger than this many times the archive, nor than [`MAX_ENTRY`]: numbers hardly
/// compress, and what does is made to fill the memory.
const MAX_EXPANSION: u64 = 64;
/// MANO's largest array has 2.5 MB \[bytes\].
const MAX_ENTRY: u64 = 1 << 28;
/// So that small archives of zeros pass \[bytes\].
const SMALL_ENTRY: u64 = 1 << 24;

/// An opened `.npz` file.
pub(crate) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    size: u64,
}

impl<'a> Archive<'a> {
    /// Reads the list of entries.
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
        Ok(Self {
            zip,
            size: bytes.len() as u64,
        })
    }

    /// Returns the names of the arrays.
    pub(crate) fn names(&self) -> Vec<String> {
        let names = self.zip.file_names();
        names
            .filter_map(|name| Some(readable(name.strip_suffix(".npy")?.as_bytes())))
            .collect()
    }

    /// Returns the bytes of the `.npy` file of one array; `None` if there is none.
    pub(crate) fn entry(&mut self, name: &str) -> Option<Result<Vec<u8>, String>> {
        let index = self.zip.index_for_name(&format!("{name}.npy"))?;
        Some(self.read(index))
    }

    fn read(&mut self, index: usize) -> Result<Vec<u8>, String> {
        let entry = self
            .zip
            .by_index(index)
            .map_err(|error| format!("cannot be read ({error})"))?;
        let limit = (self.size * MAX_EXPANSION).clamp(SMALL_ENTRY, MAX_ENTRY);
        let mut bytes = Vec::new();
        // Whatever size the entry claims, memory grows with what is really there.
        let length = entry.take(limit).read_to_end(&mut bytes);
        let length =
            length.map_err(|error| format!("cannot be read ({error}); the file is damaged"))?;
        if length as u64 == limit {
            return Err(format!(
                "unpacks to over {} MiB, more than any hand has",
                limit >> 20
            ));
        }
        Ok(bytes)
    }
}
