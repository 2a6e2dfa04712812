//! The parts of the method that can be left out, to see what each is worth.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::preset::SynthesisSettings;

/// How constraints enter the Lagrangian; both are in units of their limits, with g = value / limit - 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ConstraintMethod {
    /// Multipliers that ascend, with damping (the modified differential method of multipliers).
    #[default]
    Mdmm,
    /// A fixed penalty, `weight` max(g, 0)^2 / 2, and no multipliers.
    Penalty {
        /// The penalty's weight.
        weight: f64,
    },
}

impl ConstraintMethod {
    pub(crate) fn penalty_weight(&self) -> Option<f64> {
        match self {
            Self::Mdmm => None,
            Self::Penalty { weight } => Some(*weight),
        }
    }
}

/// A part of the method, as the paper's ablation study leaves them out one by one.
///
/// # Source
/// Grasp'D (ECCV 2022), section 4.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodPart {
    /// The dilated object that shrinks to its true size.
    CoarseToFine,
    /// The gradient that reaches contacts which do not touch.
    LeakyGradient,
    /// Target wrenches between the task and the contacts.
    Relaxation,
    /// Multipliers for the constraints.
    Mdmm,
}

impl MethodPart {
    /// All parts.
    pub const ALL: [Self; 4] = [
        Self::CoarseToFine,
        Self::LeakyGradient,
        Self::Relaxation,
        Self::Mdmm,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::CoarseToFine => "coarse-to-fine",
            Self::LeakyGradient => "leaky-gradient",
            Self::Relaxation => "relaxation",
            Self::Mdmm => "mdmm",
        }
    }
}

impl FromStr for MethodPart {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        (Self::ALL.into_iter())
            .find(|part| part.name() == name)
            .ok_or_else(|| {
                let known = Self::ALL.map(Self::name).join(", ");
                format!("known parts: {known}")
            })
    }
}

impl SynthesisSettings {
    /// These settings without a part of the method; the preset's name says so.
    ///
    /// Multipliers are replaced by a penalty of the weight that their damping has at first.
    #[must_use]
    pub fn without(mut self, part: MethodPart) -> Self {
        match part {
            MethodPart::CoarseToFine => self.smoothing_steps = 0,
            MethodPart::LeakyGradient => self.leak = 0.0,
            MethodPart::Relaxation => self.relaxation = false,
            MethodPart::Mdmm => {
                self.constraint_method = ConstraintMethod::Penalty {
                    weight: self.damping.max(f64::MIN_POSITIVE),
                };
            }
        }
        self.preset = format!("{}-without-{}", self.preset, part.name());
        self
    }
}
