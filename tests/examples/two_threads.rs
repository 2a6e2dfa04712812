//! What a second core brings: independent starts in a pool of one thread and of two, one after the other.
//!
//! `cargo run --release -p graspd-tests --example two_threads -- [HAND] [ROUNDS]`; by default `allegro 8`. Each
//! round makes the same eight grasps of the built-in mug (7000 steps, preset `paper`) with one thread and with two,
//! and takes the wall clock's and the process's time of both. The wall clock's ratio is what a user sees, and falls
//! with whatever else the machine does. The ratio by processor time is what two cores would make of it that do
//! nothing else: it falls with what the threads take from each other in caches and memory alone.

use std::error::Error;
use std::time::{Duration, Instant};

use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_hand::{Hand, HandPose, builtin_hand};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use rustix::time::{ClockId, clock_gettime};

/// Samples of the object's distance grid along each axis.
const RESOLUTION: usize = 128;
/// Grasps made at a time: an even number.
const STARTS: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "allegro".into());
    let hand = builtin_hand(&name).ok_or("no such hand")?;
    let rounds = arguments.next().map_or(Ok(8), |count| count.parse())?;

    let settings = SynthesisSettings::paper();
    let source = NamedMesh::load("mug", 1.0)?;
    let object = GraspObject::prepare(source, RESOLUTION, settings.density, &|_| {})?;
    let mut starts = Vec::new();
    for index in 0..STARTS {
        starts.push(draw_start(&object, &*hand, &settings, 0, index)?);
    }
    let pools = [pool(1)?, pool(2)?];
    let mut wall_ratios = Vec::new();
    let mut processor_ratios = Vec::new();
    println!("one thread [s]  two threads [s]  ratio  by processor time");
    for _ in 0..rounds {
        let [one, two] = [&pools[0], &pools[1]]
            .map(|pool| pool.install(|| time(&*hand, &object, &starts, &settings)));
        let ratio = |of: fn(&Times) -> Duration| of(&one).as_secs_f64() / of(&two).as_secs_f64();
        let (wall, processor) = (ratio(|t| t.wall), 2.0 * ratio(|t| t.processor));
        let [one, two] = [one, two].map(|times| times.wall.as_secs_f64());
        println!("{one:>14.3}  {two:>15.3}  {wall:>5.2}  {processor:>17.2}");
        wall_ratios.push(wall);
        processor_ratios.push(processor);
    }
    for (what, ratios) in [
        ("wall clock", &mut wall_ratios),
        ("processor time", &mut processor_ratios),
    ] {
        ratios.sort_by(f64::total_cmp);
        if let (Some(most), Some(median)) = (ratios.last(), ratios.get(ratios.len() / 2)) {
            println!("{what}: {most:.2} at best, median {median:.2}");
        }
    }
    Ok(())
}

fn pool(threads: usize) -> Result<ThreadPool, rayon::ThreadPoolBuildError> {
    ThreadPoolBuilder::new().num_threads(threads).build()
}

struct Times {
    wall: Duration,
    processor: Duration,
}

/// The time in which the current pool makes a grasp of each start.
fn time(
    hand: &dyn Hand,
    object: &GraspObject,
    starts: &[HandPose],
    settings: &SynthesisSettings,
) -> Times {
    let (clock, processor) = (Instant::now(), processor_time());
    starts.par_iter().with_max_len(1).for_each(|start| {
        let (object, start) = (&object.simulated, start.clone());
        synthesize::<f32>(hand, object, start, settings, &mut |_, _, _| {})
            .expect("the preset is valid");
    });
    Times {
        wall: clock.elapsed(),
        processor: processor_time() - processor,
    }
}

/// Processor time of all threads so far.
fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}
