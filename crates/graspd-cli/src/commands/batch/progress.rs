//! How far a batch is: grasps, their rate, what is left.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use graspd::{BatchObserver, PlannedObject, PlannedRun, StartOutcome};
use indicatif::{ProgressBar, ProgressStyle};

use crate::console::tell;

/// Least time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// A bar on a terminal, plain lines otherwise, nothing when quiet.
pub(super) struct BatchProgress {
    is_quiet: bool,
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

struct State {
    planned: usize,
    over: usize,
    /// Those that were in a journal already.
    restored: usize,
    failed: usize,
    started: Instant,
    told: Instant,
}

impl BatchProgress {
    pub(super) fn new(is_quiet: bool) -> Self {
        let bar = (!is_quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(0);
            if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}") {
                bar.set_style(style);
            }
            bar
        });
        let now = Instant::now();
        Self {
            is_quiet,
            bar,
            state: Mutex::new(State {
                planned: 0,
                over: 0,
                restored: 0,
                failed: 0,
                started: now,
                told: now,
            }),
        }
    }

    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish();
        }
    }

    /// Changes the state, and tells of it now and then.
    fn update(&self, change: impl FnOnce(&mut State)) {
        if self.is_quiet {
            return;
        }
        // A thread that panicked while printing leaves the counts usable.
        let mut state = self
            .state
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        change(&mut state);
        let text = state.text();
        if let Some(bar) = &self.bar {
            bar.set_length(state.planned as u64);
            bar.set_position(state.over as u64);
            bar.set_message(text);
        } else if state.told.elapsed() >= LINE_INTERVAL || state.over == state.planned {
            state.told = Instant::now();
            tell(&text);
        }
    }

    fn note(&self, line: &str) {
        match &self.bar {
            _ if self.is_quiet => {}
            Some(bar) => bar.println(line),
            None => tell(line),
        }
    }
}

impl State {
    fn text(&self) -> String {
        let made = self.over.saturating_sub(self.restored);
        let rate = made as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
        let mut text = format!("{} of {} grasps", self.over, self.planned);
        if made > 0 && rate > 0.0 {
            let left = (self.planned - self.over.min(self.planned)) as f64 / rate;
            text += &format!(", {rate:.2} a second, {} left", duration(left));
        }
        if self.failed > 0 {
            text += &format!(", {} failed", self.failed);
        }
        text
    }
}

/// Seconds for people.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s:02} s"),
        (h, m, _) => format!("{h} h {m:02} min"),
    }
}

impl BatchObserver for BatchProgress {
    fn planned(&self, starts: usize) {
        self.update(|state| {
            state.planned = starts;
            state.started = Instant::now();
        });
    }

    fn start_over(&self, run: &PlannedRun, outcome: &StartOutcome, is_restored: bool) {
        if let StartOutcome::Failure(failure) = outcome
            && !is_restored
        {
            self.note(&format!("{}: start failed: {}", run.name, failure.error));
        }
        self.update(|state| {
            state.over += 1;
            state.restored += usize::from(is_restored);
            state.failed += usize::from(matches!(outcome, StartOutcome::Failure(_)));
        });
    }

    fn object_failed(&self, object: &PlannedObject, error: &str, starts: usize) {
        self.note(&format!("{} failed: {error}", object.name_or_path));
        self.update(|state| {
            state.over += starts;
            state.restored += starts;
            state.failed += starts;
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_for_people() {
        assert_eq!(duration(3.4), "3 s");
        assert_eq!(duration(64.0), "1 min 04 s");
        assert_eq!(duration(7260.0), "2 h 01 min");
    }

    #[test]
    fn what_was_there_before_counts_for_no_rate() {
        let mut state = State {
            planned: 10,
            over: 5,
            restored: 5,
            failed: 0,
            started: Instant::now() - Duration::from_secs(10),
            told: Instant::now(),
        };
        assert_eq!(state.text(), "5 of 10 grasps");
        state.over = 6;
        assert_eq!(state.text(), "6 of 10 grasps, 0.10 a second, 40 s left");
        state.failed = 1;
        assert!(state.text().ends_with(", 1 failed"));
    }
}
