//! Any bytes as an `.npy` file of Python's objects, as grasps of other projects come.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Err(fault) = graspd_hand::read_npy(bytes) {
        assert!(!fault.is_empty() && !fault.contains('\n'), "{fault}");
    }
});
