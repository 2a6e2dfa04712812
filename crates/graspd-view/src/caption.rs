//! Text in pictures: Noto Sans Mono, as rendered into the crate `noto-sans-mono-bitmap`.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::{Color, Image};

/// How text looks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextStyle {
    weight: FontWeight,
    height: RasterHeight,
    color: Color,
}

impl TextStyle {
    /// A heading.
    pub(crate) const TITLE: Self = Self {
        weight: FontWeight::Bold,
        height: RasterHeight::Size24,
        color: Color::new(36, 41, 46),
    };
    /// What stands below it.
    pub(crate) const BODY: Self = Self {
        weight: FontWeight::Regular,
        height: RasterHeight::Size20,
        color: Color::new(88, 96, 105),
    };

    /// Width of a character \[px\].
    pub(crate) fn advance(self) -> usize {
        get_raster_width(self.weight, self.height)
    }

    /// Height of a line \[px\].
    pub(crate) fn line_height(self) -> usize {
        self.height.val() + 3
    }

    /// Returns the text, or its beginning with a mark of omission, in at most `width` pixels.
    pub(crate) fn fitted(self, text: &str, width: usize) -> String {
        let most = width / self.advance();
        if text.chars().count() <= most {
            return text.to_owned();
        }
        let kept: String = text.chars().take(most.saturating_sub(2)).collect();
        kept + &"..".chars().take(most).collect::<String>()
    }
}

/// Draws a line of text with its upper left corner at (`x`, `y`); what falls outside is cut off. A character that the
/// font lacks shows as a question mark.
pub(crate) fn draw_text(image: &mut Image, x: usize, y: usize, text: &str, style: TextStyle) {
    let ink = style.color.to_linear();
    let (width, height) = (image.width(), image.height());
    for (place, character) in text.chars().enumerate() {
        let left = x + place * style.advance();
        let glyph = get_raster(character, style.weight, style.height)
            .or_else(|| get_raster('?', style.weight, style.height));
        let Some(glyph) = glyph else {
            continue;
        };
        for (row, levels) in glyph.rows().enumerate() {
            for (column, level) in levels.iter().enumerate() {
                let (column, row) = (left + column, y + row);
                if *level == 0 || column >= width || row >= height {
                    continue;
                }
                let pixel = &mut image.pixels_mut()[row * width + column];
                let opacity = f32::from(*level) / 255.0;
                let under = Color { srgb: *pixel }.to_linear();
                let mixed = std::array::from_fn(|c| under[c] + opacity * (ink[c] - under[c]));
                *pixel = Color::from_linear(mixed).srgb;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_drawn_where_it_is_asked_for_and_cut_off_at_the_border() {
        let mut image = Image::filled(60, 40, Color::WHITE).unwrap();
        draw_text(&mut image, 30, 10, "H漢", TextStyle::BODY);
        let dark = |x: usize, y: usize| image.pixel(x, y)[0] < 200;
        let inside = (10..26).flat_map(|y| (30..60).map(move |x| (x, y)));
        assert!(inside.filter(|(x, y)| dark(*x, *y)).count() > 20);
        let left = (0..40).flat_map(|y| (0..30).map(move |x| (x, y)));
        assert_eq!(left.filter(|(x, y)| dark(*x, *y)).count(), 0);
        draw_text(&mut image, 55, 35, "wide text", TextStyle::TITLE);
        draw_text(&mut image, 500, 500, "away", TextStyle::TITLE);
    }

    #[test]
    fn long_text_is_shortened() {
        let width = 10 * TextStyle::BODY.advance() + 3;
        assert_eq!(TextStyle::BODY.fitted("0123456789", width), "0123456789");
        assert_eq!(TextStyle::BODY.fitted("0123456789a", width), "01234567..");
        assert_eq!(TextStyle::BODY.fitted("0123456789a", 3), "");
    }
}
