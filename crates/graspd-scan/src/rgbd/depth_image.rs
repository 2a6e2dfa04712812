//! Depth images: what a depth camera measured, pixel by pixel.

use std::io::Cursor;
use std::path::Path;

use graspd_geom::GeometryError;
use graspd_mesh::{file_bytes, parse_error};

const PNG_REMEDY: &str = "give a depth image as a grey PNG of 16 bits";

/// Depths along the line of sight, as the camera gave them: whole multiples of a unit, 0 where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row; 0 where nothing was measured.
    pub raw: Vec<u16>,
    /// Metres for each unit of `raw`.
    pub unit: f64,
}

impl DepthImage {
    /// The depth at a pixel, counted row by row \[m\].
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn depth(&self, pixel: usize) -> Option<f64> {
        let raw = self.raw[pixel];
        (raw > 0).then(|| f64::from(raw) * self.unit)
    }

    /// How many pixels have a depth.
    pub fn valid(&self) -> usize {
        self.raw.iter().filter(|&&raw| raw > 0).count()
    }

    /// The image without pixels whose neighbourhood (`radius` pixels in each direction) spans more than `jump`
    /// \[m\] in depth: at the edge of an object a camera mixes it with what is behind ("flying pixels"). A radius
    /// of 0 leaves all pixels.
    pub fn without_edges(&self, radius: usize, jump: f64) -> Self {
        let (width, height) = (self.width, self.height);
        // Lowest and highest valid value of each window, first along rows, then along columns.
        let mut rows = vec![(u16::MAX, 0); self.raw.len()];
        for y in 0..height {
            for x in 0..width {
                let window =
                    y * width + x.saturating_sub(radius)..=y * width + (x + radius).min(width - 1);
                rows[y * width + x] =
                    window.fold((u16::MAX, 0), |(low, high), i| match self.raw[i] {
                        0 => (low, high),
                        raw => (low.min(raw), high.max(raw)),
                    });
            }
        }
        let most = jump / self.unit;
        let mut raw = self.raw.clone();
        for y in 0..height {
            for x in 0..width {
                let window = y.saturating_sub(radius)..=(y + radius).min(height - 1);
                let (low, high) = window.fold((u16::MAX, 0), |(low, high), row| {
                    let (l, h) = rows[row * width + x];
                    (low.min(l), high.max(h))
                });
                if f64::from(high) - f64::from(low) > most {
                    raw[y * width + x] = 0;
                }
            }
        }
        Self { raw, ..*self }
    }

    /// Reads a grey PNG of 16 bits a pixel, `unit` metres for each unit; `invalid` is a value that means no depth,
    /// besides 0.
    ///
    /// # Errors
    /// A file that cannot be read, is cut off or damaged, or holds another kind of picture.
    pub fn load_png(
        path: impl AsRef<Path>,
        unit: f64,
        invalid: u16,
    ) -> Result<Self, GeometryError> {
        let path = path.as_ref();
        let bytes = file_bytes(path)?;
        let fault = |what: String| GeometryError::Parse {
            path: path.into(),
            line: None,
            fault: what,
            remedy: PNG_REMEDY,
        };
        let failed = |error: png::DecodingError| fault(format!("not a whole PNG: {error}"));
        let mut reader = png::Decoder::new(Cursor::new(&bytes))
            .read_info()
            .map_err(failed)?;
        let info = reader.info();
        let (width, height) = (info.width as usize, info.height as usize);
        let kind = (info.color_type, info.bit_depth);
        if kind != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
            return Err(fault(format!(
                "the picture is {:?} of {} bits",
                kind.0, kind.1 as u8
            )));
        }
        let mut buffer = vec![0; reader.output_buffer_size().unwrap_or(0)];
        reader.next_frame(&mut buffer).map_err(failed)?;
        let raw: Vec<u16> = (buffer.chunks_exact(2))
            .map(|pair| u16::from_be_bytes([pair[0], pair[1]]))
            .map(|value| if value == invalid { 0 } else { value })
            .collect();
        if raw.len() != width * height {
            return Err(parse_error(path, None, "the picture lacks rows"));
        }
        Ok(Self {
            width,
            height,
            raw,
            unit,
        })
    }

    /// The image as a grey PNG of 16 bits.
    ///
    /// # Errors
    /// What the encoder gives: an image without pixels, or of other than `width * height` values.
    pub fn to_png(&self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let data: Vec<u8> = self.raw.iter().flat_map(|raw| raw.to_be_bytes()).collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&data)?;
        writer.finish()?;
        Ok(bytes)
    }
}
