//! How far a mean over a few grasps may be trusted: the percentile bootstrap.

use rand::Rng;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Resamples drawn; the bounds of the interval are then those of 50 of them on either side.
const RESAMPLES: usize = 2000;
/// The part of the resampled values that an interval leaves out at either end.
const TAIL: f64 = 0.025;
/// Seed of the resamples: the same grasps have the same intervals.
const SEED: u64 = 95;

/// Computes the 95 % interval of `statistic` over samples of `count` items drawn with replacement; `None` for fewer
/// than two items, or where some resample has no value.
///
/// `statistic` is given the indices of a resample. For two items the interval is from the smaller to the larger: no
/// more can be known from two.
///
/// # Source
/// B. Efron, R. J. Tibshirani, "An Introduction to the Bootstrap", 1993, section 13.3 (the percentile interval).
pub(crate) fn interval_95(
    count: usize,
    statistic: impl Fn(&[usize]) -> Option<f64>,
) -> Option<[f64; 2]> {
    if count < 2 {
        return None;
    }
    let mut indices = vec![0; count];
    percentiles(|rng| {
        indices.fill_with(|| rng.random_range(0..count));
        statistic(&indices)
    })
}

/// Computes the 95 % interval of a function of means over items in groups (grasps of several objects): each mean is
/// over groups of means over items. A resample draws groups with replacement and items within each of them; of a
/// single group only items are drawn.
///
/// `None` where there is nothing to draw from (a single item of a single group), or some resample has no finite value.
///
/// # Source
/// A. C. Davison, D. V. Hinkley, "Bootstrap Methods and their Application", 1997, section 3.8 (hierarchical data).
pub fn grouped_interval_95<const TERMS: usize>(
    groups: &[Vec<[f64; TERMS]>],
    statistic: impl Fn([f64; TERMS]) -> f64,
) -> Option<[f64; 2]> {
    if groups.iter().any(Vec::is_empty) || groups.len() < 2 && groups.first()?.len() < 2 {
        return None;
    }
    percentiles(|rng| {
        let mut sum = [0.0; TERMS];
        for position in 0..groups.len() {
            let group = if groups.len() == 1 {
                position
            } else {
                rng.random_range(0..groups.len())
            };
            let items = &groups[group];
            for _ in 0..items.len() {
                let item = &items[rng.random_range(0..items.len())];
                for (total, term) in sum.iter_mut().zip(item) {
                    *total += term / items.len() as f64;
                }
            }
        }
        let value = statistic(sum.map(|total| total / groups.len() as f64));
        value.is_finite().then_some(value)
    })
}

/// Computes the percentile interval of the values of resamples.
fn percentiles(mut resample: impl FnMut(&mut ChaCha8Rng) -> Option<f64>) -> Option<[f64; 2]> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut values = (0..RESAMPLES)
        .map(|_| resample(&mut rng))
        .collect::<Option<Vec<f64>>>()?;
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[(share * (RESAMPLES - 1) as f64).round() as usize];
    Some([at(TAIL), at(1.0 - TAIL)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: &[f64]) -> Option<[f64; 2]> {
        interval_95(values.len(), |indices| {
            Some(indices.iter().map(|i| values[*i]).sum::<f64>() / indices.len() as f64)
        })
    }

    #[test]
    fn intervals_of_many_values_are_those_of_the_normal_distribution() {
        // 400 values at even quantiles of the uniform distribution on [0, 1]: standard error sqrt(1 / 12 / 400).
        let values: Vec<f64> = (0..400).map(|k| (k as f64 + 0.5) / 400.0).collect();
        let [low, high] = of(&values).unwrap();
        let half = 1.96 * (1.0f64 / 12.0 / 400.0).sqrt();
        // 2000 resamples know their 2.5 % quantile to about a twentieth of the half width.
        let tolerance = 0.15 * half;
        assert!((low - (0.5 - half)).abs() < tolerance, "{low}");
        assert!((high - (0.5 + half)).abs() < tolerance, "{high}");
        assert_eq!(of(&values), Some([low, high]));
    }

    #[test]
    fn few_values_say_little() {
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[3.0]), None);
        assert_eq!(of(&[3.0, 5.0]), Some([3.0, 5.0]));
        assert_eq!(of(&[2.0; 7]), Some([2.0, 2.0]));
        assert_eq!(interval_95(5, |_| None), None);
    }

    #[test]
    fn nine_of_ten_intervals_cover_the_mean() {
        // Percentile intervals of 20 values are a little short: about 93 of 100 cover.
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let covered = (0..100)
            .filter(|_| {
                let values: Vec<f64> = (0..20).map(|_| rng.random_range(0.0..1.0)).collect();
                let [low, high] = of(&values).unwrap();
                low < 0.5 && 0.5 < high
            })
            .count();
        assert!((85..=99).contains(&covered), "{covered}");
    }

    fn mean(groups: &[Vec<[f64; 1]>]) -> Option<[f64; 2]> {
        grouped_interval_95(groups, |[mean]| mean)
    }

    fn uniform(count: usize) -> Vec<[f64; 1]> {
        (0..count)
            .map(|k| [(k as f64 + 0.5) / count as f64])
            .collect()
    }

    #[test]
    fn the_variance_of_groups_and_of_items_add_up() {
        // 100 groups of 4 items: the groups' own means vary as 1/12, and items vary by as much about them.
        let groups: Vec<Vec<[f64; 1]>> = (uniform(100).iter())
            .map(|[mean]| uniform(4).iter().map(|[item]| [mean + item]).collect())
            .collect();
        let [low, high] = mean(&groups).unwrap();
        let items = (uniform(4).iter().map(|[x]| (x - 0.5).powi(2))).sum::<f64>() / 4.0;
        let variance = (1.0 / 12.0 + items / 4.0) / 100.0;
        let half = 1.96 * variance.sqrt();
        assert!(
            (high - low - 2.0 * half).abs() < 0.15 * half,
            "{low} to {high}, {half}"
        );
    }

    #[test]
    fn too_little_in_groups_says_nothing() {
        assert_eq!(mean(&[]), None);
        assert_eq!(mean(&[vec![[3.0]]]), None);
        assert_eq!(mean(&[vec![], vec![[3.0]]]), None);
        assert_eq!(mean(&[vec![[3.0], [5.0]]]), Some([3.0, 5.0]));
        assert_eq!(mean(&[vec![[3.0]], vec![[5.0]]]), Some([3.0, 5.0]));
        // A ratio whose denominator may be drawn as 0.
        let groups = [vec![[1.0, 0.0], [1.0, 1.0]]];
        assert_eq!(grouped_interval_95(&groups, |[a, b]| a / b), None);
    }
}
