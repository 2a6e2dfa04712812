//! The volume of a hull: exact while its facets can be counted, estimated beyond.

use graspd_settings::{ANY, NOT_NEGATIVE, Ranges, Validate, between, ranges};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::CompensatedSum;
use super::certificate::{DEPTH_SLACK, VOLUME_SLACK, is_convex};
use super::frame::{Frame, Start};
use super::hyperplane::difference;
use super::leaves::Leaves;
use super::polytope::Polytope;
use super::quickhull::{Order, quickhull};
use crate::error::EvaluationError;

/// Quantile of the normal distribution for intervals that hold the value 19 times out of 20.
const NORMAL_95: f64 = 1.959_963_984_540_054;
/// Directions before the sample's own variance is trusted, and between two looks at it.
const BATCH: usize = 128;
/// A support point this little beyond a facet, in units of the facet's distance, is not beyond it.
const BEYOND: f64 = 1e-11;
/// Multiples of the usual tolerance at which an inner polytope is tried in rounded arithmetic: points of a plane that
/// are off it by their rounding make slivers, unless they count as on it.
const COARSENINGS: [f64; 4] = [1.0, 1e3, 1e5, 1e7];
/// Points left out within this of the extent leave a volume exact for all purposes.
const EXACT: f64 = 1e-8;
/// Facets of an inner polytope in exact arithmetic, which is slow.
const MAX_EXACT_FACETS: usize = 2000;
/// Exchanges of a vertex along one ray; tens are usual.
const MAX_EXCHANGES: usize = 2000;

/// How much effort a volume is worth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct VolumeSettings {
    /// A hull of up to this many facets is constructed, and its volume is exact; one with 8000
    /// facets and more than 500 points still outside is taken for one of more.
    #[serde(alias = "most_facets")]
    pub max_facets: usize,
    /// Beyond, directions are sampled until the half width of the 95 % interval, relative to the volume, is below
    /// this ...
    pub relative_half_width: f64,
    /// ... or until there are this many.
    #[serde(alias = "most_directions")]
    pub max_directions: usize,
    /// Seed of the directions.
    pub seed: u64,
}

impl Default for VolumeSettings {
    fn default() -> Self {
        Self {
            max_facets: 50_000,
            relative_half_width: 0.02,
            max_directions: 2048,
            seed: 0,
        }
    }
}

impl Validate for VolumeSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            max_facets: NOT_NEGATIVE,
            relative_half_width: between(1e-4, 1.0),
            max_directions: NOT_NEGATIVE,
            seed: ANY,
        }
    }
}

/// How a volume was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeMethod {
    /// From all facets; 0 for points without interior.
    Exact,
    /// From the distance of the boundary along random directions.
    Sampled {
        /// How many.
        directions: usize,
    },
}

/// The volume of a hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HullVolume {
    /// D-dimensional measure, or an unbiased estimate of it.
    pub value: f64,
    /// Lower end of its 95 % confidence interval; the value itself where that is exact.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
    /// How it was found.
    pub method: VolumeMethod,
}

impl HullVolume {
    fn exact(value: f64) -> Self {
        Self {
            value,
            lower: value,
            upper: value,
            method: VolumeMethod::Exact,
        }
    }
}

