//! One function, three uses: its value, its gradient in reverse and forward mode, and a descent along it.
//!
//! `cargo run -p graspd-ad --example descend`

use graspd_ad::{Real, gradient, gradient_forward};

/// Rosenbrock's valley; its minimum is at (1, 1).
fn rosenbrock<T: Real>(x: T, y: T) -> T {
    (T::constant(1.0) - x).square() + T::constant(100.0) * (y - x.square()).square()
}

fn main() {
    let start = [-1.2, 1.0];
    println!("value at the start: {}", rosenbrock(start[0], start[1]));

    let (_, reverse) = gradient(|v| rosenbrock(v[0], v[1]), &start);
    let (_, forward) = gradient_forward(|[x, y]| rosenbrock(x, y), start);
    println!("gradient there: {reverse:?} in reverse, {forward:?} forward");

    // Gradient descent with backtracking, on the gradient alone.
    let mut point = start;
    for _ in 0..20_000 {
        let (value, slope) = gradient_forward(|[x, y]| rosenbrock(x, y), point);
        let mut rate = 1.0;
        let moved = loop {
            let next = [point[0] - rate * slope[0], point[1] - rate * slope[1]];
            if rosenbrock(next[0], next[1]) < value || rate < 1e-12 {
                break next;
            }
            rate *= 0.5;
        };
        point = moved;
    }
    println!("descended to {point:?}");
    assert!((point[0] - 1.0).abs() < 1e-2 && (point[1] - 1.0).abs() < 2e-2);
}
