//! What a structured-light camera makes of exact depths.

use std::f64::consts::{FRAC_PI_2, PI};

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Step of 1/z between neighbouring disparities \[1/m\]: 2.85 mm of depth at 1 m.
const DISPARITY_STEP: f64 = 1.0 / 351.3;
/// Standard deviation of depth that no distance goes below \[m\], how it grows \[1/m\], and from which distance on
/// \[m\].
const AXIAL: [f64; 3] = [0.0012, 0.0019, 0.4];
/// What it gains at grazing angles, and from which angle on \[rad\].
const AXIAL_GRAZING: f64 = 0.0001;
const GRAZING: f64 = PI / 3.0;
/// Standard deviation of where a pixel looks, facing a surface, and what it gains at an angle \[pixels\].
const LATERAL: [f64; 2] = [0.8, 0.035];
/// Angle between line of sight and surface normal at which measurements begin to fail, and at which all do \[rad\].
const FAILING_ANGLES: [f64; 2] = [70.0 / 180.0 * PI, 85.0 / 180.0 * PI];
/// Part of the pixels beside a jump in depth that have none.
const SILHOUETTE_LOSS: f64 = 0.5;
/// What is a jump \[m\].
pub(super) const SILHOUETTE_JUMP: f64 = 0.02;

/// The noise of a depth camera of the first generation (Kinect, Carmine), times a scale.
///
/// With theta the angle between line of sight and surface normal and q = theta / (pi/2 - theta):
///
/// * A pixel looks beside where it should, by a normal deviate of 0.8 + 0.035 q pixels along each axis.
/// * Depth has normal noise of 1.2 mm + 1.9 mm (z/m - 0.4)^2, beyond 60 degrees also 0.1 mm q^2 / sqrt(z/m).
/// * 1/z is then rounded to multiples of 1/351.3 m: steps of 2.85 mm at 1 m that grow with z^2.
/// * A pixel is lost with a probability that rises from 0 at 70 degrees to 1 at 85, and in half of all cases beside
///   a jump of over 20 mm.
///
/// The scale multiplies deviations, steps and (up to 1) probabilities; at 0 depths are exact to the image's unit.
/// Pixels are independent, where those of a real camera have part of their noise in common with their neighbours.
///
/// # Source
/// Deviations: Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and
/// tracking", 3DIMPVT 2012 (fitted to measurements). Steps: Barron and Malik, "Intrinsic scene properties from a
/// single RGB-D image", CVPR 2013 (disparity 35130 / depth in cm), which agrees with Khoshelham and Oude Elberink,
/// "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12 (2012): 2.85 mm at 1
/// m. The probabilities of a loss are ours, and not measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthNoise {
    /// 1 for such a camera, 0 for a perfect one.
    pub scale: f64,
    /// Of the random numbers.
    pub seed: u64,
}

impl DepthNoise {
    /// Random numbers of one row of one view: the same whichever thread takes it.
    pub(super) fn row(&self, view: u64, row: usize) -> ChaCha8Rng {
        let mut rng = <ChaCha8Rng as rand::SeedableRng>::seed_from_u64(self.seed);
        rng.set_stream(view << 32 | row as u64);
        rng
    }

    /// How far a pixel looks beside its place. `cosine`: of the angle between line of sight and surface normal.
    pub(super) fn jitter(&self, cosine: f64, rng: &mut ChaCha8Rng) -> [f64; 2] {
        let spread = LATERAL[0] + LATERAL[1] * slant(angle(cosine));
        normal_pair(rng).map(|deviate| self.scale * spread * deviate)
    }

    /// The depth measured for an exact one \[m\]; `None` where there is none. `cosine`: of the angle between line of
    /// sight and surface normal.
    pub(super) fn measured(
        &self,
        z: f64,
        cosine: f64,
        is_silhouette: bool,
        rng: &mut ChaCha8Rng,
    ) -> Option<f64> {
        // Always as many numbers, so that one pixel's fate does not move the next one's.
        let (chance, other_chance): (f64, f64) = (rng.random(), rng.random());
        let [deviate, _] = normal_pair(rng);
        if self.scale == 0.0 {
            return Some(z);
        }
        let angle = angle(cosine);
        let [first, last] = FAILING_ANGLES;
        let failing = ((angle - first) / (last - first)).clamp(0.0, 1.0);
        let likely = self.scale.min(1.0);
        if chance < likely * failing || (is_silhouette && other_chance < likely * SILHOUETTE_LOSS) {
            return None;
        }
        let noisy = z + self.scale * axial(z, angle) * deviate;
        let step = self.scale * DISPARITY_STEP;
        let disparity = step * (1.0 / (step * noisy)).round();
        (noisy > 0.0 && disparity > 0.0).then(|| 1.0 / disparity)
    }
}

