//! `hand.toml` beside `hand.urdf`: what to take instead of what was found automatically.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use toml::{Table, Value};

use crate::{ArticulatedHand, HandError, HandOptions, KinematicTree, Limit, PalmFrame};

/// The settings, or none; their file and every table checked for unknown keys.
pub(crate) struct Overrides {
    file: PathBuf,
    table: Table,
    is_there: bool,
}

const TOP_KEYS: [&str; 8] = [
    "name",
    "package_paths",
    "palm",
    "open",
    "limits",
    "closing",
    "contacts",
    "self_collision",
];
const PALM_KEYS: [&str; 3] = ["center_m", "normal", "fingers"];

impl Overrides {
    /// Reads the settings beside a URDF file, if there are any.
    pub(crate) fn read(urdf: &Path) -> Result<Self, HandError> {
        let file = urdf.with_extension("toml");
        let mut overrides = Self {
            is_there: file.is_file(),
            file,
            table: Table::new(),
        };
        if !overrides.is_there {
            return Ok(overrides);
        }
        let text = std::fs::read_to_string(&overrides.file).map_err(|error| HandError::Read {
            file: overrides.file.clone(),
            error,
        })?;
        overrides.table = text.parse().map_err(|error: toml::de::Error| {
            let line = error
                .span()
                .map(|span| text[..span.start.min(text.len())].lines().count().max(1));
            let place = line.map_or_else(String::new, |line| format!("line {line}: "));
            overrides.fault(format!("{place}{}; correct it", error.message()))
        })?;
        overrides.check_keys("", &overrides.table, &TOP_KEYS)?;
        for (table, keys) in [
            ("palm", &PALM_KEYS[..]),
            ("contacts", &["count"]),
            ("self_collision", &["spheres", "allow"]),
        ] {
            if let Some(inside) = overrides.inside(table)? {
                overrides.check_keys(table, inside, keys)?;
            }
        }
        overrides.check_kinds()?;
        Ok(overrides)
    }

    /// Values whose kind nothing else looks at.
    fn check_kinds(&self) -> Result<(), HandError> {
        let at = |table: &str, key: &str| self.table.get(table).and_then(|inside| inside.get(key));
        let is_text = |value: &Value| value.is_str();
        let is_list = |value: &Value| value.is_array();
        let are_texts = |value: &Value| {
            value
                .as_array()
                .is_some_and(|list| list.iter().all(Value::is_str))
        };
        let is_count = |value: &Value| value.as_integer().is_some_and(|count| count >= 0);
        type Check<'a> = &'a dyn Fn(&Value) -> bool;
        let kinds: [(&str, Option<&Value>, Check<'_>, &str); 5] = [
            ("name", self.table.get("name"), &is_text, "a text"),
            (
                "package_paths",
                self.table.get("package_paths"),
                &are_texts,
                "a list of texts",
            ),
            (
                "contacts.count",
                at("contacts", "count"),
                &is_count,
                "a whole number",
            ),
            (
                "self_collision.spheres",
                at("self_collision", "spheres"),
                &is_count,
                "a whole number",
            ),
            (
                "self_collision.allow",
                at("self_collision", "allow"),
                &is_list,
                "a list of pairs of link names",
            ),
        ];
        for (key, value, is_right, kind) in kinds {
            if value.is_some_and(|value| !is_right(value)) {
                return Err(self.fault(format!("`{key}` must be {kind}")));
            }
        }
        Ok(())
    }

    pub(crate) fn note(&self) -> Option<String> {
        let keys: Vec<&str> = self.table.keys().map(String::as_str).collect();
        let file = self.file.display();
        self.is_there
            .then(|| format!("{file} decides: {}", keys.join(", ")))
    }

    pub(crate) fn name(&self) -> Option<String> {
        Some(self.table.get("name")?.as_str()?.to_owned())
    }

    /// Its own folders, relative to its own, before those given.
    pub(crate) fn search_paths(&self, given: &[PathBuf]) -> Vec<PathBuf> {
        let own = self.table.get("package_paths").and_then(Value::as_array);
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let own = own.into_iter().flatten().filter_map(Value::as_str);
        own.map(|path| folder.join(path))
            .chain(given.iter().cloned())
            .collect()
    }

    pub(crate) fn limit(&self, tree: &mut KinematicTree) -> Result<(), HandError> {
        for (name, value) in self.inside("limits")?.into_iter().flatten() {
            let joint = self.joint("limits", name, tree)?;
            let [lower, upper] = self.numbers(&format!("limits.{name}"), value)?;
            if lower > upper {
                return Err(self.fault(format!(
                    "limits.{name}: lower limit {lower} is above the upper limit {upper}; swap them"
                )));
            }
            tree.set_limit(joint, Limit { lower, upper });
        }
        Ok(())
    }

    pub(crate) fn open(&self, tree: &KinematicTree, open: &mut [f64]) -> Result<(), HandError> {
        for (name, value) in self.inside("open")?.into_iter().flatten() {
            let joint = self.joint("open", name, tree)?;
            let value = number(value)
                .ok_or_else(|| self.fault(format!("open.{name} must be a finite number")))?;
            let Limit { lower, upper } = tree.limits()[joint];
            if !tree.limits()[joint].contains(value) {
                return Err(self.fault(format!(
                    "open.{name} is {value}; the joint's limits are {lower} to {upper}"
                )));
            }
            open[joint] = value;
        }
        Ok(())
    }

    /// Which way joints close, `[n]`, where they tell.
    pub(crate) fn closing(&self, tree: &KinematicTree) -> Result<Vec<Option<f64>>, HandError> {
        let mut closing = vec![None; tree.articulation_names().len()];
        for (name, value) in self.inside("closing")?.into_iter().flatten() {
            let joint = self.joint("closing", name, tree)?;
            let direction = number(value).filter(|value| [-1.0, 0.0, 1.0].contains(value));
            closing[joint] = Some(direction.ok_or_else(|| {
                self.fault(format!(
                    "closing.{name} must be 1 (closes up), -1 (closes down) or 0 (neither)"
                ))
            })?);
        }
        Ok(closing)
    }

    pub(crate) fn palm(&self, palm: &mut PalmFrame) -> Result<(), HandError> {
        let Some(palm_table) = self.inside("palm")? else {
            return Ok(());
        };
        if let Some(value) = palm_table.get("center_m") {
            palm.center = Point3::from(self.numbers::<3>("palm.center_m", value)?);
        }
        let direction = |key: &'static str| -> Result<Option<Vector3<f64>>, HandError> {
            let Some(value) = palm_table.get(key) else {
                return Ok(None);
            };
            let what = format!("palm.{key}");
            let vector = Vector3::from(self.numbers::<3>(&what, value)?);
            let unit = vector.try_normalize(1e-9);
            unit.map(Some).ok_or_else(|| {
                self.fault(format!(
                    "{what} has no direction; give one, such as [1.0, 0.0, 0.0]"
                ))
            })
        };
        palm.normal = direction("normal")?.unwrap_or(palm.normal);
        let fingers = direction("fingers")?.unwrap_or(palm.fingers);
        let across = fingers - palm.normal * palm.normal.dot(&fingers);
        palm.fingers = across.try_normalize(1e-3).ok_or_else(|| {
            self.fault("palm.fingers points along palm.normal; give the direction of the outstretched fingers".into())
        })?;
        Ok(())
    }