/// The volume of the hull of `points`.
///
/// A hull of more than `max_facets` facets is abandoned at that size, or as soon as it shows that
/// it will have more; what has been built by then is a polytope P within it that fills most of it.
/// With points x uniform in P and r the distance of a boundary from an interior point c in the
/// direction of x, the whole volume is
///
/// `vol(P) E[(r_hull(x) / r_P(x))^D]`,
///
/// whose terms are all at least 1 and, unless `max_facets` is small, close to it. A ray leaves P
/// through a known facet, and from that facet linear programming finds the one through which it
/// leaves the hull. The same settings give the same estimate.
///
/// # Errors
/// [`EvaluationError::NotFinite`] for a coordinate that is NaN or infinite.
pub fn hull_volume<const D: usize>(
    points: &[[f64; D]],
    settings: &VolumeSettings,
) -> Result<HullVolume, EvaluationError> {
    const { assert!(2 <= D && D <= 6, "hulls are for 2 to 6 dimensions") };
    let Start::Full { mut frame, simplex } = Frame::start(points)? else {
        return Ok(HullVolume::exact(0.0));
    };
    let tolerance = frame.tolerance;
    for coarsening in COARSENINGS {
        frame.tolerance = coarsening * tolerance;
        let slack = (VOLUME_SLACK / coarsening).max(DEPTH_SLACK);
        if let Ok((polytope, is_whole)) =
            quickhull(&frame, &simplex, settings.max_facets, Order::MostVolume)
            && is_convex(&frame, &polytope, slack)
        {
            let is_exact = is_whole && coarsening * tolerance < EXACT;
            return Ok(volume_by(&frame, &polytope, is_exact, settings));
        }
    }
    frame.snap_to_grid();
    let max_facets = settings.max_facets.min(MAX_EXACT_FACETS);
    let (polytope, is_whole) = quickhull(&frame, &simplex, max_facets, Order::MostVolume)
        .map_err(|_| EvaluationError::Unresolved)?;
    Ok(volume_by(&frame, &polytope, is_whole, settings))
}

fn volume_by<const D: usize>(
    frame: &Frame<D>,
    polytope: &Polytope<D>,
    is_whole: bool,
    settings: &VolumeSettings,
) -> HullVolume {
    let inner = InnerPolytope::new(frame, polytope);
    let to_input = frame.scale.powi(D as i32);
    if is_whole {
        HullVolume::exact(inner.volume * to_input)
    } else {
        inner.estimate(frame, settings, to_input)
    }
}

/// The facets of a polytope, as pyramids about an interior point.
struct InnerPolytope<const D: usize> {
    corners: Vec<[u32; D]>,
    /// Volumes of the pyramids up to and including each facet's.
    cumulative: Vec<f64>,
    volume: f64,
}

impl<const D: usize> InnerPolytope<D> {
    fn new(frame: &Frame<D>, polytope: &Polytope<D>) -> Self {
        let (mut corners, mut cumulative) = (Vec::new(), Vec::new());
        let mut volume = CompensatedSum::default();
        for (_, facet) in polytope.facets() {
            volume.add(frame.area(facet) * frame.depth_of_interior(facet) / D as f64);
            corners.push(facet.vertices);
            cumulative.push(volume.value());
        }
        Self {
            corners,
            cumulative,
            volume: volume.value(),
        }
    }

    fn estimate(&self, frame: &Frame<D>, settings: &VolumeSettings, to_input: f64) -> HullVolume {
        let points: Vec<_> = frame
            .points
            .iter()
            .map(|point| difference(point, &frame.interior))
            .collect();
        let mut rays = Rays::new(&points);
        let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
        let (mut count, mut mean, mut squares) = (0usize, 0.0, 0.0);
        let most = settings.max_directions.max(2);
        let relative = loop {
            let facet = self.random_facet(&mut random);
            let weights = random_weights(&mut random);
            let ratio = rays.reach(self.corners[facet], weights).powi(D as i32);
            // Welford's update of mean and sum of squared deviations.
            count += 1;
            let deviation = ratio - mean;
            mean += deviation / count as f64;
            squares += deviation * (ratio - mean);
            if count == most || count.is_multiple_of(BATCH) {
                let variance = squares / (count - 1) as f64;
                let half_width = NORMAL_95 * (variance / count as f64).sqrt();
                if count == most || half_width <= settings.relative_half_width * mean {
                    break half_width;
                }
            }
        };
        let unit = self.volume * to_input;
        HullVolume {
            value: unit * mean,
            lower: unit * (mean - relative).max(1.0),
            upper: unit * (mean + relative),
            method: VolumeMethod::Sampled { directions: count },
        }
    }

    /// A facet, by the volume of its pyramid.
    fn random_facet(&self, random: &mut ChaCha8Rng) -> usize {
        let at = random.random::<f64>() * self.volume;
        let facet = self.cumulative.partition_point(|&sum| sum <= at);
        facet.min(self.cumulative.len() - 1)
    }
}

