//! Any bytes as a mesh file.

#![no_main]

use graspd_fuzz::check_mesh;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| check_mesh(bytes, "mesh.ply"));
