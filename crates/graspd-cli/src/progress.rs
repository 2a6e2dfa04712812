//! Progress on stderr: a bar on a terminal, plain lines otherwise, nothing when quiet.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::console::tell;

/// Least time between two plain lines of one phase.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// One phase of work with a known length.
pub(crate) struct Progress {
    sink: Sink,
}

enum Sink {
    Quiet,
    Bar(ProgressBar),
    Lines {
        title: String,
        length: u64,
        state: Mutex<LineState>,
    },
}

struct LineState {
    position: u64,
    last: Instant,
}

impl Progress {
    /// Starts a phase of `length` units.
    pub(crate) fn start(title: &str, length: u64, quiet: bool) -> Self {
        let sink = if quiet {
            Sink::Quiet
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(length);
            if let Ok(style) = ProgressStyle::with_template(
                "{msg:24} {bar:32} {percent:>3} %  {elapsed} elapsed, {eta} left",
            ) {
                bar.set_style(style);
            }
            bar.set_message(title.to_owned());
            Sink::Bar(bar)
        } else {
            tell(&format!("{title} ..."));
            Sink::Lines {
                title: title.to_owned(),
                length,
                state: Mutex::new(LineState {
                    position: 0,
                    last: Instant::now(),
                }),
            }
        };
        Self { sink }
    }

    /// Counts `count` more units as done.
    pub(crate) fn advance(&self, count: u64) {
        self.update(|position| position + count);
    }

    /// Sets how many units are done in all.
    pub(crate) fn set(&self, position: u64) {
        self.update(|_| position);
    }

    fn update(&self, next: impl Fn(u64) -> u64) {
        match &self.sink {
            Sink::Quiet => {}
            Sink::Bar(bar) => bar.set_position(next(bar.position())),
            Sink::Lines {
                title,
                length,
                state,
            } => {
                // A thread that panicked while printing leaves the count usable.
                let mut state = state
                    .lock()
                    .unwrap_or_else(|poisoned| poisoned.into_inner());
                state.position = next(state.position);
                if state.last.elapsed() >= LINE_INTERVAL {
                    state.last = Instant::now();
                    let percent = 100 * state.position.min(*length) / (*length).max(1);
                    tell(&format!("{title}: {percent} %"));
                }
            }
        }
    }

    /// Writes a line beside the bar.
    pub(crate) fn note(&self, line: &str) {
        match &self.sink {
            Sink::Quiet => {}
            Sink::Bar(bar) => bar.println(line),
            Sink::Lines { .. } => tell(line),
        }
    }

    /// Ends the phase.
    pub(crate) fn finish(self) {
        if let Sink::Bar(bar) = self.sink {
            bar.finish();
        }
    }
}
