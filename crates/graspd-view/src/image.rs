//! Pictures: rows of RGB pixels, PNG files, contact sheets.

use std::io::Write;
use std::path::Path;

use graspd_geom::write_atomically;

use crate::error::{MAX_PIXELS, MAX_SIDE};
use crate::{Color, ViewError};

/// A picture in 8-bit sRGB, rows top to bottom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// Returns a picture of one colour.
    ///
    /// # Errors
    /// [`ViewError::Size`] for no pixels, more than 2^26 or a side over 2^15.
    pub fn filled(width: usize, height: usize, color: Color) -> Result<Self, ViewError> {
        let is_side = |side| (1..=MAX_SIDE).contains(&side);
        if !(is_side(width) && is_side(height) && width * height <= MAX_PIXELS) {
            return Err(ViewError::Size { width, height });
        }
        Ok(Self {
            width,
            height,
            pixels: vec![color.srgb; width * height],
        })
    }

    /// Width \[px\].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height \[px\].
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the pixels, rows top to bottom, `[height * width]`, sRGB.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// Returns the pixels, to be written.
    pub(crate) fn pixels_mut(&mut self) -> &mut [[u8; 3]] {
        &mut self.pixels
    }

    /// Returns the pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.pixels[y * self.width + x]
    }

    /// Returns the picture as the bytes of a PNG file.
    ///
    /// # Errors
    /// What the encoder says; it has no reason to fail on a picture that fits in memory.
    pub fn to_png(&self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(std::io::Error::other)?;
        writer
            .write_image_data(self.pixels.as_flattened())
            .map_err(std::io::Error::other)?;
        writer.finish().map_err(std::io::Error::other)?;
        Ok(bytes)
    }

    /// Writes a PNG file: wholly or not at all, so that a reader never sees half a picture.
    ///
    /// # Errors
    /// [`ViewError::Write`] when the folder is missing or not writable.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), ViewError> {
        let path = path.as_ref();
        let write = |out: &mut dyn Write| out.write_all(&self.to_png()?);
        write_atomically(path, write).map_err(|cause| ViewError::Write {
            path: path.to_owned(),
            cause,
        })
    }

    /// Copies `other` into this picture with its upper left corner at (`x`, `y`); what falls outside is cut off.
    pub(crate) fn paste(&mut self, other: &Self, x: usize, y: usize) {
        if x >= self.width {
            return;
        }
        let columns = other.width.min(self.width - x);
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let target = (y + row) * self.width + x;
            let source = row * other.width;
            self.pixels[target..target + columns]
                .copy_from_slice(&other.pixels[source..source + columns]);
        }
    }
}

/// Puts pictures side by side in rows of `columns`, each centred in a cell of the largest one's
/// size, on white with narrow gaps.
///
/// # Errors
/// [`ViewError::Size`] when there are no pictures or no columns, or the sheet would be too large.
pub fn tile(images: &[Image], columns: usize) -> Result<Image, ViewError> {
    const GAP: usize = 4;
    let columns = columns.min(images.len());
    if columns == 0 {
        return Err(ViewError::Size {
            width: 0,
            height: 0,
        });
    }
    let rows = images.len().div_ceil(columns);
    let cell_width = images.iter().map(Image::width).max().unwrap_or(0);
    let cell_height = images.iter().map(Image::height).max().unwrap_or(0);
    let mut sheet = Image::filled(
        columns * (cell_width + GAP) - GAP,
        rows * (cell_height + GAP) - GAP,
        Color::WHITE,
    )?;
    for (index, image) in images.iter().enumerate() {
        let x = (index % columns) * (cell_width + GAP) + (cell_width - image.width) / 2;
        let y = (index / columns) * (cell_height + GAP) + (cell_height - image.height) / 2;
        sheet.paste(image, x, y);
    }
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn sizes_that_cannot_be_made_are_refused() {
        for (width, height) in [(0, 5), (5, 0), (usize::MAX, 2), (1 << 20, 1 << 20)] {
            assert!(matches!(
                Image::filled(width, height, Color::GREY),
                Err(ViewError::Size { .. })
            ));
        }
        assert!(tile(&[], 3).is_err());
        let one = Image::filled(2, 2, Color::GREY).unwrap();
        assert!(tile(&[one], 0).is_err());
    }

    #[test]
    fn a_png_file_reads_back_and_replaces_the_old_one() {
        let mut image = Image::filled(7, 3, Color::SAND).unwrap();
        image.pixels_mut()[7 + 4] = [1, 2, 3];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        fs::write(&path, b"an older file").unwrap();
        image.write_png(&path).unwrap();
        let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height), (7, 3));
        assert_eq!(bytes, image.pixels().as_flattened());
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "nothing else is left behind");
    }

    #[test]
    fn a_missing_folder_is_named_in_the_error() {
        let image = Image::filled(2, 2, Color::GREY).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("picture.png");
        let message = image.write_png(&path).unwrap_err().to_string();
        assert!(
            message.contains("absent") && message.contains("folder"),
            "{message}"
        );
    }

    #[test]
    fn a_contact_sheet_places_pictures_in_reading_order() {
        let colors = [Color::SAND, Color::SLATE, Color::SAGE];
        let images: Vec<_> = colors
            .iter()
            .map(|color| Image::filled(10, 6, *color).unwrap())
            .collect();
        let sheet = tile(&images, 2).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (24, 16));
        assert_eq!(sheet.pixel(5, 3), colors[0].srgb);
        assert_eq!(sheet.pixel(19, 3), colors[1].srgb);
        assert_eq!(sheet.pixel(5, 13), colors[2].srgb);
        assert_eq!(sheet.pixel(19, 13), Color::WHITE.srgb);
    }
}
