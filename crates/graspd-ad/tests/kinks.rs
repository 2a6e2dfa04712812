//! The points where a formula has a kink, a pole or a corner: values and derivatives are pinned, the same in every
//! mode, and never NaN.

use std::f64::consts::{FRAC_PI_2, PI};

use graspd_ad::{
    Dual, Function, Lanes, Real, gradient, hessian, leaky_min, safe_acos, safe_divide, safe_norm,
};

/// What `f32` keeps of a number at scale 1.
const SINGLE: f64 = 1e-6;

/// Asserts value, gradient and Hessian in forward, nested, reverse and lane mode.
fn pin<const N: usize>(
    what: &str,
    function: &impl Function,
    x: [f64; N],
    value: f64,
    slopes: [f64; N],
    rows: [[f64; N]; N],
) {
    let what = format!("{what} at {x:?}");
    assert_eq!(function.call(&x), value, "{what}");
    assert_eq!(
        function.call(&Dual::variables(x)),
        Dual::new(value, slopes),
        "{what}"
    );
    assert_eq!(
        gradient(|x| function.call(x), &x),
        (value, slopes.to_vec()),
        "{what}"
    );

    let nested = function.call(&Dual::variables(Dual::variables(x)));
    assert_eq!(nested.value, Dual::new(value, slopes), "{what}");
    for i in 0..N {
        assert_eq!(
            nested.derivative[i],
            Dual::new(slopes[i], rows[i]),
            "{what}, row {i}"
        );
    }
    let expected_rows = rows.map(|row| row.to_vec()).to_vec();
    assert_eq!(
        hessian(|x| function.call(x), &x),
        (value, slopes.to_vec(), expected_rows),
        "{what}"
    );

    // One lane at the kink, the others away from it.
    let point = x.map(|x| Lanes::from_lanes(|lane| if lane == 3 { x } else { 0.6 }));
    let lanes = function.call(&Dual::<Lanes, N>::variables(point));
    let elsewhere = function.call(&Dual::<f32, N>::variables([0.6; N]));
    let close = |found: f64, expected: f64| {
        let scale = expected.abs().max(1.0);
        assert!(
            (found - expected).abs() <= SINGLE * scale,
            "{what}: {lanes:?}"
        );
    };
    close(lanes.value.lane(3), value);
    close(lanes.value.lane(5), elsewhere.value.into());
    for i in 0..N {
        close(lanes.derivative[i].lane(3), slopes[i]);
        close(lanes.derivative[i].lane(5), elsewhere.derivative[i].into());
    }
}

macro_rules! pin {
    (|$($x:ident),+| $expression:expr; $([$($at:expr),+] => $value:expr, $slopes:expr, $rows:expr;)+) => {{
        struct Kink;
        impl Function for Kink {
            fn call<T: Real>(&self, x: &[T]) -> T {
                let [$($x),+] = *x else { unreachable!("one value for each variable") };
                $expression
            }
        }
        $(pin(stringify!($expression), &Kink, [$($at),+], $value, $slopes, $rows);)+
    }};
}

#[test]
fn roots_and_absolute_values() {
    pin!(|x| x.sqrt(); [0.0] => 0.0, [0.0], [[0.0]]; [-0.0] => 0.0, [0.0], [[0.0]];);
    pin!(|x| x.abs(); [0.0] => 0.0, [0.0], [[0.0]]; [-0.0] => 0.0, [0.0], [[0.0]];
        [1e-30] => 1e-30, [1.0], [[0.0]]; [-1e-30] => 1e-30, [-1.0], [[0.0]];);
    pin!(|x| x.square().sqrt(); [0.0] => 0.0, [0.0], [[0.0]];);
}

#[test]
fn powers_of_zero() {
    pin!(|x| x.powi(0); [0.0] => 1.0, [0.0], [[0.0]]; [2.0] => 1.0, [0.0], [[0.0]];);
    pin!(|x| x.powi(1); [0.0] => 0.0, [1.0], [[0.0]];);
    pin!(|x| x.powi(2); [0.0] => 0.0, [0.0], [[2.0]];);
    pin!(|x| x.powi(3); [0.0] => 0.0, [0.0], [[0.0]];);
    pin!(|x| x.powf(0.0); [0.0] => 1.0, [0.0], [[0.0]];);
    pin!(|x| x.powf(0.5); [0.0] => 0.0, [0.0], [[0.0]];);
    pin!(|x| x.powf(1.0); [0.0] => 0.0, [1.0], [[0.0]];);
    pin!(|x| x.powf(1.5); [0.0] => 0.0, [0.0], [[0.0]];);
    pin!(|x| x.powf(2.0); [0.0] => 0.0, [0.0], [[2.0]];);
    pin!(|x| x.powf(3.0); [0.0] => 0.0, [0.0], [[0.0]];);
}

