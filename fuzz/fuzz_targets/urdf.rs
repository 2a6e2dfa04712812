//! Any text as a URDF; meshes and settings beside it are looked for, but there are none.

#![no_main]

use graspd_fuzz::check_hand_error;
use graspd_hand::{HandOptions, UrdfOptions, parse_urdf};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let options = UrdfOptions {
        // As few as there may be: what is fuzzed is the reader.
        hand: HandOptions {
            contact_points: 8,
            collision_spheres: 0,
            ..HandOptions::default()
        },
        ..UrdfOptions::default()
    };
    let text = String::from_utf8_lossy(bytes);
    if let Err(error) = parse_urdf(&text, "/no/such/folder/hand.urdf", &options) {
        check_hand_error(&error);
    }
});
