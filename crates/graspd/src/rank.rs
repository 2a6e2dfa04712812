//! Which grasp is best.

use std::cmp::Ordering;

use crate::record::GraspRecord;

/// Sorts evaluated grasps by simulation displacement, least first, and numbers them from 1.
///
/// Ties, and grasps without a displacement (these come last), are ordered by index.
///
/// # Source
/// Grasp'D (ECCV 2022), supplementary A.6: grasps are ordered by simulation displacement.
pub fn rank_by_displacement(records: &mut [GraspRecord]) {
    let displacement = |record: &GraspRecord| {
        record
            .metrics
            .as_ref()
            .and_then(|metrics| metrics.sim_displacement_cm)
            .filter(|value| value.is_finite())
    };
    records.sort_by(|a, b| {
        match (displacement(a), displacement(b)) {
            (Some(a), Some(b)) => a.total_cmp(&b),
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (None, None) => Ordering::Equal,
        }
        .then(a.index.cmp(&b.index))
    });
    for (position, record) in records.iter_mut().enumerate() {
        record.rank = Some(position + 1);
    }
}
