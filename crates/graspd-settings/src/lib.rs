//! Settings described once: each struct of settings declares its keys, what they may be, their units and where their
//! defaults are from; they are checked and listed by that one declaration.
//!
//! ```
//! use graspd_settings::{ANY, AT_LEAST_ONE, POSITIVE, Ranges, Validate, between, ranges};
//!
//! struct Contact {
//!     stiffness: f64,
//!     soft_stiffness: f64,
//!     iterations: [usize; 2],
//!     is_smooth: bool,
//! }
//!
//! impl Validate for Contact {
//!     fn ranges(&self) -> Ranges {
//!         ranges! { self =>
//!             stiffness: POSITIVE.unit("N/m").source("the paper, A.5"),
//!             soft_stiffness: POSITIVE.at_most_setting("stiffness", self.stiffness),
//!             iterations: AT_LEAST_ONE,
//!             is_smooth: ANY,
//!         }
//!     }
//! }
//!
//! struct Run {
//!     scale: f64,
//!     contact: Contact,
//! }
//!
//! impl Validate for Run {
//!     fn ranges(&self) -> Ranges {
//!         ranges! { self => scale: between(0.1, 10.0) }.nested("contact", &self.contact)
//!     }
//! }
//!
//! let contact = Contact { stiffness: 1e3, soft_stiffness: 1e4, iterations: [3, 5], is_smooth: true };
//! let error = Run { scale: 1.0, contact }.validate().unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "setting `contact.soft_stiffness` is 10000; it must be more than 0 and at most `stiffness`"
//! );
//! ```

mod numbers;
mod range;

pub use numbers::Numbers;
pub use range::{ANY, AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Range, between};

/// A setting whose value its range does not contain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("setting `{setting}` is {value}; it must be {allowed}")]
pub struct OutOfRange {
    /// The setting's key, such as `contact.stiffness`, or the flag that sets it.
    pub setting: String,
    /// Its value.
    pub value: f64,
    /// The values that it may have.
    pub allowed: Box<Range>,
}

/// Settings that declare the ranges of their fields.
pub trait Validate {
    /// Declares each field's range; see [`ranges!`].
    fn ranges(&self) -> Ranges;

    /// Checks that each field lies in its range.
    ///
    /// # Errors
    /// Names the first field, in the order of declaration, that does not; NaN and infinity lie in no range.
    fn validate(&self) -> Result<(), OutOfRange> {
        self.ranges().check()
    }
}

impl<T: Validate> Validate for Option<T> {
    fn ranges(&self) -> Ranges {
        self.as_ref().map(T::ranges).unwrap_or_default()
    }
}

/// The ranges of some settings by key, in the order of declaration, and the first setting outside its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ranges {
    list: Vec<(String, Range)>,
    fault: Option<OutOfRange>,
}

impl Ranges {
    /// Adds a setting; each of its numbers has to lie in `allowed`.
    #[must_use]
    pub fn with(mut self, key: &str, value: &impl Numbers, allowed: Range) -> Self {
        self.list.push((key.to_owned(), allowed));
        self.require(key, value, allowed)
    }

    /// Adds a condition on numbers that are no setting by themselves, such as the length of a vector.
    #[must_use]
    pub fn require(mut self, name: &str, value: &impl Numbers, allowed: Range) -> Self {
        if self.fault.is_none() {
            self.fault = allowed.check(name, value).err();
        }
        self
    }

    /// Adds the settings of a part, their keys under `section`.
    #[must_use]
    pub fn nested(mut self, section: &str, part: &impl Validate) -> Self {
        let Self { list, fault } = part.ranges();
        let key = |key: String| format!("{section}.{key}");
        self.list
            .extend(list.into_iter().map(|(name, range)| (key(name), range)));
        self.fault = self.fault.or(fault.map(|fault| OutOfRange {
            setting: key(fault.setting),
            ..fault
        }));
        self
    }

    /// Says where the defaults of those settings are from that do not say it themselves.
    #[must_use]
    pub fn source(mut self, source: &'static str) -> Self {
        for (_, range) in &mut self.list {
            if range.source.is_empty() {
                range.source = source;
            }
        }
        self
    }

    /// Checks that each setting lies in its range, see [`Validate::validate`].
    ///
    /// # Errors
    /// Names the first that does not.
    pub fn check(self) -> Result<(), OutOfRange> {
        self.fault.map_or(Ok(()), Err)
    }

    /// Returns the keys and their ranges, in the order of declaration.
    pub fn into_list(self) -> Vec<(String, Range)> {
        self.list
    }
}

/// Declares the ranges of fields: `ranges! { self => mass: POSITIVE, friction: between(0.0, 10.0) }` makes [`Ranges`].
///
/// A field may be a number, a list of numbers, an [`Option`] of either, or a switch or text, which have none.
#[macro_export]
macro_rules! ranges {
    ($settings:expr => $($field:ident: $range:expr),* $(,)?) => {
        $crate::Ranges::default()$(.with(stringify!($field), &$settings.$field, $range))*
    };
}
