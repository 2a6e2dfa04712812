//! Every operation of `Real`: forward mode, reverse mode, both nested, central differences and num-dual agree.

use graspd_ad::check::Checker;
use graspd_ad::{Dual, Function, Real, gradient, hessian, leaky_min, safe_divide, safe_norm};
use num_dual::{DualNum, HyperDual64};
use proptest::prelude::*;

/// Differences of a function at scale 1, whose fifth derivative may be in the thousands.
const NUMERIC: f64 = 1e-7;
/// The same formula, rounded in another order.
const ROUNDING: f64 = 1e-12;

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 32,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    let scale = expected.abs().max(1.0);
    assert!(
        (found - expected).abs() <= tolerance * scale,
        "{what}: {found}, not {expected}"
    );
}

/// Value, gradient and Hessian by forward mode over forward mode.
fn nested<const N: usize>(function: &impl Function, x: [f64; N]) -> Dual<Dual<f64, N>, N> {
    function.call(&Dual::variables(Dual::variables(x)))
}

fn check<const N: usize>(function: &impl Function, x: [f64; N]) {
    let value = function.call(&x);
    let checker = Checker::default();

    let worst = checker.function(function, &x);
    assert!(worst.error <= NUMERIC, "{worst}, at {x:?}");

    let forward = function.call(&Dual::variables(x));
    let (reverse_value, reverse) = gradient(|x| function.call(x), &x);
    assert_eq!(forward.value, value);
    assert_eq!(reverse_value, value);
    for i in 0..N {
        assert_close(
            "reverse, by forward",
            reverse[i],
            forward.derivative[i],
            ROUNDING,
        );
    }

    let second = nested(function, x);
    let (over_value, over_gradient, over_rows) = hessian(|x| function.call(x), &x);
    assert_eq!(second.value.value, value);
    assert_eq!(over_value, value);
    let mut rows = vec![vec![0.0; N]; N];
    for i in 0..N {
        assert_close(
            "nested value part",
            second.value.derivative[i],
            reverse[i],
            ROUNDING,
        );
        assert_close(
            "nested first derivative",
            second.derivative[i].value,
            reverse[i],
            ROUNDING,
        );
        assert_close(
            "forward over reverse",
            over_gradient[i],
            reverse[i],
            ROUNDING,
        );
        for j in 0..N {
            rows[i][j] = second.derivative[i].derivative[j];
            assert_close("Hessian", over_rows[i][j], rows[i][j], ROUNDING);
        }
    }
    let gradient_at = |x: &[f64]| gradient(|x| function.call(x), x).1;
    let worst = checker.jacobian(gradient_at, &x, &rows);
    assert!(worst.error <= NUMERIC, "second {worst}, at {x:?}");
}

fn check_with_oracle<const N: usize>(
    function: &impl Function,
    oracle: impl Fn(&[HyperDual64]) -> HyperDual64,
    x: [f64; N],
) {
    check(function, x);
    let ours = nested(function, x);
    for i in 0..N {
        for j in 0..N {
            let mut point = x.map(HyperDual64::from);
            point[i].eps1 = 1.0;
            point[j].eps2 = 1.0;
            let theirs = oracle(&point);
            assert_close("value, by num-dual", ours.value.value, theirs.re, ROUNDING);
            assert_close(
                "first, by num-dual",
                ours.derivative[i].value,
                theirs.eps1,
                ROUNDING,
            );
            let second = ours.derivative[i].derivative[j];
            assert_close("second, by num-dual", second, theirs.eps1eps2, ROUNDING);
        }
    }
}

