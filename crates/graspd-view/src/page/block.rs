//! The block of integers of a page: differences in byte planes, compressed as a whole.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;

/// Where values stand in a [`Block`], and how they are written: the difference of each to the one `stride` before it,
/// modulo 2^(8 width); first the lowest bytes of all, then the second ones, and so on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Section {
    at: usize,
    count: usize,
    width: usize,
    stride: usize,
}

/// Sections one after another.
#[derive(Default)]
pub(super) struct Block {
    bytes: Vec<u8>,
}

impl Block {
    /// Appends values of `width` (1, 2 or 4) bytes; neighbours that are alike stand `stride` apart.
    pub(super) fn push(&mut self, values: &[u32], width: usize, stride: usize) -> Section {
        let section = Section {
            at: self.bytes.len(),
            count: values.len(),
            width,
            stride: stride.max(1),
        };
        let difference = |index: usize| {
            let before = index.checked_sub(section.stride).map_or(0, |at| values[at]);
            values[index].wrapping_sub(before)
        };
        for plane in 0..width {
            let bytes = (0..values.len()).map(|index| difference(index).to_le_bytes()[plane]);
            self.bytes.extend(bytes);
        }
        section
    }

    /// Appends signed values of two bytes.
    pub(super) fn push_signed(&mut self, values: &[i16], stride: usize) -> Section {
        let values: Vec<u32> = values
            .iter()
            .map(|value| u32::from(*value as u16))
            .collect();
        self.push(&values, 2, stride)
    }

    /// Returns the block as a page holds it: zlib, then base64.
    pub(super) fn to_text(&self) -> std::io::Result<String> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(8));
        encoder.write_all(&self.bytes)?;
        Ok(STANDARD.encode(encoder.finish()?))
    }
}

#[cfg(test)]
impl Block {
    /// Returns a section as the page reads it.
    pub(super) fn read(&self, section: Section) -> Vec<u32> {
        let Section {
            at,
            count,
            width,
            stride,
        } = section;
        let mask = u32::MAX >> (32 - 8 * width);
        let mut values = vec![0u32; count];
        for plane in 0..width {
            for (index, value) in values.iter_mut().enumerate() {
                *value |= u32::from(self.bytes[at + plane * count + index]) << (8 * plane);
            }
        }
        for index in stride..count {
            values[index] = values[index].wrapping_add(values[index - stride]) & mask;
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_read_back() {
        let mut block = Block::default();
        let signed = [3i16, -7, i16::MIN, i16::MAX, 0, -1, 5];
        let first = block.push_signed(&signed, 3);
        let large = [0u32, u32::MAX, 7, 1 << 31, 70_000];
        let second = block.push(&large, 4, 1);
        let small: Vec<u32> = (0..=255).rev().collect();
        let third = block.push(&small, 1, 1);
        let empty = block.push(&[], 2, 1);

        let back: Vec<i16> = (block.read(first).iter())
            .map(|value| *value as u16 as i16)
            .collect();
        assert_eq!(back, signed);
        assert_eq!(block.read(second), large);
        assert_eq!(block.read(third), small);
        assert!(block.read(empty).is_empty());
        let mut unpacked = Vec::new();
        let packed = STANDARD.decode(block.to_text().unwrap()).unwrap();
        std::io::Read::read_to_end(
            &mut flate2::read::ZlibDecoder::new(&packed[..]),
            &mut unpacked,
        )
        .unwrap();
        assert_eq!(unpacked, block.bytes);
    }
}
