//! `graspd completions` and `graspd man`: what shells and manuals need to know of the command.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use clap::{Args, Command};
use clap_complete::Shell;

use super::output::prepare_folder;
use crate::console::print;

#[derive(Args)]
pub(crate) struct CompletionArguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Args)]
pub(crate) struct ManArguments {
    /// Folder for the pages
    #[arg(default_value = "man")]
    folder: PathBuf,
}

/// Prints the completions of a shell.
pub(crate) fn completions(arguments: &CompletionArguments, mut command: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "graspd", &mut script);
    print(&String::from_utf8(script)?)
}

/// Writes a page for the command and each of its subcommands.
pub(crate) fn man(arguments: &ManArguments, command: Command) -> Result<()> {
    let folder: &Path = &arguments.folder;
    prepare_folder(folder)?;
    clap_mangen::generate_to(command, folder).map_err(|error| {
        anyhow!(
            "{}: the pages cannot be written: {error}; choose another folder",
            folder.display()
        )
    })?;
    print(&format!(
        "{}: read them with man -l {}\n",
        folder.display(),
        folder.join("graspd.1").display()
    ))
}
