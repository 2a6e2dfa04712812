//! Ranges of settings: each struct of settings declares once what its fields may be, and is checked and described by
//! that one declaration.
//!
//! ```
//! use graspd_settings::{AT_LEAST_ONE, POSITIVE, Range, Ranges, Validate, between, ranges};
//!
//! struct Contact {
//!     stiffness: f64,
//!     soft_stiffness: f64,
//!     iterations: [usize; 2],
//! }
//!
//! impl Validate for Contact {
//!     fn ranges(&self) -> Ranges {
//!         ranges! { self =>
//!             stiffness: POSITIVE,
//!             soft_stiffness: POSITIVE.at_most_setting("stiffness", self.stiffness),
//!             iterations: AT_LEAST_ONE,
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
//!         ranges! { self => scale: between(0.1, 10.0).unit("m") }.nested("contact", &self.contact)
//!     }
//! }
//!
//! let contact = Contact { stiffness: 1e3, soft_stiffness: 1e4, iterations: [3, 5] };
//! let error = Run { scale: 1.0, contact }.validate().unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "setting `contact.soft_stiffness` is 10000; it must be more than 0 and at most `stiffness`"
//! );
//! ```

mod numbers;
mod range;

pub use numbers::Numbers;
pub use range::{AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Range, between};

/// A setting whose value its range does not contain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("setting `{setting}` is {value}; it must be {allowed}")]
pub struct OutOfRange {
    /// The setting's key, such as `contact.stiffness`, or the flag that sets it.
    pub setting: String,
    /// Its value.
    pub value: f64,
    /// The values that it may have.
    pub allowed: Range,
}

/// Settings that declare the ranges of their fields.
pub trait Validate {
    /// Declares the range of each field; see [`ranges!`].
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

/// The ranges of some settings, and the first setting outside its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ranges {
    list: Vec<(String, Range)>,
    fault: Option<OutOfRange>,
}

impl Ranges {
    /// Adds a setting; of a list, each number has to lie in `allowed`.
    #[must_use]
    pub fn with(mut self, setting: &str, value: &impl Numbers, allowed: Range) -> Self {
        if self.fault.is_none() {
            self.fault = allowed.check(setting, value).err();
        }
        self.list.push((setting.to_owned(), allowed));
        self
    }

    /// Adds the settings of a part, their keys under `section`.
    #[must_use]
    pub fn nested(mut self, section: &str, part: &impl Validate) -> Self {
        let Self { list, fault } = part.ranges();
        let key = |key: String| format!("{section}.{key}");
        self.fault = self.fault.or(fault.map(|fault| OutOfRange {
            setting: key(fault.setting),
            ..fault
        }));
        self.list
            .extend(list.into_iter().map(|(name, range)| (key(name), range)));
        self
    }

    /// Checks that each setting lies in its range, see [`Validate::validate`].
    pub fn check(self) -> Result<(), OutOfRange> {
        self.fault.map_or(Ok(()), Err)
    }

    /// The range of the setting with this key.
    pub fn of(&self, setting: &str) -> Option<Range> {
        let found = self.list.iter().find(|(key, _)| key == setting);
        found.map(|(_, range)| *range)
    }
}

/// Declares the ranges of fields: `ranges! { self => mass: POSITIVE, friction: between(0.0, 10.0) }` makes [`Ranges`].
///
/// A field may be a number, a list of numbers, or an [`Option`] of either.
#[macro_export]
macro_rules! ranges {
    ($settings:expr => $($field:ident: $range:expr),* $(,)?) => {
        $crate::Ranges::default()$(.with(stringify!($field), &$settings.$field, $range))*
    };
}
