//! Runs the command and looks at what comes back.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// What a run of the command gave.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// The command, not yet started; a backtrace that it might print would be found.
pub(crate) fn command<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspd"));
    command.args(arguments).env("RUST_BACKTRACE", "1");
    // Not the user's, and the same for all tests: it must make no difference.
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graspd-cache");
    command.env("GRASPD_CACHE_DIR", cache);
    command
}

/// Runs the command with `arguments`.
pub(crate) fn graspd<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Outcome {
    outcome(command(arguments).output().unwrap())
}

pub(crate) fn outcome(output: Output) -> Outcome {
    Outcome {
        status: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

impl Outcome {
    /// Status 0; gives stdout.
    pub(crate) fn succeeds(self) -> String {
        assert_eq!(self.status, Some(0), "{self:?}");
        self.stdout
    }

    /// Status 0; gives stdout as JSON.
    pub(crate) fn gives_json(self) -> serde_json::Value {
        let stdout = self.succeeds();
        serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error} in {stdout}"))
    }

    /// Status 1, nothing on stdout, and on stderr one line, the error, that holds all of `parts`.
    pub(crate) fn fails_at_once(self, parts: &[&str]) {
        assert_eq!(self.stderr.trim_end().lines().count(), 1, "{self:?}");
        self.fails(parts);
    }

    /// Status 1, nothing on stdout, and on stderr exactly one error line, the last, that holds all of `parts`.
    pub(crate) fn fails(self, parts: &[&str]) {
        assert_eq!(
            (self.status, self.stdout.as_str()),
            (Some(1), ""),
            "{self:?}"
        );
        let errors = self
            .stderr
            .lines()
            .filter(|line| line.starts_with("error:"));
        assert_eq!(errors.count(), 1, "{self:?}");
        let last = self.stderr.lines().last().unwrap();
        assert!(last.starts_with("error: "), "{self:?}");
        for part in parts {
            assert!(last.contains(part), "no `{part}` in: {last}");
        }
        for sign in ["panicked", "backtrace", "RUST_BACKTRACE"] {
            assert!(!self.stderr.contains(sign), "{self:?}");
        }
    }

    /// Wrong usage: status 2, nothing on stdout, an explanation on stderr that holds `part`.
    pub(crate) fn fails_as_wrong_usage(self, part: &str) {
        assert_eq!(
            (self.status, self.stdout.as_str()),
            (Some(2), ""),
            "{self:?}"
        );
        assert!(
            self.stderr.contains(part),
            "no `{part}` in: {}",
            self.stderr
        );
        assert!(!self.stderr.contains("panicked"), "{self:?}");
    }
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
