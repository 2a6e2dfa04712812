//! The keys that settings have, those they had before, and the one that a misspelt key is most like.

use graspd_fit::SkinFitSettings;
use graspd_settings::{Range, Validate};
use toml::{Table, Value};

use super::Configuration;
use super::tree::leaves;
use crate::annealing::AnnealingSettings;

/// Keys of earlier versions, or sections of them, and what they are called now.
const RENAMED: [(&str, &str); 10] = [
    (
        "settings.skin_fit.projection.iterations",
        "settings.skin_fit.projection_iterations",
    ),
    (
        "settings.skin_fit.soft.check_samples",
        "settings.skin_fit.soft.dense_samples",
    ),
    (
        "settings.skin_fit.rigid.check_samples",
        "settings.skin_fit.rigid.dense_samples",
    ),
    (
        "settings.skin_fit.deepest",
        "settings.skin_fit.soft.depth_limit",
    ),
    (
        "settings.skin_fit.rigid_deepest",
        "settings.skin_fit.rigid.depth_limit",
    ),
    ("settings.conformity", "settings.skin_fit"),
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

/// Keys under `settings.skin_fit` of earlier versions, or sections of them, of what is no more: the fit had stages of
/// their own costs, and its candidates were rated otherwise.
const RETIRED: [&str; 31] = [
    "finalists",
    "imbalance_discount",
    "closure_discount",
    "firm_closure",
    "coarse_medial_spheres",
    "fine_medial_spheres",
    "depenetration_iterations",
    "target_depth",
    "depth_scale",
    "limit_weight",
    "approach",
    "contact",
    "draw_in",
    "push_out",
    "projection",
    "soft.max_depth",
    "soft.projection_samples",
    "rigid.max_depth",
    "rigid.projection_samples",
    "core_samples",
    "dense_samples",
    "densest_samples",
    "coarse_iterations",
    "fine_iterations",
    "retreat_iterations",
    "reach",
    "depth",
    "deep_weights",
    "core_weights",
    "most_depth",
    "rigid_most_depth",
];

/// Returns the values of a table by their present keys; what is no more is left out.
pub(crate) fn present_leaves(table: &Table) -> Vec<(String, Value)> {
    let present = leaves(table)
        .into_iter()
        .filter(|(key, _)| !is_retired(key));
    present
        .map(|(key, value)| (present_name(key), value))
        .collect()
}

/// Returns the keys of a table of what is no more.
pub(super) fn retired_keys(table: &Table) -> Vec<String> {
    let keys = leaves(table).into_iter().map(|(key, _)| key);
    keys.filter(|key| is_retired(key)).collect()
}

fn is_retired(key: &str) -> bool {
    let present = present_name(key.to_owned());
    let Some(key) = present.strip_prefix("settings.skin_fit.") else {
        return false;
    };
    RETIRED.iter().any(|retired| is_under(key, retired))
}

/// Whether a key is that of a section or under it.
fn is_under(key: &str, section: &str) -> bool {
    let rest = key.strip_prefix(section);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Returns the present name of a key, which may have been renamed more than once.
fn present_name(mut key: String) -> String {
    while let Some((before, now)) = RENAMED.iter().find(|(before, _)| is_under(&key, before)) {
        key = format!("{now}{}", &key[before.len()..]);
    }
    key
}

/// Returns every key that there can be, with the range of its values: of the run, the optimisation, what comes before
/// and after the grasp, the judge.
pub(super) fn known_keys() -> Vec<(String, Range)> {
    let mut all = Configuration::default();
    all.settings.skin_fit = Some(SkinFitSettings::default());
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
