//! The surface where the implicit function has a given value, as a closed mesh.

use std::collections::HashSet;

use nalgebra::Point3;
use rayon::prelude::*;

use super::cube_cases::{EDGE_STARTS, Triangles, all_cases};
use super::octree::{Level, cells_across};
use super::runs::Runs;
use super::samples::Cube;
use super::solve::Implicit;
use graspd_geom::TriangleMesh;

/// How far from either end of a cell's edge a vertex stays, as a part of its length: no triangle loses its area.
const END_MARGIN: f64 = 1e-4;

/// Cells and their corners inside the surface, as bits.
type Crossed = ([u32; 3], u8);

/// The function on the finest level's lattice, below 0 inside.
struct Lattice<'a> {
    implicit: &'a Implicit,
    level: &'a Level,
    values: &'a [f64],
    isovalue: f64,
}

/// The boundary of the region where the function is below `isovalue`: of its parts, those that come near samples.
///
/// Cells of the finest level around the samples that the surface crosses are the start; from these it is followed
/// through cells of the same size, whose corners get their values from coarser levels, so that it closes also
/// where there are no samples. At the cube's border it is cut off.
///
/// # Errors
/// The number of cells that it passes through, when they are more than `most_cells`.
pub(super) fn surface(
    implicit: &Implicit,
    isovalue: f64,
    cube: &Cube,
    most_cells: usize,
) -> Result<TriangleMesh, usize> {
    let last = implicit.levels.len() - 1;
    let lattice = Lattice {
        implicit,
        level: &implicit.levels[last],
        values: &implicit.values[last],
        isovalue,
    };
    let mut crossed = lattice.crossed_around_samples();
    lattice.follow(&mut crossed, most_cells)?;
    crossed.par_sort_unstable_by_key(|&([x, y, z], _)| (z, y, x));
    Ok(lattice.mesh(&crossed, cube))
}

