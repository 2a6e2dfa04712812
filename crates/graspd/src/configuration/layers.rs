//! Configurations in layers: each overrides those below it, and each value remembers where it is from.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use graspd_settings::Validate;
use toml::{Table, Value};

use super::descriptions::place;
use super::tree::{at, leaves, put};
use super::{Configuration, Parameter, parameter};
use crate::GraspError;
use crate::annealing::AnnealingSettings;
use crate::conformity::ConformitySettings;
use crate::preset::SynthesisSettings;

/// The key that names the preset under everything else.
const PRESET: &str = "settings.preset";
/// Setting it stretches the schedules of the layers below.
const STEPS: &str = "settings.steps";
/// A table, or `false` for no fit, or `true` for the usual one.
const CONFORMITY: &str = "settings.conformity";
/// A table, or `false` for none.
const ANNEALING: &str = "settings.annealing";
/// A name, unless this key makes it a table.
const PENALTY: &str = "settings.constraint_method.penalty.weight";
/// A table, or a list such as `"ca,iv"`.
const METRICS: &str = "evaluation.metrics";

/// Where a value comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Nothing else was said.
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

/// Overrides, the last of which wins.
#[derive(Clone, Debug, Default)]
pub struct ConfigurationLayers {
    layers: Vec<(Origin, Table)>,
}

/// One value of a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigurationEntry {
    /// Its path, such as `settings.conformity.depth`.
    pub key: String,
    /// The value; `None` where it follows from others (`evaluation.torque_scale`).
    pub value: Option<Value>,
    /// The paper's, where the paper (or the preset that takes it to the letter) has another.
    pub paper: Option<Value>,
    /// Where the value comes from.
    pub origin: Origin,
    /// Unit and source.
    pub parameter: Parameter,
}

/// A configuration, and where each of its values comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedConfiguration {
    /// The values.
    pub configuration: Configuration,
    /// Those that some layer sets, by key.
    origins: BTreeMap<String, Origin>,
    is_stretched: bool,
}

impl ConfigurationLayers {
    /// Puts a table on top, its keys as in `run.toml`.
    pub fn push(&mut self, origin: Origin, table: Table) {
        self.layers.push((origin, table));
    }

    /// The tables, from the lowest up.
    pub(crate) fn into_tables(self) -> Vec<Table> {
        self.layers.into_iter().map(|(_, table)| table).collect()
    }

    /// Puts one value on top.
    pub fn set(&mut self, origin: Origin, key: &str, value: impl Into<Value>) {
        let mut table = Table::new();
        put(&mut table, key, value.into());
        self.push(origin, table);
    }

    /// Puts a value on top that is written as in TOML; what is no TOML value is a string.
    pub fn set_text(&mut self, origin: Origin, key: &str, text: &str) {
        let parsed: Option<Table> = format!("value = {text}").parse().ok();
        let value = parsed.and_then(|mut table| table.remove("value"));
        self.set(origin, key, value.unwrap_or_else(|| text.into()));
    }

    /// Puts the contents of a file on top.
    ///
    /// # Errors
    /// If it cannot be read, or is not TOML.
    pub fn push_file(&mut self, path: &Path) -> Result<(), GraspError> {
        let text = std::fs::read_to_string(path).map_err(|source| GraspError::Read {
            path: path.to_owned(),
            source,
        })?;
        let table = text.parse().map_err(|error: toml::de::Error| {
            let line = error.span().map_or(0, |span| {
                1 + text[..span.start.min(text.len())].matches('\n').count()
            });
            GraspError::ParseConfiguration {
                path: path.to_owned(),
                line,
                fault: error.message().to_owned(),
            }
        })?;
        self.push(Origin::File(path.to_owned()), table);
        Ok(())
    }

