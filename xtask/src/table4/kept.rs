//! Results of objects that are done, so that an interrupted run loses at most the object in progress.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::report::ObjectRow;

/// Where an object's results are kept, and what they depend on.
pub(super) struct Kept {
    path: PathBuf,
    key: String,
}

impl Kept {
    /// `asked`: what was asked for; `files`: what it is made with and of (a built-in object is no file).
    pub(super) fn new(folder: &Path, asked: &str, files: &[&Path]) -> Result<Self> {
        let mut hasher = DefaultHasher::new();
        asked.hash(&mut hasher);
        for file in files.iter().filter(|file| file.is_file()) {
            fs::read(file)
                .with_context(|| format!("cannot read {}", file.display()))?
                .hash(&mut hasher);
        }
        Ok(Self {
            path: folder.join("row.json"),
            key: format!("{:016x}", hasher.finish()),
        })
    }

    /// The results, if there are any for the same.
    pub(super) fn row(&self) -> Option<ObjectRow> {
        let value: Value = serde_json::from_str(&fs::read_to_string(&self.path).ok()?).ok()?;
        (value["key"] == self.key.as_str())
            .then(|| ObjectRow::from_json(&value["row"]).ok())
            .flatten()
    }

    /// Keeps results.
    pub(super) fn keep(&self, row: &ObjectRow) -> Result<()> {
        let value = json!({"key": self.key, "row": row.to_json()});
        super::write(&self.path, &format!("{value:#}\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::report::Means;
    use super::*;

    #[test]
    fn results_are_kept_for_the_same_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("graspd-kept-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let mesh = folder.join("mesh.obj");
        fs::write(&mesh, "v 0 0 0").unwrap();
        let kept = |asked| Kept::new(&folder, asked, &[mesh.as_path(), Path::new("can")]).unwrap();
        assert_eq!(kept("10 grasps").row(), None);
        let means = Means {
            area_cm2: 20.25,
            counted_area_cm2: 24.5,
            volume_cm3: 0.5,
            displacement_cm: 0.125,
        };
        let row = ObjectRow {
            name: "mug".into(),
            note: Some("a built-in shape".into()),
            is_rendered: true,
            views: 15,
            truth: means,
            rgbd: Means {
                volume_cm3: 0.0,
                ..means
            },
            seconds: 3.5,
        };
        kept("10 grasps").keep(&row).unwrap();
        assert_eq!(kept("10 grasps").row(), Some(row));
        assert_eq!(kept("20 grasps").row(), None);
        fs::write(&mesh, "v 1 0 0").unwrap();
        assert_eq!(kept("10 grasps").row(), None);
        // A damaged file is none.
        fs::write(folder.join("row.json"), "{").unwrap();
        assert_eq!(kept("10 grasps").row(), None);
        fs::remove_dir_all(folder).unwrap();
    }
}
