//! What a batch is to make: objects by name or pattern, hands, starts, seeds, and any setting.

use std::path::{Path, PathBuf};

use graspd_mesh::builtin_object;
use serde::Deserialize;
use toml::Table;

use crate::GraspError;
use crate::configuration::{ConfigurationLayers, Origin, is_section, nearest_key};

/// Extensions of the meshes that patterns match.
const MESH_EXTENSIONS: [&str; 7] = ["obj", "stl", "ply", "off", "glb", "gltf", "dae"];
/// The manifest's own keys; all others are settings.
const KEYS: [&str; 11] = [
    "objects",
    "exclude",
    "object_scale",
    "repair",
    "hands",
    "mirror",
    "package_paths",
    "starts",
    "seeds",
    "top_k",
    "preset",
];

/// A manifest as its file has it. Paths are relative to the file's folder.
#[derive(Clone, Debug, Deserialize)]
pub struct BatchManifest {
    /// Built-in names, mesh files, and patterns such as `meshes/**/*.obj`.
    pub objects: Vec<String>,
    /// Patterns of files to leave out.
    #[serde(default)]
    pub exclude: Vec<String>,
    /// Multiplies every object's coordinates.
    #[serde(default = "one")]
    pub object_scale: f64,
    /// Whether objects that are not closed are repaired; otherwise they fail.
    #[serde(default = "yes")]
    pub repair: bool,
    /// Built-in hands, URDFs or MANO models.
    pub hands: Vec<String>,
    /// Whether to take the hands' mirror images.
    #[serde(default)]
    pub mirror: bool,
    /// Where meshes of URDFs are looked for.
    #[serde(default)]
    pub package_paths: Vec<PathBuf>,
    /// Starts of each object, hand and seed; the setting `grasps` by default.
    pub starts: Option<usize>,
    /// Seeds; the setting `seed` by default.
    pub seeds: Option<Vec<u64>>,
    /// Keeps only the best of each run.
    pub top_k: Option<usize>,
    /// The preset; short for `settings.preset`.
    pub preset: Option<String>,
    /// The file.
    #[serde(skip)]
    path: PathBuf,
    /// Its settings.
    #[serde(skip)]
    settings: Table,
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

impl BatchManifest {
    /// Reads a manifest.
    ///
    /// # Errors
    /// If the file cannot be read or is not a manifest; names the nearest key for one that there is not.
    pub fn read(path: &Path) -> Result<Self, GraspError> {
        let mut file = ConfigurationLayers::default();
        file.push_file(path)?;
        let mut own = file.into_tables().pop().unwrap_or_default();
        let mut settings = Table::new();
        let others: Vec<String> = own.keys().cloned().collect();
        for key in others
            .into_iter()
            .filter(|key| !KEYS.contains(&key.as_str()))
        {
            if !is_section(&key) {
                return Err(GraspError::UnknownKey {
                    origin: path.display().to_string(),
                    nearest: nearest_key(&key, &KEYS),
                    key,
                });
            }
            settings.extend(own.remove_entry(&key));
        }
        let fault = |fault: String| GraspError::Manifest {
            path: path.to_owned(),
            fault,
        };
        let mut manifest: Self = own
            .try_into()
            .map_err(|error: toml::de::Error| fault(error.message().trim().to_owned()))?;
        manifest.path = path.to_owned();
        manifest.settings = settings;
        manifest.check().map_err(fault)?;
        Ok(manifest)
    }

    fn check(&self) -> Result<(), String> {
        let checks = [
            (self.objects.is_empty(), "`objects` names none"),
            (self.hands.is_empty(), "`hands` names none"),
            (
                self.starts == Some(0),
                "`starts` is 0; it must be at least 1",
            ),
            (self.top_k == Some(0), "`top_k` is 0; it must be at least 1"),
            (
                self.seeds.as_ref().is_some_and(Vec::is_empty),
                "`seeds` is empty; leave it out for one seed",
            ),
            (
                // TOML, and so run.toml, has no larger integers.
                self.seeds
                    .iter()
                    .flatten()
                    .any(|seed| i64::try_from(*seed).is_err()),
                "`seeds` has one beyond 2^63",
            ),
            (
                !(self.object_scale.is_finite() && self.object_scale > 0.0),
                "`object_scale` must be a positive number",
            ),
        ];
        match checks.iter().find(|(is_wrong, _)| *is_wrong) {
            Some((_, what)) => Err((*what).into()),
            None => Ok(()),
        }
    }

