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

/// The 95 % interval of `statistic` over samples of `count` items drawn with replacement; `None` for fewer than two
/// items, or where some resample has no value.
///
/// `statistic` is given the indices of a resample. For two items the interval is from the smaller to the larger: no more
/// can be known from two.
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
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut indices = vec![0; count];
    let mut values = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        indices.fill_with(|| rng.random_range(0..count));
        values.push(statistic(&indices)?);
    }
    values.sort_by(f64::total_cmp);
    let last = (RESAMPLES - 1) as f64;
    let at = |share: f64| values[(share * last).round() as usize];
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
}
