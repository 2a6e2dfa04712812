//! Balls that fill the hand: whatever is in one of them has gone into the hand, on whichever side
//! of a wall its skin is.

use graspd_geom::{Quaternion, SignedDistance, TriangleMesh, Vec3};
use graspd_hand::{Hand, HandPose, Limit, PointForces};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::FitError;
use crate::skin::SkinSamples;

/// No ball is larger \[m\]: half the thickness of a finger is enough to notice a wall, and larger balls cost range.
const MAX_RADIUS: f64 = 0.012;
/// Balls smaller than this say no more than the skin \[m\].
const MIN_RADIUS: f64 = 0.002;
/// A ball may stand out of the hand by this \[m\]: the skin is made of flat faces.
const TOLERANCE: f64 = 2e-4;
/// Halvings of the interval in which a radius lies.
const HALVINGS: usize = 12;

/// A hand as solids: open, and bent, if its joints have limits.
pub(crate) struct HandSolids {
    pub(crate) open: TriangleMesh,
    pub(crate) open_distance: SignedDistance,
    /// Skin moves inwards where joints bend: a ball has to fit then, too.
    bent: Option<(TriangleMesh, SignedDistance)>,
}

impl HandSolids {
    /// # Errors
    /// If the hand's surface is not closed.
    pub(crate) fn new(hand: &dyn Hand) -> Result<Self, FitError> {
        let open = hand.surface_at_rest();
        let middle = |limits: &[Limit]| {
            let surface = hand.surface(&HandPose {
                translation: Vec3::zero(),
                rotation: Quaternion::identity(),
                articulation: limits.iter().map(Limit::middle).collect(),
            });
            let distance = SignedDistance::new(&surface)?;
            Ok::<_, FitError>((surface, distance))
        };
        Ok(Self {
            open_distance: SignedDistance::new(&open)?,
            open,
            bent: hand.limits().map(middle).transpose()?,
        })
    }

    fn all(&self) -> impl Iterator<Item = (&TriangleMesh, &SignedDistance)> {
        let bent = self
            .bent
            .iter()
            .map(|(surface, distance)| (surface, distance));
        std::iter::once((&self.open, &self.open_distance)).chain(bent)
    }
}

/// Balls inside the open hand, each touching its skin from within at a sample of it, which they follow as the hand
/// moves.
///
/// An object that is nowhere deeper than D in the hand is nowhere nearer than r - D to the centre
/// of a ball of radius r. In contrast to the depth of the skin in the object, which is never more
/// than half the thickness of a wall, the lack of this distance tells how far a thin wall has cut
/// into a finger.
#[derive(Clone, Debug)]
pub(crate) struct MedialSpheres {
    skin: SkinSamples,
    radius: Vec<f64>,
}

impl MedialSpheres {
    /// The largest balls that touch the hand's skin at about `count` points.
    pub(crate) fn new(solids: &HandSolids, count: usize) -> Self {
        let mut skin = SkinSamples::on(&solids.open, &solids.open_distance, count);
        let fitting = (0..skin.len()).into_par_iter().map(|i| {
            let solids = solids.all();
            solids.fold(MAX_RADIUS, |radius, (surface, solid)| {
                let vertices = &surface.vertices;
                let (point, outward) = (skin.position(vertices, i), skin.outward(vertices, i));
                largest_radius(solid, &point, &outward, radius)
            })
        });
        let radii: Vec<f64> = fitting.collect();
        let wide: Vec<usize> = (0..skin.len())
            .filter(|i| radii[*i] >= MIN_RADIUS)
            .collect();
        skin = skin.only(&wide);
        let radius = radii.into_iter().filter(|&r| r >= MIN_RADIUS).collect();
        Self { skin, radius }
    }

    /// How many balls there are.
    pub(crate) fn len(&self) -> usize {
        self.radius.len()
    }

    /// The radius of a ball \[m\].
    pub(crate) fn radius(&self, ball: usize) -> f64 {
        self.radius[ball]
    }

    /// The centre of a ball, of the surface's vertices as posed.
    #[inline]
    pub(crate) fn center(&self, vertices: &[Point3<f64>], ball: usize) -> Vector3<f64> {
        let outward = self.skin.outward(vertices, ball);
        self.skin.position(vertices, ball) - outward * self.radius[ball]
    }

    /// The movement of a ball's centre along a direction.
    pub(crate) fn pull(
        &self,
        vertices: &[Point3<f64>],
        ball: usize,
        direction: &Vector3<f64>,
    ) -> PointForces {
        (self.skin).pull_above(vertices, ball, -self.radius[ball], direction)
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
    use graspd_hand::builtin_hand;

    #[test]
    fn balls_fill_the_open_hand_and_stay_inside() {
        for name in ["allegro", "human"] {
            let hand = builtin_hand(name).expect("it is built in");
            let solids = HandSolids::new(&*hand).unwrap();
            let spheres = MedialSpheres::new(&solids, 400);
            let (surface, solid) = (&solids.open, &solids.open_distance);
            assert!(spheres.len() > 100, "{name}: {}", spheres.len());
            let mut largest: f64 = 0.0;
            for ball in 0..spheres.len() {
                let radius = spheres.radius(ball);
                let center = spheres.center(&surface.vertices, ball);
                let depth = -solid.signed_distance(&center.into());
                assert!(
                    depth >= radius - TOLERANCE - 1e-9,
                    "{name}: {depth} {radius}"
                );
                assert!((MIN_RADIUS..=MAX_RADIUS).contains(&radius));
                largest = largest.max(radius);
            }
            // Palms are thicker than the largest balls, fingers about 16 mm.
            assert!(largest > 0.01, "{name}: {largest}");
        }
    }
}
