//! The losses of a hand by itself: joint ranges, joint limits and self-intersection.
//!
//! Each is written once over any scalar, and beside it stands the gradient that the optimiser uses. Articulations,
//! limits and gradients are slices of one length, `[n]`; entries beyond the shortest of them do not count.

use graspd_ad::{Element, Real};
use graspd_geom::Vec3;
use graspd_hand::{CollisionSpheres, Limit, PointBuffer};

/// L_range = sum_i (theta_i - middle_i)^2 over the joints with two finite limits \[rad^2 or m^2\]; smooth.
///
/// A joint without a lower or an upper limit has no middle and adds nothing.
pub fn range_loss<T: Real>(articulation: &[T], limits: &[Limit]) -> T {
    articulation
        .iter()
        .zip(limits)
        .fold(T::zero(), |sum, (&value, limit)| match middle(limit) {
            Some(middle) => sum + (value - T::constant(middle)).square(),
            None => sum,
        })
}

/// [`range_loss`]; adds `weight` times its gradient to `gradient`, `[n]`.
pub fn range_loss_gradient(
    articulation: &[f64],
    limits: &[Limit],
    weight: f64,
    gradient: &mut [f64],
) -> f64 {
    for ((value, limit), slot) in articulation.iter().zip(limits).zip(gradient) {
        if let Some(middle) = middle(limit) {
            *slot += weight * 2.0 * (value - middle);
        }
    }
    range_loss(articulation, limits)
}

fn middle(limit: &Limit) -> Option<f64> {
    let middle = 0.5 * (limit.lower + limit.upper);
    middle.is_finite().then_some(middle)
}

/// L_limit = sum_i max(theta_i - upper_i, lower_i - theta_i, 0)^2 \[rad^2 or m^2\].
///
/// The derivative is continuous, and 0 exactly at the limits. An infinite limit cannot be violated.
pub fn limit_loss<T: Real>(articulation: &[T], limits: &[Limit]) -> T {
    articulation
        .iter()
        .zip(limits)
        .fold(T::zero(), |sum, (&value, limit)| {
            sum + limit_violation(value, limit).square()
        })
}

/// [`limit_loss`]; adds `weight` times its gradient to `gradient`, `[n]`.
pub fn limit_loss_gradient(
    articulation: &[f64],
    limits: &[Limit],
    weight: f64,
    gradient: &mut [f64],
) -> f64 {
    for ((&value, limit), slot) in articulation.iter().zip(limits).zip(gradient) {
        *slot += weight * 2.0 * limit_violation(value, limit);
    }
    limit_loss(articulation, limits)
}

/// How far a joint is beyond its range, with sign; 0 inside.
fn limit_violation<T: Real>(value: T, limit: &Limit) -> T {
    let mut violation = T::zero();
    if limit.upper.is_finite() {
        violation += (value - T::constant(limit.upper)).max(T::zero());
    }
    if limit.lower.is_finite() {
        violation += (value - T::constant(limit.lower)).min(T::zero());
    }
    violation
}

/// The overlap of two spheres, max(r_a + r_b - |a - b|, 0) \[m\], for centres `a` and `b` and `radius_sum` = r_a +
/// r_b.
///
/// For spheres that just touch, the derivative is that of overlapping ones; for concentric ones it is 0.
#[inline(always)]
pub fn sphere_overlap<T: Real>(a: Vec3<T>, b: Vec3<T>, radius_sum: f64) -> T {
    let distance = (a - b).norm();
    (T::constant(radius_sum) - distance).max(T::zero())
}

