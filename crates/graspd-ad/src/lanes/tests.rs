//! Every kind of register computes what `f32` computes, lane by lane and bit by bit.

use proptest::prelude::*;

use super::array::Array;
use super::{Instructions, Kernel, Lanes, LanesOver, vectorize_with};
use crate::{Dual, Mask, Real};

const SPECIAL: [f32; 8] = [
    0.0,
    -0.0,
    1.0,
    -1.5,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    1e-42,
];
const ODD: [f32; 8] = [-0.0, 0.0, f32::NAN, -1.5, -1e30, 3e9, 2.5, 16_777_215.0];

/// Runs a check for every kind of lanes that the machine has.
macro_rules! for_all_lanes {
    ($check:ident($($argument:ident: $type:ty),*) $body:block) => {{
        struct Check($($type),*);
        impl Kernel for Check {
            type Output = ();
            fn run<L: Real<Element = f32>>(self) {
                let Check($($argument),*) = self;
                $body
            }
        }
        let check = |$($argument: $type),*| Check($($argument),*);
        check($($argument),*).run::<LanesOver<Array>>();
        for instructions in [Instructions::Baseline, Instructions::Avx2, Instructions::Avx512] {
            vectorize_with(instructions, check($($argument),*));
        }
    }};
}

fn bits<L: Real<Element = f32>>(lanes: L) -> [u32; 8] {
    let mut values = [0.0_f32; 8];
    lanes.store(&mut values);
    // One NaN is as good as another.
    values.map(|x| {
        if x.is_nan() {
            f32::NAN.to_bits()
        } else {
            x.to_bits()
        }
    })
}

fn expect_lanes<L: Real<Element = f32>>(what: &str, lanes: L, scalar: impl Fn(usize) -> f32) {
    let expected: [f32; 8] = std::array::from_fn(scalar);
    assert_eq!(
        bits(lanes),
        bits(Lanes::from_array(expected)),
        "{what}: {lanes:?}, not {expected:?}"
    );
}

/// All of [`Real`], against `f32`.
fn check_lanes<L: Real<Element = f32>>(a: [f32; 8], b: [f32; 8]) {
    let (x, y) = (L::load(&a), L::load(&b));
    assert_eq!(L::LANES, 8);
    expect_lanes("+", x + y, |i| a[i] + b[i]);
    expect_lanes("-", x - y, |i| a[i] - b[i]);
    expect_lanes("*", x * y, |i| a[i] * b[i]);
    expect_lanes("/", x / y, |i| a[i] / b[i]);
    expect_lanes("%", x % y, |i| a[i] % b[i]);
    expect_lanes("neg", -x, |i| -a[i]);
    expect_lanes("min", x.min(y), |i| Real::min(a[i], b[i]));
    expect_lanes("max", x.max(y), |i| Real::max(a[i], b[i]));
    expect_lanes("clamp", x.clamp(y, x), |i| Real::clamp(a[i], b[i], a[i]));
    expect_lanes("clamp", x.clamp(x, y), |i| Real::clamp(a[i], a[i], b[i]));
    expect_lanes("mul_add", x.mul_add(y, x), |i| a[i] * b[i] + a[i]);
    expect_lanes("mul_detached", x.mul_detached(y), |i| a[i] * b[i]);
    expect_lanes("sin_cos", x.sin_cos().0, |i| a[i].sin());
    expect_lanes("sin_cos", x.sin_cos().1, |i| a[i].cos());
    macro_rules! assigning {
        ($($operator:tt $with:tt),*) => {
            $({
                let mut result = x;
                result $operator y;
                expect_lanes(stringify!($operator), result, |i| a[i] $with b[i]);
            })*
        };
    }
    assigning!(+= +, -= -, *= *, /= /, %= %);
    expect_lanes("scale", x.scale(0.1), |i| a[i] * 0.1);
    expect_lanes("atan2", x.atan2(y), |i| a[i].atan2(b[i]));
    expect_lanes("powf", x.powf(1.5), |i| a[i].powf(1.5));
    expect_lanes("detach", x.detach(), |i| a[i]);
    for exponent in [-3, -1, 0, 1, 2, 7] {
        expect_lanes("powi", x.powi(exponent), |i| a[i].powi(exponent));
    }
    macro_rules! unary {
        ($($function:ident),*) => {
            $(expect_lanes(stringify!($function), x.$function(), |i| Real::$function(a[i]));)*
        };
    }
    unary!(
        square, floor, recip, sqrt, abs, exp, ln, sin, cos, tan, asin, acos, atan, tanh
    );
    let mut indices = [0; 8];
    x.store_indices(&mut indices);
    assert_eq!(indices, a.map(|x| (x as u32).min(1 << 31)));
    for i in 0..8 {
        assert_eq!(x.lane(i).to_bits(), f64::from(a[i]).to_bits());
    }

    let (less, at_most) = (x.lt(y), x.le(y));
    let signed = L::zero().le(x);
    expect_lanes("select", L::select(less, x, y), |i| {
        if a[i] < b[i] { a[i] } else { b[i] }
    });
    for i in 0..8 {
        let (lt, le, at_least_0) = (a[i] < b[i], a[i] <= b[i], a[i] >= 0.0);
        assert_eq!(less.lane(i), lt);
        assert_eq!(at_most.lane(i), le);
        assert_eq!(x.gt(y).lane(i), a[i] > b[i]);
        assert_eq!(x.ge(y).lane(i), a[i] >= b[i]);
        assert_eq!((less & signed).lane(i), lt && at_least_0);
        assert_eq!((less | signed).lane(i), lt || at_least_0);
        assert_eq!((!less).lane(i), !lt);
    }
    assert_eq!(less.any(), (0..8).any(|i| a[i] < b[i]));
    assert_eq!(less.all(), (0..8).all(|i| a[i] < b[i]));
    assert!(L::Mask::splat(true).all() && !L::Mask::splat(false).any());
}

