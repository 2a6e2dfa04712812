//! Colours as people name them (sRGB) and as light adds up (linear).

/// A colour in sRGB, 0 to 255 a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color {
    /// Red, green, blue.
    pub srgb: [u8; 3],
}

impl Color {
    /// Muted blue-grey: the object.
    pub const SLATE: Self = Self::new(116, 146, 165);
    /// Warm sand: the hand.
    pub const SAND: Self = Self::new(224, 187, 154);
    /// Muted green.
    pub const SAGE: Self = Self::new(148, 172, 132);
    /// Light neutral grey.
    pub const GREY: Self = Self::new(190, 190, 188);
    /// White.
    pub const WHITE: Self = Self::new(255, 255, 255);

    /// Returns the colour of these sRGB channels.
    pub const fn new(red: u8, green: u8, blue: u8) -> Self {
        Self {
            srgb: [red, green, blue],
        }
    }

    /// Returns the colour that stands for `level` from 0 (light yellow) to 1 (dark red), as for forces on contact
    /// dots.
    ///
    /// Levels outside \[0, 1\] are clamped; NaN counts as 0.
    pub fn heat(level: f64) -> Self {
        // Luminance falls evenly from stop to stop, so that the order survives greyscale print.
        const STOPS: [[f64; 3]; 5] = [
            [255.0, 245.0, 180.0],
            [254.0, 204.0, 92.0],
            [250.0, 141.0, 60.0],
            [220.0, 50.0, 32.0],
            [110.0, 0.0, 38.0],
        ];
        let level = if level.is_nan() {
            0.0
        } else {
            level.clamp(0.0, 1.0)
        };
        let scaled = level * (STOPS.len() - 1) as f64;
        let stop = (scaled as usize).min(STOPS.len() - 2);
        let t = scaled - stop as f64;
        let channel =
            |c: usize| (STOPS[stop][c] * (1.0 - t) + STOPS[stop + 1][c] * t).round() as u8;
        Self::new(channel(0), channel(1), channel(2))
    }

    /// Returns the channels as linear light, 0 to 1.
    pub(crate) fn to_linear(self) -> [f32; 3] {
        self.srgb.map(|channel| {
            let s = f32::from(channel) / 255.0;
            if s <= 0.04045 {
                s / 12.92
            } else {
                ((s + 0.055) / 1.055).powf(2.4)
            }
        })
    }

    /// Returns the colour of linear light; what is brighter than white is clamped.
    pub(crate) fn from_linear(light: [f32; 3]) -> Self {
        Self {
            srgb: light.map(|l| {
                let l = l.clamp(0.0, 1.0);
                let s = if l <= 0.003_130_8 {
                    12.92 * l
                } else {
                    1.055 * l.powf(1.0 / 2.4) - 0.055
                };
                (255.0 * s).round() as u8
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_light_round_trips_for_every_byte() {
        for byte in 0..=255 {
            let color = Color::new(byte, 255 - byte, byte);
            assert_eq!(Color::from_linear(color.to_linear()), color);
        }
    }

    #[test]
    fn heat_darkens_with_the_level_and_takes_any_number() {
        let luminance = |level: f64| {
            let [r, g, b] = Color::heat(level).to_linear();
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..100 {
            assert!(luminance(f64::from(i) / 100.0) > luminance(f64::from(i + 1) / 100.0));
        }
        assert_eq!(Color::heat(f64::NAN), Color::heat(0.0));
        assert_eq!(Color::heat(f64::INFINITY), Color::heat(1.0));
        assert_eq!(Color::heat(-3.0), Color::heat(0.0));
    }
}
