//! Articulation limits: membership, clamping, middles.

use rand::Rng;

/// Lowest and highest value of one articulation parameter \[rad or m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Lowest allowed value; may be -infinity.
    pub lower: f64,
    /// Highest allowed value; may be infinity.
    pub upper: f64,
}

impl Limit {
    /// No limit at all, as a continuous joint has.
    pub const UNLIMITED: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
    };

    /// Tells whether `value` is between the bounds, bounds included.
    pub fn contains(&self, value: f64) -> bool {
        self.lower <= value && value <= self.upper
    }

    /// Returns the allowed value that is nearest to `value`.
    pub fn clamp(&self, value: f64) -> f64 {
        // f64::clamp panics where lower > upper; max and min do not.
        value.max(self.lower).min(self.upper)
    }

    /// Returns the middle of the range; with one bound missing the other bound, with both missing 0.
    pub fn middle(&self) -> f64 {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => 0.5 * (self.lower + self.upper),
            (true, false) => self.lower,
            (false, true) => self.upper,
            (false, false) => 0.0,
        }
    }

    /// Returns the length of the range; infinite where a bound is missing.
    pub fn range(&self) -> f64 {
        self.upper - self.lower
    }

    /// Draws a value evenly from the range; an unlimited side counts as half a turn (pi) away from the other
    /// bound, or from 0 where both are missing.
    pub fn sample(&self, random: &mut impl Rng) -> f64 {
        let half_turn = std::f64::consts::PI;
        let (lower, upper) = match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => (self.lower, self.upper),
            (true, false) => (self.lower, self.lower + half_turn),
            (false, true) => (self.upper - half_turn, self.upper),
            (false, false) => (-half_turn, half_turn),
        };
        lower + (upper - lower) * random.random::<f64>()
    }
}

/// Moves every value into its limits.
///
/// # Panics
/// If the slices' lengths differ.
pub fn clamp_to_limits(articulation: &mut [f64], limits: &[Limit]) {
    assert_eq!(articulation.len(), limits.len(), "one limit for each value");
    for (value, limit) in articulation.iter_mut().zip(limits) {
        *value = limit.clamp(*value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    const HALF_OPEN: Limit = Limit {
        lower: 0.5,
        upper: f64::INFINITY,
    };

    #[test]
    fn clamping_moves_only_what_is_outside() {
        let limits = [
            Limit {
                lower: -1.0,
                upper: 2.0,
            },
            Limit::UNLIMITED,
            HALF_OPEN,
        ];
        let mut values = [3.0, -1e9, 0.0];
        clamp_to_limits(&mut values, &limits);
        assert_eq!(values, [2.0, -1e9, 0.5]);
        assert!(values.iter().zip(&limits).all(|(v, l)| l.contains(*v)));
        assert_eq!(limits.map(|limit| limit.middle()), [0.5, 0.0, 0.5]);
    }

    #[test]
    fn samples_stay_inside_and_reach_both_halves() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for limit in [
            HALF_OPEN,
            Limit::UNLIMITED,
            Limit {
                lower: -2.0,
                upper: -1.0,
            },
        ] {
            let samples: Vec<f64> = (0..64).map(|_| limit.sample(&mut random)).collect();
            assert!(samples.iter().all(|v| v.is_finite() && limit.contains(*v)));
            let mean = samples.iter().sum::<f64>() / 64.0;
            assert!(samples.iter().any(|v| *v < mean) && samples.iter().any(|v| *v > mean));
        }
    }
}
