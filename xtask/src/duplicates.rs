//! One version of each crate whose types cross crate borders.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::Result;

use crate::steps::{cargo, output, report};

/// Crates (by the beginning of their names) of which one version, of one crate, is compiled.
const SINGLE: [&str; 4] = ["nalgebra", "parry", "rapier", "glam"];
/// Crates of those names that are something else.
const OTHER: [&str; 3] = ["nalgebra-macros", "nalgebra-sparse", "glamx"];

/// Checks what is compiled for this machine: Cargo.lock also holds versions that no feature in use asks for. Tests may
/// compare with crates that bring their own.
pub(crate) fn check_workspace(root: &Path) -> Result<()> {
    let line = "tree --locked --workspace --edges normal,build --prefix none --format {p}";
    report(faults(&output(&mut cargo(root, line))?))
}

/// One line for each crate of which `tree` (a `name vVERSION` a line) holds several versions.
fn faults(tree: &str) -> Vec<String> {
    let mut found: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for line in tree.lines() {
        let mut words = line.split_whitespace();
        let (Some(name), Some(version)) = (words.next(), words.next()) else {
            continue;
        };
        if let Some(single) = SINGLE.into_iter().find(|single| name.starts_with(single))
            && !OTHER.contains(&name)
        {
            found
                .entry(single)
                .or_default()
                .insert(format!("{name} {version}"));
        }
    }
    found
        .into_values()
        .filter(|versions| versions.len() > 1)
        .map(|versions| {
            let list = versions.into_iter().collect::<Vec<_>>().join(", ");
            format!("{list}: keep one, so that their types are the same")
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_version_passes_and_two_are_named() {
        let good = "graspd v0.1.0 (/a b)\nnalgebra v0.35.0\nnalgebra-macros v0.3.0 (proc-macro)\n\nglam v0.33.12\n\
                    glamx v0.3.1\nparry3d-f64 v0.31.1\nglam v0.33.12 (*)\n";
        assert_eq!(faults(good), Vec::<String>::new());
        let two_versions = faults(&format!("{good}glam v0.30.1\n"));
        assert!(
            two_versions.len() == 1 && two_versions[0].contains("glam v0.30.1, glam v0.33.12"),
            "{two_versions:?}"
        );
        let two_crates = faults(&format!("{good}parry3d v0.31.1\n"));
        assert!(
            two_crates.len() == 1 && two_crates[0].contains("parry3d v0.31.1"),
            "{two_crates:?}"
        );
    }
}
