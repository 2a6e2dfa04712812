//! Lower bounds of distances, in single precision: eight boxes or eight points at a time.

use graspd_ad::Real;

use super::oriented_box::OrientedBox;

/// How many boxes stand side by side.
pub(super) const BOXES: usize = 8;

/// How far a length computed in single precision may be off, relative to the lengths that went into it.
///
/// A bound is the length of a vector of three sums of four products of numbers rounded to 2^-24: less than 20
/// roundings. This is 64.
const ROUNDING: f64 = 4e-6;

/// Up to eight oriented boxes side by side.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct EightBoxes {
    /// Unit vectors along the edges, `[edge][coordinate][box]`.
    axes: [[[f32; BOXES]; 3]; 3],
    /// The centres' coordinates along them, `[edge][box]`.
    center: [[f32; BOXES]; 3],
    /// Half the edges' lengths, `[edge][box]`.
    half: [[f32; BOXES]; 3],
}

impl EightBoxes {
    /// At most eight boxes; missing ones are infinitely far from everything.
    pub(super) fn new(boxes: &[OrientedBox]) -> Self {
        let mut all = Self {
            axes: [[[0.0; BOXES]; 3]; 3],
            center: [[0.0; BOXES]; 3],
            half: [[f32::NEG_INFINITY; BOXES]; 3],
        };
        for (place, one) in boxes.iter().enumerate().take(BOXES) {
            for edge in 0..3 {
                for coordinate in 0..3 {
                    all.axes[edge][coordinate][place] = one.axes[(edge, coordinate)] as f32;
                }
                all.center[edge][place] = one.center[edge] as f32;
                all.half[edge][place] = one.half[edge] as f32;
            }
        }
        all
    }

    /// Squared distances from the point `p`, in every lane, to the boxes, one in each lane.
    #[inline(always)]
    pub(super) fn distances_squared<L: Real<Element = f32>>(&self, p: [L; 3]) -> L {
        let mut sum = L::zero();
        for edge in 0..3 {
            let [x, y, z] = &self.axes[edge];
            sum += beyond_squared(
                p,
                [L::load(x), L::load(y), L::load(z)],
                L::load(&self.center[edge]),
                L::load(&self.half[edge]),
            );
        }
        sum
    }

    /// Squared distances from the points `p`, one in each lane, to the box at `place`.
    #[inline(always)]
    pub(super) fn distances_squared_to<L: Real<Element = f32>>(
        &self,
        place: usize,
        p: [L; 3],
    ) -> L {
        let mut sum = L::zero();
        for edge in 0..3 {
            let [x, y, z] = &self.axes[edge];
            sum += beyond_squared(
                p,
                [
                    everywhere(x[place]),
                    everywhere(y[place]),
                    everywhere(z[place]),
                ],
                everywhere(self.center[edge][place]),
                everywhere(self.half[edge][place]),
            );
        }
        sum
    }
}

/// The square of how far beyond a box, along one of its edges, a point is.
#[inline(always)]
fn beyond_squared<L: Real>(p: [L; 3], axis: [L; 3], center: L, half: L) -> L {
    let along = (p[0] * axis[0] + p[1] * axis[1]) + (p[2] * axis[2] - center);
    (along.abs() - half).max(L::zero()).square()
}

#[inline(always)]
fn everywhere<L: Real>(x: f32) -> L {
    L::constant(f64::from(x))
}

/// How much wider than the best distance so far a search in single precision must look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slack {
    length: f64,
}

impl Slack {
    /// For points whose coordinates, relative to the middle of the mesh, and for a mesh whose extent, are at
    /// most `reach`.
    pub(super) fn new(reach: f64) -> Self {
        Self {
            length: ROUNDING * reach,
        }
    }

    /// The square of the distance up to which boxes must be opened, given the square of the best so far.
    #[inline(always)]
    pub(super) fn widen<T: Real>(self, best_squared: T) -> T {
        let wider = best_squared.sqrt() * T::constant(1.0 + ROUNDING) + T::constant(self.length);
        wider * wider
    }
}
