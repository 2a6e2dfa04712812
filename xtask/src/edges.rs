//! Which crate may depend on which: the layers of ARCHITECTURE.md.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::graph::{Graph, circles};
use crate::steps::{cargo, output, report};

/// What a crate may depend on, by normal and build dependencies.
enum Allowed {
    /// These crates of the workspace, and any other crate.
    Workspace(&'static [&'static str]),
    /// Anything.
    Anything,
    /// These crates only, of the workspace or not.
    Only(&'static [&'static str]),
}

/// Crates in the order of their layers; development dependencies are free as long as they make no cycle.
const LAYERS: &[(&str, Allowed)] = &[
    ("graspd-ad", Allowed::Workspace(&[])),
    ("graspd-settings", Allowed::Workspace(&[])),
    (
        "graspd-geom",
        Allowed::Workspace(&["graspd-ad", "graspd-settings"]),
    ),
    (
        "graspd-mesh",
        Allowed::Workspace(&["graspd-settings", "graspd-geom"]),
    ),
    (
        "graspd-scan",
        Allowed::Workspace(&["graspd-ad", "graspd-settings", "graspd-geom", "graspd-mesh"]),
    ),
    (
        "graspd-hand",
        Allowed::Workspace(&["graspd-ad", "graspd-settings", "graspd-geom", "graspd-mesh"]),
    ),
    // The judge shares no contact code with the judged.
    (
        "graspd-eval",
        Allowed::Workspace(&["graspd-ad", "graspd-settings", "graspd-geom"]),
    ),
    (
        "graspd-opt",
        Allowed::Workspace(&["graspd-ad", "graspd-settings"]),
    ),
    (
        "graspd-sim",
        Allowed::Workspace(&["graspd-ad", "graspd-settings", "graspd-geom", "graspd-hand"]),
    ),
    (
        "graspd-fit",
        Allowed::Workspace(&[
            "graspd-ad",
            "graspd-settings",
            "graspd-geom",
            "graspd-hand",
            "graspd-sim",
        ]),
    ),
    (
        "graspd",
        Allowed::Workspace(&[
            "graspd-ad",
            "graspd-settings",
            "graspd-geom",
            "graspd-mesh",
            "graspd-scan",
            "graspd-hand",
            "graspd-sim",
            "graspd-opt",
            "graspd-fit",
            "graspd-eval",
        ]),
    ),
    (
        "graspd-view",
        Allowed::Workspace(&["graspd-geom", "graspd-hand"]),
    ),
    ("graspd-cli", Allowed::Anything),
    ("graspd-tests", Allowed::Anything),
    ("bench-lab", Allowed::Workspace(&["graspd", "graspd-eval"])),
    ("xtask", Allowed::Only(&["anyhow", "serde_json"])),
];

/// Checks the workspace at `root`.
pub(crate) fn check_workspace(root: &Path) -> Result<()> {
    let text = output(&mut cargo(
        root,
        "metadata --locked --no-deps --format-version 1",
    ))?;
    let metadata = serde_json::from_str(&text).context("cargo metadata printed no JSON")?;
    report(faults(&metadata)?)
}

/// One line for each edge that the layers do not allow, each crate without a layer, and each cycle.
fn faults(metadata: &Value) -> Result<Vec<String>> {
    let packages = metadata["packages"]
        .as_array()
        .context("cargo metadata lists no packages")?;
    let name_of = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let members: BTreeSet<String> = packages.iter().map(name_of).collect();
    let mut faults = Vec::new();
    let mut uses = Graph::new();
    for package in packages {
        let name = name_of(package);
        let layer = LAYERS.iter().find(|(layer, _)| *layer == name);
        if layer.is_none() {
            faults.push(format!(
                "{name} has no layer: add it to LAYERS in xtask and to ARCHITECTURE.md"
            ));
        }
        let dependencies = package["dependencies"].as_array();
        for dependency in dependencies.into_iter().flatten() {
            let used = name_of(dependency);
            let is_development = dependency["kind"].as_str() == Some("dev");
            let is_member = members.contains(&used);
            // A crate names itself to switch on features of its own for its tests.
            if is_member && used != name {
                uses.entry(used.clone()).or_default();
                uses.entry(name.clone()).or_default().insert(used.clone());
            }
            let is_allowed = match layer.map(|(_, allowed)| allowed) {
                _ if is_development => true,
                Some(Allowed::Workspace(list)) => !is_member || list.contains(&used.as_str()),
                Some(Allowed::Only(list)) => list.contains(&used.as_str()),
                Some(Allowed::Anything) | None => true,
            };
            if !is_allowed {
                faults.push(format!("{name} may not depend on {used}"));
            }
        }
    }
    faults.extend(circles(&uses));
    Ok(faults)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use serde_json::json;

    fn metadata(edges: &[(&str, &str, Option<&str>)]) -> Value {
        let mut dependencies: BTreeMap<&str, Vec<Value>> = BTreeMap::new();
        for (user, used, kind) in edges {
            dependencies
                .entry(user)
                .or_default()
                .push(json!({"name": used, "kind": kind}));
            if LAYERS.iter().any(|(name, _)| name == used) || used.starts_with("graspd") {
                dependencies.entry(used).or_default();
            }
        }
        let packages: Vec<Value> = dependencies
            .into_iter()
            .map(|(name, list)| json!({"name": name, "dependencies": list}))
            .collect();
        json!({"packages": packages})
    }

    #[test]
    fn allowed_edges_pass() {
        let edges = [
            ("graspd-geom", "graspd-ad", None),
            ("graspd-geom", "nalgebra", None),
            ("graspd-hand", "graspd-geom", None),
            ("graspd", "graspd-eval", None),
            ("graspd-cli", "graspd-view", None),
            ("xtask", "anyhow", None),
            // For tests only: a crate of its own layer, and itself.
            ("graspd-opt", "graspd-geom", Some("dev")),
            ("graspd-geom", "graspd-geom", Some("dev")),
        ];
        assert_eq!(faults(&metadata(&edges)).unwrap(), Vec::<String>::new());
    }

    #[test]
    fn forbidden_edges_are_named() {
        for (user, used, kind) in [
            ("graspd-ad", "graspd-geom", None),
            ("graspd-eval", "graspd-sim", None),
            ("graspd-eval", "graspd-sim", Some("build")),
            ("graspd-opt", "graspd-geom", None),
            ("graspd-view", "graspd", None),
            ("xtask", "nalgebra", None),
        ] {
            let found = faults(&metadata(&[(user, used, kind)])).unwrap();
            assert_eq!(found, [format!("{user} may not depend on {used}")]);
        }
    }

    #[test]
    fn a_crate_without_a_layer_is_named() {
        let found = faults(&metadata(&[("graspd-cli", "graspd-new", None)])).unwrap();
        assert!(
            found.len() == 1 && found[0].starts_with("graspd-new has no layer"),
            "{found:?}"
        );
    }

    #[test]
    fn cycles_through_development_dependencies_are_found() {
        let edges = [
            ("graspd-hand", "graspd-geom", None),
            ("graspd-geom", "graspd-ad", None),
            ("graspd-ad", "graspd-hand", Some("dev")),
        ];
        let found = faults(&metadata(&edges)).unwrap();
        assert_eq!(
            found,
            [
                "a circle: graspd-ad -> graspd-hand, graspd-geom -> graspd-ad, graspd-hand -> graspd-geom"
            ]
        );
    }

    #[test]
    fn other_json_is_an_error() {
        assert!(faults(&json!({})).is_err());
    }
}
