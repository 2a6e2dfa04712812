//! The `graspd` command and the folders that experiments work in.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use graspd::write_atomically;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Where things are.
pub(crate) struct Laboratory {
    /// The project's checkout.
    pub(crate) root: PathBuf,
    /// The folder of build outputs; experiments keep their files in it.
    pub(crate) target: PathBuf,
    /// The `graspd` program.
    pub(crate) graspd: PathBuf,
}

impl Laboratory {
    /// Finds the command beside this program: `cargo xtask` builds both into one folder.
    pub(crate) fn find() -> Result<Self> {
        let own = std::env::current_exe().context("cannot find this program's own folder")?;
        let graspd = own.with_file_name(format!("graspd{}", std::env::consts::EXE_SUFFIX));
        // <target>/<profile>/bench-lab
        let target = own
            .ancestors()
            .nth(2)
            .context("this program is not in a target folder")?;
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = manifest.parent().unwrap_or(manifest).to_owned();
        Ok(Self {
            root,
            target: target.to_owned(),
            graspd,
        })
    }
}

/// Runs a command that has to succeed; returns what it prints to stdout.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("cannot start {command:?}"))?;
    if !output.status.success() {
        bail!("{command:?}: {}", output.status);
    }
    String::from_utf8(output.stdout)
        .with_context(|| format!("{command:?} printed other than UTF-8"))
}

/// Runs a command and reads the JSON that it prints.
pub(crate) fn json_output<T: DeserializeOwned>(command: &mut Command) -> Result<T> {
    let text = output(command)?;
    serde_json::from_str(&text)
        .with_context(|| format!("{command:?} printed other JSON than expected"))
}

/// Reads a JSON file.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} cannot be used", path.display()))
}

/// Writes a JSON file, whole or not at all.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    write_text(path, &format!("{}\n", serde_json::to_string_pretty(value)?))
}

/// Writes a text file, whole or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<()> {
    Ok(write_atomically(path, text.as_bytes())?)
}

/// Returns a number that changes with what was asked for and with the contents of the files it depends on; names that
/// are no files (built-in objects) are left out.
pub(crate) fn digest(asked: &impl Hash, files: &[&Path]) -> Result<String> {
    let mut hasher = DefaultHasher::new();
    asked.hash(&mut hasher);
    for file in files.iter().filter(|file| file.is_file()) {
        let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        bytes.hash(&mut hasher);
    }
    Ok(format!("{:016x}", hasher.finish()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_follow_what_is_asked_and_the_bytes_of_files() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("mesh.obj");
        fs::write(&mesh, "v 0 0 0").unwrap();
        let files = [mesh.as_path(), Path::new("can")];
        let first = digest(&["ab", "c"], &files).unwrap();
        assert_eq!(digest(&["ab", "c"], &files).unwrap(), first);
        assert_ne!(digest(&["a", "bc"], &files).unwrap(), first);
        fs::write(&mesh, "v 1 0 0").unwrap();
        assert_ne!(digest(&["ab", "c"], &files).unwrap(), first);
    }
}