/// Makes a test of an expression over some variables in ranges; with `oracle`, the expression is also one of
/// num-dual.
macro_rules! operation {
    ($name:ident($($x:ident in $range:expr),+) $expression:expr) => {
        operation!(@ $name($($x in $range),+) $expression, check(&Operation, [$($x),+]));
    };
    (oracle $name:ident($($x:ident in $range:expr),+) $expression:expr) => {
        operation!(@ $name($($x in $range),+) $expression, {
            fn oracle<T: DualNum<Primitive = f64> + Copy>(x: &[T]) -> T {
                let [$($x),+] = *x else { unreachable!("one value for each variable") };
                $expression
            }
            check_with_oracle(&Operation, oracle::<HyperDual64>, [$($x),+]);
        });
    };
    (@ $name:ident($($x:ident in $range:expr),+) $expression:expr, $check:expr) => {
        #[test]
        fn $name() {
            struct Operation;
            impl Function for Operation {
                fn call<T: Real>(&self, x: &[T]) -> T {
                    let [$($x),+] = *x else { unreachable!("one value for each variable") };
                    $expression
                }
            }
            proptest!(config(), |($($x in $range),+)| $check);
        }
    };
}

operation!(oracle add(x in -3.0..3.0, y in -3.0..3.0) x + y);
operation!(oracle subtract(x in -3.0..3.0, y in -3.0..3.0) x - y);
operation!(oracle multiply(x in -3.0..3.0, y in -3.0..3.0) x * y);
operation!(oracle divide(x in -3.0..3.0, y in 0.5..3.0) x / y);
operation!(oracle divide_by_negative(x in -3.0..3.0, y in -3.0..-0.5) x / y);
operation!(oracle negate(x in -3.0..3.0) -x * x);
operation!(remainder(x in 4.1..4.9, y in 1.9..2.04) x * (x % y));
operation!(remainder_of_negative(x in -4.9..-4.1, y in 1.9..2.04) x * (x % y));
operation!(oracle assign_operators(x in -3.0..3.0, y in 0.5..3.0) {
    let mut z = x;
    z += y;
    z *= x;
    z -= y;
    z /= y;
    z
});
operation!(remainder_assign(x in 4.1..4.9, y in 1.9..2.04) {
    let mut z = x;
    z %= y;
    z * z
});

operation!(oracle recip(x in 0.5..3.0) x.recip());
operation!(oracle sqrt(x in 0.2..4.0) x.sqrt());
operation!(oracle abs(x in 0.1..3.0) x.abs() * x);
operation!(oracle abs_of_negative(x in -3.0..-0.1) x.abs() * x);
operation!(square(x in -3.0..3.0) x.square());
operation!(oracle powi_0(x in -2.0..2.0) x.powi(0) * x);
operation!(oracle powi_1(x in -2.0..2.0) x.powi(1) * x);
operation!(oracle powi_2(x in -2.0..2.0) x.powi(2));
// Away from 0, where all derivatives that the differences resolve vanish.
operation!(oracle powi_5(x in 0.3..2.0) x.powi(5));
operation!(oracle powi_minus_1(x in 0.5..2.0) x.powi(-1));
operation!(oracle powi_minus_3(x in -2.0..-0.5) x.powi(-3));
operation!(oracle powf_0(x in 0.5..2.0) x.powf(0.0) * x);
operation!(oracle powf_1(x in 0.5..2.0) x.powf(1.0) * x);
operation!(oracle powf_2(x in -2.0..-0.5) x.powf(2.0));
operation!(oracle powf_fraction(x in 0.5..2.0) x.powf(0.3));
operation!(oracle powf_above_1(x in 0.5..2.0) x.powf(1.7));
operation!(oracle powf_negative(x in 0.5..2.0) x.powf(-1.5));
operation!(oracle exp(x in -2.0..2.0) x.exp());
operation!(oracle ln(x in 0.5..4.0) x.ln());
operation!(oracle sin(x in -4.0..4.0) x.sin());
operation!(oracle cos(x in -4.0..4.0) x.cos());
operation!(oracle sin_cos(x in -4.0..4.0) {
    let (sin, cos) = x.sin_cos();
    sin * x + cos
});
operation!(oracle tan(x in -1.2..1.2) x.tan());
operation!(oracle asin(x in -0.9..0.9) x.asin());
operation!(oracle acos(x in -0.9..0.9) x.acos());
operation!(oracle atan(x in -3.0..3.0) x.atan());
operation!(oracle atan2_right(y in -2.0..2.0, x in 0.5..2.0) y.atan2(x));
operation!(oracle atan2_above(y in 0.5..2.0, x in -2.0..2.0) y.atan2(x));
operation!(oracle atan2_below(y in -2.0..-0.5, x in -2.0..2.0) y.atan2(x));
operation!(oracle tanh(x in -2.0..2.0) x.tanh());

