//! Means of every column over the best grasps and over all, with intervals; and the differences between two runs.

use anyhow::{Result, bail};
use graspd::grouped_interval_95;
use serde::Serialize;

use super::metrics::{Column, Grasp, ObjectResult};

/// Which grasps of each object count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Selection {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// How many of the least displacement; `None` for all.
    best: Option<usize>,
}

pub(super) const SELECTIONS: [Selection; 3] = [
    Selection {
        key: "top_2",
        best: Some(2),
    },
    Selection {
        key: "top_5",
        best: Some(5),
    },
    Selection {
        key: "all",
        best: None,
    },
];

/// A mean and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Estimate {
    #[serde(rename = "mean")]
    pub(super) value: f64,
    #[serde(rename = "interval_95")]
    pub(super) interval: Option<[f64; 2]>,
}

impl Estimate {
    /// Evaluates a function of means over groups of means over items, with its interval.
    fn of<const TERMS: usize>(
        groups: &[Vec<[f64; TERMS]>],
        statistic: fn([f64; TERMS]) -> f64,
    ) -> Self {
        let means: Vec<[f64; TERMS]> = groups.iter().map(|items| mean(items)).collect();
        Self {
            value: statistic(mean(&means)),
            interval: grouped_interval_95(groups, statistic),
        }
    }
}

fn mean<const TERMS: usize>(items: &[[f64; TERMS]]) -> [f64; TERMS] {
    std::array::from_fn(|k| items.iter().map(|item| item[k]).sum::<f64>() / items.len() as f64)
}

fn quotient([over, under]: [f64; 2]) -> f64 {
    over / under
}

fn difference_of_quotients([a, b, c, d]: [f64; 4]) -> f64 {
    a / b - c / d
}

/// Computes the mean of a column over objects of its mean over the selected grasps (of a ratio: the ratio of the
/// means).
///
/// Of one object, grasps are resampled. Of several, objects are, and grasps within them too if all count: the best
/// of a resample are not a sample of the best.
pub(super) fn estimate(
    objects: &[ObjectResult],
    selection: Selection,
    column: &Column,
) -> Estimate {
    let groups: Vec<Vec<[f64; 2]>> = (objects.iter())
        .map(|object| {
            let terms = terms(object, selection, column);
            settled(terms, selection, objects.len())
        })
        .collect();
    Estimate::of(&groups, quotient)
}

/// Computes how much more a column is in `ours` than in `theirs`, on the same objects. If all grasps count, they are
/// paired by start
/// and both runs must have the same starts; the best of each run are paired by object.
pub(super) fn difference(
    ours: &[ObjectResult],
    theirs: &[ObjectResult],
    selection: Selection,
    column: &Column,
) -> Estimate {
    let groups: Vec<Vec<[f64; 4]>> = (ours.iter().zip(theirs))
        .map(|(a, b)| {
            let of = |object| terms(object, selection, column);
            let pairs = of(a).into_iter().zip(of(b));
            let pairs = pairs.map(|([a, b], [c, d])| [a, b, c, d]).collect();
            settled(pairs, selection, ours.len())
        })
        .collect();
    Estimate::of(&groups, difference_of_quotients)
}

fn terms(object: &ObjectResult, selection: Selection, column: &Column) -> Vec<[f64; 2]> {
    let terms = |grasps: &[Grasp]| grasps.iter().map(|grasp| grasp.terms(column)).collect();
    match selection.best {
        Some(count) => terms(&object.best(count)),
        None => terms(&object.grasps),
    }
}

/// Returns one item an object, the mean, where the best grasps of several objects count.
fn settled<const TERMS: usize>(
    items: Vec<[f64; TERMS]>,
    selection: Selection,
    objects: usize,
) -> Vec<[f64; TERMS]> {
    if selection.best.is_none() || objects < 2 {
        return items;
    }
    vec![mean(&items)]
}

/// What the difference of a column is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    Better,
    Worse,
    /// The interval of the difference contains 0.
    NoDifference,
    /// There is no interval: too few grasps, or a ratio over 0.
    Unknown,
}

