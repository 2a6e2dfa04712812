//! Settings that differ from a preset's, from a file.

use std::path::Path;

use toml::{Table, Value};

use crate::GraspError;
use crate::preset::SynthesisSettings;

impl SynthesisSettings {
    /// These settings with those changed that a TOML file names, as `run.toml` names them under `[settings]`. The preset's
    /// name gets the file's added. The result is not validated.
    ///
    /// # Errors
    /// If the file cannot be read, is no TOML, names a setting that does not exist, or gives one of another type.
    pub fn with_overrides_from(&self, path: &Path) -> Result<Self, GraspError> {
        let text = std::fs::read_to_string(path).map_err(|source| GraspError::Read {
            path: path.into(),
            source,
        })?;
        let mut changed =
            self.with_overrides(&text)
                .map_err(|fault| GraspError::InvalidConfig {
                    path: path.into(),
                    fault,
                })?;
        if let Some(stem) = path.file_stem() {
            changed.preset = format!("{}+{}", self.preset, stem.to_string_lossy());
        }
        Ok(changed)
    }

    fn with_overrides(&self, text: &str) -> Result<Self, String> {
        // One line: messages of the parser draw the place below it.
        let first_line = |error: toml::de::Error| match error.span() {
            Some(span) => {
                let line = 1 + text[..span.start.min(text.len())].matches('\n').count();
                format!("line {line}: {}", error.message())
            }
            None => error.message().to_owned(),
        };
        let overrides: Table = text.parse().map_err(first_line)?;
        let mut base = self.clone();
        if overrides.contains_key("conformity") {
            base.conformity.get_or_insert_default();
        }
        let mut settings = Table::try_from(&base).map_err(|error| error.to_string())?;
        merge(&mut settings, overrides);
        settings
            .try_into()
            .map_err(|error: toml::de::Error| error.message().to_owned())
    }
}

/// Puts `overrides` into `table`, tables key by key.
fn merge(table: &mut Table, overrides: Table) {
    for (key, value) in overrides {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(value)) => merge(inner, value),
            (Some(slot @ Value::Float(_)), Value::Integer(value)) => {
                *slot = Value::Float(value as f64);
            }
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformity::ConformitySettings;

    #[test]
    fn only_what_is_named_changes() {
        let text = "task_limit = 1\nsteps = 50\n[conformity]\ncandidates = 3\n";
        let changed = SynthesisSettings::default().with_overrides(text).unwrap();
        let expected = SynthesisSettings {
            task_limit: 1.0,
            steps: 50,
            conformity: Some(ConformitySettings {
                candidates: 3,
                ..ConformitySettings::default()
            }),
            ..SynthesisSettings::default()
        };
        assert_eq!(changed, expected);
        // A preset without a fit gets the usual one.
        let paper = SynthesisSettings::paper().with_overrides(text).unwrap();
        assert_eq!(paper.conformity, expected.conformity);
        assert_eq!(
            SynthesisSettings::soft().with_overrides("").unwrap(),
            SynthesisSettings::soft()
        );
    }

    #[test]
    fn faults_are_named() {
        let fault = |text| SynthesisSettings::soft().with_overrides(text).unwrap_err();
        assert!(
            fault("step = 3").contains("`step`"),
            "{}",
            fault("step = 3")
        );
        assert!(
            fault("\nsteps 3").starts_with("line 2: "),
            "{}",
            fault("\nsteps 3")
        );
        let text = fault("steps = 'many'");
        assert!(text.contains("string") && !text.contains('\n'), "{text}");
    }

    #[test]
    fn the_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("quick.toml");
        let fault = SynthesisSettings::soft()
            .with_overrides_from(&path)
            .unwrap_err();
        assert!(fault.to_string().contains("quick.toml"), "{fault}");
        std::fs::write(&path, "steps = 9").unwrap();
        let changed = SynthesisSettings::soft()
            .with_overrides_from(&path)
            .unwrap();
        assert_eq!((changed.steps, changed.preset.as_str()), (9, "soft+quick"));
        std::fs::write(&path, "steps = -9").unwrap();
        let fault = SynthesisSettings::soft()
            .with_overrides_from(&path)
            .unwrap_err();
        assert!(fault.to_string().contains("quick.toml"), "{fault}");
    }
}
