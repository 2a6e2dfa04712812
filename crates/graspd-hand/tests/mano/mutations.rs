//! Files with random damage: an answer or one line of error, never a panic, a hang or memory beyond the file's size.

use graspd_hand::{SkinnedHand, SkinnedHandOptions, parse_skinned_model};
use proptest::prelude::*;
use std::sync::LazyLock;

use crate::archives::archived;
use crate::pickles::{Extras, pickled};
use crate::synthetic;

static FILES: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
    let model = synthetic::smallest();
    [pickled(&model, &Extras::default()), archived(&model)]
});

fn look(bytes: &[u8]) {
    match parse_skinned_model(bytes, "hand") {
        Ok(model) => {
            if let Err(error) = SkinnedHand::new(model, &SkinnedHandOptions::default()) {
                assert!(!error.to_string().contains('\n'));
            }
        }
        Err(error) => {
            let error = error.to_string();
            assert!(!error.contains('\n') && error.len() < 2000, "{error}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn changed_bytes(
        which in 0..2_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = FILES[which].clone();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        look(&bytes);
    }

    #[test]
    fn lengths_that_lie(place in any::<prop::sample::Index>(), length in any::<[u8; 4]>(), which in 0..2_usize) {
        let mut bytes = FILES[which].clone();
        let place = place.index(bytes.len() - 4);
        bytes[place..place + 4].copy_from_slice(&length);
        look(&bytes);
    }

    #[test]
    fn pieces_moved_cut_and_doubled(
        from in any::<prop::sample::Index>(),
        to in any::<prop::sample::Index>(),
        length in 1..200_usize,
        which in 0..2_usize,
    ) {
        let bytes = &FILES[which];
        let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
        let piece = bytes[from..(from + length).min(bytes.len())].to_vec();
        let mut moved = bytes.clone();
        moved.splice(to..to, piece);
        look(&moved);
        moved.truncate(to);
        look(&moved);
    }

    #[test]
    fn any_instructions(bytes in prop::collection::vec(
        prop::sample::select(&b"\x80\x02.(012KMJNU\x01TX]})l\x85\x86\x87taeusdqhrjcRb\x81\x88\x89\x8aSVIFG\x00\n"[..]),
        0..200,
    )) {
        look(&bytes);
    }
}

/// Where fuzzing starts from: `cargo test -p graspd-hand --test mano write_seeds -- --ignored` writes it.
#[test]
#[ignore = "writes the seeds of the fuzz targets"]
fn write_seeds() {
    let seeds = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds");
    for (file, bytes) in ["pickle/smallest.pkl", "npz/smallest.npz"]
        .iter()
        .zip(&*FILES)
    {
        std::fs::write(format!("{seeds}/{file}"), bytes).unwrap();
    }
}
