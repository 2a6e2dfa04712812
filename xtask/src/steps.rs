//! Steps of a run, each announced and timed.

use std::path::Path;
use std::process::{Command, ExitStatus};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// The steps done so far.
pub(crate) struct Steps {
    start: Instant,
    times: Vec<(String, Duration)>,
}

impl Steps {
    pub(crate) fn new() -> Self {
        Self {
            start: Instant::now(),
            times: Vec::new(),
        }
    }

    /// Does one step and prints how long it took.
    pub(crate) fn step(&mut self, name: &str, work: impl FnOnce() -> Result<()>) -> Result<()> {
        println!("== {name}");
        let start = Instant::now();
        work().with_context(|| format!("step \"{name}\" failed"))?;
        let time = start.elapsed();
        println!("-- {name}: {:.1} s", time.as_secs_f64());
        self.times.push((name.to_owned(), time));
        Ok(())
    }

    /// Prints the time of each step.
    pub(crate) fn print_summary(&self) {
        println!("== done so far");
        for (name, time) in &self.times {
            println!("{:>8.1} s  {name}", time.as_secs_f64());
        }
        println!("{:>8.1} s  in all", self.start.elapsed().as_secs_f64());
    }
}

/// Cargo, as started by the cargo that runs this program, in the project's root, with a line of arguments.
pub(crate) fn cargo(root: &Path, line: &str) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root).args(line.split_whitespace());
    command
}

/// Runs a command and waits for it; its output goes where this program's goes.
pub(crate) fn status(command: &mut Command) -> Result<ExitStatus> {
    command
        .status()
        .with_context(|| format!("cannot start {command:?}"))
}

/// Runs a command that has to succeed.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let status = status(command)?;
    if !status.success() {
        bail!("{command:?}: {status}");
    }
    Ok(())
}

/// What a command that has to succeed prints to stdout.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    let output = command
        .stderr(std::process::Stdio::inherit())
        .output()
        .with_context(|| format!("cannot start {command:?}"))?;
    if !output.status.success() {
        bail!("{command:?}: {}", output.status);
    }
    String::from_utf8(output.stdout)
        .with_context(|| format!("{command:?} printed other than UTF-8"))
}

/// An error that lists all faults found, if there are any.
pub(crate) fn report(faults: Vec<String>) -> Result<()> {
    if faults.is_empty() {
        return Ok(());
    }
    bail!("{} fault(s)\n  {}", faults.len(), faults.join("\n  "))
}
