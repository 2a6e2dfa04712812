//! Flags and files that set numbers, and `graspd config`, which tells them.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use graspd::{ConfigurationEntry, ConfigurationLayers, Origin, PRESETS, ResolvedConfiguration};
use toml::Value;

use crate::console::{print, print_json, warn};

/// The file that is looked for where the command is run.
const USUAL_FILE: &str = "graspd.toml";
/// Letters of a cell that a column makes room for.
const MAX_CELL: usize = 42;

/// Settings by file or by name.
#[derive(Args)]
pub(crate) struct ConfigurationChoice {
    /// Take settings from this file (graspd.toml in the current folder by default, if there is one)
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a number by its name, such as settings.leak=0.2 (`graspd config show` lists them; may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl ConfigurationChoice {
    /// Reads the file, `--config` or the usual one.
    pub(crate) fn file_layer(&self, quiet: bool) -> Result<ConfigurationLayers> {
        let mut layers = ConfigurationLayers::default();
        match &self.config {
            Some(file) => layers.push_file(file)?,
            None if Path::new(USUAL_FILE).is_file() => {
                layers.push_file(Path::new(USUAL_FILE))?;
                warn(
                    quiet,
                    &format!("settings are taken from {USUAL_FILE} in this folder"),
                );
            }
            None => {}
        }
        Ok(layers)
    }

    /// Puts `--set` on top.
    pub(crate) fn lay_flags(&self, layers: &mut ConfigurationLayers) -> Result<()> {
        for text in &self.set {
            let Some((key, value)) = text.split_once('=') else {
                bail!("--set {text}: it must be KEY=VALUE, such as settings.leak=0.2");
            };
            let key = key.trim();
            layers.set_text(Origin::Flag(format!("--set {key}")), key, value.trim());
        }
        Ok(())
    }

    /// Resolves file and `--set`.
    pub(crate) fn resolve(&self, quiet: bool) -> Result<ResolvedConfiguration> {
        let mut layers = self.file_layer(quiet)?;
        self.lay_flags(&mut layers)?;
        resolve(&layers, quiet)
    }
}

/// Resolves layers; says what of them has no meaning any more.
pub(crate) fn resolve(layers: &ConfigurationLayers, quiet: bool) -> Result<ResolvedConfiguration> {
    let resolved = layers.resolve()?;
    if let Some(text) = resolved.warning() {
        warn(quiet, &text);
    }
    Ok(resolved)
}

/// The settings that have a flag of their own.
#[derive(Args)]
pub(crate) struct SettingFlags {
    /// How many grasps, each from its own start [default: 10]
    #[arg(short = 'n', long = "count")]
    count: Option<usize>,
    /// Seed of the starts [default: 0]
    // TOML, and so run.toml, has no larger integers.
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Set of parameters
    #[arg(long, value_parser = PossibleValuesParser::new(PRESETS))]
    preset: Option<String>,
    /// Steps of the simulation for each grasp (the preset's number by default); schedules stretch along
    #[arg(long)]
    steps: Option<usize>,
    /// Samples of the distance grid along each axis [default: 256]
    #[arg(long)]
    resolution: Option<usize>,
    /// How far the opened hand of the pre-grasp stands back \[m\] [default: 0.05]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    retreat: Option<f64>,
    /// How far the squeeze target moves the contact points on into the object, on average \[m\] [default: 0.005]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    squeeze: Option<f64>,
    /// Sum of the contact forces that the squeeze's joint torques balance \[N\] [default: 10]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    squeeze_force: Option<f64>,
    #[command(flatten)]
    choice: ConfigurationChoice,
}

impl SettingFlags {
    /// Resolves file and flags.
    pub(crate) fn resolve(&self, quiet: bool) -> Result<ResolvedConfiguration> {
        let mut layers = self.choice.file_layer(quiet)?;
        let number = |count: usize| Value::Integer(i64::try_from(count).unwrap_or(i64::MAX));
        for (flag, key, value) in [
            ("--count", "grasps", self.count.map(number)),
            (
                "--seed",
                "seed",
                self.seed.map(|seed| Value::Integer(seed as i64)),
            ),
            (
                "--preset",
                "settings.preset",
                self.preset.clone().map(Value::String),
            ),
            ("--steps", "settings.steps", self.steps.map(number)),
            (
                "--resolution",
                "sdf_resolution",
                self.resolution.map(number),
            ),
            (
                "--retreat",
                "execution.retreat",
                self.retreat.map(Value::Float),
            ),
            (
                "--squeeze",
                "execution.squeeze",
                self.squeeze.map(Value::Float),
            ),
            (
                "--squeeze-force",
                "execution.squeeze_force",
                self.squeeze_force.map(Value::Float),
            ),
        ] {
            if let Some(value) = value {
                layers.set(Origin::Flag(flag.into()), key, value);
            }
        }
        self.choice.lay_flags(&mut layers)?;
        resolve(&layers, quiet)
    }
}

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: ConfigCommand,
}

#[derive(Subcommand)]
enum ConfigCommand {
    /// Print every setting: value, unit, allowed values, where the value comes from, and the source of the number
    Show(ShowArguments),
}

#[derive(Args)]
struct ShowArguments {
    #[command(flatten)]
    flags: SettingFlags,
    /// Print as a file that --config takes
    #[arg(long, conflicts_with = "json")]
    toml: bool,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let ConfigCommand::Show(show) = &arguments.command;
    let resolved = show.flags.resolve(true)?;
    if show.toml {
        return print(&resolved.to_toml()?);
    }
    let entries = resolved.entries()?;
    if show.json {
        let list: Vec<_> = entries
            .iter()
            .map(|entry| {
                serde_json::json!({
                    "key": entry.key,
                    "value": entry.value,
                    "unit": entry.range.unit,
                    "allowed": entry.range.words(),
                    "from": entry.origin.to_string(),
                    "source": entry.range.source,
                    "paper": entry.paper,
                })
            })
            .collect();
        return print_json(&list);
    }
    print(&table(&entries))
}

fn table(entries: &[ConfigurationEntry]) -> String {
    let mut rows =
        vec![["setting", "value", "unit", "from", "source", "allowed"].map(String::from)];
    rows.extend(entries.iter().map(row));
    // What is longer sticks out instead of spreading the column.
    let widths = [0, 1, 2, 3, 4].map(|column| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.filter(|width| *width <= MAX_CELL).max().unwrap_or(0)
    });
    let mut text = String::new();
    for row in &rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(widths.iter().chain(&[0])) {
            line += &format!("{cell:width$}  ");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

fn row(entry: &ConfigurationEntry) -> [String; 6] {
    let mut source = entry.range.source.to_owned();
    if let Some(paper) = &entry.paper {
        source += &format!(" (preset paper: {})", shown(paper));
    }
    let value = entry.value.as_ref();
    [
        entry.key.clone(),
        value.map_or_else(|| "(of the object)".into(), shown),
        entry.range.unit.to_owned(),
        entry.origin.to_string(),
        source,
        entry.range.words(),
    ]
}

/// Returns a value as TOML has it, but with powers of ten where there would be many zeros.
fn shown(value: &Value) -> String {
    match value {
        Value::Float(number) if *number != 0.0 && !(1e-3..1e6).contains(&number.abs()) => {
            format!("{number:e}")
        }
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(shown).collect();
            format!("[{}]", items.join(", "))
        }
        other => other.to_string(),
    }
}