fn angle(cosine: f64) -> f64 {
    cosine.clamp(0.0, 1.0).acos()
}

/// theta / (pi/2 - theta), for angles at which anything is measured.
fn slant(angle: f64) -> f64 {
    let angle = angle.min(FAILING_ANGLES[1]);
    angle / (FRAC_PI_2 - angle)
}

/// Standard deviation of a depth \[m\].
fn axial(z: f64, angle: f64) -> f64 {
    let [least, growth, from] = AXIAL;
    let facing = least + growth * (z - from).powi(2);
    if angle > GRAZING {
        facing + AXIAL_GRAZING * slant(angle).powi(2) / z.sqrt()
    } else {
        facing
    }
}

/// Two independent standard normal deviates (Box and Muller).
fn normal_pair(rng: &mut ChaCha8Rng) -> [f64; 2] {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    let radius = (-2.0 * (1.0 - u).ln()).sqrt();
    let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
    [radius * cos, radius * sin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_and_steps_grow_with_the_square_of_the_depth() {
        let noise = DepthNoise {
            scale: 1.0,
            seed: 3,
        };
        for z in [0.5, 1.0, 2.0] {
            let mut rng = noise.row(0, 0);
            let depths: Vec<f64> = (0..20_000)
                .filter_map(|_| noise.measured(z, 1.0, false, &mut rng))
                .collect();
            assert_eq!(
                depths.len(),
                20_000,
                "nothing is lost where a surface faces the camera"
            );
            let mean = depths.iter().sum::<f64>() / depths.len() as f64;
            let variance =
                depths.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / depths.len() as f64;
            // Rounding to a step adds a twelfth of its square.
            let step = z * z / 351.3;
            let deviation = 0.0012 + 0.0019 * (z - 0.4).powi(2);
            let expected = (deviation.powi(2) + step.powi(2) / 12.0).sqrt();
            assert!(
                (variance.sqrt() / expected - 1.0).abs() < 0.05,
                "{z}: {}",
                variance.sqrt()
            );
            assert!((mean - z).abs() < 0.1 * expected, "{z}: {mean}");
            let mut values = depths.clone();
            values.sort_by(f64::total_cmp);
            values.dedup();
            // Neighbouring depths in the middle, where none is skipped.
            let middle = values.partition_point(|&value| value < z);
            let found = values[middle] - values[middle - 1];
            assert!((found / step - 1.0).abs() < 0.05, "{z}: {found}");
        }
    }

    #[test]
    fn grazing_rays_and_silhouettes_lose_pixels() {
        let noise = DepthNoise {
            scale: 1.0,
            seed: 4,
        };
        let lost = |degrees: f64, is_silhouette| {
            let mut rng = noise.row(1, 2);
            let cosine = degrees.to_radians().cos();
            let kept = (0..10_000).filter(|_| {
                noise
                    .measured(0.7, cosine, is_silhouette, &mut rng)
                    .is_some()
            });
            1.0 - kept.count() as f64 / 10_000.0
        };
        assert_eq!(lost(69.0, false), 0.0);
        assert!((lost(77.5, false) - 0.5).abs() < 0.03);
        assert_eq!(lost(86.0, false), 1.0);
        assert!((lost(0.0, true) - SILHOUETTE_LOSS).abs() < 0.03);
    }

    #[test]
    fn deviations_grow_with_the_angle() {
        // 0.7 m away: the values of the published formulas, by hand.
        let degrees = |d: f64| d.to_radians();
        assert!((axial(0.7, 0.0) - 0.001371).abs() < 1e-6);
        assert_eq!(axial(0.7, degrees(59.0)), axial(0.7, 0.0));
        // q = 75 / 15 = 5: 1.371 + 0.1 * 25 / 0.83666 mm.
        assert!((axial(0.7, degrees(75.0)) - 0.004359).abs() < 1e-6);
        let noise = DepthNoise {
            scale: 1.0,
            seed: 6,
        };
        let mut rng = noise.row(0, 0);
        for (cosine, expected) in [(1.0, 0.8), (degrees(75.0).cos(), 0.8 + 0.035 * 5.0)] {
            let squares: f64 = (0..20_000)
                .map(|_| noise.jitter(cosine, &mut rng)[0].powi(2))
                .sum();
            let deviation = (squares / 20_000.0).sqrt();
            assert!((deviation / expected - 1.0).abs() < 0.02, "{deviation}");
        }
    }

    #[test]
    fn without_noise_depths_are_exact() {
        let noise = DepthNoise {
            scale: 0.0,
            seed: 5,
        };
        let mut rng = noise.row(0, 0);
        assert_eq!(noise.measured(0.7, 0.01, true, &mut rng), Some(0.7));
        assert_eq!(noise.jitter(0.5, &mut rng), [0.0; 2]);
    }
}
