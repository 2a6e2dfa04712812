//! Circles in graphs of names.

use std::collections::{BTreeMap, BTreeSet};

/// What each name uses.
pub(crate) type Graph = BTreeMap<String, BTreeSet<String>>;

/// Returns a line for each set of names that reach each other, with the uses among them.
pub(crate) fn circles(graph: &Graph) -> Vec<String> {
    let reached = |start: &String| {
        let mut found = BTreeSet::new();
        let mut next: Vec<&String> = graph[start].iter().collect();
        while let Some(name) = next.pop() {
            if found.insert(name) {
                next.extend(graph.get(name).into_iter().flatten());
            }
        }
        found
    };
    let reach: BTreeMap<&String, BTreeSet<&String>> =
        graph.keys().map(|name| (name, reached(name))).collect();
    let circle_of = |name: &&String| -> BTreeSet<&String> {
        let back = |other: &&&String| reach.get(*other).is_some_and(|back| back.contains(name));
        reach[*name].iter().filter(back).copied().collect()
    };
    let line = |circle: BTreeSet<&String>| {
        let mut uses = Vec::new();
        for from in &circle {
            let used = graph[*from].iter().filter(|to| circle.contains(to));
            uses.extend(used.map(|to| format!("{from} -> {to}")));
        }
        format!("a circle: {}", uses.join(", "))
    };
    let found = graph
        .keys()
        .map(|name| circle_of(&name))
        .filter(|circle| !circle.is_empty());
    found
        .map(line)
        .collect::<BTreeSet<String>>()
        .into_iter()
        .collect()
}
