//! Lines on stdout and stderr. Neither a reader that went away nor a full disk makes a panic of them.

use std::io::{self, ErrorKind, Write};

use anyhow::{Result, anyhow};
use serde::Serialize;

/// Writes a result to stdout. A reader that has seen enough, as `head` has, is no failure.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(anyhow!(
            "cannot write to the standard output: {error}; send it somewhere with room for it"
        )),
        Ok(()) => Ok(()),
    }
}

/// Writes a value to stdout as JSON.
pub(crate) fn print_json(value: &impl Serialize) -> Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Writes a line to stderr, if that can be done: there is nowhere left to say that it cannot.
pub(crate) fn tell(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Writes a warning to stderr, unless quiet.
pub(crate) fn warn(quiet: bool, text: &str) {
    if !quiet {
        tell(&format!("warning: {}", one_line(text)));
    }
}

/// Describes an error and its causes in one line, each cause once: many messages already name their cause.
pub(crate) fn describe(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            if !text.is_empty() {
                text.push_str(": ");
            }
            text.push_str(&cause);
        }
    }
    one_line(&text)
}

/// Replaces control characters, which file names and parsers' messages may hold, by spaces.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

#[cfg(test)]
mod tests {
    use anyhow::Context;

    use super::*;

    #[test]
    fn errors_are_one_line_that_tells_each_cause_once() {
        let cause = || io::Error::other("disk\non fire");
        let told: Result<()> = Err(cause()).context("cannot read a.obj: disk\non fire; call help");
        assert_eq!(
            describe(&told.unwrap_err()),
            "cannot read a.obj: disk on fire; call help"
        );
        let untold: Result<()> = Err(cause()).context("run.toml");
        assert_eq!(describe(&untold.unwrap_err()), "run.toml: disk on fire");
    }
}
