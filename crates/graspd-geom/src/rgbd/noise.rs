//! What a structured-light camera makes of exact depths.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Step of 1/z between neighbouring disparities \[1/m\]: 2.85 mm of depth at 1 m.
const DISPARITY_STEP: f64 = 2.85e-3;
/// Standard deviation of 1/z, in steps.
const DISPARITY_SPREAD: f64 = 0.5;
/// Standard deviation of where a pixel looks \[pixels\].
const LATERAL_SPREAD: f64 = 0.5;
/// Angle between line of sight and surface normal at which measurements begin to fail, and at which all do \[degrees\].
const FAILING_ANGLES: [f64; 2] = [70.0, 85.0];
/// Part of the pixels beside a jump in depth that have none.
const SILHOUETTE_LOSS: f64 = 0.5;
/// What is a jump \[m\].
pub(super) const SILHOUETTE_JUMP: f64 = 0.02;

/// The noise of a depth camera of the first generation (Kinect, Carmine), times a scale.
///
/// * A pixel looks beside where it should, by a normal deviate of 0.5 pixels along each axis.
/// * 1/z has normal noise of 1.4e-3 /m and is rounded to multiples of 2.85e-3 /m: in depth a standard deviation of 1.4 mm and
///   steps of 2.85 mm at 1 m, both growing with z^2.
/// * A pixel is lost with a probability that rises from 0 at 70 degrees between line of sight and normal to 1 at 85, and
///   in half of all cases beside a jump of over 20 mm.
///
/// The scale multiplies deviations, steps and (up to 1) probabilities; at 0 depths are exact to the image's unit.
///
/// # Source
/// Disparities: Khoshelham and Oude Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping
/// applications", Sensors 12 (2012). Lateral jitter and the order of the steps: Barron and Malik, "Intrinsic scene properties from a single RGB-D
/// image", CVPR 2013. Failing angles: Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and
/// tracking", 3DIMPVT 2012, who found no stable depths beyond 70 to 80 degrees. The loss at silhouettes is ours.
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

    /// How far a pixel looks beside its place.
    pub(super) fn jitter(&self, rng: &mut ChaCha8Rng) -> [f64; 2] {
        normal_pair(rng).map(|deviate| self.scale * LATERAL_SPREAD * deviate)
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
        let angle = cosine.clamp(0.0, 1.0).acos().to_degrees();
        let [first, last] = FAILING_ANGLES;
        let failing = ((angle - first) / (last - first)).clamp(0.0, 1.0);
        let likely = self.scale.min(1.0);
        if chance < likely * failing || (is_silhouette && other_chance < likely * SILHOUETTE_LOSS) {
            return None;
        }
        let step = self.scale * DISPARITY_STEP;
        let steps = (1.0 / z) / step + DISPARITY_SPREAD * deviate;
        let disparity = step * steps.round();
        (disparity > 0.0).then(|| 1.0 / disparity)
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
            // Rounding to a step adds a twelfth of its square: 0.25 + 0.083 steps squared in all.
            let expected = (1.0_f64 / 3.0).sqrt() * DISPARITY_STEP * z * z;
            assert!(
                (variance.sqrt() / expected - 1.0).abs() < 0.05,
                "{z}: {}",
                variance.sqrt()
            );
            assert!((mean - z).abs() < 0.1 * expected, "{z}: {mean}");
            let mut values = depths.clone();
            values.sort_by(f64::total_cmp);
            values.dedup();
            let step = values[1] - values[0];
            assert!(
                (step / (DISPARITY_STEP * z * z) - 1.0).abs() < 0.05,
                "{z}: {step}"
            );
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
    fn without_noise_depths_are_exact() {
        let noise = DepthNoise {
            scale: 0.0,
            seed: 5,
        };
        let mut rng = noise.row(0, 0);
        assert_eq!(noise.measured(0.7, 0.01, true, &mut rng), Some(0.7));
        assert_eq!(noise.jitter(&mut rng), [0.0; 2]);
    }
}
