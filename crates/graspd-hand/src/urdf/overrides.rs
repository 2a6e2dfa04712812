//! `hand.toml` beside `hand.urdf`: what to take instead of what was found automatically.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;

use crate::{ArticulatedHand, HandError, HandOptions, KinematicTree, Limit, PalmFrame};

/// The overrides of one hand, or none.
pub(crate) struct Overrides {
    file: PathBuf,
    /// The keys of the file, if there is one.
    keys: Option<String>,
    tables: Tables,
}

/// What the file may hold.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Tables {
    name: Option<String>,
    package_paths: Vec<PathBuf>,
    palm: Palm,
    open: BTreeMap<String, f64>,
    limits: BTreeMap<String, [f64; 2]>,
    closing: BTreeMap<String, f64>,
    contacts: Contacts,
    self_collision: SelfCollision,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Palm {
    center_m: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
    fingers: Option<[f64; 3]>,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Contacts {
    count: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct SelfCollision {
    spheres: Option<usize>,
    /// Pairs of link names.
    allow: Vec<[String; 2]>,
}

impl Overrides {
    /// Reads the file beside a URDF, if there is one.
    pub(crate) fn read(urdf: &Path) -> Result<Self, HandError> {
        let mut overrides = Self {
            file: urdf.with_extension("toml"),
            keys: None,
            tables: Tables::default(),
        };
        if !overrides.file.is_file() {
            return Ok(overrides);
        }
        let text = std::fs::read_to_string(&overrides.file).map_err(|error| HandError::Read {
            file: overrides.file.clone(),
            error,
        })?;
        let fault = |error: toml::de::Error| overrides.fault(described(&error, &text));
        let keys: toml::Table = text.parse().map_err(fault)?;
        overrides.tables = toml::from_str(&text).map_err(fault)?;
        overrides.keys = Some(
            keys.keys()
                .map(String::as_str)
                .collect::<Vec<_>>()
                .join(", "),
        );
        Ok(overrides)
    }

    /// Says what the file decides.
    pub(crate) fn note(&self) -> Option<String> {
        let keys = self.keys.as_ref()?;
        Some(format!("{} decides: {keys}", self.file.display()))
    }

    pub(crate) fn name(&self) -> Option<String> {
        self.tables.name.clone()
    }

    /// Lists the file's own folders, relative to its own, before those given.
    pub(crate) fn search_paths(&self, given: &[PathBuf]) -> Vec<PathBuf> {
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let own = self
            .tables
            .package_paths
            .iter()
            .map(|path| folder.join(path));
        own.chain(given.iter().cloned()).collect()
    }

    /// Replaces the limits of joints.
    pub(crate) fn limit(&self, tree: &mut KinematicTree) -> Result<(), HandError> {
        for (name, &bounds) in &self.tables.limits {
            let joint = self.joint("limits", name, tree)?;
            let [lower, upper] = self.finite(&format!("limits.{name}"), bounds)?;
            if lower > upper {
                return Err(self.fault(format!(
                    "limits.{name}: lower limit {lower} is above the upper limit {upper}; swap them"
                )));
            }
            tree.set_limit(joint, Limit { lower, upper });
        }
        Ok(())
    }

    /// Replaces the values of joints in the open hand.
    pub(crate) fn open(&self, tree: &KinematicTree, open: &mut [f64]) -> Result<(), HandError> {
        for (name, &value) in &self.tables.open {
            let joint = self.joint("open", name, tree)?;
            let limit = tree.limits()[joint];
            if !limit.contains(value) {
                let Limit { lower, upper } = limit;
                return Err(self.fault(format!(
                    "open.{name} is {value}; the joint's limits are {lower} to {upper}"
                )));
            }
            open[joint] = value;
        }
        Ok(())
    }

    /// Returns which way joints close, `[n]`, where the file tells.
    pub(crate) fn closing(&self, tree: &KinematicTree) -> Result<Vec<Option<f64>>, HandError> {
        let mut closing = vec![None; tree.articulation_names().len()];
        for (name, &direction) in &self.tables.closing {
            let joint = self.joint("closing", name, tree)?;
            if ![-1.0, 0.0, 1.0].contains(&direction) {
                return Err(self.fault(format!(
                    "closing.{name} must be 1 (closes up), -1 (closes down) or 0 (neither)"
                )));
            }
            closing[joint] = Some(direction);
        }
        Ok(closing)
    }

    /// Replaces parts of the palm.
    pub(crate) fn palm(&self, palm: &mut PalmFrame) -> Result<(), HandError> {
        let Palm {
            center_m,
            normal,
            fingers,
        } = self.tables.palm;
        if let Some(center) = center_m {
            palm.center = Point3::from(self.finite("palm.center_m", center)?);
        }
        let direction = |what: &str, given: Option<[f64; 3]>, found: Vector3<f64>| {
            let Some(vector) = given else {
                return Ok(found);
            };
            let unit = Vector3::from(self.finite(what, vector)?).try_normalize(1e-9);
            unit.ok_or_else(|| {
                self.fault(format!(
                    "{what} has no direction; give one, such as [1.0, 0.0, 0.0]"
                ))
            })
        };
        palm.normal = direction("palm.normal", normal, palm.normal)?;
        let fingers = direction("palm.fingers", fingers, palm.fingers)?;
        let across = fingers - palm.normal * palm.normal.dot(&fingers);
        palm.fingers = across.try_normalize(1e-3).ok_or_else(|| {
            self.fault("palm.fingers points along palm.normal; give the direction of the outstretched fingers".into())
        })?;
        Ok(())
    }

    pub(crate) fn hand_options(&self, given: &HandOptions) -> HandOptions {
        let Tables {
            contacts,
            self_collision,
            ..
        } = &self.tables;
        HandOptions {
            contact_points: contacts.count.unwrap_or(given.contact_points),
            collision_spheres: self_collision.spheres.unwrap_or(given.collision_spheres),
            ..given.clone()
        }
    }

    /// Leaves out pairs of spheres.
    pub(crate) fn allow_overlaps(&self, hand: &mut ArticulatedHand) -> Result<(), HandError> {
        for pair in &self.tables.self_collision.allow {
            let links = hand.tree().links();
            let body = |name: &String| {
                let found = links.iter().find(|link| link.name == *name);
                found.map(|link| link.body).ok_or_else(|| {
                    let known = links.iter().map(|link| link.name.as_str());
                    self.fault(format!(
                        "self_collision.allow: there is no link `{name}`{}",
                        suggestion(name, known)
                    ))
                })
            };
            let (a, b) = (body(&pair[0])?, body(&pair[1])?);
            hand.allow_overlap(a, b);
        }
        Ok(())
    }

    fn joint(&self, table: &str, name: &str, tree: &KinematicTree) -> Result<usize, HandError> {
        let names = tree.articulation_names();
        names.iter().position(|known| known == name).ok_or_else(|| {
            self.fault(format!(
                "[{table}]: there is no joint `{name}` that moves by itself{}",
                suggestion(name, names.iter().map(String::as_str))
            ))
        })
    }

    fn finite<const N: usize>(&self, what: &str, numbers: [f64; N]) -> Result<[f64; N], HandError> {
        if numbers.iter().all(|number| number.is_finite()) {
            return Ok(numbers);
        }
        Err(self.fault(format!("{what} must be a list of {N} finite numbers")))
    }

    fn fault(&self, fault: String) -> HandError {
        HandError::BadSettings {
            file: self.file.clone(),
            fault,
        }
    }
}

/// Says where an error is, and which key may have been meant.
fn described(error: &toml::de::Error, text: &str) -> String {
    let line = error
        .span()
        .map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
    let place = line.map_or_else(String::new, |line| format!("line {line}: "));
    let message = error.message().replace('\n', " ");
    // Of an unknown key serde tells itself, and then all that are known.
    let mut quoted = message.split('`').skip(1).step_by(2);
    let meant = match quoted.next() {
        Some(key) if message.starts_with("unknown field") => suggestion(key, quoted),
        _ => "; correct it".into(),
    };
    format!("{place}{message}{meant}")
}

/// Suggests the known name that needs the fewest edits, if that is not most of it.
fn suggestion<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let nearest = known
        .map(|known| (strsim::levenshtein(name, known), known))
        .min();
    match nearest {
        Some((edits, nearest)) if 2 * edits <= name.chars().count().max(2) => {
            format!("; did you mean `{nearest}`?")
        }
        _ => String::new(),
    }
}
