//! The keys that settings have, those they had before, and the one that a misspelt key is most like.

use graspd_fit::SkinFitSettings;
use graspd_settings::{Range, Validate};
use toml::{Table, Value};

use super::Configuration;
use super::tree::leaves;
use crate::annealing::AnnealingSettings;

/// Keys of earlier versions, or sections of them, and what they are called now.
const RENAMED: [(&str, &str); 12] = [
    (
        "settings.conformity.projection_iterations",
        "settings.skin_fit.projection.iterations",
    ),
    (
        "settings.conformity.retreat_iterations",
        "settings.skin_fit.depenetration_iterations",
    ),
    (
        "settings.conformity.depth",
        "settings.skin_fit.target_depth",
    ),
    (
        "settings.conformity.most_depth",
        "settings.skin_fit.soft.max_depth",
    ),
    (
        "settings.conformity.rigid_most_depth",
        "settings.skin_fit.rigid.max_depth",
    ),
    (
        "settings.conformity.deepest",
        "settings.skin_fit.soft.depth_limit",
    ),
    (
        "settings.conformity.rigid_deepest",
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

/// Lists of numbers of earlier versions: the present keys of their elements.
const SPLIT: [(&str, &[&[&str]]); 8] = [
    (
        "core_samples",
        &[&["coarse_medial_spheres"], &["fine_medial_spheres"]],
    ),
    (
        "dense_samples",
        &[&["soft.projection_samples"], &["rigid.projection_samples"]],
    ),
    (
        "densest_samples",
        &[&["soft.check_samples"], &["rigid.check_samples"]],
    ),
    (
        "coarse_iterations",
        &[&["approach.iterations"], &["contact.iterations"]],
    ),
    (
        "fine_iterations",
        &[&["draw_in.iterations"], &["push_out.iterations"]],
    ),
    (
        "reach",
        &[
            &["approach.start_reach"],
            &["approach.end_reach", "contact.start_reach"],
            &["contact.end_reach"],
            &["draw_in.start_reach"],
            &[
                "draw_in.end_reach",
                "push_out.start_reach",
                "push_out.end_reach",
                "projection.start_reach",
                "projection.end_reach",
            ],
        ],
    ),
    (
        "deep_weights",
        &[
            &["approach.depth_weight"],
            &["contact.depth_weight"],
            &["draw_in.depth_weight"],
            &["push_out.depth_weight", "projection.depth_weight"],
        ],
    ),
    (
        "core_weights",
        &[
            &["approach.medial_weight"],
            &["contact.medial_weight"],
            &["draw_in.medial_weight", "push_out.medial_weight"],
            &["projection.medial_weight"],
        ],
    ),
];

/// Returns the values of a table by their present keys.
pub(crate) fn present_leaves(table: &Table) -> Vec<(String, Value)> {
    let present = leaves(table).into_iter().flat_map(|(key, value)| {
        split(&key, &value).unwrap_or_else(|| vec![(present_name(key), value)])
    });
    present.collect()
}

/// Returns the elements of a list of an earlier version; one of another length keeps its key, which
/// is unknown now. `None` for other keys.
fn split(key: &str, value: &Value) -> Option<Vec<(String, Value)>> {
    let name = key.strip_prefix("settings.conformity.")?;
    let (_, elements) = SPLIT.iter().find(|(before, _)| *before == name)?;
    let values = value.as_array().filter(|list| list.len() == elements.len());
    let Some(values) = values else {
        return Some(vec![(key.to_owned(), value.clone())]);
    };
    let keys = elements.iter().zip(values);
    let pairs = keys.flat_map(|(keys, value)| {
        keys.iter()
            .map(|key| (format!("settings.skin_fit.{key}"), value.clone()))
    });
    Some(pairs.collect())
}

/// Returns the present name of a key.
fn present_name(key: String) -> String {
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
