//! The losses of a hand by itself: joint ranges, joint limits and self-intersection.
//!
//! Each is written once over any scalar, and beside it stands the gradient that the optimiser uses.

use graspd_ad::{Element, Real};
use graspd_geom::Vec3;
use graspd_hand::{CollisionSpheres, Limit, PointBuffer};

/// L_range = sum_i (theta_i - middle_i)^2 over the joints with finite limits \[rad^2 or m^2\].
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

/// L_limit = sum_i max(theta_i - upper_i, lower_i - theta_i, 0)^2 \[rad^2 or m^2\]; smooth at the limits.
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

/// The overlap of two spheres, max(r_a + r_b - |a - b|, 0) \[m\]; derivative 0 for concentric ones.
#[inline(always)]
pub fn sphere_overlap<T: Real>(a: Vec3<T>, b: Vec3<T>, radius_sum: f64) -> T {
    let distance = (a - b).norm();
    (T::constant(radius_sum) - distance).max(T::zero())
}

/// L_inter = sum over the pairs of overlap^2 \[m^2\]; writes `weight` times its gradient with respect to the
/// spheres' centres to `gradient`, `[s]`, object frame.
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
