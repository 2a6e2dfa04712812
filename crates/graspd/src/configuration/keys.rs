//! The keys that settings have, those they had before, and the one that a misspelt key is most like.

use graspd_settings::{Range, Validate};

use super::Configuration;
use crate::annealing::AnnealingSettings;
use crate::conformity::ConformitySettings;

/// Keys of earlier versions, or sections of them, and what they are called now.
const RENAMED: [(&str, &str); 4] = [
    (
        "evaluation.shake.most_displacement",
        "evaluation.shake.max_displacement",
    ),
    (
        "evaluation.shake.most_rotation",
        "evaluation.shake.max_rotation",
    ),
    (
        "evaluation.volume.most_facets",
        "evaluation.volume.max_facets",
    ),
    (
        "evaluation.volume.most_directions",
        "evaluation.volume.max_directions",
    ),
];

/// Returns the present name of a key.
pub(crate) fn present_name(key: String) -> String {
    let renamed = RENAMED.iter().find_map(|(before, now)| {
        let rest = key.strip_prefix(before)?;
        (rest.is_empty() || rest.starts_with('.')).then(|| format!("{now}{rest}"))
    });
    renamed.unwrap_or(key)
}

/// Returns every key that there can be, with the range of its values: of the run, the optimisation, what comes before
/// and after the grasp, the judge.
pub(super) fn known_keys() -> Vec<(String, Range)> {
    let mut all = Configuration::default();
    all.settings.conformity = Some(ConformitySettings::default());
    all.settings.annealing = Some(AnnealingSettings::default());
    all.ranges().into_list()
}

/// Returns whether a configuration has a value or a section of this name at its top.
pub(crate) fn is_section(name: &str) -> bool {
    known_keys().iter().any(|(key, _)| top(key) == name)
}

fn top(key: &str) -> &str {
    key.split('.').next().unwrap_or_default()
}

/// Returns the key most like `key` among all keys and sections of a configuration and `others`.
pub(crate) fn nearest_key(key: &str, others: &[&str]) -> String {
    let known = known_keys();
    let keys = known.iter().map(|(key, _)| key.as_str());
    let sections = keys.clone().map(top);
    nearest(key, keys.chain(sections).chain(others.iter().copied()))
}

/// Returns the known key that is most like `key`: one that differs in its section counts as one letter off.
pub(super) fn nearest<'a>(key: &str, known: impl Iterator<Item = &'a str>) -> String {
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
    let distance = |other: &&str| {
        let by_name = 1 + strsim::damerau_levenshtein(&last(key), &last(other));
        let by_path = strsim::damerau_levenshtein(key, other);
        (by_path.min(by_name), by_path)
    };
    known.min_by_key(distance).unwrap_or_default().to_owned()
}
