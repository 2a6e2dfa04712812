//! Processor time, which other programs disturb less than the time by the clock.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time of this thread so far.
#[allow(dead_code)] // Not every benchmark asks for it.
pub(crate) fn cpu_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// Processor time of `count` calls.
pub(crate) fn time(count: u64, mut call: impl FnMut()) -> Duration {
    let start = cpu_time();
    for _ in 0..count {
        call();
    }
    cpu_time() - start
}
