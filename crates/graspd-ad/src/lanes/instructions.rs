//! Which vector instructions hot loops run with.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

/// The environment variable that [`Instructions::in_use`] reads.
pub const INSTRUCTIONS_VARIABLE: &str = "GRASPD_INSTRUCTIONS";

/// Vector instructions of a processor, each kind including those before it. Results are the same bits with all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What every processor of the target has: SSE2 on x86-64, plain arrays of eight elsewhere.
    Baseline,
    /// AVX2: eight floats in a register.
    Avx2,
    /// AVX-512 with vector lengths (AVX-512VL): the same arithmetic with 32 registers instead of 16, and masks of
    /// their own.
    Avx512,
}

impl Instructions {
    const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// Those that [`vectorize`](crate::vectorize) uses: the widest that the processor has, but no wider than the
    /// environment variable [`INSTRUCTIONS_VARIABLE`] says (`baseline`, `avx2` or `avx512`; what else it says
    /// counts for nothing, see [`Instructions::requested`]). Read once.
    pub fn in_use() -> Self {
        static IN_USE: OnceLock<Instructions> = OnceLock::new();
        *IN_USE.get_or_init(|| {
            let widest = Self::of_processor();
            match Self::requested() {
                Ok(Some(requested)) => requested.min(widest),
                _ => widest,
            }
        })
    }

    /// What [`INSTRUCTIONS_VARIABLE`] says; `None` if it is not set.
    ///
    /// # Errors
    /// If it names no instructions.
    pub fn requested() -> Result<Option<Self>, UnknownInstructions> {
        match std::env::var_os(INSTRUCTIONS_VARIABLE) {
            Some(name) => name.to_string_lossy().parse().map(Some),
            None => Ok(None),
        }
    }

    /// The widest that the processor has.
    fn of_processor() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if super::has_avx512() {
                return Self::Avx512;
            }
            if std::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }

    /// Its name, as [`INSTRUCTIONS_VARIABLE`] has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// A name that belongs to no [`Instructions`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownInstructions {
    /// What was given.
    pub name: String,
}

impl fmt::Display for UnknownInstructions {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{INSTRUCTIONS_VARIABLE} is {:?}; use baseline, avx2 or avx512",
            self.name
        )
    }
}

impl std::error::Error for UnknownInstructions {}

impl FromStr for Instructions {
    type Err = UnknownInstructions;

    fn from_str(name: &str) -> Result<Self, UnknownInstructions> {
        let named = Self::ALL.into_iter().find(|one| one.name() == name);
        named.ok_or_else(|| UnknownInstructions { name: name.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for one in Instructions::ALL {
            assert_eq!(one.name().parse(), Ok(one));
        }
        let error = "sse9".parse::<Instructions>().unwrap_err();
        let text = "GRASPD_INSTRUCTIONS is \"sse9\"; use baseline, avx2 or avx512";
        assert_eq!(error.to_string(), text);
        assert!(Instructions::in_use() <= Instructions::of_processor());
    }
}