    pub(crate) fn hand_options(&self, given: &HandOptions) -> HandOptions {
        let count = |table: &str, key: &str| {
            let value = self.table.get(table)?.get(key)?.as_integer()?;
            // What is out of range is refused where options are checked.
            Some(usize::try_from(value).unwrap_or(usize::MAX))
        };
        HandOptions {
            contact_points: count("contacts", "count").unwrap_or(given.contact_points),
            collision_spheres: count("self_collision", "spheres")
                .unwrap_or(given.collision_spheres),
            ..given.clone()
        }
    }

    pub(crate) fn allow_overlaps(&self, hand: &mut ArticulatedHand) -> Result<(), HandError> {
        let allowed = self
            .inside("self_collision")?
            .and_then(|table| table.get("allow"));
        for pair in allowed.and_then(Value::as_array).into_iter().flatten() {
            let names: Vec<&str> = pair
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(Value::as_str)
                .collect();
            let [a, b] = names[..] else {
                return Err(self.fault(
                    "self_collision.allow must hold pairs of link names, such as [[\"a\", \"b\"]]"
                        .into(),
                ));
            };
            let links: Vec<&str> = hand
                .tree()
                .links()
                .iter()
                .map(|link| link.name.as_str())
                .collect();
            let body = |name: &str| {
                let found = hand.tree().links().iter().find(|link| link.name == name);
                found.map(|link| link.body).ok_or_else(|| {
                    self.fault(format!(
                        "self_collision.allow: there is no link `{name}`{}",
                        suggestion(name, &links)
                    ))
                })
            };
            let (a, b) = (body(a)?, body(b)?);
            hand.allow_overlap(a, b);
        }
        Ok(())
    }

    fn inside(&self, key: &str) -> Result<Option<&Table>, HandError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Value::Table(table)) => Ok(Some(table)),
            Some(_) => Err(self.fault(format!("`{key}` must be a table: [{key}]"))),
        }
    }

    fn joint(&self, table: &str, name: &str, tree: &KinematicTree) -> Result<usize, HandError> {
        let names = tree.articulation_names();
        names.iter().position(|known| known == name).ok_or_else(|| {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            self.fault(format!(
                "[{table}]: there is no joint `{name}` that moves by itself{}",
                suggestion(name, &known)
            ))
        })
    }

    fn check_keys(&self, table: &str, inside: &Table, known: &[&str]) -> Result<(), HandError> {
        let Some(unknown) = inside.keys().find(|key| !known.contains(&key.as_str())) else {
            return Ok(());
        };
        let place = if table.is_empty() {
            String::new()
        } else {
            format!(" in [{table}]")
        };
        Err(self.fault(format!(
            "unknown key `{unknown}`{place}{}; known: {}",
            suggestion(unknown, known),
            known.join(", ")
        )))
    }

    fn numbers<const N: usize>(&self, what: &str, value: &Value) -> Result<[f64; N], HandError> {
        let numbers: Option<Vec<f64>> = value
            .as_array()
            .and_then(|list| list.iter().map(number).collect());
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        numbers.ok_or_else(|| self.fault(format!("{what} must be a list of {N} finite numbers")))
    }

    fn fault(&self, fault: String) -> HandError {
        HandError::BadSettings {
            file: self.file.clone(),
            fault,
        }
    }
}

fn number(value: &Value) -> Option<f64> {
    let number = value
        .as_float()
        .or_else(|| value.as_integer().map(|i| i as f64));
    number.filter(|number| number.is_finite())
}

/// The known name that needs the fewest edits, if that is not most of it.
fn suggestion(name: &str, known: &[&str]) -> String {
    let nearest = known.iter().map(|known| (edits(name, known), *known)).min();
    match nearest {
        Some((edits, nearest)) if 2 * edits <= name.chars().count().max(2) => {
            format!("; did you mean `{nearest}`?")
        }
        _ => String::new(),
    }
}

/// The Levenshtein distance.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().take(64).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
