//! Any bytes as one array of an otherwise sound archive: its checksums would keep most damage from the reader of
//! arrays.

#![no_main]

use std::io::{Cursor, Write};

use graspd_fuzz::check_model;
use zip::write::SimpleFileOptions;

/// The arrays of a hand that is a tetrahedron, with their shapes; those that may be left out last.
const ARRAYS: [(&str, &str); 8] = [
    ("v_template", "4, 3"),
    ("f", "4, 3"),
    ("weights", "4, 16"),
    ("parents", "16,"),
    ("J", "16, 3"),
    ("shapedirs", "4, 3, 2"),
    ("hands_components", "2, 45"),
    ("hands_mean", "45,"),
];

fn values(name: &str) -> Vec<f64> {
    match name {
        "v_template" => vec![0.0, 0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.05],
        "f" => vec![0.0, 2.0, 1.0, 0.0, 1.0, 3.0, 1.0, 2.0, 3.0, 0.0, 3.0, 2.0],
        "weights" => (0..64)
            .map(|i| f64::from(u8::from(i % 16 == i / 16)))
            .collect(),
        "parents" => {
            let mut parents: Vec<f64> = (0..16).map(|i| f64::from(i) - 1.0).collect();
            for first in [1, 4, 7, 10, 13] {
                parents[first] = 0.0;
            }
            parents
        }
        "J" => (0..48).map(|i| 1e-3 * f64::from(i)).collect(),
        "shapedirs" => vec![1e-3; 24],
        "hands_components" => (0..90).map(|i| f64::from(u8::from(i % 46 == 0))).collect(),
        _ => vec![0.1; 45],
    }
}

fn npy(name: &str, shape: &str) -> Vec<u8> {
    let is_whole = matches!(name, "f" | "parents");
    let kind = if is_whole { "<i8" } else { "<f8" };
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for value in values(name) {
        let word = if is_whole {
            (value as i64).to_le_bytes()
        } else {
            value.to_le_bytes()
        };
        bytes.extend(word);
    }
    bytes
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&which, array)) = bytes.split_first() else {
        return;
    };
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (index, (name, shape)) in ARRAYS.into_iter().enumerate() {
        writer
            .start_file(format!("{name}.npy"), stored)
            .expect("memory takes it");
        let content = if index == usize::from(which) % ARRAYS.len() {
            array.to_vec()
        } else {
            npy(name, shape)
        };
        writer.write_all(&content).expect("memory takes it");
    }
    check_model(&writer.finish().expect("memory takes it").into_inner());
});