#[test]
fn special_values() {
    for shift in 0..8 {
        let (a, mut b) = (SPECIAL, ODD);
        b.rotate_left(shift);
        for_all_lanes!(check(a: [f32; 8], b: [f32; 8]) {
            check_lanes::<L>(a, b);
            check_lanes::<L>(b, a);
        });
    }
}

/// What [`Real`] says of NaN and signed zeros.
#[test]
fn documented_special_cases() {
    for_all_lanes!(check() {
        let all = |value: f32| L::constant(f64::from(value));
        let expect = |what, lanes: L, value: f32| expect_lanes(what, lanes, |_| value);
        let (nan, one, zero) = (all(f32::NAN), L::one(), L::zero());
        for mask in [nan.lt(one), nan.le(nan), nan.gt(one), nan.ge(one), one.le(nan)] {
            assert!(!mask.any());
        }
        expect("select", L::select(nan.lt(one), one, zero), 0.0);
        expect("min", one.min(nan), f32::NAN);
        expect("min", nan.min(one), 1.0);
        expect("max", nan.max(one), 1.0);
        expect("clamp", nan.clamp(zero, one), 0.0);
        expect("min", (-zero).min(zero), -0.0);
        expect("max", (-zero).max(zero), -0.0);
        expect("max", zero.max(-zero), 0.0);
        expect("neg", -zero, -0.0);
        expect("abs", (-zero).abs(), 0.0);
        let minus_zero = -zero;
        for (what, kept) in [
            ("floor", minus_zero.floor()),
            ("sqrt", minus_zero.sqrt()),
            ("sin", minus_zero.sin()),
            ("tan", minus_zero.tan()),
            ("asin", minus_zero.asin()),
            ("atan", minus_zero.atan()),
            ("tanh", minus_zero.tanh()),
        ] {
            expect(what, kept, -0.0);
        }
        expect("recip", minus_zero.recip(), f32::NEG_INFINITY);
        expect("sqrt", (-one).sqrt(), f32::NAN);
        expect("ln", (-one).ln(), f32::NAN);
        let tiny = f32::MIN_POSITIVE / 4.0;
        expect("denormal", all(tiny) * all(0.5), tiny / 2.0);
    });
}

#[test]
fn floor_up_to_the_largest_integers() {
    let a = [
        -0.5,
        0.5,
        -8_388_607.5,
        8_388_607.5,
        -8_388_609.0,
        8_388_609.0,
        -1e-30,
        2_147_483_700.0,
    ];
    for_all_lanes!(check(a: [f32; 8]) {
        check_lanes::<L>(a, a);
    });
}

#[test]
fn gather_and_constants() {
    for_all_lanes!(check() {
        let values: Vec<f32> = (0..100).map(|i| i as f32).collect();
        let indices: [u32; 8] = [3, 99, 0, 0, 50, 7, 7, 12];
        expect_lanes("gather", L::gather(&values, &indices), |i| indices[i] as f32);
        expect_lanes("from_lanes", L::from_lanes(|lane| lane as f64), |i| i as f32);
        expect_lanes("constant", L::constant(0.1), |_| 0.1);
        expect_lanes("from_u64", L::from_u64(7).unwrap(), |_| 7.0);
        expect_lanes("from_i64", L::from_i64(-7).unwrap(), |_| -7.0);
        expect_lanes("from_f64", L::from_f64(0.1).unwrap(), |_| 0.1);
        expect_lanes("one", L::one(), |_| 1.0);
        assert!(L::zero().is_zero() && !L::from_lanes(|lane| lane as f64).is_zero());
    });
}

#[test]
fn gather_outside_panics() {
    for_all_lanes!(check() {
        for (values, place) in [(vec![1.0; 100], 100), (vec![1.0; 100], u32::MAX), (vec![], 0)] {
            for lane in 0..8 {
                let mut indices = [0; 8];
                indices[lane] = place;
                let gathered = std::panic::catch_unwind(|| bits(L::gather(&values, &indices)));
                assert!(gathered.is_err(), "place {place} of {}", values.len());
            }
        }
    });
}

/// A formula with most of what a kernel does, over a dual.
#[inline(always)]
fn formula<T: Real>(x: T, y: T) -> T {
    let radius = (x.square() + y.square()).sqrt();
    T::select(radius.lt(T::one()), x.abs() / radius, (x * y).min(radius)) + y.sin().scale(0.3)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn lanes_are_eight_scalars(a: [f32; 8], b in prop::array::uniform8(-3.0_f32..3.0)) {
        for_all_lanes!(check(a: [f32; 8], b: [f32; 8]) {
            check_lanes::<L>(a, b);
            check_lanes::<L>(b, a);
        });
    }

    #[test]
    fn duals_over_lanes_are_eight_duals(
        a in prop::array::uniform8(-1.5_f32..1.5),
        b in prop::array::uniform8(-1.5_f32..1.5),
    ) {
        for_all_lanes!(check(a: [f32; 8], b: [f32; 8]) {
            let [x, y] = Dual::variables([L::load(&a), L::load(&b)]);
            let z = formula(x, y);
            let scalar = |i: usize| {
                let [x, y] = Dual::variables([a[i], b[i]]);
                formula(x, y)
            };
            expect_lanes("value", z.value, |i| scalar(i).value);
            expect_lanes("d/dx", z.derivative[0], |i| scalar(i).derivative[0]);
            expect_lanes("d/dy", z.derivative[1], |i| scalar(i).derivative[1]);
        });
    }
}
