//! The runs of a batch, in one order that every process agrees on.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Serialize;

use super::manifest::BatchManifest;
use crate::configuration::Configuration;
use crate::run_description::{ObjectRepair, RunDescription};
use crate::{GraspError, SCHEMA};

/// Letters of a run's name that are of the object's.
const NAME_LETTERS: usize = 40;

/// One part of a batch: number `index` (from 1) of `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// The whole batch.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Whether object number `object` is this shard's: every `count`-th one is.
    pub fn has(&self, object: usize) -> bool {
        object % self.count == self.index - 1
    }

    /// Into how many parts the batch is split.
    pub fn count(&self) -> usize {
        self.count
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// From `I/N`, I from 1 to N.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text
            .split_once('/')
            .and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        match parts {
            Some((index, count)) if 1 <= index && index <= count => Ok(Self { index, count }),
            Some((0, count)) if count > 0 => {
                Err(format!("shards count from 1: 1/{count} is the first"))
            }
            _ => Err("it must be I/N with I from 1 to N, such as 3/8".into()),
        }
    }
}

/// One object of a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedObject {
    /// Its built-in name, or its file.
    pub name_or_path: String,
    /// Its runs, as a range of [`BatchPlan::runs`].
    pub runs: std::ops::Range<usize>,
}

/// One object, one hand, one seed.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedRun {
    /// Its folder's name, unique in the batch.
    pub name: String,
    /// Which of [`BatchPlan::objects`].
    pub object: usize,
    /// Which of [`BatchPlan::hands`].
    pub hand: usize,
    /// The seed of its starts.
    pub seed: u64,
}

/// What a batch is to make, with all names resolved.
#[derive(Clone, Debug)]
pub struct BatchPlan {
    /// The objects.
    pub objects: Vec<PlannedObject>,
    /// Multiplies their coordinates.
    pub object_scale: f64,
    /// Whether those that are not closed are repaired.
    pub repair: bool,
    /// The hands, as a loader takes them.
    pub hands: Vec<String>,
    /// Whether to take their mirror images.
    pub mirror: bool,
    /// Where meshes of URDFs are looked for.
    pub package_paths: Vec<PathBuf>,
    /// The runs, those of an object together.
    pub runs: Vec<PlannedRun>,
    /// Starts of each run.
    pub starts: usize,
    /// How many of them are kept.
    pub top_k: Option<usize>,
    /// All numbers; `seed` and `grasps` are those of the first run.
    pub configuration: Configuration,
}

impl BatchPlan {
    /// Finds the objects and lists the runs.
    ///
    /// # Errors
    /// A pattern that matches nothing.
    pub fn new(manifest: &BatchManifest, configuration: Configuration) -> Result<Self, GraspError> {
        let seeds = manifest
            .seeds
            .clone()
            .unwrap_or_else(|| vec![configuration.seed]);
        let starts = manifest.starts.unwrap_or(configuration.grasps);
        let hands = manifest.hands();
        let labels = hand_labels(&hands);
        let (mut objects, mut runs) = (Vec::new(), Vec::new());
        for (object, name_or_path) in manifest.objects()?.into_iter().enumerate() {
            let first = runs.len();
            let label = label(&name_or_path);
            for (hand, hand_label) in labels.iter().enumerate() {
                for &seed in &seeds {
                    let name = format!("{object:05}_{label}_{hand_label}_{seed}");
                    runs.push(PlannedRun {
                        name,
                        object,
                        hand,
                        seed,
                    });
                }
            }
            objects.push(PlannedObject {
                name_or_path,
                runs: first..runs.len(),
            });
        }
        Ok(Self {
            objects,
            object_scale: manifest.object_scale,
            repair: manifest.repair,
            hands,
            mirror: manifest.mirror,
            package_paths: manifest.package_folders(),
            runs,
            starts,
            top_k: manifest.top_k,
            configuration: Configuration {
                seed: seeds[0],
                grasps: starts,
                ..configuration
            },
        })
    }

    /// The numbers of one run.
    pub(super) fn configuration_of(&self, run: &PlannedRun) -> Configuration {
        Configuration {
            seed: run.seed,
            ..self.configuration.clone()
        }
    }

    /// The objects of a shard, by number.
    pub fn objects_of(&self, shard: Shard) -> impl Iterator<Item = usize> {
        (0..self.objects.len()).filter(move |object| shard.has(*object))
    }

    /// `batch.toml`.
    pub(super) fn description(&self) -> Result<String, GraspError> {
        let mut seeds: Vec<u64> = self.runs.iter().map(|run| run.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        let description = Description {
            graspd_version: env!("CARGO_PKG_VERSION"),
            record_schema: SCHEMA,
            runs: self.runs.len(),
            seeds,
            top_k: self.top_k,
            object_scale: self.object_scale,
            repair: self.repair,
            hands: &self.hands,
            hands_mirrored: self.mirror,
            package_paths: &self.package_paths,
            objects: self
                .objects
                .iter()
                .map(|object| object.name_or_path.as_str())
                .collect(),
            configuration: &self.configuration,
        };
        toml::to_string(&description).map_err(|error| GraspError::BadConfiguration {
            origin: "the batch".into(),
            key: "(all)".into(),
            fault: error.to_string(),
        })
    }

    /// Describes a run; `repair` tells how its object's surface was closed.
    pub(super) fn run_description(
        &self,
        run: &PlannedRun,
        repair: Option<ObjectRepair>,
    ) -> RunDescription {
        RunDescription {
            graspd_version: env!("CARGO_PKG_VERSION").into(),
            record_schema: SCHEMA.into(),
            object: self.objects[run.object].name_or_path.clone(),
            object_scale: self.object_scale,
            object_repair: repair,
            hand: self.hands[run.hand].clone(),
            hand_mirrored: self.mirror,
            package_paths: self.package_paths.clone(),
            top_k: self.top_k,
            configuration: Some(self.configuration_of(run)),
            ..RunDescription::default()
        }
    }
}

#[derive(Serialize)]
struct Description<'a> {
    graspd_version: &'static str,
    record_schema: &'static str,
    runs: usize,
    seeds: Vec<u64>,
    top_k: Option<usize>,
    object_scale: f64,
    repair: bool,
    hands: &'a [String],
    hands_mirrored: bool,
    package_paths: &'a [PathBuf],
    objects: Vec<&'a str>,
    #[serde(flatten)]
    configuration: &'a Configuration,
}

/// A name or a file's name as part of a folder's name.
fn label(name_or_path: &str) -> String {
    let stem = Path::new(name_or_path).file_stem().unwrap_or_default();
    let letters = stem.to_string_lossy();
    let letters = letters.chars().take(NAME_LETTERS);
    letters
        .map(|c| {
            if c.is_ascii_alphanumeric() || c == '-' {
                c
            } else {
                '-'
            }
        })
        .collect()
}

/// Labels of hands, no two the same.
fn hand_labels(hands: &[String]) -> Vec<String> {
    let plain: Vec<String> = hands.iter().map(|hand| label(hand)).collect();
    let is_taken = |label: &String| plain.iter().filter(|other| *other == label).count() > 1;
    (plain.iter().enumerate())
        .map(|(number, label)| {
            if is_taken(label) {
                format!("{label}.{number}")
            } else {
                label.clone()
            }
        })
        .collect()
}
