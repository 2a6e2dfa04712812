//! Configurations in layers: each overrides those below it.

use std::path::Path;

use graspd_settings::Validate;
use toml::{Table, Value};

use super::keys::{known_keys, nearest, present_leaves, retired_keys};
use super::origin::Origin;
use super::resolved::{
    ANNEALING, METRICS, PENALTY, PRESET, ResolvedConfiguration, SKIN_FIT, STEPS,
};
use super::tree::{at, put};
use crate::GraspError;
use crate::preset::SynthesisSettings;

/// Overrides, the last of which wins.
#[derive(Clone, Debug, Default)]
pub struct ConfigurationLayers {
    layers: Vec<(Origin, Table)>,
}

impl ConfigurationLayers {
    /// Puts a table on top, its keys as in `run.toml`.
    pub fn push(&mut self, origin: Origin, table: Table) {
        self.layers.push((origin, table));
    }

    /// Returns the tables, from the lowest up.
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

    /// Lays the layers over one another and checks the values that result.
    ///
    /// The preset is the one that the last layer with `settings.preset` names. Then the layers are laid over it in
    /// their order; in each, `settings.steps` comes first and stretches the schedules of what is below.
    ///
    /// # Errors
    /// A key that does not exist (names the nearest that does), a value of the wrong type or out of range.
    pub fn resolve(&self) -> Result<ResolvedConfiguration, GraspError> {
        let known = known_keys();
        let known: Vec<&str> = known.iter().map(|(key, _)| key.as_str()).collect();
        let mut resolved = ResolvedConfiguration::of(self.preset()?);
        for (origin, table) in &self.layers {
            for key in retired_keys(table) {
                resolved.ignore(origin, &key);
            }
            let mut values = present_leaves(table);
            // Stable: the rest keep their order.
            values.sort_by_key(|(key, _)| (key != PRESET, key != STEPS));
            for (key, value) in values {
                if !is_known(&key, &value, &known) {
                    return Err(GraspError::UnknownKey {
                        origin: origin.to_string(),
                        nearest: nearest(&key, known.into_iter()),
                        key,
                    });
                }
                resolved.lay(origin, key, value)?;
            }
        }
        match resolved.configuration.validate() {
            Ok(()) => Ok(resolved),
            Err(fault) => Err(GraspError::SettingFrom {
                origin: resolved.origin(&fault.setting).to_string(),
                fault,
            }),
        }
    }

    fn preset(&self) -> Result<SynthesisSettings, GraspError> {
        let mut layers = self.layers.iter().rev();
        let named = layers.find_map(|(origin, table)| Some((origin, at(table, PRESET)?)));
        match named {
            None => Ok(SynthesisSettings::default()),
            Some((_, Value::String(name))) => SynthesisSettings::preset(name),
            Some((origin, _)) => Err(origin.bad_value(PRESET, "it must be a name")),
        }
    }
}

fn is_known(key: &str, value: &Value, known: &[&str]) -> bool {
    let section = format!("{key}.");
    known.contains(&key)
        || key == PENALTY
        || (matches!(key, SKIN_FIT | ANNEALING) && value.is_bool())
        || (key == METRICS && value.is_str())
        || (value.as_table().is_some_and(Table::is_empty)
            && known.iter().any(|other| other.starts_with(&section)))
}
