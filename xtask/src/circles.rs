//! No circles between the modules of a crate: of two files at most one uses the other, directly or through others.
//!
//! What a module takes from the modules that it is a part of does not count: a folder is one room.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::graph::{Graph, circles};
use crate::sources::rust_files;
use crate::steps::report;
use crate::uses::{paths, without_tests};

/// Circles that are still to be taken apart, by crate and one use in each; the list may only get shorter.
const LEFT: &[(&str, &str)] = &[
    ("graspd", "ablation -> preset"),
    ("graspd", "attempt -> run"),
    ("graspd-ad", "tape -> var"),
    ("graspd-geom", "distance::search -> distance::tree"),
];

/// Checks each package of the workspace at `root`.
pub(crate) fn check_workspace(root: &Path) -> Result<()> {
    let mut folders = vec![root.join("bench-lab"), root.join("xtask")];
    for entry in fs::read_dir(root.join("crates")).context("cannot list crates")? {
        folders.push(entry?.path());
    }
    folders.sort();
    let mut faults = Vec::new();
    for folder in folders {
        let source = folder.join("src");
        let mut files = BTreeMap::new();
        for file in rust_files(&source)? {
            let text = fs::read_to_string(&file)
                .with_context(|| format!("cannot read {}", file.display()))?;
            files.insert(module_of(file.strip_prefix(&source)?), text);
        }
        let name = folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        faults.extend(
            circles(&uses(&files))
                .into_iter()
                .map(|circle| (name.clone(), circle)),
        );
    }
    let is_left = |(crate_name, circle): &(String, String), (left, usage): &(&str, &str)| {
        crate_name == left && circle.contains(usage)
    };
    let gone = LEFT
        .iter()
        .filter(|left| !faults.iter().any(|fault| is_left(fault, left)));
    let gone: Vec<String> = gone
        .map(|(name, usage)| {
            format!("{name}: {usage} is in no circle any more: take it off the list")
        })
        .collect();
    let new = faults
        .iter()
        .filter(|fault| !LEFT.iter().any(|left| is_left(fault, left)));
    let mut faults: Vec<String> = new
        .map(|(name, circle)| format!("{name}: {circle}"))
        .collect();
    faults.extend(gone);
    report(faults)
}

/// Returns the path of the module in a file, relative to the crate's root: `a/b.rs` and `a/b/mod.rs` are `a::b`.
fn module_of(file: &Path) -> Vec<String> {
    let mut path: Vec<String> = (file.with_extension("").iter())
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if matches!(
        path.last().map(String::as_str),
        Some("mod" | "lib" | "main")
    ) {
        path.pop();
    }
    path
}

type Module = Vec<String>;

fn name(module: &Module) -> String {
    if module.is_empty() {
        "crate".into()
    } else {
        module.join("::")
    }
}

/// Returns which module uses which, by the paths in their texts.
fn uses(files: &BTreeMap<Module, String>) -> Graph {
    let mut read = BTreeMap::new();
    let mut tests = BTreeSet::new();
    for (module, text) in files {
        let (code, test_modules) = without_tests(text);
        tests.extend(
            test_modules
                .into_iter()
                .map(|test| [module.clone(), vec![test]].concat()),
        );
        read.insert(module.clone(), paths(&code));
    }
    let is_test = |module: &Module| tests.iter().any(|test| module.starts_with(test));
    read.retain(|module, _| !is_test(module));
    let full = |module: &Module, path: &[String]| -> Option<Module> {
        let (first, rest) = path.split_first()?;
        let child = [module.clone(), vec![first.clone()]].concat();
        match first.as_str() {
            "crate" => Some(rest.to_vec()),
            "self" => Some([module.clone(), rest.to_vec()].concat()),
            "super" => {
                let ups = path.iter().take_while(|part| *part == "super").count();
                let depth = module.len().checked_sub(ups)?;
                Some([&module[..depth], &path[ups..]].concat())
            }
            _ if read.contains_key(&child) => Some([module.clone(), path.to_vec()].concat()),
            _ => None,
        }
    };
    // The module that defines what a path names: re-exports are followed.
    let definer = |mut path: Module| -> Module {
        for _ in 0..8 {
            let length = (0..=path.len())
                .rev()
                .find(|n| read.contains_key(&path[..*n]));
            let module = path[..length.unwrap_or(0)].to_vec();
            let Some(name) = path.get(module.len()) else {
                return module;
            };
            let uses = read.get(&module).into_iter().flatten();
            let mut handed_on = uses.filter(|path| path.is_use && path.parts.last() == Some(name));
            match handed_on.find_map(|path| full(&module, &path.parts)) {
                Some(next) if next != path => path = next,
                _ => return module,
            }
        }
        path
    };
    let mut edges = BTreeMap::new();
    for (module, paths) in &read {
        let used = (paths.iter().filter(|path| !path.is_public))
            .filter_map(|path| full(module, &path.parts))
            .map(&definer)
            .filter(|used| !module.starts_with(used));
        edges.insert(name(module), used.map(|used| name(&used)).collect());
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let file = |(path, text): &(&str, &str)| (module_of(Path::new(path)), (*text).to_owned());
        circles(&uses(&files.iter().map(file).collect()))
    }

    #[test]
    fn circles_are_found_through_re_exports_and_groups() {
        let root = (
            "lib.rs",
            "mod a;\nmod b;\npub use a::First;\npub use b::Second;\n",
        );
        let a = (
            "a.rs",
            "use crate::{Second, other::Thing};\npub struct First;\n",
        );
        assert_eq!(
            found(&[root, a, ("b.rs", "pub struct Second;\n")]),
            Vec::<String>::new()
        );
        let b = (
            "b.rs",
            "fn f() -> crate::First { super::First }\npub struct Second;\n",
        );
        assert_eq!(found(&[root, a, b]), ["a circle: a -> b, b -> a"]);
    }

    #[test]
    fn a_folder_is_one_room_and_a_sibling_is_another() {
        let root = ("lib.rs", "mod a;\nmod b;\n");
        let whole = (
            "a/mod.rs",
            "mod part;\npub struct Whole;\nfn f() { part::half(Whole) }\n",
        );
        let part = (
            "a/part.rs",
            "use super::Whole;\npub fn half(whole: Whole) {}\n",
        );
        assert_eq!(found(&[root, whole, part]), Vec::<String>::new());
        let part = ("a/part.rs", "use crate::b::Other;\n");
        let other = ("b.rs", "fn f() { crate::a::f() }\n");
        assert_eq!(
            found(&[root, whole, part, other]),
            ["a circle: a -> a::part, a::part -> b, b -> a"]
        );
    }

    #[test]
    fn tests_and_comments_do_not_count() {
        let b = ("b.rs", "use crate::a::F;\n");
        for text in [
            "//! [`crate::b`]\npub struct F; // crate::b\n",
            "pub struct F;\n#[cfg(test)]\nmod tests {\n    use crate::b::G;\n}\n",
        ] {
            assert_eq!(
                found(&[("lib.rs", "mod a;\nmod b;"), ("a.rs", text), b]),
                Vec::<String>::new()
            );
        }
        let a = ("a.rs", "pub struct F;\n#[cfg(test)]\nmod check;\n");
        let check = ("a/check.rs", "use crate::b::G;\nuse super::F;");
        assert_eq!(
            found(&[("lib.rs", "mod a;\nmod b;"), a, check, b]),
            Vec::<String>::new()
        );
    }
}
