//! The objects that experiments grasp.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

/// The objects of the paper's Table 4.
pub(crate) const TABLE4: [&str; 8] = [
    "001_chips_can",
    "002_master_chef_can",
    "005_tomato_soup_can",
    "006_mustard_bottle",
    "008_pudding_box",
    "010_potted_meat_can",
    "021_bleach_cleanser",
    "035_power_drill",
];
/// Fourteen objects of the YCB set: those of Table 4, and other boxes, a banana, and thin walls.
const YCB: [&str; 14] = [
    "001_chips_can",
    "002_master_chef_can",
    "003_cracker_box",
    "004_sugar_box",
    "005_tomato_soup_can",
    "006_mustard_bottle",
    "008_pudding_box",
    "010_potted_meat_can",
    "011_banana",
    "019_pitcher_base",
    "021_bleach_cleanser",
    "024_bowl",
    "025_mug",
    "035_power_drill",
];
/// Built-in shapes that stand in where there are no scans.
const BUILT_IN: [&str; 7] = ["can", "box", "bottle", "drill", "mug", "bowl", "banana"];

/// An object of an experiment.
#[derive(Debug, Hash, PartialEq)]
pub(crate) struct Subject {
    pub(crate) name: String,
    /// What the command is given: a file, or the name of a built-in object.
    pub(crate) argument: String,
    /// What readers of the table should know.
    pub(crate) note: Option<String>,
}

/// Returns the objects of a list, `ycb`, `table4` or names: scans from `$GRASPD_YCB` or `../shared/data/ycb`, or
/// built-in shapes where that folder does not exist.
pub(crate) fn subjects(root: &Path, list: &str) -> Result<Vec<Subject>> {
    let given = std::env::var_os("GRASPD_YCB").map(PathBuf::from);
    let folder = given.unwrap_or_else(|| root.join("../shared/data/ycb"));
    let names: Vec<&str> = match list {
        "ycb" => YCB.to_vec(),
        "table4" => TABLE4.to_vec(),
        names => names.split(',').collect(),
    };
    if folder.is_dir() {
        return names.iter().map(|name| scan(&folder, name)).collect();
    }
    println!(
        "{} does not exist: built-in shapes instead of YCB scans (set GRASPD_YCB to the scans' folder)",
        folder.display()
    );
    let is_asked = |name: &str| matches!(list, "ycb" | "table4") || names.contains(&name);
    let chosen: Vec<Subject> = (BUILT_IN.into_iter().filter(|name| is_asked(name)))
        .map(|name| Subject {
            name: name.to_owned(),
            argument: name.to_owned(),
            note: Some("a built-in shape".into()),
        })
        .collect();
    if chosen.is_empty() {
        bail!(
            "none of the objects asked for is built in: {}",
            BUILT_IN.join(", ")
        );
    }
    Ok(chosen)
}

/// Returns the scan of an object, by the names under which collections keep it.
fn scan(folder: &Path, name: &str) -> Result<Subject> {
    let files = [
        (format!("{name}.obj"), None),
        (format!("{name}/google_16k/textured.obj"), None),
        (format!("{name}/google_16k/nontextured.ply"), None),
        (format!("{name}_hull.obj"), Some("the scan's convex hull")),
    ];
    for (file, note) in files {
        let path = folder.join(file);
        if path.exists() {
            return Ok(Subject {
                name: name.to_owned(),
                argument: path.to_string_lossy().into_owned(),
                note: note.map(String::from),
            });
        }
    }
    bail!(
        "{}: there is no scan of {name}; name others with --objects",
        folder.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_are_found_by_their_usual_names() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(folder.path().join("c/google_16k")).unwrap();
        for file in ["a.obj", "b_hull.obj", "c/google_16k/textured.obj"] {
            std::fs::write(folder.path().join(file), "").unwrap();
        }
        let found =
            |name| scan(folder.path(), name).map(|subject| (subject.argument, subject.note));
        assert!(found("a").unwrap().0.ends_with("a.obj"));
        assert_eq!(
            found("b").unwrap().1.as_deref(),
            Some("the scan's convex hull")
        );
        assert!(found("c").unwrap().0.ends_with("textured.obj"));
        assert!(found("d").unwrap_err().to_string().contains("no scan of d"));
    }
}
