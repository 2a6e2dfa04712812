//! The parts of the method that can be left out, to see what each is worth.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::GraspError;
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
    /// The dilated object that shrinks to its true size, or the smoothing that falls.
    CoarseToFine,
    /// The gradient, or the tail of the contact law, that reaches contacts which do not touch.
    LeakyGradient,
    /// Target wrenches between the task and the contacts.
    Relaxation,
    /// Multipliers for the constraints.
    Mdmm,
    /// The task, by which the second-order solver rates its candidates.
    Task,
    /// Steps of second order.
    SecondOrder,
}

impl MethodPart {
    /// The parts of the paper's method, by steps of first order.
    pub const FIRST_ORDER: [Self; 4] = [
        Self::CoarseToFine,
        Self::LeakyGradient,
        Self::Relaxation,
        Self::Mdmm,
    ];
    /// The parts of the second-order solver.
    pub const SOLVER: [Self; 4] = [
        Self::CoarseToFine,
        Self::LeakyGradient,
        Self::Task,
        Self::SecondOrder,
    ];
    const NAMES: [(Self, &str); 6] = [
        (Self::CoarseToFine, "coarse-to-fine"),
        (Self::LeakyGradient, "leaky-gradient"),
        (Self::Relaxation, "relaxation"),
        (Self::Mdmm, "mdmm"),
        (Self::Task, "task"),
        (Self::SecondOrder, "second-order"),
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        let named = Self::NAMES.iter().find(|(part, _)| *part == self);
        named.map_or("", |(_, name)| name)
    }
}

impl FromStr for MethodPart {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let named = Self::NAMES.iter().find(|(_, known)| *known == name);
        named.map(|(part, _)| *part).ok_or_else(|| {
            let known = Self::NAMES.map(|(_, name)| name).join(", ");
            format!("known parts: {known}")
        })
    }
}

impl SynthesisSettings {
    /// Returns these settings without a part of the method; the preset's name says so.
    ///
    /// Multipliers are replaced by a penalty of the weight that their damping has at first.
    ///
    /// # Errors
    /// If the method that these settings choose has no such part; names those that it has.
    pub fn without(mut self, part: MethodPart) -> Result<Self, GraspError> {
        let parts = match (&self.annealing, &self.skin_fit) {
            (Some(_), _) => &[][..],
            (None, Some(_)) => &MethodPart::SOLVER,
            (None, None) => &MethodPart::FIRST_ORDER,
        };
        if !parts.contains(&part) {
            let names: Vec<_> = parts.iter().map(|part| part.name()).collect();
            return Err(GraspError::NoSuchPart {
                preset: self.preset,
                part: part.name().into(),
                parts: names.join(", "),
            });
        }
        match &mut self.skin_fit {
            Some(fit) => match part {
                MethodPart::CoarseToFine => fit.start_smoothing = fit.end_smoothing,
                MethodPart::LeakyGradient => fit.tail = 0.0,
                MethodPart::Task => fit.task = false,
                _ => fit.second_order = false,
            },
            None => match part {
                MethodPart::CoarseToFine => self.smoothing_steps = 0,
                MethodPart::LeakyGradient => self.leak = 0.0,
                MethodPart::Relaxation => self.relaxation = false,
                _ => {
                    self.constraint_method = ConstraintMethod::Penalty {
                        weight: self.damping.max(f64::MIN_POSITIVE),
                    };
                }
            },
        }
        self.preset = format!("{}-without-{}", self.preset, part.name());
        Ok(self)
    }
}
