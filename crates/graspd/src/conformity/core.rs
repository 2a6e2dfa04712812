//! Balls that fill the hand: whatever is in one of them has gone into the hand, on whichever side of a wall its skin is.

use graspd_geom::{Quaternion, SignedDistance, TriangleMesh, Vec3};
use graspd_hand::{Hand, HandPose, Limit};
use nalgebra::Vector3;

use super::skin::SkinSamples;
use crate::GraspError;

/// No ball is larger \[m\]: half the thickness of a finger is enough to notice a wall, and larger balls cost range.
const MOST_RADIUS: f64 = 0.012;
/// Balls smaller than this say no more than the skin \[m\].
const LEAST_RADIUS: f64 = 0.002;
/// A ball may stand out of the hand by this \[m\]: the skin is made of flat faces.
const TOLERANCE: f64 = 2e-4;
/// Halvings of the interval in which a radius lies.
const HALVINGS: usize = 12;

/// Balls inside the open hand, each touching its skin from within at a sample of it, which they follow as the hand
/// moves.
///
/// An object that is nowhere deeper than D in the hand is nowhere nearer than r - D to the centre of a ball of radius r. In
/// contrast to the depth of the skin in the object, which is never more than half the thickness of a wall, the lack of
/// this distance tells how far a thin wall has cut into a finger.
#[derive(Clone, Debug)]
pub(super) struct HandCore {
    skin: SkinSamples,
    radius: Vec<f64>,
}

impl HandCore {
    /// The largest balls that touch the open hand's skin at about `count` points.
    ///
    /// # Errors
    /// If the hand's surface is not closed.
    pub(super) fn new(hand: &dyn Hand, count: usize) -> Result<Self, GraspError> {
        let mut skin = SkinSamples::new(hand, count)?;
        let open = hand.open_articulation().to_vec();
        let bent = (hand.limits()).map(|limits| limits.iter().map(Limit::middle).collect());
        let mut radii = vec![MOST_RADIUS; skin.len()];
        // Skin moves inwards where joints bend: a ball has to fit then, too.
        for articulation in [Some(open), bent].into_iter().flatten() {
            let surface = hand.surface(&HandPose {
                translation: Vec3::zero(),
                rotation: Quaternion::identity(),
                articulation,
            });
            let solid = SignedDistance::new(&surface)?;
            for (i, radius) in radii.iter_mut().enumerate() {
                let (point, outward) = skin.point_and_normal(&surface, i);
                *radius = largest_radius(&solid, &point, &outward, *radius);
            }
        }
        skin.keep(|i| radii[i] >= LEAST_RADIUS);
        let radius = radii.into_iter().filter(|&r| r >= LEAST_RADIUS).collect();
        Ok(Self { skin, radius })
    }

    /// How many balls there are.
    pub(super) fn len(&self) -> usize {
        self.radius.len()
    }

    /// The radius of a ball \[m\].
    pub(super) fn radius(&self, ball: usize) -> f64 {
        self.radius[ball]
    }

    /// The centre of a ball of the posed hand.
    pub(super) fn center(&self, surface: &TriangleMesh, ball: usize) -> Vector3<f64> {
        let (point, outward) = self.skin.point_and_normal(surface, ball);
        point - outward * self.radius[ball]
    }
}

/// The radius of the largest ball, up to `most`, that touches a solid's surface at a point from within.
fn largest_radius(
    solid: &SignedDistance,
    point: &Vector3<f64>,
    outward: &Vector3<f64>,
    most: f64,
) -> f64 {
    let fits = |radius: f64| {
        let center = point - outward * radius;
        solid.signed_distance(&center.into()) <= TOLERANCE - radius
    };
    if fits(most) {
        return most;
    }
    // A ball that fits contains all smaller ones that touch at the same point.
    let (mut low, mut high) = (0.0, most);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::surface_at_rest;
    use graspd_hand::builtin_hand;

    #[test]
    fn balls_fill_the_open_hand_and_stay_inside() {
        for name in ["allegro", "human"] {
            let hand = builtin_hand(name).expect("it is built in");
            let core = HandCore::new(&*hand, 400).unwrap();
            let surface = surface_at_rest(&*hand);
            let solid = SignedDistance::new(&surface).unwrap();
            assert!(core.len() > 100, "{name}: {}", core.len());
            let mut largest: f64 = 0.0;
            for ball in 0..core.len() {
                let radius = core.radius(ball);
                let center = core.center(&surface, ball);
                let depth = -solid.signed_distance(&center.into());
                assert!(
                    depth >= radius - TOLERANCE - 1e-9,
                    "{name}: {depth} {radius}"
                );
                assert!((LEAST_RADIUS..=MOST_RADIUS).contains(&radius));
                largest = largest.max(radius);
            }
            // Palms are thicker than the largest balls, fingers about 16 mm.
            assert!(largest > 0.01, "{name}: {largest}");
        }
    }
}
