//! Distance and gradient between the nodes of a grid, for any scalar.

use graspd_ad::{Mask, Real};

use super::SdfGrid;
use crate::Vec3;

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
        let cell = self.cell(p);
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
        let cell = self.cell(p);
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

    /// Finds the cell: which one is a discrete choice on real parts, lane by lane.
    #[inline(always)]
    fn cell<T: Real>(&self, p: Vec3<T>) -> Cell<T> {
        const { assert!(T::LANES <= MAX_LANES) };
        let [nx, ny, nz] = self.dims();
        let (x_near, x_within) = nearest_in(p.x, self.origin.x, self.spacing.x, nx);
        let (y_near, y_within) = nearest_in(p.y, self.origin.y, self.spacing.y, ny);
        let (z_near, z_within) = nearest_in(p.z, self.origin.z, self.spacing.z, nz);
        let (i, x_at) = split(x_near, self.origin.x, self.spacing.x, nx);
        let (j, y_at) = split(y_near, self.origin.y, self.spacing.y, ny);
        let (k, z_at) = split(z_near, self.origin.z, self.spacing.z, nz);
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

/// The cell along one axis, per lane, and the coordinate within it.
#[inline(always)]
fn split<T: Real>(x: T, origin: f64, spacing: f64, count: usize) -> ([u32; MAX_LANES], T) {
    let steps = (x - T::constant(origin)) * T::constant(spacing.recip());
    // The last sample ends the last cell and begins none.
    let cell = steps.detach().floor().min(T::constant((count - 2) as f64));
    let mut cells = [0; MAX_LANES];
    cell.store_indices(&mut cells);
    (cells, steps - cell)
}
