//! Documents name files that exist.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::sources::files_under;
use crate::steps::report;

/// Checks all Markdown files of the project at `root`: what they link to, and the paths below `crates/` that they
/// name.
pub(crate) fn check_workspace(root: &Path) -> Result<()> {
    let mut faults = Vec::new();
    let mut files = vec![
        root.join("ARCHITECTURE.md"),
        root.join("CHANGELOG.md"),
        root.join("README.md"),
    ];
    for folder in ["bench-lab", "crates", "docs", "examples", "fuzz", "lab"] {
        files.extend(files_under(&root.join(folder), "md")?);
    }
    for file in files {
        let text =
            fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
        let folder = file.parent().unwrap_or(root);
        let name = file.strip_prefix(root).unwrap_or(&file).display();
        for (index, line) in text.lines().enumerate() {
            let missing = |base: &Path, target: &&str| !base.join(target).exists();
            let links = links(line).filter(|target| missing(folder, target));
            let paths = paths(line).filter(|target| missing(root, target));
            faults.extend(
                links
                    .chain(paths)
                    .map(|target| format!("{name}:{}: no {target}", index + 1)),
            );
        }
    }
    report(faults)
}

/// Returns the files that a line links to.
fn links(line: &str) -> impl Iterator<Item = &str> {
    line.split("](").skip(1).filter_map(|rest| {
        let target = rest.split([')', '#', ' ']).next().unwrap_or_default();
        (!target.is_empty() && !target.contains("://")).then_some(target)
    })
}

/// Returns the paths below `crates/` that a line names in code.
fn paths(line: &str) -> impl Iterator<Item = &str> {
    let is_path = |c: char| c.is_alphanumeric() || "/._-".contains(c);
    line.split('`')
        .skip(1)
        .step_by(2)
        .filter(move |code| code.starts_with("crates/") && code.chars().all(is_path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_paths_are_found() {
        let line = "[a](../b.md#c) of `crates/x/src/y.rs`, `cargo`, `crates/*/src`";
        assert_eq!(links(line).collect::<Vec<_>>(), ["../b.md"]);
        let others = "![p](p.png) [w](https://w) [h](#here)";
        assert_eq!(links(others).collect::<Vec<_>>(), ["p.png"]);
        assert_eq!(paths(line).collect::<Vec<_>>(), ["crates/x/src/y.rs"]);
    }
}
