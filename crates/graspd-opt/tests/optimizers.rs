//! The optimisers against closed forms, hand-computed steps and each other.

use graspd_ad::Element;
use graspd_opt::{
    Adam, AdamSettings, Adamax, OptimizationError, Optimizer, OptimizerKind, ParameterGroup,
    Schedule,
};
use proptest::prelude::*;

/// Epsilon of 1e-8 against gradients of order one.
const EPSILON_EFFECT: f64 = 1e-7;

fn adamax<E: Element>(len: usize) -> Adamax<E> {
    Adamax::new(len, AdamSettings::default()).unwrap()
}
fn adam<E: Element>(len: usize) -> Adam<E> {
    Adam::new(len, AdamSettings::default()).unwrap()
}
fn every_kind() -> [OptimizerKind; 2] {
    [
        OptimizerKind::Adam(AdamSettings::default()),
        OptimizerKind::Adamax(AdamSettings::default()),
    ]
}

/// The updates of one coordinate for a sequence of gradients.
fn updates(optimizer: &mut dyn Optimizer<f64>, rate: f64, gradients: &[f64]) -> Vec<f64> {
    gradients
        .iter()
        .map(|&g| {
            let mut update = [0.0];
            optimizer.step(rate, &mut update, &[g]);
            update[0]
        })
        .collect()
}

fn assert_close(actual: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(actual.len(), expected.len());
    for (index, (a, e)) in actual.iter().zip(expected).enumerate() {
        let error = (a - e).abs();
        assert!(error <= tolerance, "{index}: {a} is not {e}, by {error:e}");
    }
}

#[test]
fn first_steps_of_adamax_by_hand() {
    // m = 0.1, -0.11, -0.049; u = 1, 2, 1.998; 1 - 0.9^t = 0.1, 0.19, 0.271.
    let expected = [
        -0.01,
        0.01 * 0.11 / 0.19 / 2.0,
        0.01 * 0.049 / 0.271 / 1.998,
    ];
    let actual = updates(&mut adamax(1), 0.01, &[1.0, -2.0, 0.5]);
    assert_close(&actual, &expected, 0.01 * EPSILON_EFFECT);
}

#[test]
fn first_steps_of_adam_by_hand() {
    // m as for Adamax; v = 0.001, 0.004999, 0.005244001; 1 - 0.999^t = 0.001, 0.001999, 0.002997001.
    let expected = [
        -0.01,
        0.01 * (0.11 / 0.19) / (0.004999_f64 / 0.001999).sqrt(),
        0.01 * (0.049 / 0.271) / (0.005244001_f64 / 0.002997001).sqrt(),
    ];
    let actual = updates(&mut adam(1), 0.01, &[1.0, -2.0, 0.5]);
    assert_close(&actual, &expected, 0.01 * EPSILON_EFFECT);
}

/// Adamax's updates from the whole history, without recursions: m_t = (1 - beta1) sum_i beta1^(t-i) g_i and
/// u_t = max_i beta2^(t-i) (|g_i| + epsilon).
fn adamax_from_history(settings: &AdamSettings, rate: f64, gradients: &[f64]) -> Vec<f64> {
    let AdamSettings {
        beta1,
        beta2,
        epsilon,
    } = *settings;
    (1..=gradients.len())
        .map(|t| {
            let age = |i: usize| (t - 1 - i) as i32;
            let (mut m, mut u) = (0.0, 0.0_f64);
            for (i, g) in gradients[..t].iter().enumerate() {
                m += (1.0 - beta1) * beta1.powi(age(i)) * g;
                u = u.max(beta2.powi(age(i)) * (g.abs() + epsilon));
            }
            -rate / (1.0 - beta1.powi(t as i32)) * m / u
        })
        .collect()
}