impl Lattice<'_> {
    /// The value at a node; outside the cube it is outside the surface.
    fn at(&self, [x, y, z]: [u32; 3]) -> f64 {
        let last = self.level.nodes.side() - 1;
        if [x, y, z]
            .iter()
            .any(|&x| Level::is_outside(x as usize, last))
        {
            return 0.5;
        }
        let value = match self.level.nodes.find(z as usize, y as usize, x) {
            Some(node) => self.values[node],
            None => {
                let across = cells_across(self.level.depth) as f64;
                let position = [x, y, z].map(|x| f64::from(x - 1) / across);
                self.implicit
                    .at_or_above(self.implicit.levels.len().saturating_sub(2), &position)
            }
        };
        value - self.isovalue
    }

    /// The corners of a cell that are inside, as bits.
    fn inside(&self, [x, y, z]: [u32; 3]) -> u8 {
        (0..8_u32)
            .filter(|corner| {
                self.at([x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)]) < 0.0
            })
            .fold(0, |bits, corner| bits | 1 << corner)
    }

    fn crossed_around_samples(&self) -> Vec<Crossed> {
        let cells = &self.level.cells;
        let last = self.level.nodes.side() - 1;
        let layers: Vec<Vec<Crossed>> = (0..cells.side())
            .into_par_iter()
            .map(|z| {
                let mut found = Vec::new();
                for y in 0..cells.side() {
                    for run in cells.row(z, y) {
                        let rows = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(dz, dy)| {
                            let outside =
                                Level::is_outside(z + dz, last) || Level::is_outside(y + dy, last);
                            let node = self.level.nodes.find(z + dz, y + dy, run.first);
                            node.filter(|_| !outside)
                        });
                        let column = |x: u32| {
                            rows.iter().enumerate().fold(0_u8, |bits, (k, row)| {
                                let is_inside = !Level::is_outside(x as usize, last)
                                    && row.is_some_and(|row| {
                                        self.values[row + (x - run.first) as usize] < self.isovalue
                                    });
                                bits | u8::from(is_inside) << (2 * k)
                            })
                        };
                        let mut before = column(run.first);
                        for x in run.first..run.end {
                            let after = column(x + 1);
                            let inside = before | after << 1;
                            if inside != 0 && inside != 255 {
                                found.push(([x, y as u32, z as u32], inside));
                            }
                            before = after;
                        }
                    }
                }
                found
            })
            .collect();
        layers.into_iter().flatten().collect()
    }

    /// Adds the crossed cells that hang together with those given, beyond the finest level's cells.
    fn follow(&self, crossed: &mut Vec<Crossed>, most: usize) -> Result<(), usize> {
        /// The corners of the faces towards -x, +x, -y, +y, -z, +z.
        const FACES: [u8; 6] = [0x55, 0xaa, 0x33, 0xcc, 0x0f, 0xf0];
        let mut seen = HashSet::new();
        let mut next = 0;
        while next < crossed.len() {
            let (cell, inside) = crossed[next];
            next += 1;
            for (face, corners) in FACES.into_iter().enumerate() {
                if inside & corners == 0 || inside & corners == corners {
                    continue;
                }
                // Faces towards nodes outside the cube are not crossed, so this stays within the lattice.
                let mut neighbour = cell;
                neighbour[face / 2] =
                    neighbour[face / 2].wrapping_add_signed(if face % 2 == 0 { -1 } else { 1 });
                let [x, y, z] = neighbour;
                if self.level.cells.find(z as usize, y as usize, x).is_none()
                    && seen.insert(neighbour)
                {
                    crossed.push((neighbour, self.inside(neighbour)));
                }
            }
            if crossed.len() > most {
                return Err(crossed.len());
            }
        }
        Ok(())
    }

    /// The mesh over crossed cells sorted by z, y, x.
    fn mesh(&self, crossed: &[Crossed], cube: &Cube) -> TriangleMesh {
        let cells: Vec<[u32; 3]> = crossed.iter().map(|cell| cell.0).collect();
        let numbers = Runs::from_sorted(self.level.cells.side(), &cells);
        // A cell owns the vertices on the three edges from its lowest corner: all four cells around an edge are
        // crossed.
        let owned = |inside: u8| [1, 2, 4].map(|end| (inside ^ inside >> end) & 1 == 1);
        let mut count = 0;
        let first_vertex: Vec<u32> = crossed
            .iter()
            .map(|&(_, inside)| {
                let first = count;
                count += owned(inside).iter().filter(|&&is| is).count() as u32;
                first
            })
            .collect();
        let vertices: Vec<Vec<Point3<f64>>> = crossed
            .par_chunks(4096)
            .map(|chunk| {
                let mut vertices = Vec::new();
                for &(cell, inside) in chunk {
                    for (axis, _) in owned(inside).into_iter().enumerate().filter(|one| one.1) {
                        vertices.push(cube.outward(self.crossing(cell, axis)));
                    }
                }
                vertices
            })
            .collect();
        let cases = all_cases();
        let vertex = |cell: [u32; 3], edge: u8| {
            let (axis, place) = (edge as usize / 4, edge as usize % 4);
            let start = EDGE_STARTS[axis][place] as u32;
            let [x, y, z] = [
                cell[0] + (start & 1),
                cell[1] + (start >> 1 & 1),
                cell[2] + (start >> 2),
            ];
            let owner = numbers
                .find(z as usize, y as usize, x)
                .expect("a crossed cell beside a crossed edge");
            let before = owned(crossed[owner].1)[..axis]
                .iter()
                .filter(|&&is| is)
                .count() as u32;
            first_vertex[owner] + before
        };
        let faces: Vec<Vec<[u32; 3]>> = crossed
            .par_chunks(4096)
            .map(|chunk| {
                let mut faces = Vec::new();
                for &(cell, inside) in chunk {
                    let triangles: &Triangles = &cases[inside as usize];
                    faces.extend(
                        triangles
                            .iter()
                            .map(|one| one.map(|edge| vertex(cell, edge))),
                    );
                }
                faces
            })
            .collect();
        TriangleMesh {
            vertices: vertices.concat(),
            faces: faces.concat(),
        }
    }

    /// Where the surface crosses the edge along an axis from a cell's lowest corner, in the unit cube.
    fn crossing(&self, cell: [u32; 3], axis: usize) -> [f64; 3] {
        let mut end = cell;
        end[axis] += 1;
        let (a, b) = (self.at(cell), self.at(end));
        let t = (a / (a - b)).clamp(END_MARGIN, 1.0 - END_MARGIN);
        let mut position = cell.map(|x| f64::from(x) - 1.0);
        position[axis] += t;
        position.map(|x| x / cells_across(self.level.depth) as f64)
    }
}