#[test]
fn inverse_trigonometric_functions_at_their_ends() {
    pin!(|x| x.asin(); [1.0] => FRAC_PI_2, [0.0], [[0.0]]; [-1.0] => -FRAC_PI_2, [0.0], [[0.0]];
        [0.0] => 0.0, [1.0], [[0.0]];);
    pin!(|x| x.acos(); [1.0] => 0.0, [0.0], [[0.0]]; [-1.0] => PI, [0.0], [[0.0]];
        [0.0] => FRAC_PI_2, [-1.0], [[0.0]];);
    pin!(|x| safe_acos(x); [1.5] => 0.0, [0.0], [[0.0]]; [-1.5] => PI, [0.0], [[0.0]];);
    pin!(|x| x.atan(); [0.0] => 0.0, [1.0], [[0.0]];);
}

#[test]
fn angles() {
    let nothing = [[0.0, 0.0], [0.0, 0.0]];
    pin!(|y, x| y.atan2(x);
        [0.0, 0.0] => 0.0, [0.0, 0.0], nothing;
        [0.0, 1.0] => 0.0, [1.0, 0.0], [[0.0, -1.0], [-1.0, 0.0]];
        [0.0, -1.0] => PI, [-1.0, 0.0], [[0.0, -1.0], [-1.0, 0.0]];
        [1.0, 0.0] => FRAC_PI_2, [0.0, -1.0], [[0.0, 1.0], [1.0, 0.0]];
        [0.0, 2.0] => 0.0, [0.5, 0.0], [[0.0, -0.25], [-0.25, 0.0]];);
    // At sizes whose squares vanish or overflow.
    for size in [1e-200, 1e200] {
        let angle = Dual::variable(0.0, 0).atan2(Dual::<f64, 1>::constant(size));
        assert_eq!(angle, Dual::new(0.0, [1.0 / size]));
    }
    pin!(|x| x.sin(); [0.0] => 0.0, [1.0], [[0.0]];);
    pin!(|x| x.cos(); [0.0] => 1.0, [0.0], [[-1.0]];);
    pin!(|x| x.tan(); [0.0] => 0.0, [1.0], [[0.0]];);
    pin!(|x| x.sin(); [PI] => PI.sin(), [-1.0], [[-PI.sin()]];);
    pin!(|x| x.cos(); [PI] => -1.0, [-PI.sin()], [[1.0]];);
}

#[test]
fn ties_and_bounds() {
    let nothing = [[0.0, 0.0], [0.0, 0.0]];
    pin!(|x, y| x.min(y); [2.0, 2.0] => 2.0, [1.0, 0.0], nothing;);
    pin!(|x, y| x.max(y); [2.0, 2.0] => 2.0, [1.0, 0.0], nothing;);
    pin!(|x, y| y.max(x); [0.0, -0.0] => 0.0, [0.0, 1.0], nothing;);
    pin!(|x| x.clamp(T::zero(), T::one());
        [0.0] => 0.0, [1.0], [[0.0]]; [1.0] => 1.0, [1.0], [[0.0]];
        [-0.5] => 0.0, [0.0], [[0.0]]; [1.5] => 1.0, [0.0], [[0.0]];);
    pin!(|x| leaky_min(x, 0.125);
        [0.0] => 0.0, [1.0], [[0.0]]; [-3.0] => -3.0, [1.0], [[0.0]]; [3.0] => 0.0, [0.125], [[0.0]];);
    pin!(|x| x.floor(); [2.0] => 2.0, [0.0], [[0.0]]; [-0.5] => -1.0, [0.0], [[0.0]];);
    pin!(|x, y| x % y; [4.0, 2.0] => 0.0, [1.0, -2.0], nothing; [-5.0, 2.0] => -1.0, [1.0, 2.0], nothing;);
}

#[test]
fn the_side_not_chosen_never_leaks() {
    pin!(|x| T::select(x.le(T::zero()), x, x.ln());
        [0.0] => 0.0, [1.0], [[0.0]]; [-2.0] => -2.0, [1.0], [[0.0]];);
    pin!(|x| T::select(x.gt(T::zero()), x.recip() * x.sqrt(), x.square());
        [0.0] => 0.0, [0.0], [[2.0]];);
    pin!(|x| T::select(x.lt(T::zero()), (x / x).powf(-0.5), T::one()) * x;
        [0.0] => 0.0, [1.0], [[0.0]];);
    pin!(|x| T::select(x.gt(-T::one()), T::zero(), x.asin().tan()) + x;
        [7.0] => 7.0, [1.0], [[0.0]];);
    pin!(|x, y| safe_divide(x, y); [2.0, 0.0] => 0.0, [0.0, 0.0], [[0.0, 0.0], [0.0, 0.0]];);
}

#[test]
fn vectors_of_length_zero() {
    let nothing = [[0.0; 3]; 3];
    pin!(|x, y, z| safe_norm([x, y, z]); [0.0, 0.0, 0.0] => 0.0, [0.0; 3], nothing;);
    // The direction of friction where nothing slides.
    pin!(|x, y, z| safe_divide(x, safe_norm([x, y, z])); [0.0, 0.0, 0.0] => 0.0, [0.0; 3], nothing;);
}

#[test]
fn saturated_functions_stay_finite() {
    pin!(|x| x.tanh(); [1000.0] => 1.0, [0.0], [[0.0]]; [-1000.0] => -1.0, [0.0], [[0.0]];);
    pin!(|x| x.exp(); [-1000.0] => 0.0, [0.0], [[0.0]]; [0.0] => 1.0, [1.0], [[1.0]];);
}
