//! `cargo xtask man`: what a package of the command has beside the program.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::steps::{cargo, output, run};

/// The shells, and what they call a file of completions.
const SHELLS: [(&str, &str); 3] = [
    ("bash", "graspd.bash"),
    ("zsh", "_graspd"),
    ("fish", "graspd.fish"),
];

/// Writes manual pages into `folder`, and completions into its subfolder `completions`.
pub(crate) fn write(root: &Path, folder: &str) -> Result<()> {
    let folder = std::path::absolute(folder).context("the folder's path")?;
    let completions = folder.join("completions");
    fs::create_dir_all(&completions)
        .with_context(|| format!("cannot make {}", completions.display()))?;
    let program = "run --locked --quiet -p graspd-cli --";
    let mut pages = cargo(root, &format!("{program} man"));
    run(pages.arg(&folder))?;
    for (shell, name) in SHELLS {
        let script = output(&mut cargo(root, &format!("{program} completions {shell}")))?;
        let path = completions.join(name);
        fs::write(&path, script).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
