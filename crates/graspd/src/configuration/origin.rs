//! Where the values of a configuration come from.

use std::fmt;
use std::path::PathBuf;

use crate::GraspError;

/// Where a value comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// No layer sets it.
    Default,
    /// The preset of this name.
    Preset(String),
    /// The preset of this name, its schedules stretched along with `settings.steps`.
    StretchedPreset(String),
    /// A file.
    File(PathBuf),
    /// A flag of the command line.
    Flag(String),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => f.write_str("default"),
            Self::Preset(name) => write!(f, "preset {name}"),
            Self::StretchedPreset(name) => write!(f, "preset {name}, stretched"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Flag(name) => f.write_str(name),
        }
    }
}

impl Origin {
    pub(super) fn bad_value(&self, key: &str, fault: impl Into<String>) -> GraspError {
        GraspError::BadConfiguration {
            origin: self.to_string(),
            key: key.into(),
            fault: fault.into(),
        }
    }
}
