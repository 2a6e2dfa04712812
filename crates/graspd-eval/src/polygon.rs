//! Convex polygons cut by axis-aligned planes.

use nalgebra::{Point3, Vector3};

/// One side of a cut polygon; `None` where nothing with an area is on that side.
type Side = Option<Vec<Point3<f64>>>;

/// The parts of a convex polygon below and above the plane x\[axis\] = at; a polygon within the plane goes below.
pub(crate) fn clip(polygon: &[Point3<f64>], axis: usize, at: f64) -> (Side, Side) {
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        if a[axis] <= at {
            below.push(*a);
        }
        if a[axis] >= at {
            above.push(*a);
        }
        if (a[axis] < at && b[axis] > at) || (a[axis] > at && b[axis] < at) {
            let point = crossing(a, b, axis, at);
            below.push(point);
            above.push(point);
        }
    }
    let is_within_plane = polygon.iter().all(|p| p[axis] == at);
    (
        (below.len() >= 3).then_some(below),
        (above.len() >= 3 && !is_within_plane).then_some(above),
    )
}

/// Where the edge from `a` to `b` crosses the plane x\[axis\] = at; exactly on it in that coordinate.
pub(crate) fn crossing(a: &Point3<f64>, b: &Point3<f64>, axis: usize, at: f64) -> Point3<f64> {
    let fraction = (at - a[axis]) / (b[axis] - a[axis]);
    let mut point = a + (b - a) * fraction;
    point[axis] = at;
    point
}

/// The part of a convex polygon within a box, if any.
pub(crate) fn clip_to_box(
    polygon: &[Point3<f64>],
    low: &Point3<f64>,
    high: &Point3<f64>,
) -> Option<Vec<Point3<f64>>> {
    let mut rest = polygon.to_vec();
    for axis in 0..3 {
        let extent = extent(&rest, axis);
        if extent.0 < low[axis] {
            rest = clip(&rest, axis, low[axis]).1?;
        }
        if extent.1 > high[axis] {
            rest = clip(&rest, axis, high[axis]).0?;
        }
    }
    Some(rest)
}

/// Lowest and highest coordinate along `axis`.
pub(crate) fn extent(polygon: &[Point3<f64>], axis: usize) -> (f64, f64) {
    polygon
        .iter()
        .map(|p| p[axis])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        })
}

/// Area \[m^2\] and centroid of a convex polygon.
pub(crate) fn area_and_centroid(polygon: &[Point3<f64>]) -> (f64, Point3<f64>) {
    let origin = polygon[0];
    let (mut area, mut moment) = (0.0, Vector3::zeros());
    for pair in polygon[1..].windows(2) {
        let (a, b) = (pair[0] - origin, pair[1] - origin);
        let triangle = 0.5 * a.cross(&b).norm();
        area += triangle;
        moment += (a + b) * (triangle / 3.0);
    }
    if area > 0.0 {
        (area, origin + moment / area)
    } else {
        (0.0, origin)
    }
}