/// Adam's updates from the whole history, without recursions: means weighted by beta^(age), divided by their total
/// weight.
fn adam_from_history(settings: &AdamSettings, rate: f64, gradients: &[f64]) -> Vec<f64> {
    let weighted_mean = |beta: f64, values: &mut dyn DoubleEndedIterator<Item = f64>| {
        let (mut sum, mut total, mut weight) = (0.0, 0.0, 1.0);
        for value in values.rev() {
            sum += weight * value;
            total += weight;
            weight *= beta;
        }
        sum / total
    };
    (1..=gradients.len())
        .map(|t| {
            let history = &gradients[..t];
            let mean = weighted_mean(settings.beta1, &mut history.iter().copied());
            let mean_square = weighted_mean(settings.beta2, &mut history.iter().map(|g| g * g));
            -rate * mean / (mean_square.sqrt() + settings.epsilon)
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn adamax_equals_its_closed_form(
        gradients in prop::collection::vec(-10.0..10.0_f64, 1..60),
        beta1 in 0.0..0.99_f64,
        beta2 in 0.0..0.9999_f64,
    ) {
        let settings = AdamSettings { beta1, beta2, epsilon: 1e-8 };
        let expected = adamax_from_history(&settings, 1.0, &gradients);
        let mut optimizer = Adamax::new(1, settings).unwrap();
        let actual = updates(&mut optimizer, 1.0, &gradients);
        for (a, e) in actual.iter().zip(&expected) {
            // 60 roundings, each at most of the largest term.
            prop_assert!((a - e).abs() <= 1e-10 * (1.0 + e.abs()), "{a} {e}");
        }
    }

    #[test]
    fn adam_equals_its_closed_form(
        gradients in prop::collection::vec(-10.0..10.0_f64, 1..60),
        beta1 in 0.0..0.99_f64,
        beta2 in 0.0..0.9999_f64,
    ) {
        let settings = AdamSettings { beta1, beta2, epsilon: 1e-8 };
        let expected = adam_from_history(&settings, 1.0, &gradients);
        let mut optimizer = Adam::new(1, settings).unwrap();
        let actual = updates(&mut optimizer, 1.0, &gradients);
        for (a, e) in actual.iter().zip(&expected) {
            // 1 - beta2^t loses digits where beta2 is near 1.
            prop_assert!((a - e).abs() <= 1e-9 * (1.0 + e.abs()), "{a} {e}");
        }
    }

    /// Powers of two scale without rounding, so with a negligible epsilon the updates are the same bit for bit.
    #[test]
    fn adamax_does_not_see_the_scale_of_the_gradient(
        gradients in prop::collection::vec(-10.0..10.0_f64, 1..60),
        exponent in -40..40_i32,
    ) {
        let settings = AdamSettings { epsilon: 1e-200, ..AdamSettings::default() };
        let scaled: Vec<f64> = gradients.iter().map(|g| g * 2f64.powi(exponent)).collect();
        let plain = updates(&mut Adamax::new(1, settings.clone()).unwrap(), 0.1, &gradients);
        let other = updates(&mut Adamax::new(1, settings).unwrap(), 0.1, &scaled);
        prop_assert_eq!(plain, other);
    }

    #[test]
    fn single_precision_follows_double(gradients in prop::collection::vec(-10.0..10.0_f32, 1..60)) {
        for kind in every_kind() {
            let mut single = kind.build::<f32>(1).unwrap();
            let mut double = kind.build::<f64>(1).unwrap();
            let (mut x, mut y) = ([0.0_f32], [0.0_f64]);
            for &g in &gradients {
                single.step(0.01, &mut x, &[g]);
                double.step(0.01, &mut y, &[f64::from(g)]);
            }
            // The path is at most 60 steps of 0.1 long; each rounds to 6e-8 of it a few times.
            prop_assert!((f64::from(x[0]) - y[0]).abs() < 1e-4, "{kind:?}: {} {}", x[0], y[0]);
        }
    }
}

#[test]
fn quadratic_is_minimised() {
    // f = sum_i c_i (x_i - t_i)^2 / 2 with curvatures over four orders of magnitude.
    let (curvature, target) = ([100.0, 1.0, 0.01], [0.3, -0.7, 1.1]);
    let rate = Schedule::constant(0.02)
        .and_then(|rate| rate.with_exponential_decay(500, 3000, 1e-6))
        .unwrap();
    for kind in every_kind() {
        let mut optimizer = kind.build::<f64>(3).unwrap();
        let (mut x, mut gradient) = ([0.0; 3], [0.0; 3]);
        for step in 0..3000 {
            for i in 0..3 {
                gradient[i] = curvature[i] * (x[i] - target[i]);
            }
            optimizer.step(rate.value(step), &mut x, &gradient);
        }
        // The rate ends at 2e-8.
        assert_close(&x, &target, 1e-6);
    }
}

#[test]
fn rosenbrock_is_minimised() {
    let rate = Schedule::constant(0.02)
        .and_then(|rate| rate.with_exponential_decay(5000, 20_000, 1e-6))
        .unwrap();
    for kind in every_kind() {
        let mut optimizer = kind.build::<f64>(2).unwrap();
        let mut x = [-1.2, 1.0];
        for step in 0..20_000 {
            let valley = x[1] - x[0] * x[0];
            let gradient = [2.0 * (x[0] - 1.0) - 400.0 * x[0] * valley, 200.0 * valley];
            optimizer.step(rate.value(step), &mut x, &gradient);
        }
        assert_close(&x, &[1.0, 1.0], 1e-5);
    }
}

/// After the gradient vanishes the moments reach 0 in the end and are never denormal on the way.
fn moments_vanish<E: Element>(mut moments: impl FnMut(E) -> [E; 2], steps: usize) {
    moments(E::constant(0.37));
    for _ in 0..steps {
        for moment in moments(E::zero()) {
            assert!(moment.is_normal() || moment == E::zero(), "{moment:?}");
        }
    }
    assert_eq!(moments(E::zero())[0], E::zero());
    // A gradient that is denormal itself counts as zero.
    let denormal = E::min_positive_value() / E::constant(8.0);
    assert_eq!(moments(denormal)[0], E::zero());
}

fn adamax_moments<E: Element>() -> impl FnMut(E) -> [E; 2] {
    let (mut optimizer, mut x) = (adamax::<E>(1), [E::one()]);
    move |gradient| {
        optimizer.step(1e-3, &mut x, &[gradient]);
        [optimizer.mean()[0], optimizer.largest()[0]]
    }
}
fn adam_moments<E: Element>() -> impl FnMut(E) -> [E; 2] {
    let (mut optimizer, mut x) = (adam::<E>(1), [E::one()]);
    move |gradient| {
        optimizer.step(1e-3, &mut x, &[gradient]);
        [optimizer.mean()[0], optimizer.mean_square()[0]]
    }
}

#[test]
fn moments_never_linger_as_denormals() {
    // 0.9^t falls below the smallest normal number after 829 (f32) and 6723 steps (f64), 0.999^t after 87 000 (f32).
    moments_vanish::<f32>(adamax_moments(), 100_000);
    moments_vanish::<f64>(adamax_moments(), 8_000);
    moments_vanish::<f32>(adam_moments(), 100_000);
    moments_vanish::<f64>(adam_moments(), 8_000);
}

#[test]
fn a_vanished_gradient_stops_the_parameters() {
    let mut optimizer = adamax::<f32>(1);
    let mut x = [0.0_f32];
    optimizer.step(1e-3, &mut x, &[1.0]);
    for _ in 0..1000 {
        optimizer.step(1e-3, &mut x, &[0.0]);
    }
    let rest = x;
    optimizer.step(1e-3, &mut x, &[0.0]);
    assert_eq!(x, rest);
}

#[test]
fn updates_are_what_steps_add() {
    let gradients = [[0.3, -0.2, 5.0], [0.0, 0.1, -4.0], [-1.0, 0.2, 3.0]];
    for kind in every_kind() {
        let mut stepping = kind.build::<f64>(3).unwrap();
        let mut updating = kind.build::<f64>(3).unwrap();
        let (mut x, mut y, mut update) = ([1.0; 3], [1.0; 3], [f64::NAN; 3]);
        let whole = [ParameterGroup {
            range: 0..3,
            rate: 0.01,
        }];
        for gradient in &gradients {
            stepping.step(0.01, &mut x, gradient);
            updating.update_groups(&whole, gradient, &mut update);
            for i in 0..3 {
                y[i] += update[i];
            }
        }
        assert_eq!(x, y, "{kind:?}");
    }
}

#[test]
fn groups_are_separate_optimizers_at_their_own_rates() {
    let groups = [
        ParameterGroup {
            range: 0..2,
            rate: 0.1,
        },
        ParameterGroup {
            range: 3..4,
            rate: 0.001,
        },
    ];
    let gradients = [[0.3, -0.2, 5.0, 2.0], [0.1, 0.1, -4.0, -2.5]];
    for kind in every_kind() {
        let mut together = kind.build::<f64>(4).unwrap();
        let mut first = kind.build::<f64>(2).unwrap();
        let mut second = kind.build::<f64>(1).unwrap();
        let (mut x, mut y) = ([1.0; 4], [1.0; 4]);
        let mut update = [f64::NAN; 4];
        for gradient in &gradients {
            together.step_groups(&groups, &mut x, gradient);
            first.step(0.1, &mut y[..2], &gradient[..2]);
            second.step(0.001, &mut y[3..], &gradient[3..]);
        }
        assert_eq!(x, y, "{kind:?}");
        assert_eq!(x[2], 1.0, "{kind:?}: a parameter in no group moved");
        together.update_groups(&groups, &gradients[0], &mut update);
        assert_eq!(update[2], 0.0, "{kind:?}");
    }
}

#[test]
fn nan_stays_visible_in_its_own_coordinate() {
    for kind in every_kind() {
        let mut optimizer = kind.build::<f64>(2).unwrap();
        let mut x = [0.0; 2];
        optimizer.step(0.1, &mut x, &[f64::NAN, 1.0]);
        assert!(x[0].is_nan() && x[1] < 0.0, "{kind:?}");
    }
}

#[test]
fn settings_out_of_range_are_named() {
    let wrong = [
        (
            AdamSettings {
                beta1: 1.0,
                ..Default::default()
            },
            "beta1",
        ),
        (
            AdamSettings {
                beta2: f64::NAN,
                ..Default::default()
            },
            "beta2",
        ),
        (
            AdamSettings {
                epsilon: 0.0,
                ..Default::default()
            },
            "epsilon",
        ),
    ];
    for (settings, name) in wrong {
        for kind in [
            OptimizerKind::Adamax(settings.clone()),
            OptimizerKind::Adam(settings),
        ] {
            let error = kind.build::<f64>(1).err().unwrap();
            assert!(error.to_string().contains(name), "{error}");
        }
    }
    let vanishing = AdamSettings {
        epsilon: 1e-60,
        ..Default::default()
    };
    assert!(Adamax::<f64>::new(1, vanishing.clone()).is_ok());
    assert!(matches!(
        Adamax::<f32>::new(1, vanishing),
        Err(OptimizationError::Setting(_))
    ));
}

#[test]
#[should_panic(expected = "overlaps")]
fn overlapping_groups_panic() {
    let groups = [0..2, 1..3].map(|range| ParameterGroup { range, rate: 0.1 });
    adamax::<f64>(3).step_groups(&groups, &mut [0.0; 3], &[1.0; 3]);
}

#[test]
#[should_panic(expected = "length of the gradient")]
fn a_gradient_of_another_length_panics() {
    adam::<f64>(3).step(0.1, &mut [0.0; 3], &[1.0; 2]);
}