    /// The values that result, checked.
    ///
    /// The preset is the one that the last layer with `settings.preset` names. Then the layers are laid over it in their
    /// order; in each, `settings.steps` comes first and stretches the schedules of what is below.
    ///
    /// # Errors
    /// A key that does not exist (names the nearest that does), a value of the wrong type or out of range.
    pub fn resolve(&self) -> Result<ResolvedConfiguration, GraspError> {
        let known = known_keys()?;
        let preset = self.preset()?;
        let mut resolved = ResolvedConfiguration {
            configuration: Configuration::with_settings(preset),
            origins: BTreeMap::new(),
            is_stretched: false,
        };
        for (origin, table) in &self.layers {
            let mut values = leaves(table);
            // Stable: the rest keep their order.
            values.sort_by_key(|(key, _)| (key != PRESET, key != STEPS));
            for (key, value) in values {
                if !is_known(&key, &value, &known) {
                    return Err(GraspError::UnknownKey {
                        origin: origin.to_string(),
                        nearest: nearest(&key, &known),
                        key,
                    });
                }
                resolved.lay(origin, &key, value)?;
            }
        }
        resolved.configuration.validate()?;
        Ok(resolved)
    }

    fn preset(&self) -> Result<SynthesisSettings, GraspError> {
        let named = self.layers.iter().rev().find_map(|(origin, table)| {
            let name = at(table, PRESET)?;
            Some((origin, name.clone()))
        });
        match named {
            None => Ok(SynthesisSettings::default()),
            Some((_, Value::String(name))) => SynthesisSettings::preset(&name),
            Some((origin, _)) => Err(bad_value(origin, PRESET, "it must be a name")),
        }
    }
}

fn bad_value(origin: &Origin, key: &str, fault: impl Into<String>) -> GraspError {
    GraspError::BadConfiguration {
        origin: origin.to_string(),
        key: key.into(),
        fault: fault.into(),
    }
}

/// The tree of a configuration.
fn tree(configuration: &Configuration) -> Result<Table, GraspError> {
    Table::try_from(configuration)
        .map_err(|error| bad_value(&Origin::Default, "(all)", error.to_string()))
}

/// Every key that there can be.
fn known_keys() -> Result<Vec<String>, GraspError> {
    let mut all = Configuration::default();
    all.settings.conformity = Some(ConformitySettings::default());
    all.settings.annealing = Some(AnnealingSettings::default());
    all.evaluation.torque_scale = Some(1.0);
    Ok(leaves(&tree(&all)?)
        .into_iter()
        .map(|(key, _)| key)
        .collect())
}

/// Whether a configuration has a value or a section of this name at its top.
pub(crate) fn is_section(name: &str) -> Result<bool, GraspError> {
    Ok(tree(&Configuration::default())?.contains_key(name))
}

/// Of all keys and sections of a configuration and `others`, the one most like `key`.
pub(crate) fn nearest_key(key: &str, others: &[&str]) -> Result<String, GraspError> {
    let mut known = known_keys()?;
    known.extend(tree(&Configuration::default())?.keys().cloned());
    known.extend(others.iter().map(|other| (*other).to_owned()));
    Ok(nearest(key, &known))
}

fn is_known(key: &str, value: &Value, known: &[String]) -> bool {
    let is_section = || {
        known
            .iter()
            .any(|other| other.starts_with(&format!("{key}.")))
    };
    known.iter().any(|other| other == key)
        || key == PENALTY
        || (matches!(key, CONFORMITY | ANNEALING) && value.is_bool())
        || (key == METRICS && value.is_str())
        || (value.as_table().is_some_and(Table::is_empty) && is_section())
}

/// The known key that is most like `key`: one that differs in its section counts as one letter off.
fn nearest(key: &str, known: &[String]) -> String {
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
    let distance = |other: &String| {
        let by_name = 1 + strsim::damerau_levenshtein(&last(key), &last(other));
        let by_path = strsim::damerau_levenshtein(key, other);
        (by_path.min(by_name), by_path)
    };
    known
        .iter()
        .min_by_key(|other| distance(other))
        .cloned()
        .unwrap_or_default()
}