operation!(mul_add(x in -3.0..3.0, y in -3.0..3.0) x.mul_add(y, x));
operation!(scale(x in -3.0..3.0) x.scale(-2.5) * x);
operation!(floor(x in 1.1..1.9) x.floor() * x);
operation!(min(x in 0.1..1.0, y in 1.1..2.0) x.min(y) * y.min(x));
operation!(max(x in 0.1..1.0, y in 1.1..2.0) x.max(y) * y.max(x));
operation!(clamp_inside(x in 0.1..0.9) x.clamp(T::zero(), T::one()) * x);
operation!(clamp_below(x in -0.9..-0.1) x.clamp(T::zero(), T::one()) * x);
operation!(clamp_above(x in 1.1..1.9) x.clamp(T::zero(), T::one()) * x);
operation!(select(x in 0.1..1.0, y in 1.1..2.0) {
    let chosen = T::select(x.lt(y), x * y, x.ln());
    chosen + T::select(x.ge(y), x.ln(), y.sin())
});
operation!(norm(x in 0.1..2.0, y in -2.0..-0.1) safe_norm([x, y, x * y]));
operation!(quotient(x in 0.1..2.0, y in 0.5..2.0) safe_divide(x, y));
operation!(leaky_inside(x in -2.0..-0.1) leaky_min(x, 0.1) * x);

operation!(oracle longer_expression(x in 0.2..1.5, y in 0.2..1.5, z in 0.2..1.5)
    (x * y.sin() + (z / x).exp()).sqrt() * (y.atan2(z) + x.tanh()).powi(3) / (x + y * z).ln().cos());

proptest! {
    #![proptest_config(config())]

    /// Constants held fixed: here forward and reverse mode agree with each other and not with differences.
    #[test]
    fn detached_factors(x in -2.0..2.0_f64, y in -2.0..2.0_f64) {
        struct Held;
        impl Function for Held {
            fn call<T: Real>(&self, x: &[T]) -> T {
                (x[0] * x[1]).mul_detached(x[0]).square() + x[1].detach() * x[0]
            }
        }
        let expected = [2.0 * f64::powi(x, 3) * y * y + y, 2.0 * f64::powi(x, 4) * y];
        let forward: Dual<f64, 2> = Held.call(&Dual::variables([x, y]));
        let (value, reverse) = gradient(|x| Held.call(x), &[x, y]);
        assert_close("value", value, f64::powi(x, 4) * y * y + x * y, ROUNDING);
        let (_, _, rows) = hessian(|x| Held.call(x), &[x, y]);
        // Held factors are constants for the second derivative, too.
        let mixed = 4.0 * f64::powi(x, 3) * y;
        let expected_rows = [[2.0 * f64::powi(x * y, 2), mixed], [mixed, 2.0 * f64::powi(x, 4)]];
        let second = nested(&Held, [x, y]);
        for i in 0..2 {
            assert_close("forward", forward.derivative[i], expected[i], ROUNDING);
            assert_close("reverse", reverse[i], expected[i], ROUNDING);
            for j in 0..2 {
                assert_close("second", second.derivative[i].derivative[j], expected_rows[i][j], ROUNDING);
                assert_close("Hessian", rows[i][j], expected_rows[i][j], ROUNDING);
            }
        }
    }
}
