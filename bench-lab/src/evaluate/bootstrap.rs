//! How far means over few grasps of few objects may be trusted: the percentile bootstrap at two levels.

/// Resamples drawn.
const RESAMPLES: usize = 4000;
/// The part of the resampled values that an interval leaves out at either end.
const TAIL: f64 = 0.025;

/// The 95 % interval of a function of means. `groups` has the terms of each item by group (grasps by object); a mean is
/// over groups of means over items. A resample draws groups with replacement, and items within each of those, so that the
/// interval speaks of other objects of the kind and of other starts. Of a single group only items are drawn.
///
/// `None` where there is nothing to draw from (a single item of a single group), or some resample has no finite value.
///
/// # Source
/// B. Efron, R. J. Tibshirani, "An Introduction to the Bootstrap", 1993, section 13.3 (percentile intervals);
/// A. C. Davison, D. V. Hinkley, "Bootstrap Methods and their Application", 1997, section 3.8 (hierarchical data).
pub(super) fn interval_95<const TERMS: usize>(
    groups: &[Vec<[f64; TERMS]>],
    statistic: impl Fn([f64; TERMS]) -> f64,
) -> Option<[f64; 2]> {
    if groups.iter().any(Vec::is_empty) || groups.len() < 2 && groups.first()?.len() < 2 {
        return None;
    }
    let mut random = SplitMix64(95);
    let mut values = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        let mut sum = [0.0; TERMS];
        for position in 0..groups.len() {
            let group = match groups.len() {
                1 => position,
                count => random.below(count),
            };
            let items = &groups[group];
            for _ in 0..items.len() {
                let item = &items[random.below(items.len())];
                for (total, term) in sum.iter_mut().zip(item) {
                    *total += term / items.len() as f64;
                }
            }
        }
        let value = statistic(sum.map(|total| total / groups.len() as f64));
        values.push(value.is_finite().then_some(value)?);
    }
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[(share * (RESAMPLES - 1) as f64).round() as usize];
    Some([at(TAIL), at(1.0 - TAIL)])
}

/// The function of the means themselves.
pub(super) fn value_of<const TERMS: usize>(
    groups: &[Vec<[f64; TERMS]>],
    statistic: impl Fn([f64; TERMS]) -> f64,
) -> f64 {
    let mut sum = [0.0; TERMS];
    for items in groups {
        for (k, total) in sum.iter_mut().enumerate() {
            *total += items.iter().map(|item| item[k]).sum::<f64>() / items.len() as f64;
        }
    }
    statistic(sum.map(|total| total / groups.len() as f64))
}

/// A generator for drawing items.
///
/// # Source
/// G. L. Steele, D. Lea, C. H. Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
struct SplitMix64(u64);

impl SplitMix64 {
    /// A whole number below `count`, uniform but for one part in 2^64 / count.
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((u128::from(z) * count as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(groups: &[Vec<[f64; 1]>]) -> Option<[f64; 2]> {
        interval_95(groups, |[mean]| mean)
    }

    fn uniform(count: usize) -> Vec<[f64; 1]> {
        (0..count)
            .map(|k| [(k as f64 + 0.5) / count as f64])
            .collect()
    }

    #[test]
    fn one_group_gives_the_normal_interval() {
        let [low, high] = mean(&[uniform(400)]).unwrap();
        let half = 1.96 * (1.0f64 / 12.0 / 400.0).sqrt();
        assert!((low - (0.5 - half)).abs() < 0.15 * half, "{low}");
        assert!((high - (0.5 + half)).abs() < 0.15 * half, "{high}");
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
    fn too_little_says_nothing() {
        assert_eq!(mean(&[]), None);
        assert_eq!(mean(&[vec![[3.0]]]), None);
        assert_eq!(mean(&[vec![], vec![[3.0]]]), None);
        assert_eq!(mean(&[vec![[3.0], [5.0]]]), Some([3.0, 5.0]));
        assert_eq!(mean(&[vec![[3.0]], vec![[5.0]]]), Some([3.0, 5.0]));
        // A ratio whose denominator may be drawn as 0.
        let groups = [vec![[1.0, 0.0], [1.0, 1.0]]];
        assert_eq!(interval_95(&groups, |[a, b]| a / b), None);
    }

    #[test]
    fn values_are_means_over_groups_of_means_over_items() {
        let groups = [vec![[1.0, 2.0], [3.0, 2.0]], vec![[6.0, 6.0]]];
        assert_eq!(value_of(&groups, |[a, b]| a / b), 1.0);
        assert_eq!(value_of(&groups, |[a, _]| a), 4.0);
    }
}