impl ResolvedConfiguration {
    fn lay(&mut self, origin: &Origin, key: &str, value: Value) -> Result<(), GraspError> {
        let settings = &mut self.configuration.settings;
        if value.as_table().is_some_and(Table::is_empty) {
            return Ok(());
        }
        match (key, &value) {
            // It has done its work.
            (PRESET, _) => {}
            (STEPS, Value::Integer(steps @ 1..)) => {
                let steps = usize::try_from(*steps)
                    .map_err(|_| bad_value(origin, key, "it is too large"))?;
                self.is_stretched |= steps != settings.steps;
                *settings = settings.clone().with_steps(steps);
            }
            (CONFORMITY, Value::Boolean(is_wanted)) => {
                let usual = settings.conformity.take().unwrap_or_default();
                settings.conformity = is_wanted.then_some(usual);
            }
            (ANNEALING, Value::Boolean(is_wanted)) => {
                let usual = settings.annealing.take().unwrap_or_default();
                settings.annealing = is_wanted.then_some(usual);
            }
            (METRICS, Value::String(list)) => {
                let metrics = list.parse();
                self.configuration.evaluation.metrics =
                    metrics.map_err(|error: graspd_eval::EvaluationError| {
                        bad_value(origin, key, error.to_string())
                    })?;
            }
            _ => self.lay_leaf(origin, key, value)?,
        }
        self.origins.insert(key.into(), origin.clone());
        Ok(())
    }

    fn lay_leaf(&mut self, origin: &Origin, key: &str, value: Value) -> Result<(), GraspError> {
        if key.starts_with(CONFORMITY) {
            self.configuration
                .settings
                .conformity
                .get_or_insert_default();
        }
        if key.starts_with(ANNEALING) {
            (self.configuration.settings.annealing).get_or_insert_default();
        }
        let mut table = tree(&self.configuration)?;
        put(&mut table, key, value);
        self.configuration = table
            .try_into()
            .map_err(|error| bad_value(origin, key, type_fault(&error)))?;
        Ok(())
    }

    /// All values: of the run, the optimisation, what comes before and after the grasp, the judge.
    ///
    /// # Errors
    /// None that is known: a configuration that was resolved can be told.
    pub fn entries(&self) -> Result<Vec<ConfigurationEntry>, GraspError> {
        let table = tree(&self.configuration)?;
        let paper = tree(&Configuration::with_settings(SynthesisSettings::paper()))?;
        let mut keys = known_keys()?;
        keys.sort_by_key(|key| place(key));
        if self.configuration.settings.conformity.is_none() {
            keys.retain(|key| !key.starts_with(CONFORMITY));
        }
        if self.configuration.settings.annealing.is_none() {
            keys.retain(|key| !key.starts_with(ANNEALING));
        }
        let entries = keys.into_iter().map(|key| {
            let value = at(&table, &key).cloned();
            let papers = at(&paper, &key).filter(|paper| Some(*paper) != value.as_ref());
            ConfigurationEntry {
                paper: papers.filter(|_| key != PRESET).cloned(),
                origin: self.origin(&key),
                parameter: parameter(&key),
                key,
                value,
            }
        });
        Ok(entries.collect())
    }

    /// Where the value of a key comes from.
    pub fn origin(&self, key: &str) -> Origin {
        let mut path = key;
        loop {
            if let Some(origin) = self.origins.get(path) {
                return origin.clone();
            }
            match path.rsplit_once('.') {
                Some((section, _)) => path = section,
                None => break,
            }
        }
        let preset = &self.configuration.settings.preset;
        let is_schedule = parameter(key).stretches;
        match key.strip_prefix("settings.") {
            Some(_) if self.is_stretched && is_schedule => Origin::StretchedPreset(preset.clone()),
            Some(_) => Origin::Preset(preset.clone()),
            None => Origin::Default,
        }
    }

    /// The configuration as a file that gives the same.
    ///
    /// # Errors
    /// None that is known.
    pub fn to_toml(&self) -> Result<String, GraspError> {
        toml::to_string(&self.configuration)
            .map_err(|error| bad_value(&Origin::Default, "(all)", error.to_string()))
    }
}

/// What is wrong with a value, without the place, which the key tells.
fn type_fault(error: &toml::de::Error) -> String {
    let text = error.message();
    text.lines().next().unwrap_or_default().trim().to_owned()
}
