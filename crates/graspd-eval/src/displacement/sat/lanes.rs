//! Blocks of numbers that compilers turn into vector instructions.

/// Numbers in a block.
pub(in super::super) const LANES: usize = 4;

/// One number of each of [`LANES`] rows.
pub(in super::super) type Lanes = [f64; LANES];

/// Groups rows into blocks of [`LANES`], coordinate by coordinate; the last block is padded with `filling`.
pub(in super::super) fn in_blocks<const K: usize>(
    rows: &[[f64; K]],
    filling: [f64; K],
) -> Vec<[Lanes; K]> {
    (rows.chunks(LANES))
        .map(|chunk| {
            std::array::from_fn(|k| std::array::from_fn(|i| chunk.get(i).unwrap_or(&filling)[k]))
        })
        .collect()
}

/// Returns the smaller number; without handling NaN, so that it compiles to one vector instruction.
#[inline(always)]
pub(in super::super) fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
