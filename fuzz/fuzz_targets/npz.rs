//! Any bytes as a file in MANO's layout; the seeds are .npz archives.

#![no_main]

use graspd_fuzz::check_model;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| check_model(bytes));
