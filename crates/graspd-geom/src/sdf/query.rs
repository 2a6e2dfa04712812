//! Distance and gradient between the nodes of a grid, for any scalar.

use graspd_ad::{Mask, Real};

use super::SdfGrid;
use crate::{Mat3, Vec3};

/// No scalar has more lanes than this.
const MAX_LANES: usize = 16;

/// The part that one axis adds to a place in memory, for each lane.
type Parts = [u32; MAX_LANES];

/// The cell around a point: the distances at its corners and where in it the point is.
struct Cell<T: Real> {
    /// Corner values, x fastest.
    corners: [T; 8],
    /// Coordinates in the cell, from 0 to 1.
    at: Vec3<T>,
    /// From the grid's box to the point; zero inside.
    outside: Vec3<T>,
    /// Whether the point is within the box's extent along each axis.
    within: [T::Mask; 3],
}

impl SdfGrid {
    /// Signed distance at `p`: the trilinear interpolant inside the grid's box, and outside it the interpolant
    /// at the nearest point of the box plus the distance to that point \[m\].
    ///
    /// Continuous everywhere. Derivatives (where `T` carries them) are those of
    /// [`SdfGrid::distance_and_gradient`].
    #[inline(always)]
    pub fn distance<T: Real>(&self, p: Vec3<T>) -> T {
        let cell = self.cell(p, None);
        let [near, far] = cell.along_x().1;
        let [low, high] = [lerp(near, cell.at.y), lerp(far, cell.at.y)];
        low + (high - low) * cell.at.z + cell.outside.norm()
    }

    /// Signed distance at `p` \[m\] and its gradient: the exact gradient of the interpolated field
    /// phi(p) = g(c(p)) + |p - c(p)|, where g is trilinear and c(p) is the nearest point of the box.
    ///
    /// Inside, the gradient is that of g, which is not of unit length in general. Outside, it is the part of
    /// g's gradient along the axes in whose extent p lies, plus the unit vector from c(p) to p. If `T` carries
    /// derivatives, so does the gradient: they are the second derivatives of phi in the cell (of a trilinear
    /// function only the mixed ones differ from 0).
    ///
    /// The gradient jumps at cell faces. There it is the one of the cell on the side of larger coordinates,
    /// except on the box's upper faces, where it is the one inside. On the box's faces the distance to the box
    /// adds 0 with derivative 0. Never NaN for a finite `p`.
    #[inline(always)]
    pub fn distance_and_gradient<T: Real>(&self, p: Vec3<T>) -> (T, Vec3<T>) {
        self.interpolate(&self.cell(p, None))
    }

    /// [`SdfGrid::distance_and_gradient`] at `p + rest`, where `rest` is what rounding to single precision has left
    /// of the coordinates.
    ///
    /// With `p` alone, a place 0.1 m from the origin is known to 4e-9 m, its cell coordinate as a difference from
    /// the grid's origin to 1e-8 m, and at 1e5 N/m that is 1e-3 N. Here the coordinate is taken from the cell's own
    /// corner, so that it is as exact as in double precision but for a relative 1e-7. `rest` must be much smaller
    /// than a cell; its own derivatives are left out, and so is `rest` outside the grid's box.
    #[inline(always)]
    pub fn distance_and_gradient_of_sum<T: Real>(&self, p: Vec3<T>, rest: Vec3<T>) -> (T, Vec3<T>) {
        self.interpolate(&self.cell(p, Some(rest)))
    }

    /// [`SdfGrid::distance_and_gradient`] at `p + rest`, but outside the grid's box with the sample nearest to c(p) in
    /// place of the interpolant: phi(p) = sample + |p - c(p)|. The gradient there is the unit vector from c(p) to p
    /// alone, which says nothing about the object's shape. Jumps where another sample becomes the nearest.
    #[inline(always)]
    pub fn distance_and_gradient_by_nearest_sample<T: Real>(
        &self,
        p: Vec3<T>,
        rest: Option<Vec3<T>>,
    ) -> (T, Vec3<T>) {
        let mut cell = self.cell(p, rest);
        let [x, y, z] = cell.within;
        let inside = x & y & z;
        let half = T::constant(0.5);
        let snap = |at: T| T::select(inside, at, (at.detach() + half).floor());
        cell.at = Vec3::new(snap(cell.at.x), snap(cell.at.y), snap(cell.at.z));
        cell.within = [inside; 3];
        self.interpolate(&cell)
    }

