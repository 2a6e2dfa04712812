//! Ranges, and how messages name them.

use std::fmt;

use crate::{Numbers, OutOfRange};

/// The finite numbers between two bounds, their unit, and where the usual one is from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    low: Bound,
    high: Bound,
    /// The unit; empty for ratios, names and switches.
    pub unit: &'static str,
    /// Where the default is from, such as a section of a paper; empty where that is not said.
    pub source: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bound {
    value: f64,
    /// Whether the value itself is in the range.
    is_included: bool,
    /// The setting whose value it is; empty where it is a number.
    setting: &'static str,
}

/// Finite numbers.
pub const FINITE: Range = between(f64::NEG_INFINITY, f64::INFINITY);
/// For what is no number: switches and names.
pub const ANY: Range = FINITE.more_than(f64::NEG_INFINITY);
/// x > 0
pub const POSITIVE: Range = FINITE.more_than(0.0);
/// x >= 0
pub const NOT_NEGATIVE: Range = FINITE.at_least(0.0);
/// 0 <= x <= 1
pub const FRACTION: Range = between(0.0, 1.0);
/// x >= 1
pub const AT_LEAST_ONE: Range = FINITE.at_least(1.0);

/// low <= x <= high
pub const fn between(low: f64, high: f64) -> Range {
    Range {
        low: Bound::at(low),
        high: Bound::at(high),
        unit: "",
        source: "",
    }
}

impl Bound {
    const fn at(value: f64) -> Self {
        Self {
            value,
            is_included: true,
            setting: "",
        }
    }

    const fn beside(self) -> Self {
        Self {
            is_included: false,
            ..self
        }
    }

    const fn of(self, setting: &'static str) -> Self {
        Self { setting, ..self }
    }
}

impl Range {
    const fn from(self, low: Bound) -> Self {
        Self { low, ..self }
    }

    const fn to(self, high: Bound) -> Self {
        Self { high, ..self }
    }

    /// Returns the part with x >= low.
    pub const fn at_least(self, low: f64) -> Self {
        self.from(Bound::at(low))
    }

    /// Returns the part with x > low.
    pub const fn more_than(self, low: f64) -> Self {
        self.from(Bound::at(low).beside())
    }

    /// Returns the part with x < high.
    pub const fn less_than(self, high: f64) -> Self {
        self.to(Bound::at(high).beside())
    }

    /// Returns the part with x >= `value`, which is that of another setting.
    pub const fn at_least_setting(self, setting: &'static str, value: f64) -> Self {
        self.from(Bound::at(value).of(setting))
    }

    /// Returns the part with x > `value`, which is that of another setting.
    pub const fn more_than_setting(self, setting: &'static str, value: f64) -> Self {
        self.from(Bound::at(value).of(setting).beside())
    }

    /// Returns the part with x <= `value`, which is that of another setting.
    pub const fn at_most_setting(self, setting: &'static str, value: f64) -> Self {
        self.to(Bound::at(value).of(setting))
    }

    /// Returns the same numbers, in a unit.
    pub const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Returns the same numbers, the default from this source.
    pub const fn source(self, source: &'static str) -> Self {
        Self { source, ..self }
    }

    /// Returns whether a number is finite and lies between the bounds.
    pub fn contains(&self, value: f64) -> bool {
        let Self { low, high, .. } = self;
        value.is_finite()
            && (value > low.value || (low.is_included && value == low.value))
            && (value < high.value || (high.is_included && value == high.value))
    }

    /// Checks one setting.
    ///
    /// # Errors
    /// If it has a number outside the range.
    pub fn check(&self, setting: &str, value: &(impl Numbers + ?Sized)) -> Result<(), OutOfRange> {
        let wrong = value.find(&|number| !self.contains(number));
        wrong.map_or(Ok(()), |value| {
            Err(OutOfRange {
                setting: setting.to_owned(),
                value,
                allowed: Box::new(*self),
            })
        })
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.setting {
            "" => write!(f, "{}", self.value),
            setting => write!(f, "`{setting}`"),
        }
    }
}

impl Range {
    /// Returns the numbers in words, without their unit.
    pub fn words(&self) -> String {
        let Self { low, high, .. } = self;
        let least = if low.is_included {
            "at least"
        } else {
            "more than"
        };
        let most = if high.is_included {
            "at most"
        } else {
            "less than"
        };
        match (low.value == f64::NEG_INFINITY, high.value == f64::INFINITY) {
            (true, true) if *low == ANY.low => String::new(),
            (true, true) => "a finite number".into(),
            (false, true) if *low == POSITIVE.low => "a positive number".into(),
            (false, true) => format!("{least} {low}"),
            (true, false) => format!("{most} {high}"),
            (false, false) if low.is_included && high.is_included => format!("{low} to {high}"),
            (false, false) => format!("{least} {low} and {most} {high}"),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words())?;
        if self.unit.is_empty() {
            return Ok(());
        }
        write!(f, " ({})", self.unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_range_contains_what_is_no_finite_number() {
        for range in [
            FINITE,
            POSITIVE,
            NOT_NEGATIVE,
            AT_LEAST_ONE,
            between(-1.0, 1.0),
        ] {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!range.contains(value), "{range} contains {value}");
            }
        }
        let unbounded = FINITE.at_least_setting("depth", f64::NAN);
        assert!(
            !unbounded.contains(1.0),
            "a bound that is no number bounds nothing"
        );
    }

    #[test]
    fn bounds_belong_to_their_range_unless_excluded() {
        for (range, inside, outside) in [
            (POSITIVE, f64::MIN_POSITIVE, 0.0),
            (NOT_NEGATIVE, 0.0, -f64::MIN_POSITIVE),
            (AT_LEAST_ONE, 1.0, 0.0),
            (FRACTION, 1.0, 1.0 + f64::EPSILON),
            (FRACTION.less_than(1.0), 0.0, 1.0),
            (FRACTION.more_than(0.0), 1.0, 0.0),
            (FINITE.at_least_setting("a", 3.0), 3.0, 2.0),
            (FINITE.at_most_setting("a", 3.0), 3.0, 4.0),
        ] {
            assert!(range.contains(inside), "{range}: {inside}");
            assert!(!range.contains(outside), "{range}: {outside}");
        }
    }

    #[test]
    fn ranges_are_told_in_words() {
        for (range, words) in [
            (FINITE, "a finite number"),
            (POSITIVE, "a positive number"),
            (NOT_NEGATIVE, "at least 0"),
            (between(1e-4, 0.1).unit("m"), "0.0001 to 0.1 (m)"),
            (FRACTION.less_than(1.0), "at least 0 and less than 1"),
            (FINITE.at_most_setting("a", 3.0), "at most `a`"),
            (FINITE.less_than(2.0), "less than 2"),
        ] {
            assert_eq!(range.to_string(), words);
        }
    }
}
