//! Rules about where things may stand in the sources.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::steps::report;
use crate::uses::{is_name, words};

/// A word that only some files of the libraries may use.
struct Confined {
    word: &'static str,
    /// Files, or folders (with a slash at the end).
    places: &'static [&'static str],
    reason: &'static str,
}

const CONFINED: &[Confined] = &[
    Confined {
        word: "unsafe",
        places: &["crates/graspd-ad/src/lanes.rs"],
        reason: "all unchecked code stands in one file, each block with its reason",
    },
    Confined {
        word: "parry3d_f64",
        places: &[
            "crates/graspd-geom/src/parry_bridge.rs",
            "crates/graspd-eval/src/displacement/",
        ],
        reason: "its vector types are converted at one border",
    },
    Confined {
        word: "rapier3d_f64",
        places: &["crates/graspd-eval/src/displacement/"],
        reason: "only the judge's physics is compared with it",
    },
];

/// Lines from which a file is worth splitting.
const LONG_FILE: usize = 500;
/// Columns that a line may have.
const MAX_COLUMNS: usize = 119;

/// Words of our own and the field's terms for them: no name contains one of the former, or begins with it if it
/// ends in `_`.
const PRIVATE_WORDS: &[(&str, &str)] = &[
    ("MOST_", "MAX_"),
    ("LEAST_", "MIN_"),
    ("heir_of", "warm_start_from"),
    ("encounter", "self-collision pair"),
];

/// Checks the Rust files of the workspace at `root`; warns of long ones.
pub(crate) fn check_workspace(root: &Path) -> Result<()> {
    let mut found = Vec::new();
    for folder in ["bench-lab", "crates", "fuzz", "tests", "xtask"] {
        for file in rust_files(&root.join(folder))? {
            let text = fs::read_to_string(&file)
                .with_context(|| format!("cannot read {}", file.display()))?;
            let name = file.strip_prefix(root).unwrap_or(&file);
            let name = name.to_string_lossy().replace('\\', "/");
            let line_count = text.lines().count();
            if line_count > LONG_FILE {
                println!("warning: {name} has {line_count} lines: split it by idea");
            }
            found.extend(wide_lines(&name, &text));
            if name.starts_with("crates/") && name.contains("/src/") {
                found.extend(confined_words(&name, &text));
                found.extend(private_words(&name, &text));
            }
        }
    }
    report(found)
}

/// Returns a fault for each line that is too wide.
fn wide_lines(name: &str, text: &str) -> Vec<String> {
    let is_wide = |line: &str| line.chars().count() > MAX_COLUMNS;
    (text.lines().enumerate().filter(|(_, line)| is_wide(line)))
        .map(|(index, _)| format!("{name}:{}: over {MAX_COLUMNS} columns", index + 1))
        .collect()
}

/// Returns a fault for each use of a confined word in the wrong file.
fn confined_words(name: &str, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for Confined {
        word,
        places,
        reason,
    } in CONFINED
    {
        let is_allowed = places
            .iter()
            .any(|place| name == *place || (place.ends_with('/') && name.starts_with(place)));
        if is_allowed {
            continue;
        }
        for (index, line) in text.lines().enumerate() {
            // What comments say is free.
            let code = line.split("//").next().unwrap_or_default();
            if has_word(code, word) {
                faults.push(format!("{name}:{}: `{word}`: {reason}", index + 1));
            }
        }
    }
    faults
}

/// Returns a fault for each name with a private word; what comments and strings say is free.
fn private_words(name: &str, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        let code: String = code.split('"').step_by(2).collect();
        let names = words(&code).into_iter().filter(|word| is_name(word));
        faults.extend(names.filter_map(|found| {
            let is_in = |word: &str| {
                if word.ends_with('_') {
                    found.starts_with(word)
                } else {
                    found.contains(word)
                }
            };
            let (word, term) = PRIVATE_WORDS.iter().find(|(word, _)| is_in(word))?;
            Some(format!(
                "{name}:{}: `{found}`: say {term} and not {word}",
                index + 1
            ))
        }));
    }
    faults
}

/// Whether `word` stands in `code` and is not part of a longer name.
fn has_word(code: &str, word: &str) -> bool {
    let is_name = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    code.match_indices(word).any(|(start, _)| {
        let before = code[..start].chars().next_back();
        let after = code[start + word.len()..].chars().next();
        !is_name(before) && !is_name(after)
    })
}

/// Returns all `.rs` files under `folder`.
pub(crate) fn rust_files(folder: &Path) -> Result<Vec<PathBuf>> {
    files_under(folder, "rs")
}

/// Returns all files under `folder` whose names end so, in the order of their names; build outputs and packages of
/// other languages are left out.
pub(crate) fn files_under(folder: &Path, extension: &str) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut entries = fs::read_dir(folder)
        .and_then(Iterator::collect::<std::io::Result<Vec<_>>>)
        .with_context(|| format!("cannot list {}", folder.display()))?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        if path.is_dir() {
            if entry.file_name() != "target" && entry.file_name() != "node_modules" {
                files.extend(files_under(&path, extension)?);
            }
        } else if path.extension().is_some_and(|found| found == extension) {
            files.push(path);
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confined_words_are_found_outside_their_files_only() {
        let text = "// unsafe is not used\n#![deny(unsafe_code)]\nlet x = unsafe { f() };\n";
        let found = confined_words("crates/graspd-geom/src/mesh.rs", text);
        assert_eq!(found.len(), 1);
        assert!(
            found[0].starts_with("crates/graspd-geom/src/mesh.rs:3:"),
            "{found:?}"
        );
        assert!(confined_words("crates/graspd-ad/src/lanes.rs", text).is_empty());
    }

    #[test]
    fn private_words_are_found_in_names_only() {
        let text =
            "// heir_of\nserde(alias = \"heir_of\")\nconst MOST_STEPS: usize = 1;\nlet most = 1;\n";
        let found = private_words("a.rs", text);
        assert_eq!(found, ["a.rs:3: `MOST_STEPS`: say MAX_ and not MOST_"]);
    }

    #[test]
    fn wide_lines_are_found() {
        let text = format!("{}\n{}é\n", "x".repeat(119), "x".repeat(119));
        assert_eq!(wide_lines("a.rs", &text), ["a.rs:2: over 119 columns"]);
    }

    #[test]
    fn a_folder_and_a_file_can_be_allowed() {
        let text = "use parry3d_f64::math::Real;\n";
        assert!(confined_words("crates/graspd-geom/src/parry_bridge.rs", text).is_empty());
        assert!(confined_words("crates/graspd-eval/src/displacement/hulls.rs", text).is_empty());
        assert_eq!(
            confined_words("crates/graspd-eval/src/report.rs", text).len(),
            1
        );
        assert_eq!(
            confined_words("crates/graspd-hand/src/palm.rs", text).len(),
            1
        );
    }
}