    #[inline(always)]
    fn interpolate<T: Real>(&self, cell: &Cell<T>) -> (T, Vec3<T>) {
        let Vec3 { x: _, y, z } = cell.at;
        // Interpolate, and differentiate, along x, then y, then z.
        let (slopes, [near, far]) = cell.along_x();
        let slope_x = [lerp(slopes[0], y), lerp(slopes[1], y)];
        let slope_y = [near[1] - near[0], far[1] - far[0]];
        let value = [near[0] + slope_y[0] * y, far[0] + slope_y[1] * y];
        let slope_z = value[1] - value[0];
        let inside = Vec3::new(
            lerp(slope_x, z) * T::constant(self.spacing.x.recip()),
            lerp(slope_y, z) * T::constant(self.spacing.y.recip()),
            slope_z * T::constant(self.spacing.z.recip()),
        );
        let zero = T::zero();
        let [x_within, y_within, z_within] = cell.within;
        let along_box = Vec3::new(
            T::select(x_within, inside.x, zero),
            T::select(y_within, inside.y, zero),
            T::select(z_within, inside.z, zero),
        );
        let distance = value[0] + slope_z * z;
        if (x_within & y_within & z_within).all() {
            return (distance, along_box);
        }
        (
            distance + cell.outside.norm(),
            along_box + cell.outside.normalize_or_zero(),
        )
    }

    /// Signed distance at `p` \[m\], its gradient, and the second derivatives \[1/m\], a symmetric matrix: what
    /// [`SdfGrid::distance_and_gradient`] gives over duals, written out for derivatives taken by hand.
    ///
    /// It is the derivative of the gradient that is returned: of that of one cell, and of the unit vector from the box
    /// outside it. Across cell faces the gradient jumps, which no second derivative shows.
    #[inline(always)]
    pub fn distance_to_second_order<T: Real>(&self, p: Vec3<T>) -> (T, Vec3<T>, Mat3<T>) {
        let cell = self.cell(p, None);
        let Vec3 { x: _, y, z } = cell.at;
        let (slopes, [near, far]) = cell.along_x();
        let slope_x = [lerp(slopes[0], y), lerp(slopes[1], y)];
        let slope_y = [near[1] - near[0], far[1] - far[0]];
        let value = [near[0] + slope_y[0] * y, far[0] + slope_y[1] * y];
        let slope_z = value[1] - value[0];
        let (by_x, by_y, by_z) = (
            T::constant(self.spacing.x.recip()),
            T::constant(self.spacing.y.recip()),
            T::constant(self.spacing.z.recip()),
        );
        let slope_xy = [slopes[0][1] - slopes[0][0], slopes[1][1] - slopes[1][0]];
        let mixed = |within: T::Mask, second: T| T::select(within, second, T::zero());
        let [x_within, y_within, z_within] = cell.within;
        let xy = mixed(x_within & y_within, lerp(slope_xy, z) * by_x * by_y);
        let xz = mixed(x_within & z_within, (slope_x[1] - slope_x[0]) * by_x * by_z);
        let yz = mixed(y_within & z_within, (slope_y[1] - slope_y[0]) * by_y * by_z);
        let zero = T::zero();
        let along_box = Vec3::new(
            T::select(x_within, lerp(slope_x, z) * by_x, zero),
            T::select(y_within, lerp(slope_y, z) * by_y, zero),
            T::select(z_within, slope_z * by_z, zero),
        );
        let distance = value[0] + slope_z * z;
        let inside = Mat3 {
            rows: [
                Vec3::new(zero, xy, xz),
                Vec3::new(xy, zero, yz),
                Vec3::new(xz, yz, zero),
            ],
        };
        if (x_within & y_within & z_within).all() {
            return (distance, along_box, inside);
        }
        // Of |p - c|: the part of I - n n^T along the axes in whose extent p does not lie, over that length.
        let outward = cell.outside.normalize_or_zero();
        let length = cell.outside.norm();
        let is_outside = length.gt(zero);
        let curvature = T::select(
            is_outside,
            T::one() / T::select(is_outside, length, T::one()),
            zero,
        );
        let mut rows = inside.rows;
        for axis in 0..3 {
            rows[axis] -= outward * (outward.get(axis) * curvature);
        }
        rows[0].x += T::select(x_within, zero, curvature);
        rows[1].y += T::select(y_within, zero, curvature);
        rows[2].z += T::select(z_within, zero, curvature);
        (distance + length, along_box + outward, Mat3 { rows })
    }

