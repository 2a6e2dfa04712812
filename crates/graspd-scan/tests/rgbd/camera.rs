//! Projection and its inverse.

use graspd_scan::PinholeCamera;
use nalgebra::{Matrix3, Point3};
use proptest::prelude::*;

/// Half a millionth of a pixel: OpenCV's values, as printed, have more digits.
const PIXEL_TOLERANCE: f64 = 5e-7;
/// Undistortion stops at 1e-11 focal lengths; depths here are below 2 m.
const POINT_TOLERANCE: f64 = 1e-9;

fn bent() -> PinholeCamera {
    PinholeCamera {
        width: 640,
        height: 480,
        focal: [600.0, 590.0],
        center: [310.0, 245.0],
        distortion: [-0.28, 0.11, 0.0013, -0.0021, -0.02],
    }
}

#[test]
fn pixels_are_those_of_opencv() {
    // cv2.projectPoints, OpenCV 4, with the same camera.
    for (p, pixel) in [
        ([0.21, -0.13, 0.6], [510.038967502572, 123.23024755994227]),
        ([-0.3, 0.25, 0.9], [119.1284209206666, 401.358668967787]),
        ([0.02, 0.31, 0.7], [326.03760817310086, 493.37304066011427]),
    ] {
        let found = bent().project(&Point3::from(p)).unwrap();
        for axis in 0..2 {
            assert!(
                (found[axis] - pixel[axis]).abs() < PIXEL_TOLERANCE,
                "{found:?} {pixel:?}"
            );
        }
    }
}

#[test]
fn what_is_behind_or_beyond_the_lens_is_not_seen() {
    assert_eq!(bent().project(&Point3::new(0.0, 0.0, -1.0)), None);
    assert_eq!(bent().project(&Point3::origin()), None);
    // A strong barrel lens: r (1 - r^2 / 2) is at most 0.544, so nothing is seen at 0.6.
    let barrel = PinholeCamera {
        distortion: [-0.5, 0.0, 0.0, 0.0, 0.0],
        ..bent()
    };
    assert_eq!(barrel.ray(310.0 + 0.6 * 600.0, 245.0), None);
    let ray = barrel.ray(310.0 + 0.5 * 600.0, 245.0).unwrap();
    // Of the two solutions of r - r^3 / 2 = 0.5 the lens shows the one nearer to its axis: (sqrt(5) - 1) / 2.
    assert!((ray.x - (5.0_f64.sqrt() - 1.0) / 2.0).abs() < 1e-9, "{ray}");
}

#[test]
fn matrices_that_no_camera_has_are_refused() {
    let k = bent().matrix();
    assert!(PinholeCamera::from_matrix(640, 480, &k).is_ok());
    let mut cases = vec![("matrix", k.transpose())];
    for (fault, (row, column), value) in [
        ("matrix", (2, 2), 2.0),
        ("focal length", (0, 0), 0.0),
        ("focal length", (1, 1), f64::NAN),
        ("focal length", (0, 0), 0.6),
        ("centre", (0, 2), 1e6),
    ] {
        let mut k: Matrix3<f64> = k;
        k[(row, column)] = value;
        cases.push((fault, k));
    }
    for (fault, k) in cases {
        let error = PinholeCamera::from_matrix(640, 480, &k)
            .unwrap_err()
            .to_string();
        assert!(error.contains(fault), "{error}");
    }
    let huge = PinholeCamera::from_matrix(640_000, 480, &k).unwrap_err();
    assert!(huge.to_string().contains("640000 x 480 pixels"), "{huge}");
}

proptest! {
    #[test]
    fn rays_are_where_points_are_projected_from(
        u in 0.0..640.0, v in 0.0..480.0, z in 0.1..2.0,
        k1 in -0.3..0.3, k2 in -0.1..0.1, p1 in -0.005..0.005, p2 in -0.005..0.005, k3 in -0.02..0.02,
    ) {
        let camera = bent().with_distortion([k1, k2, p1, p2, k3]);
        let point = camera.unproject(u, v, z);
        // Lenses this mild show something in every pixel.
        prop_assert!(point.is_some());
        let point = point.unwrap();
        prop_assert!((point.z - z).abs() < POINT_TOLERANCE);
        let [u2, v2] = camera.project(&point).unwrap();
        prop_assert!((u2 - u).abs() < PIXEL_TOLERANCE && (v2 - v).abs() < PIXEL_TOLERANCE);
    }
}
