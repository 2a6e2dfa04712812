//! Files whose numbers promise more than they hold: no reader allocates beyond a multiple of the file's size.
//!
//! Alone in its program: the counter sees all threads.

use std::alloc::System;
use std::path::PathBuf;

use graspd_hand::parse_skinned_model;
use graspd_mesh::parse_mesh;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// What a reader may allocate in all, freed or not, for each byte of a file, and for its tables.
const PER_BYTE: usize = 256;
const AT_LEAST: usize = 1 << 19;

fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder =
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds")).join(target);
    let files = std::fs::read_dir(folder).expect("the seeds are part of the project");
    let mut seeds: Vec<_> = files
        .map(|file| {
            let path = file.expect("a file").path();
            let name = path
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            (name, std::fs::read(path).expect("readable"))
        })
        .collect();
    seeds.sort();
    seeds
}

/// The file with each run of digits in turn replaced by numbers that nothing could hold.
fn with_long_numbers(bytes: &[u8]) -> Vec<Vec<u8>> {
    let is_start =
        |i: usize| bytes[i].is_ascii_digit() && (i == 0 || !bytes[i - 1].is_ascii_digit());
    let starts = (0..bytes.len()).filter(|&i| is_start(i));
    starts
        .flat_map(|start| {
            let digits = bytes[start..]
                .iter()
                .take_while(|b| b.is_ascii_digit())
                .count();
            ["2147483647", "4294967295", "9223372036854775807"].map(|number| {
                let mut changed = bytes.to_vec();
                changed.splice(start..start + digits, number.bytes());
                changed
            })
        })
        .collect()
}

/// The file with each word of four bytes in turn replaced by large ones, at any alignment.
fn with_large_words(bytes: &[u8]) -> Vec<Vec<u8>> {
    let places = 0..bytes.len().saturating_sub(3);
    places
        .flat_map(|place| {
            [
                [0xff, 0xff, 0xff, 0x7f],
                [0x7f, 0xff, 0xff, 0xff],
                [0xff; 4],
                [0, 0, 0, 0x10],
            ]
            .map(|word| {
                let mut changed = bytes.to_vec();
                changed[place..place + 4].copy_from_slice(&word);
                changed
            })
        })
        .collect()
}

#[test]
fn nothing_is_allocated_for_what_is_only_promised() {
    // Shared tables of the libraries are made at their first use.
    for target in ["obj", "stl", "ply", "off", "dae", "pickle", "npz"] {
        let mut worst = 0;
        for (name, seed) in seeds(target) {
            let changed = with_long_numbers(&seed).into_iter();
            for bytes in changed.chain(with_large_words(&seed)) {
                let region = Region::new(ALLOCATOR);
                let is_model = matches!(target, "pickle" | "npz");
                if is_model {
                    let _ = parse_skinned_model(&bytes, "hand");
                } else {
                    let _ = parse_mesh(&bytes, &name);
                }
                let change = region.change();
                let allocated = change.bytes_allocated + change.bytes_reallocated.max(0) as usize;
                worst = worst.max(allocated);
                assert!(
                    allocated <= AT_LEAST + PER_BYTE * bytes.len(),
                    "{target}/{name}: {allocated} bytes for a file of {}",
                    bytes.len()
                );
            }
        }
        assert!(worst > 0, "the counter counts");
        println!("{target}: at most {worst} bytes");
    }
}