    /// The manifest's settings as layers on top of others.
    pub fn lay_settings(&self, layers: &mut ConfigurationLayers) {
        let origin = || Origin::File(self.path.clone());
        layers.push(origin(), self.settings.clone());
        if let Some(preset) = &self.preset {
            layers.set(origin(), "settings.preset", preset.as_str());
        }
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// The hands as a loader takes them.
    pub(super) fn hands(&self) -> Vec<String> {
        let beside = |hand: &String| {
            let path = self.folder().join(hand);
            if path.is_file() {
                path.to_string_lossy().into_owned()
            } else {
                hand.clone()
            }
        };
        self.hands.iter().map(beside).collect()
    }

    /// The folders of URDFs' meshes.
    pub(super) fn package_folders(&self) -> Vec<PathBuf> {
        let folders = self.package_paths.iter();
        folders.map(|path| self.folder().join(path)).collect()
    }

    /// Built-in names and mesh files, each once, in the order of the manifest; a pattern's files are sorted.
    ///
    /// # Errors
    /// For a pattern that is none, or that matches no mesh.
    pub(super) fn objects(&self) -> Result<Vec<String>, GraspError> {
        let excluded = (self.exclude.iter())
            .map(|pattern| {
                glob::Pattern::new(&self.in_folder(pattern))
                    .map_err(|error| self.bad_pattern(pattern, &error))
            })
            .collect::<Result<Vec<_>, GraspError>>()?;
        let mut found = Vec::new();
        for entry in &self.objects {
            if entry.contains(['*', '?', '[']) {
                found.extend(self.matches(entry)?);
            } else {
                let path = self.folder().join(entry);
                let is_built_in = !path.exists() && builtin_object(entry).is_some();
                found.push(if is_built_in {
                    entry.clone()
                } else {
                    path.to_string_lossy().into_owned()
                });
            }
        }
        found.retain(|path| !excluded.iter().any(|pattern| pattern.matches(path)));
        let mut seen = std::collections::HashSet::new();
        found.retain(|path| seen.insert(path.clone()));
        if found.is_empty() {
            return Err(self.fault("`exclude` leaves no object".into()));
        }
        Ok(found)
    }

    /// A pattern of paths as the file's folder sees it.
    fn in_folder(&self, pattern: &str) -> String {
        let folder = self.folder();
        if folder.as_os_str().is_empty() || Path::new(pattern).is_absolute() {
            return pattern.to_owned();
        }
        let folder = glob::Pattern::escape(&folder.to_string_lossy());
        format!("{folder}/{pattern}")
    }

    fn matches(&self, pattern: &str) -> Result<Vec<String>, GraspError> {
        let paths = glob::glob(&self.in_folder(pattern))
            .map_err(|error| self.bad_pattern(pattern, &error))?;
        let mut found = Vec::new();
        for path in paths {
            let path = path.map_err(|error| self.fault(format!("`{pattern}`: {error}")))?;
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            if MESH_EXTENSIONS.iter().any(|known| extension == *known) {
                found.push(path.to_string_lossy().into_owned());
            }
        }
        if found.is_empty() {
            let what = format!("`{pattern}` matches no mesh under {}", shown(self.folder()));
            return Err(self.fault(what));
        }
        found.sort();
        Ok(found)
    }

    fn bad_pattern(&self, pattern: &str, error: &glob::PatternError) -> GraspError {
        self.fault(format!("`{pattern}` is no pattern: {error}"))
    }

    fn fault(&self, fault: String) -> GraspError {
        GraspError::Manifest {
            path: self.path.clone(),
            fault,
        }
    }
}

fn shown(folder: &Path) -> String {
    if folder.as_os_str().is_empty() {
        "the current folder".into()
    } else {
        folder.display().to_string()
    }
}