/// Weights of a uniformly random point of a simplex: exponential variates over their sum.
fn random_weights<const D: usize>(random: &mut ChaCha8Rng) -> [f64; D] {
    let variates: [f64; D] = std::array::from_fn(|_| -(1.0 - random.random::<f64>()).ln());
    let sum: f64 = variates.iter().sum();
    variates.map(|x| x / sum)
}

/// Finds where rays from the interior point leave the hull.
struct Rays<'a, const D: usize> {
    points: &'a [[f64; D]],
    leaves: Leaves<D>,
}

impl<'a, const D: usize> Rays<'a, D> {
    /// `points` relative to the interior point.
    fn new(points: &'a [[f64; D]]) -> Self {
        let leaves = Leaves::new(points);
        Self { points, leaves }
    }

    /// How far the hull reaches in the direction `d = sum_i weights_i corners_i`, in units of |d|.
    ///
    /// The simplex method: of the facet through which the ray leaves, the corner that the ray no longer needs gives
    /// way to the point farthest beyond, and the ray gets longer by every exchange, until no point is beyond. Where
    /// rounding ends it early, the result is a lower bound.
    fn reach(&mut self, corners: [u32; D], mut weights: [f64; D]) -> f64 {
        let mut corners = corners.map(|corner| self.points[corner as usize]);
        for _ in 0..MAX_EXCHANGES {
            // The hyperplane normal . x = 1 through the corners.
            let Some(normal) = solve(corners, [1.0; D]) else {
                break;
            };
            let Some(entering) = self.leaves.farthest_beyond(&normal, 1.0 + BEYOND) else {
                break;
            };
            let entering = self.points[entering as usize];
            let transposed = std::array::from_fn(|k| std::array::from_fn(|i| corners[i][k]));
            let Some(shares) = solve::<D>(transposed, entering) else {
                break;
            };
            let mut leaving = (D, f64::INFINITY);
            for i in 0..D {
                let amount = weights[i] / shares[i];
                if shares[i] > 0.0 && amount < leaving.1 {
                    leaving = (i, amount);
                }
            }
            let (slot, amount) = leaving;
            if slot == D {
                break;
            }
            for i in 0..D {
                weights[i] = (weights[i] - amount * shares[i]).max(0.0);
            }
            weights[slot] = amount;
            corners[slot] = entering;
        }
        // d is on the facet when scaled so that its weights sum to 1.
        weights.iter().sum::<f64>().recip().max(1.0)
    }
}

