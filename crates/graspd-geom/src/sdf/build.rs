//! Fills a grid with the exact signed distance to a mesh.

use std::sync::atomic::{AtomicUsize, Ordering};

use graspd_ad::{Kernel, Real, vectorize};
use rayon::prelude::*;

use super::band::CoarseCells;
use super::grid::{allocate, node};
use super::rows::Rows;
use super::tiles::BLOCK_SIDES;
use super::{SdfGrid, SdfSampling};
use crate::distance::{PACKET, PacketSearch, SignedDistance, Slack};
use crate::{GeometryError, Vec3};

/// Layers that are filled at a time: as many as a packet is thick.
const THICKNESS: usize = 2;

impl SdfGrid {
    /// Samples the exact signed distance `resolution`^3 times over the mesh's bounding box, grown on every side
    /// by `padding` \[m\]; the first and last samples along each axis lie on the faces of the grown box.
    ///
    /// Every value is that of [`SignedDistance::signed_distance`], rounded to single precision. Runs on rayon's
    /// current thread pool; the result does not depend on the number of threads. `progress` is called now and
    /// then, from any thread, with the share that is done.
    ///
    /// # Errors
    /// A resolution below 2 or above 1024, a padding that is negative or not finite, and a grid for which there
    /// is no memory.
    pub fn build(
        surface: &SignedDistance,
        resolution: usize,
        padding: f64,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, GeometryError> {
        Self::sample(surface, &SdfSampling::exact(resolution, padding), progress)
    }

    /// As [`SdfGrid::build`], or exact near the surface only, as `sampling` says.
    ///
    /// # Errors
    /// As [`SdfGrid::build`], and a band that is negative or not finite.
    pub fn sample(
        surface: &SignedDistance,
        sampling: &SdfSampling,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, GeometryError> {
        let SdfSampling {
            resolution,
            padding,
            band,
        } = *sampling;
        sampling.validate()?;
        let dims = [resolution; 3];
        let (low, high) = surface.bounds();
        let origin = Vec3::new(low.x - padding, low.y - padding, low.z - padding);
        let steps = (resolution - 1) as f64;
        let spacing = Vec3::new(
            (high.x - low.x + 2.0 * padding) / steps,
            (high.y - low.y + 2.0 * padding) / steps,
            (high.z - low.z + 2.0 * padding) / steps,
        );
        let far = node(origin, spacing, dims.map(|n| n - 1));
        let slack = surface.tree().slack_within(&origin.into(), &far.into());
        let slack = slack.ok_or_else(|| GeometryError::GridExtent {
            what: "the box is too large".into(),
        })?;
        let mut grid = Self {
            origin,
            spacing,
            tiles: allocate(dims)?,
        };
        let coarse = band.map(|band| CoarseCells::new(surface, &grid, band));
        let map = grid.tiles.map();
        let done = AtomicUsize::new(0);
        let thickness = BLOCK_SIDES[2];
        grid.tiles
            .places_mut()
            .par_chunks_mut(map.layer())
            .enumerate()
            .for_each(|(slab, places)| {
                let slab = slab * thickness..resolution.min((slab + 1) * thickness);
                for first in slab.clone().step_by(THICKNESS) {
                    let layers = (first, slab.end.min(first + THICKNESS));
                    let rows = Rows {
                        origin,
                        spacing,
                        nx: resolution,
                        ny: resolution,
                        layers,
                    };
                    let values = signed_rows(surface, rows, slack, coarse.as_ref());
                    for ([i, j, k], value) in rows.indices().zip(values) {
                        places[map.place([i, j, k - slab.start])] = value;
                    }
                }
                let done = done.fetch_add(slab.len(), Ordering::Relaxed) + slab.len();
                progress(done as f64 / resolution as f64);
            });
        Ok(grid)
    }
}

/// Signed distances at all nodes of one or two layers, x fastest.
fn signed_rows(
    surface: &SignedDistance,
    rows: Rows,
    slack: Slack,
    coarse: Option<&CoarseCells>,
) -> impl Iterator<Item = f32> {
    let mut distances = vectorize(Distances {
        surface,
        rows,
        slack,
        coarse,
    });
    if let Some(coarse) = coarse {
        coarse.fill_far(rows, &mut distances);
    }
    let winding = rows.winding_numbers(surface.tree().corners());
    let sign = |(distance, winding): (f32, i32)| {
        if winding > 0 && distance > 0.0 {
            -distance
        } else {
            distance
        }
    };
    distances.into_iter().zip(winding).map(sign)
}

/// Unsigned distances at all nodes of one or two layers, or at those of near cells only; 0 at the others.
struct Distances<'a> {
    surface: &'a SignedDistance,
    rows: Rows,
    slack: Slack,
    coarse: Option<&'a CoarseCells>,
}

impl Kernel for Distances<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> Vec<f32> {
        let Self {
            surface,
            rows,
            slack,
            coarse,
        } = self;
        let Rows {
            origin,
            spacing,
            nx,
            ny,
            layers,
        } = rows;
        let mut values = vec![0.0; nx * ny * (layers.1 - layers.0)];
        let last = [nx, ny, layers.1].map(|n| n - 1);
        let mut search = PacketSearch::<L>::new(surface.tree());
        for y in 0..ny.div_ceil(2) {
            for step in 0..nx.div_ceil(2) {
                // To and fro, so that each packet touches the one before.
                let x = if y % 2 == 0 {
                    step
                } else {
                    nx.div_ceil(2) - 1 - step
                };
                // Packets that stick out hold the outermost nodes twice.
                let index = |lane: usize| {
                    [
                        (2 * x + lane % 2).min(last[0]),
                        (2 * y + lane / 2 % 2).min(last[1]),
                        (layers.0 + lane / 4).min(last[2]),
                    ]
                };
                if coarse.is_some_and(|coarse| coarse.are_far(index(0), index(PACKET - 1))) {
                    continue;
                }
                let mut points = [[0.0; PACKET]; 3];
                for lane in 0..PACKET {
                    let p = node(origin, spacing, index(lane));
                    for axis in 0..3 {
                        points[axis][lane] = p.get(axis);
                    }
                }
                let distances = search.distances(&points, slack);
                for lane in 0..PACKET {
                    let [i, j, k] = index(lane);
                    values[i + nx * (j + ny * (k - layers.0))] = distances[lane] as f32;
                }
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use graspd_ad::Lanes;

    use super::*;
    use crate::sphere_mesh;

    #[test]
    fn every_processor_computes_the_same_bits() {
        let surface = SignedDistance::new(&sphere_mesh(0.05, 0.005)).unwrap();
        let kernel = || Distances {
            surface: &surface,
            rows: Rows {
                origin: Vec3::new(-0.06, -0.06, -0.01),
                spacing: Vec3::new(0.01, 0.012, 0.014),
                nx: 13,
                ny: 11,
                layers: (0, 2),
            },
            slack: surface
                .tree()
                .slack_within(&[-1.0; 3].into(), &[1.0; 3].into())
                .unwrap(),
            coarse: None,
        };
        assert_eq!(kernel().run::<Lanes>(), vectorize(kernel()));
    }
}