impl Verdict {
    pub(super) fn of(column: &Column, difference: &Estimate) -> Self {
        let Some([low, high]) = difference.interval else {
            return Self::Unknown;
        };
        if low <= 0.0 && high >= 0.0 {
            Self::NoDifference
        } else if difference.value * column.better > 0.0 {
            Self::Better
        } else {
            Self::Worse
        }
    }

    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "worse",
            Self::NoDifference => "no significant difference",
            Self::Unknown => "cannot be told",
        }
    }
}

/// The objects that both runs have, in the order of the first, each with the starts that both have.
pub(super) fn common(
    ours: &[ObjectResult],
    theirs: &[ObjectResult],
) -> Result<(Vec<ObjectResult>, Vec<ObjectResult>)> {
    let mut both = (Vec::new(), Vec::new());
    for a in ours {
        let Some(b) = theirs.iter().find(|b| b.name == a.name) else {
            continue;
        };
        let keep = |object: &ObjectResult, other: &ObjectResult| ObjectResult {
            grasps: (object.grasps.iter())
                .filter(|grasp| other.grasps.iter().any(|g| g.index == grasp.index))
                .cloned()
                .collect(),
            ..object.clone()
        };
        let (a, b) = (keep(a, b), keep(b, a));
        if !a.grasps.is_empty() {
            both.0.push(a);
            both.1.push(b);
        }
    }
    if both.0.is_empty() {
        bail!(
            "the two runs have no start of no object in common; give --against a run on the same objects"
        );
    }
    Ok(both)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::metrics::tests::{column, grasp};
    use super::*;

    /// Grasps of the areas given, the first of the least displacement.
    pub(in crate::evaluate) fn object(name: &str, areas: &[f64]) -> ObjectResult {
        let grasps = (areas.iter().zip(0..))
            .map(|(area, index)| grasp(index, *area, 0.01 * (index + 1) as f64))
            .collect();
        ObjectResult::new(name, None, grasps).unwrap()
    }

    #[test]
    fn means_are_over_objects_and_ratios_are_of_means() {
        let objects = [object("a", &[10.0, 20.0, 90.0]), object("b", &[30.0; 3])];
        let [top_2, _, all] = SELECTIONS;
        let area = estimate(&objects, top_2, column("contact_area_cm2"));
        assert_eq!(area.value, 22.5);
        assert_eq!(area.interval, Some([15.0, 30.0]));
        let ratio = estimate(&objects, all, column("ca_over_iv"));
        assert!((ratio.value - 35.0 / 2.0).abs() < 1e-12);
        let [low, high] = ratio.interval.unwrap();
        assert!(low < 35.0 / 2.0 && 35.0 / 2.0 < high);
    }

    #[test]
    fn pairs_show_what_means_alone_do_not() {
        // Objects differ far more than the two runs do.
        let areas = [5.0, 20.0, 40.0, 80.0].map(|area| [area, area + 1.0, area + 2.0]);
        let ours: Vec<_> = areas.iter().map(|a| object(&a[0].to_string(), a)).collect();
        let theirs: Vec<_> = (areas.iter())
            .map(|a| object(&a[0].to_string(), &a.map(|area| area - 0.5)))
            .collect();
        let area = column("contact_area_cm2");
        for selection in SELECTIONS {
            let [low, high] = estimate(&ours, selection, area).interval.unwrap();
            assert!(high - low > 10.0);
            let more = difference(&ours, &theirs, selection, area);
            assert!((more.value - 0.5).abs() < 1e-9);
            assert_eq!(Verdict::of(area, &more), Verdict::Better);
            let less = difference(&theirs, &ours, selection, area);
            assert_eq!(Verdict::of(area, &less), Verdict::Worse);
            let none = difference(&ours, &ours, selection, area);
            assert_eq!(Verdict::of(area, &none), Verdict::NoDifference);
        }
    }

    #[test]
    fn runs_are_compared_where_they_overlap() {
        let (ours, theirs) = common(
            &[object("a", &[1.0, 2.0]), object("b", &[1.0])],
            &[object("c", &[1.0]), object("a", &[4.0, 5.0, 6.0])],
        )
        .unwrap();
        assert_eq!(ours, [object("a", &[1.0, 2.0])]);
        assert_eq!(theirs, [object("a", &[4.0, 5.0])]);
        assert!(common(&ours, &[object("c", &[1.0])]).is_err());
    }
}
