//! The order of grasps.

use graspd::{GraspRecord, rank_by_displacement};
use proptest::prelude::*;

use crate::fixtures::{bare_record, displaced_record};

/// Indices in order of rank, after checking that the ranks count from 1.
fn ranked(mut records: Vec<GraspRecord>) -> Vec<usize> {
    rank_by_displacement(&mut records);
    for (position, record) in records.iter().enumerate() {
        assert_eq!(record.rank, Some(position + 1));
    }
    records.iter().map(|record| record.index).collect()
}

#[test]
fn the_least_displacement_comes_first() {
    let records = [3.0, 0.25, 11.0, 0.5].map(Some);
    let records = records.into_iter().enumerate();
    let records = records.map(|(index, sd)| displaced_record(index, sd));
    assert_eq!(ranked(records.collect()), [1, 3, 0, 2]);
}

#[test]
fn ties_are_ordered_by_index_whatever_the_order_before() {
    for order in [[0, 1, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]] {
        let tied = |index| displaced_record(index, Some(if index == 2 { 0.1 } else { 0.7 }));
        assert_eq!(ranked(order.map(tied).into()), [2, 0, 1, 3]);
    }
}

#[test]
fn grasps_without_a_displacement_come_last_by_index() {
    let records = vec![
        displaced_record(5, Some(f64::NAN)),
        bare_record(4),
        displaced_record(3, Some(f64::INFINITY)),
        displaced_record(2, None),
        displaced_record(1, Some(1e3)),
        displaced_record(0, Some(2e3)),
    ];
    assert_eq!(ranked(records), [1, 0, 2, 3, 4, 5]);
}

#[test]
fn nothing_to_rank_is_fine() {
    assert_eq!(ranked(Vec::new()), [0_usize; 0]);
}

proptest! {
    /// Displacements drawn from few values, so that there are ties.
    #[test]
    fn the_order_does_not_depend_on_the_order_before(
        levels in prop::collection::vec(0..6_u8, 1..20),
        rotation in 0..20_usize,
    ) {
        let value = |level| match level {
            0 => None,
            1 => Some(f64::NAN),
            level => Some(f64::from(level)),
        };
        let records: Vec<_> = levels
            .iter()
            .enumerate()
            .map(|(index, &level)| displaced_record(index, value(level)))
            .collect();
        let mut turned = records.clone();
        turned.rotate_left(rotation % records.len());
        turned.reverse();
        let order = ranked(turned);
        prop_assert_eq!(&order, &ranked(records));
        let sorted = order.windows(2).all(|pair| {
            match (levels[pair[0]] > 1, levels[pair[1]] > 1) {
                (true, true) => (levels[pair[0]], pair[0]) < (levels[pair[1]], pair[1]),
                (false, false) => pair[0] < pair[1],
                (first, _) => first,
            }
        });
        prop_assert!(sorted, "{levels:?} ranked as {order:?}");
    }
}
