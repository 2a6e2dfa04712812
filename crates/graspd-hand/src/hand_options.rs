//! How finely a hand is covered.

use graspd_settings::{Ranges, Validate, between, ranges};

/// How finely a hand is covered with contact points and spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct HandOptions {
    /// About how many contact points to spread over the outer surface; 3000 in the paper.
    pub contact_points: usize,
    /// At most this many spheres stand for the hand where it might intersect itself; 0 switches that off.
    pub collision_spheres: usize,
    /// At most this many pairs of spheres are looked at.
    pub collision_pairs: usize,
    /// Seed of whatever is sampled.
    pub seed: u64,
}

impl Default for HandOptions {
    fn default() -> Self {
        Self {
            contact_points: 3000,
            collision_spheres: 160,
            collision_pairs: 4000,
            seed: 0,
        }
    }
}

impl Validate for HandOptions {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            contact_points: between(8.0, 200_000.0),
            collision_spheres: between(0.0, 1000.0),
        }
    }
}