    /// Finds the cell of `p + rest`: which one is a discrete choice on real parts, lane by lane.
    #[inline(always)]
    fn cell<T: Real>(&self, p: Vec3<T>, rest: Option<Vec3<T>>) -> Cell<T> {
        const { assert!(T::LANES <= MAX_LANES) };
        let [nx, ny, nz] = self.dims();
        let (x_near, x_within) = nearest_in(p.x, self.origin.x, self.spacing.x, nx);
        let (y_near, y_within) = nearest_in(p.y, self.origin.y, self.spacing.y, ny);
        let (z_near, z_within) = nearest_in(p.z, self.origin.z, self.spacing.z, nz);
        let (mut rest_x, mut rest_y, mut rest_z) = (None, None, None);
        if let Some(rest) = rest {
            (rest_x, rest_y, rest_z) = (Some(rest.x), Some(rest.y), Some(rest.z));
        }
        let (i, x_at) = split(x_near, rest_x, self.origin.x, self.spacing.x, nx);
        let (j, y_at) = split(y_near, rest_y, self.origin.y, self.spacing.y, ny);
        let (k, z_at) = split(z_near, rest_z, self.origin.z, self.spacing.z, nz);
        let (mut x, mut y, mut z) = (
            [[0; MAX_LANES]; 2],
            [[0; MAX_LANES]; 2],
            [[0; MAX_LANES]; 2],
        );
        let map = self.tiles.map();
        for side in 0..2 {
            for lane in 0..T::LANES {
                x[side][lane] = map.x(i[lane] + side as u32);
                y[side][lane] = map.y(j[lane] + side as u32);
                z[side][lane] = map.z(k[lane] + side as u32);
            }
        }
        Cell {
            corners: [
                self.corner(&x[0], &y[0], &z[0]),
                self.corner(&x[1], &y[0], &z[0]),
                self.corner(&x[0], &y[1], &z[0]),
                self.corner(&x[1], &y[1], &z[0]),
                self.corner(&x[0], &y[0], &z[1]),
                self.corner(&x[1], &y[0], &z[1]),
                self.corner(&x[0], &y[1], &z[1]),
                self.corner(&x[1], &y[1], &z[1]),
            ],
            at: Vec3::new(x_at, y_at, z_at),
            outside: p - Vec3::new(x_near, y_near, z_near),
            within: [x_within, y_within, z_within],
        }
    }

    /// The samples at the places that are the sums of three parts.
    #[inline(always)]
    fn corner<T: Real>(&self, x: &Parts, y: &Parts, z: &Parts) -> T {
        let mut places = [0; MAX_LANES];
        for lane in 0..T::LANES {
            places[lane] = x[lane] + y[lane] + z[lane];
        }
        T::gather(self.tiles.places(), &places)
    }
}

impl<T: Real> Cell<T> {
    /// Differences along x and values interpolated along x, `[z][y]`.
    #[inline(always)]
    fn along_x(&self) -> ([[T; 2]; 2], [[T; 2]; 2]) {
        let c = &self.corners;
        let slopes = [[c[1] - c[0], c[3] - c[2]], [c[5] - c[4], c[7] - c[6]]];
        let x = self.at.x;
        let values = [
            [c[0] + slopes[0][0] * x, c[2] + slopes[0][1] * x],
            [c[4] + slopes[1][0] * x, c[6] + slopes[1][1] * x],
        ];
        (slopes, values)
    }
}

#[inline(always)]
fn lerp<T: Real>([low, high]: [T; 2], at: T) -> T {
    low + (high - low) * at
}

/// The nearest coordinate within the grid, with derivative 0 where that is an end, and whether it is `p` itself.
#[inline(always)]
fn nearest_in<T: Real>(p: T, origin: f64, spacing: f64, count: usize) -> (T, T::Mask) {
    let low = T::constant(origin);
    let high = T::constant(origin + (count - 1) as f64 * spacing);
    let within = p.ge(low) & p.le(high);
    let end = T::select(p.gt(high), high, low);
    (T::select(within, p, end), within)
}

/// The cell along one axis, per lane, and the coordinate of `x + rest` within it.
#[inline(always)]
fn split<T: Real>(
    x: T,
    rest: Option<T>,
    origin: f64,
    spacing: f64,
    count: usize,
) -> ([u32; MAX_LANES], T) {
    let per_cell = T::constant(spacing.recip());
    let steps = (x - T::constant(origin)) * per_cell;
    // The last sample ends the last cell and begins none.
    let cell = steps.detach().floor().min(T::constant((count - 2) as f64));
    let mut cells = [0; MAX_LANES];
    cell.store_indices(&mut cells);
    let at = match rest {
        None => steps - cell,
        Some(rest) => {
            let [corner, corner_rest] = corner_of(cell, origin, spacing);
            // The first difference is exact, or nearly so: both are close.
            ((x - corner) + (rest.detach() - corner_rest)) * per_cell
        }
    };
    (cells, at)
}

/// `origin + cell * spacing` as the sum of two numbers, exact to twice the scalar's digits.
#[inline(always)]
fn corner_of<T: Real>(cell: T, origin: f64, spacing: f64) -> [T; 2] {
    // Products of ten digits, the most that a cell's number has, and fourteen are exact in single precision.
    const KEPT: u64 = !((1 << (52 - 13)) - 1);
    let coarse = f64::from_bits(spacing.to_bits() & KEPT);
    let along = cell * T::constant(coarse);
    let fine = cell * T::constant(spacing - coarse);
    let start = T::constant(origin);
    let start_rest = T::constant(origin - start.lane(0));
    // Sum and its rounding error (Knuth's two-sum).
    let sum = along + start;
    let added = sum - along;
    let error = (along - (sum - added)) + (start - added);
    [sum, error + (fine + start_rest)]
}
