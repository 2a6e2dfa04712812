//! Grids that are exact near the surface only, against grids that are exact everywhere.

use graspd_geom::{SdfGrid, SdfSampling, SignedDistance, TriangleMesh, box_mesh, shared_file};
use graspd_mesh::{builtin_object, load_mesh};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Both distances are rounded to single precision, the bound downwards.
const ROUNDING: f64 = 1e-6;

/// Checks a banded grid against the exact one; gives how many samples are not exact.
fn check(mesh: &TriangleMesh, resolution: usize, padding: f64, band: f64) -> usize {
    let surface = SignedDistance::new(mesh).unwrap();
    let sampling = SdfSampling {
        band: Some(band),
        ..SdfSampling::exact(resolution, padding)
    };
    let banded = SdfGrid::sample(&surface, &sampling, &|_| {}).unwrap();
    let exact = SdfGrid::build(&surface, resolution, padding, &|_| {}).unwrap();
    assert_eq!(banded.spacing(), exact.spacing());
    let spacing = Vector3::from(exact.spacing());
    let diagonal = 8.0 * spacing.norm();
    let mut inexact = 0;
    for (bound, distance) in banded.to_values().into_iter().zip(exact.to_values()) {
        if bound == distance {
            continue;
        }
        inexact += 1;
        let (bound, distance) = (f64::from(bound), f64::from(distance));
        assert!(bound * distance > 0.0, "{bound} {distance}");
        let (bound, distance) = (bound.abs(), distance.abs());
        assert!(
            distance > band * (1.0 - ROUNDING),
            "{distance} in a band of {band}"
        );
        assert!(bound > band * (1.0 - ROUNDING) && bound <= distance * (1.0 + ROUNDING));
        // d - sqrt(d^2 - d c) if that has a value: see `sdf/band.rs`.
        let least = (distance * (distance - diagonal)).max(0.0).sqrt();
        assert!(bound >= least * (1.0 - ROUNDING), "{bound} for {distance}");
    }
    inexact
}

#[test]
fn a_mug_is_exact_in_the_band_and_bounded_beyond() {
    let mug = builtin_object("mug").unwrap();
    assert!(check(&mug, 60, 0.03, 0.01) > 10_000);
    // No cell is that far, so all is exact.
    assert_eq!(check(&mug, 33, 0.01, 1.0), 0);
}

#[test]
fn a_scan_is_exact_in_the_band_and_bounded_beyond() {
    let Some(file) = shared_file("data/ycb/035_power_drill.obj") else {
        return;
    };
    assert!(check(&load_mesh(file).unwrap(), 72, 0.01, SdfSampling::USUAL_BAND) > 10_000);
}

#[test]
fn the_bound_of_a_plane_is_tight() {
    // Above the middle of a large face the distance is that to a plane.
    let slab = box_mesh(Vector3::new(1.0, 1.0, 0.01), 1.0);
    let surface = SignedDistance::new(&slab).unwrap();
    let sampling = SdfSampling {
        band: Some(0.05),
        ..SdfSampling::exact(65, 0.3)
    };
    let grid = SdfGrid::sample(&surface, &sampling, &|_| {}).unwrap();
    let middle = 32;
    let diagonal = 8.0 * Vector3::from(grid.spacing()).norm();
    for k in 0..65 {
        let distance = grid.node([middle, middle, k]).z.abs() - 0.005;
        let short = distance - f64::from(grid.value([middle, middle, k]));
        assert!(short >= -ROUNDING * distance.abs());
        if distance > 0.2 {
            assert!(
                short <= 1.5 * diagonal * diagonal / (8.0 * distance),
                "{distance}: {short}"
            );
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let surface = SignedDistance::new(&builtin_object("banana").unwrap()).unwrap();
    let sampling = SdfSampling {
        band: Some(0.01),
        ..SdfSampling::exact(40, 0.02)
    };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let build = || SdfGrid::sample(&surface, &sampling, &|_| {}).unwrap();
        pool.build().unwrap().install(build)
    };
    assert!(with(1) == with(3));
}

#[test]
fn bands_that_are_no_length_are_refused() {
    let surface = SignedDistance::new(&builtin_object("box").unwrap()).unwrap();
    for band in [-1e-3, f64::NAN, f64::INFINITY] {
        let sampling = SdfSampling {
            band: Some(band),
            ..SdfSampling::exact(8, 0.01)
        };
        let error = SdfGrid::sample(&surface, &sampling, &|_| {}).unwrap_err();
        assert!(error.to_string().contains("setting `band` is"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn boxes_of_any_shape(
        sides in prop::array::uniform3(0.01..0.2_f64),
        resolution in 2..36_usize,
        padding in 0.0..0.1_f64,
        band in 0.0..0.05_f64,
    ) {
        check(&box_mesh(Vector3::from(sides), 1.0), resolution, padding, band);
    }
}