/// Solves `matrix x = right` by elimination with row pivoting; `None` for a singular matrix.
fn solve<const D: usize>(mut matrix: [[f64; D]; D], mut right: [f64; D]) -> Option<[f64; D]> {
    for column in 0..D {
        let mut pivot = column;
        for row in column + 1..D {
            if matrix[row][column].abs() > matrix[pivot][column].abs() {
                pivot = row;
            }
        }
        if matrix[pivot][column].abs() < f64::MIN_POSITIVE {
            return None;
        }
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..D {
            let factor = matrix[row][column] / matrix[column][column];
            for k in column..D {
                matrix[row][k] -= factor * matrix[column][k];
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..D).rev() {
        for k in row + 1..D {
            right[row] -= matrix[row][k] * right[k];
        }
        right[row] /= matrix[row][row];
    }
    right.iter().all(|x| x.is_finite()).then_some(right)
}

#[cfg(test)]
mod tests {
    use super::super::hyperplane::dot;
    use super::super::simplex::tests::noise_source;
    use super::*;
    use crate::convex_hull;

    fn cloud<const D: usize>(count: usize, shift: f64) -> Vec<[f64; D]> {
        let mut noise = noise_source();
        let mut point = || -> [f64; D] { std::array::from_fn(|_| noise()) };
        let mut points = Vec::new();
        while points.len() < count {
            let raw = point();
            let length = dot(&raw, &raw).sqrt();
            if (0.1..1.0).contains(&length) {
                points.push(raw.map(|x| x / length + shift));
            }
        }
        points
    }

    fn sampled(max_facets: usize, relative_half_width: f64, seed: u64) -> VolumeSettings {
        VolumeSettings {
            max_facets,
            relative_half_width,
            max_directions: 100_000,
            seed,
        }
    }

    /// Of 20 intervals 19 hold the value on average; 15 or fewer would be a chance of 1 in 400.
    #[test]
    fn intervals_hold_the_exact_volume() {
        // The origin is outside: the sampling does without it.
        let points: Vec<[f64; 4]> = cloud(120, 2.0);
        let exact = convex_hull(&points).unwrap().volume;
        let mut held = 0;
        for seed in 0..20 {
            let volume = hull_volume(&points, &sampled(150, 0.02, seed)).unwrap();
            assert!(matches!(volume.method, VolumeMethod::Sampled { .. }));
            assert!(volume.upper - volume.lower <= 0.0401 * volume.value);
            held += usize::from((volume.lower..=volume.upper).contains(&exact));
        }
        assert!(held > 15, "{held} of 20 hold {exact}");
    }

    #[test]
    fn estimates_converge_and_repeat() {
        let points: Vec<[f64; 6]> = cloud(60, 0.0);
        let exact = convex_hull(&points).unwrap().volume;
        for width in [0.03, 0.006] {
            let settings = sampled(2000, width, 1);
            let volume = hull_volume(&points, &settings).unwrap();
            // Twice the interval's half width is four standard deviations.
            assert!(
                (volume.value / exact - 1.0).abs() < 2.0 * width,
                "{volume:?} {exact}"
            );
            assert_eq!(volume, hull_volume(&points, &settings).unwrap());
        }
        let whole = hull_volume(&points, &VolumeSettings::default()).unwrap();
        assert_eq!(whole.method, VolumeMethod::Exact);
        assert!((whole.value / exact - 1.0).abs() < 1e-12);
        assert_eq!((whole.lower, whole.upper), (whole.value, whole.value));
    }

    /// A hull with too many points outside is not waited for, though in the end it would have had few enough facets.
    #[test]
    fn hulls_given_up_early_are_estimated() {
        let points: Vec<[f64; 4]> = cloud(3000, 0.5);
        let hull = convex_hull(&points).unwrap();
        let settings = VolumeSettings::default();
        assert!(hull.facets.len() < settings.max_facets);
        let volume = hull_volume(&points, &settings).unwrap();
        assert!(matches!(volume.method, VolumeMethod::Sampled { .. }));
        let error = (volume.value / hull.volume - 1.0).abs();
        assert!(error < 2.0 * settings.relative_half_width, "{volume:?}");
    }

    /// Of polytopes with as many facets, the one that takes in the pyramids of most volume first holds most.
    #[test]
    fn pyramids_of_most_volume_come_first() {
        let points: Vec<[f64; 6]> = cloud(400, 0.0)
            .iter()
            .map(|p: &[f64; 6]| std::array::from_fn(|k| p[k] / (1.0 + k as f64)))
            .collect();
        let Ok(Start::Full { frame, simplex }) = Frame::start(&points) else {
            panic!("a cloud has an interior");
        };
        let volume = |order| {
            let (polytope, is_whole) = quickhull(&frame, &simplex, 2000, order).unwrap();
            assert!(!is_whole);
            InnerPolytope::new(&frame, &polytope).volume
        };
        let (found, most) = (volume(Order::Found), volume(Order::MostVolume));
        assert!(most > 1.05 * found, "{most} {found}");
    }

    #[test]
    fn flat_and_empty_sets_have_none() {
        let flat: Vec<[f64; 3]> = cloud::<3>(30, 0.0)
            .iter()
            .map(|p| [p[0], p[1], 1.0])
            .collect();
        for points in [flat, vec![], vec![[1.0, 2.0, 3.0]; 5]] {
            let volume = hull_volume(&points, &VolumeSettings::default()).unwrap();
            assert_eq!((volume.value, volume.method), (0.0, VolumeMethod::Exact));
        }
        let bad = hull_volume(&[[f64::NAN; 3]], &VolumeSettings::default());
        assert_eq!(bad, Err(EvaluationError::NotFinite { index: 0 }));
    }
}
