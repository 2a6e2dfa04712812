//! Which objects experiments grasp.

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
pub(crate) const YCB: [&str; 14] = [
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
/// What stands in for them where there are no scans.
const BUILT_IN: [&str; 7] = ["can", "box", "bottle", "drill", "mug", "bowl", "banana"];

/// An object and how the command is told of it.
#[derive(Debug, PartialEq)]
pub(crate) struct Subject {
    pub(crate) name: String,
    /// A file, or the name of a built-in object.
    pub(crate) argument: String,
    /// What readers of the table should know.
    pub(crate) note: Option<String>,
}

/// The objects asked for, or else `usual`: scans from `$GRASPD_YCB` or `../shared/data/ycb`, or built-in shapes where
/// there are none.
pub(crate) fn subjects(root: &Path, asked: &[String], usual: &[&str]) -> Result<Vec<Subject>> {
    let given = std::env::var_os("GRASPD_YCB").map(PathBuf::from);
    let folder = given.unwrap_or_else(|| root.join("../shared/data/ycb"));
    if !folder.is_dir() {
        println!(
            "{} does not exist: built-in shapes instead of YCB scans (set GRASPD_YCB to the scans' folder)",
            folder.display()
        );
        let is_asked = |name: &str| asked.is_empty() || asked.iter().any(|a| a == name);
        let chosen: Vec<Subject> = (BUILT_IN.iter())
            .filter(|name| is_asked(name))
            .map(|name| Subject {
                name: (*name).to_owned(),
                argument: (*name).to_owned(),
                note: Some("a built-in shape".into()),
            })
            .collect();
        if chosen.is_empty() {
            bail!(
                "none of the objects asked for is built in: {}",
                BUILT_IN.join(", ")
            );
        }
        return Ok(chosen);
    }
    let names: Vec<String> = if asked.is_empty() {
        usual.iter().map(|name| (*name).to_owned()).collect()
    } else {
        asked.to_vec()
    };
    names.iter().map(|name| scan(&folder, name)).collect()
}

/// The scan of an object, by the names under which collections keep it.
fn scan(folder: &Path, name: &str) -> Result<Subject> {
    let subject = |path: PathBuf, note: Option<&str>| Subject {
        name: name.to_owned(),
        argument: path.to_string_lossy().into_owned(),
        note: note.map(String::from),
    };
    for file in [
        format!("{name}.obj"),
        format!("{name}/google_16k/textured.obj"),
        format!("{name}/google_16k/nontextured.ply"),
    ] {
        let path = folder.join(file);
        if path.exists() {
            return Ok(subject(path, None));
        }
    }
    let hull = folder.join(format!("{name}_hull.obj"));
    if hull.exists() {
        return Ok(subject(hull, Some("the scan's convex hull")));
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
        let folder = std::env::temp_dir().join(format!("graspd-table4-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("c/google_16k")).unwrap();
        for file in ["a.obj", "b_hull.obj", "c/google_16k/textured.obj"] {
            std::fs::write(folder.join(file), "").unwrap();
        }
        let found = |name| scan(&folder, name).map(|subject| (subject.argument, subject.note));
        assert!(found("a").unwrap().0.ends_with("a.obj"));
        assert_eq!(
            found("b").unwrap().1.as_deref(),
            Some("the scan's convex hull")
        );
        assert!(found("c").unwrap().0.ends_with("textured.obj"));
        assert!(found("d").unwrap_err().to_string().contains("no scan of d"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
