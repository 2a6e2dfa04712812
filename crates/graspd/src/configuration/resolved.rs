//! The configuration that layers give, in which each value remembers where it is from.

use std::collections::BTreeMap;

use graspd_settings::Range;
use toml::{Table, Value};

use super::Configuration;
use super::keys::known_keys;
use super::origin::Origin;
use super::tree::{at, put};
use crate::GraspError;
use crate::preset::SynthesisSettings;

/// The key that names the preset under everything else.
pub(super) const PRESET: &str = "settings.preset";
/// Setting it stretches the schedules of the layers below.
pub(super) const STEPS: &str = "settings.steps";
/// A table, or `false` for no fit, or `true` for the usual one.
pub(super) const SKIN_FIT: &str = "settings.skin_fit";
/// A table, or `false` for none.
pub(super) const ANNEALING: &str = "settings.annealing";
/// A name, unless this key makes it a table.
pub(super) const PENALTY: &str = "settings.constraint_method.penalty.weight";
/// A table, or a list such as `"ca,iv"`.
pub(super) const METRICS: &str = "evaluation.metrics";
/// What [`SynthesisSettings::with_steps`] stretches.
const STRETCHED: [&str; 6] = [
    "settings.skin_fit.iterations",
    "settings.smoothing_steps",
    "settings.warmup_steps",
    "settings.decay_start",
    "settings.stiffening_start",
    "settings.stiffening_end",
];

/// One value of a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigurationEntry {
    /// Its path, such as `settings.skin_fit.depth`.
    pub key: String,
    /// The value; `None` where it follows from others (`evaluation.torque_scale`).
    pub value: Option<Value>,
    /// The paper's, where the paper (or the preset that takes it to the letter) has another.
    pub paper: Option<Value>,
    /// Where the value comes from.
    pub origin: Origin,
    /// The values that it may have, unit, and source of the default.
    pub range: Range,
}

/// A configuration, and where each of its values comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedConfiguration {
    /// The values.
    pub configuration: Configuration,
    /// Those that some layer sets, by key.
    origins: BTreeMap<String, Origin>,
    is_stretched: bool,
    ignored: Vec<String>,
}

impl ResolvedConfiguration {
    /// Returns the configuration under all layers.
    pub(super) fn of(preset: SynthesisSettings) -> Self {
        Self {
            configuration: Configuration::with_settings(preset),
            origins: BTreeMap::new(),
            is_stretched: false,
            ignored: Vec::new(),
        }
    }

    /// Remembers a value of something that is no more.
    pub(super) fn ignore(&mut self, origin: &Origin, key: &str) {
        self.ignored.push(format!("{origin}: `{key}`"));
    }

    /// Returns a warning of the values of earlier versions that have no meaning any more, if there are any.
    pub fn warning(&self) -> Option<String> {
        let list = self.ignored.join(", ");
        let text = format!(
            "settings of an earlier version have no meaning any more and are ignored: {list}"
        );
        (!list.is_empty()).then_some(text)
    }

    /// Overrides one value.
    pub(super) fn lay(
        &mut self,
        origin: &Origin,
        key: String,
        value: Value,
    ) -> Result<(), GraspError> {
        let settings = &mut self.configuration.settings;
        match (key.as_str(), &value) {
            (_, Value::Table(table)) if table.is_empty() => return Ok(()),
            // It has named what is under all layers.
            (PRESET, _) => {}
            (STEPS, Value::Integer(steps @ 1..)) => {
                let steps = usize::try_from(*steps);
                let steps = steps.map_err(|_| origin.bad_value(&key, "it is too large"))?;
                self.is_stretched |= steps != settings.steps;
                *settings = settings.clone().with_steps(steps);
            }
            (SKIN_FIT, Value::Boolean(is_on)) => switch(&mut settings.skin_fit, *is_on),
            (ANNEALING, Value::Boolean(is_on)) => switch(&mut settings.annealing, *is_on),
            (METRICS, Value::String(list)) => {
                let metrics = list.parse::<graspd_eval::Metrics>();
                self.configuration.evaluation.metrics =
                    metrics.map_err(|error| origin.bad_value(&key, error.to_string()))?;
            }
            _ => self.lay_leaf(origin, &key, value)?,
        }
        self.origins.insert(key, origin.clone());
        Ok(())
    }

    fn lay_leaf(&mut self, origin: &Origin, key: &str, value: Value) -> Result<(), GraspError> {
        let settings = &mut self.configuration.settings;
        if key.starts_with(SKIN_FIT) {
            settings.skin_fit.get_or_insert_default();
        }
        if key.starts_with(ANNEALING) {
            settings.annealing.get_or_insert_default();
        }
        let mut table = tree(&self.configuration)?;
        put(&mut table, key, value);
        self.configuration = table.try_into().map_err(|error: toml::de::Error| {
            // Without the place, which the key tells.
            let fault = error.message().lines().next().unwrap_or_default().trim();
            origin.bad_value(key, fault)
        })?;
        Ok(())
    }

    /// Returns all values, in the order in which the settings declare them.
    ///
    /// # Errors
    /// A number that TOML cannot hold.
    pub fn entries(&self) -> Result<Vec<ConfigurationEntry>, GraspError> {
        let table = tree(&self.configuration)?;
        let paper = tree(&Configuration::with_settings(SynthesisSettings::paper()))?;
        let mut keys = known_keys();
        if self.configuration.settings.skin_fit.is_none() {
            keys.retain(|(key, _)| !key.starts_with(SKIN_FIT));
        }
        if self.configuration.settings.annealing.is_none() {
            keys.retain(|(key, _)| !key.starts_with(ANNEALING));
        }
        let entries = keys.into_iter().map(|(key, range)| {
            let value = at(&table, &key).cloned();
            let papers = at(&paper, &key).filter(|paper| Some(*paper) != value.as_ref());
            ConfigurationEntry {
                paper: papers.filter(|_| key != PRESET).cloned(),
                origin: self.origin(&key),
                range,
                key,
                value,
            }
        });
        Ok(entries.collect())
    }

    /// Returns where the value of a key comes from.
    pub fn origin(&self, key: &str) -> Origin {
        let sections = key.match_indices('.').map(|(end, _)| &key[..end]);
        let mut paths = std::iter::once(key).chain(sections.rev());
        if let Some(origin) = paths.find_map(|path| self.origins.get(path)) {
            return origin.clone();
        }
        let preset = &self.configuration.settings.preset;
        match key.starts_with("settings.") {
            true if self.is_stretched && STRETCHED.contains(&key) => {
                Origin::StretchedPreset(preset.clone())
            }
            true => Origin::Preset(preset.clone()),
            false => Origin::Default,
        }
    }

    /// Returns the configuration as a file that gives the same.
    ///
    /// # Errors
    /// A number that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String, GraspError> {
        toml::to_string(&self.configuration)
            .map_err(|error| Origin::Default.bad_value("(all)", error.to_string()))
    }
}

/// Switches a part on, unless it is, with its usual settings, or off.
fn switch<T: Default>(part: &mut Option<T>, is_on: bool) {
    *part = part.take().or_else(|| Some(T::default())).filter(|_| is_on);
}

fn tree(configuration: &Configuration) -> Result<Table, GraspError> {
    Table::try_from(configuration)
        .map_err(|error| Origin::Default.bad_value("(all)", error.to_string()))
}