/// L_inter = sum over the pairs of overlap^2 \[m^2\], with the overlap of [`sphere_overlap`]; writes `weight` times
/// its gradient with respect to the spheres' centres to `gradient`, `[s]`, object frame.
///
/// The gradient is continuous but for concentric spheres, which get 0: no direction parts them.
///
/// # Panics
/// If a pair names a sphere that `centers` or `gradient` does not have.
pub fn intersection_loss_gradient<E: Element>(
    centers: &PointBuffer<E>,
    spheres: &CollisionSpheres,
    weight: f64,
    gradient: &mut PointBuffer<E>,
) -> f64 {
    for axis in [&mut gradient.x, &mut gradient.y, &mut gradient.z] {
        axis.fill(E::zero());
    }
    let mut total = 0.0;
    for &[first, second] in &spheres.pairs {
        let (a, b) = (first as usize, second as usize);
        let radius_sum = spheres.radius[a] + spheres.radius[b];
        let offset = centers.get(a) - centers.get(b);
        let distance_squared = offset.norm_squared();
        if distance_squared >= radius_sum * radius_sum {
            continue;
        }
        let distance = distance_squared.sqrt();
        let overlap = radius_sum - distance;
        total += overlap * overlap;
        if distance > 0.0 {
            let pull = offset * (-2.0 * weight * overlap / distance);
            gradient.set(a, gradient.get(a) + pull);
            gradient.set(b, gradient.get(b) - pull);
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_ad::gradient;
    use proptest::prelude::*;

    /// Reverse mode and the closed forms round the same few operations differently.
    const MODE_TOLERANCE: f64 = 1e-12;
    /// Half width of central differences \[rad or m\].
    const STEP: f64 = 1e-6;
    /// Half a step at a kink of the second derivative, and 1e-16 * 100 / STEP of cancellation.
    const DIFFERENCE_TOLERANCE: f64 = 2e-6;
    const WEIGHT: f64 = -2.5;

    /// A joint: its limits, some of them infinite, and a value inside, outside or exactly at one of them.
    fn joint() -> impl Strategy<Value = (Limit, f64)> {
        let bounds = (-2.0..0.5f64, 0.0..2.0f64, 0..4u8);
        (bounds, 0..4u8, -4.0..4.0f64).prop_map(|((lower, range, infinite), place, value)| {
            let limit = Limit {
                lower: [lower, f64::NEG_INFINITY][usize::from(infinite & 1)],
                upper: [lower + range, f64::INFINITY][usize::from(infinite >> 1)],
            };
            let value = match place {
                0 if limit.lower.is_finite() => limit.lower,
                1 if limit.upper.is_finite() => limit.upper,
                _ => value,
            };
            (limit, value)
        })
    }

    /// Central difference of `function` by variable `index`.
    fn difference(function: impl Fn(&[f64]) -> f64, x: &[f64], index: usize) -> f64 {
        let at = |by: f64| {
            let mut x = x.to_vec();
            x[index] += by;
            function(&x)
        };
        (at(STEP) - at(-STEP)) / (2.0 * STEP)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn joint_gradients_are_those_of_reverse_mode_and_of_differences(
            joints in prop::collection::vec(joint(), 1..6),
        ) {
            let (limits, values): (Vec<_>, Vec<_>) = joints.into_iter().unzip();
            let (mut range, mut limit) = (vec![7.0; values.len()], vec![-7.0; values.len()]);
            let range_value = range_loss_gradient(&values, &limits, WEIGHT, &mut range);
            let limit_value = limit_loss_gradient(&values, &limits, WEIGHT, &mut limit);
            let (range_by_tape, range_tape) = gradient(|x| range_loss(x, &limits), &values);
            let (limit_by_tape, limit_tape) = gradient(|x| limit_loss(x, &limits), &values);
            prop_assert_eq!((range_value, limit_value), (range_by_tape, limit_by_tape));
            for i in 0..values.len() {
                let (range, limit) = ((range[i] - 7.0) / WEIGHT, (limit[i] + 7.0) / WEIGHT);
                prop_assert!((range - range_tape[i]).abs() <= MODE_TOLERANCE);
                prop_assert!((limit - limit_tape[i]).abs() <= MODE_TOLERANCE);
                let range_difference = difference(|x| range_loss(x, &limits), &values, i);
                let limit_difference = difference(|x| limit_loss(x, &limits), &values, i);
                prop_assert!((range - range_difference).abs() <= DIFFERENCE_TOLERANCE);
                prop_assert!((limit - limit_difference).abs() <= DIFFERENCE_TOLERANCE);
                if limits[i].contains(values[i]) {
                    prop_assert_eq!(limit_tape[i], 0.0);
                }
            }
        }

        #[test]
        fn intersection_gradient_is_that_of_reverse_mode_and_of_differences(
            spheres in prop::collection::vec((prop::array::uniform3(-1.0..1.0f64), 0.0..0.8f64), 2..6),
        ) {
            let (positions, radius): (Vec<_>, Vec<_>) = spheres.into_iter().unzip();
            let count = radius.len() as u32;
            let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
            let spheres = CollisionSpheres { radius, pairs: pairs.collect(), ..Default::default() };
            let flat: Vec<f64> = positions.concat();
            let (value, claimed) = intersection::<f64>(&flat, &spheres);
            let (by_tape, tape) = gradient(|x| overlaps_squared(x, &spheres), &flat);
            prop_assert!((value - by_tape).abs() <= MODE_TOLERANCE);
            let (single, claimed_single) = intersection::<f32>(&flat, &spheres);
            // Centres near 1 are known to 6e-8, and up to five gradients of size 4 add up.
            prop_assert!((single - value).abs() <= 1e-5);
            for i in 0..flat.len() {
                prop_assert!((claimed[i] - tape[i]).abs() <= MODE_TOLERANCE);
                prop_assert!((claimed_single[i] - tape[i]).abs() <= 1e-5);
                let numeric = difference(|x| overlaps_squared(x, &spheres), &flat, i);
                prop_assert!((claimed[i] - numeric).abs() <= 2.0 * DIFFERENCE_TOLERANCE);
            }
        }
    }

    /// L_inter from [`sphere_overlap`]; `x`: the centres, `[s][3]`.
    fn overlaps_squared<T: Real>(x: &[T], spheres: &CollisionSpheres) -> T {
        let center = |i: u32| {
            let i = 3 * i as usize;
            Vec3::new(x[i], x[i + 1], x[i + 2])
        };
        spheres.pairs.iter().fold(T::zero(), |sum, &[a, b]| {
            let radius_sum = spheres.radius[a as usize] + spheres.radius[b as usize];
            sum + sphere_overlap(center(a), center(b), radius_sum).square()
        })
    }

    /// [`intersection_loss_gradient`] with weight 1 for centres `[s][3]`.
    fn intersection<E: Element>(x: &[f64], spheres: &CollisionSpheres) -> (f64, Vec<f64>) {
        let mut centers = PointBuffer::<E>::zeros(x.len() / 3);
        // What was there before must not count.
        let mut gradient = PointBuffer::zeros(x.len() / 3);
        for (i, p) in x.chunks_exact(3).enumerate() {
            centers.set(i, Vec3::new(p[0], p[1], p[2]));
            gradient.set(i, Vec3::new(f64::NAN, 1.0, -1.0));
        }
        let value = intersection_loss_gradient(&centers, spheres, 1.0, &mut gradient);
        let gradient = (0..gradient.len()).map(|i| gradient.get(i));
        (value, gradient.flat_map(|g| [g.x, g.y, g.z]).collect())
    }

    #[test]
    fn values_by_hand() {
        let limits = [
            Limit {
                lower: -1.0,
                upper: 3.0,
            },
            Limit {
                lower: 0.5,
                upper: f64::INFINITY,
            },
            Limit::UNLIMITED,
        ];
        assert_eq!(range_loss(&[4.0, 9.0, -9.0], &limits), 9.0);
        assert_eq!(limit_loss(&[4.0, 9.0, -9.0], &limits), 1.0);
        assert_eq!(limit_loss(&[-3.0, 0.0, 9.0], &limits), 4.25);
        assert_eq!(limit_loss(&[-1.0, 0.5, 0.0], &limits), 0.0);
        assert_eq!(limit_loss(&[3.0, 0.5, 0.0], &limits), 0.0);
    }

    #[test]
    fn concentric_and_touching_spheres_have_no_gradient() {
        let spheres = CollisionSpheres {
            radius: vec![0.5, 0.25, 0.25],
            body: vec![0, 1, 2],
            pairs: vec![[0, 1], [0, 2]],
        };
        // The first two are concentric, the third touches the first from outside.
        let centers = [1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 1.75, 2.0, 3.0];
        let (value, claimed) = intersection::<f64>(&centers, &spheres);
        assert_eq!((value, claimed), (0.75 * 0.75, vec![0.0; 9]));
        let (value, tape) = gradient(|x| overlaps_squared(x, &spheres), &centers);
        assert_eq!((value, tape), (0.75 * 0.75, vec![0.0; 9]));
        // Too close for the square of their distance: still no NaN.
        let (_, near) =
            intersection::<f64>(&[0.0, 0.0, 0.0, 1e-200, 0.0, 0.0, 9.0, 9.0, 9.0], &spheres);
        assert!(near.iter().all(|v| v.is_finite()));
    }
}
