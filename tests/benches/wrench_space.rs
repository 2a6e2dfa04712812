//! Epsilon and volume of the grasp wrench space for 4 to 1000 contacts, beside the full hull where that finishes.
//!
//! `cargo bench -p graspd-tests --bench wrench_space`, with `-- --quick` for a first look. Pyramids have 8 edges,
//! and the friction is 0.8. Contacts spread over a sphere are the hardest case: all directions of torque are
//! equally weak.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use graspd_eval::{
    Contact, EpsilonSettings, FRICTION_EDGES, VolumeSettings, convex_hull, ferrari_canny,
    grasp_wrenches, hull_volume,
};
use nalgebra::{Point3, Vector3};

const FRICTION: f64 = 0.8;
const COUNTS: [usize; 5] = [4, 16, 64, 128, 1000];
/// Contacts whose full hull is still a matter of a second.
const MAX_FOR_HULL: usize = 64;

/// Wrenches of contacts on an ellipsoid, along a spiral of constant pitch.
fn ellipsoid(axes: [f64; 3], count: usize) -> Vec<[f64; 6]> {
    let axes = Vector3::from(axes);
    let at = |k: usize| {
        let height = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (sine, cosine) = (0.381_966 * TAU * k as f64).sin_cos();
        let radius = (1.0 - height * height).sqrt();
        let direction = Vector3::new(radius * cosine, radius * sine, height);
        Contact {
            point: Point3::from(direction.component_mul(&axes)),
            normal: -direction.component_div(&axes).normalize(),
        }
    };
    let contacts: Vec<_> = (0..count).map(at).collect();
    grasp_wrenches(&contacts, FRICTION, FRICTION_EDGES, Point3::origin(), 1.0)
}

fn wrench_space(criterion: &mut Criterion) {
    for (shape, axes) in [("sphere", [1.0, 1.0, 1.0]), ("ellipsoid", [1.0, 0.5, 0.3])] {
        let mut group = criterion.benchmark_group(format!("wrench space, {shape}"));
        group.sample_size(10);
        for count in COUNTS {
            let wrenches = ellipsoid(axes, count);
            group.bench_function(BenchmarkId::new("epsilon, sum", count), |bencher| {
                bencher.iter(|| ferrari_canny(black_box(&wrenches), &EpsilonSettings::sum()));
            });
            let each = EpsilonSettings::each(FRICTION_EDGES);
            group.bench_function(BenchmarkId::new("epsilon, each", count), |bencher| {
                bencher.iter(|| ferrari_canny(black_box(&wrenches), &each));
            });
            group.bench_function(BenchmarkId::new("volume", count), |bencher| {
                bencher.iter(|| hull_volume(black_box(&wrenches), &VolumeSettings::default()));
            });
            if count <= MAX_FOR_HULL {
                group.bench_function(BenchmarkId::new("full hull", count), |bencher| {
                    bencher.iter(|| convex_hull(black_box(&wrenches)));
                });
            }
        }
        group.finish();
    }
}

criterion_group!(benches, wrench_space);
criterion_main!(benches);
