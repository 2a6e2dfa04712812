//! Surfaces where a scalar field on a regular grid takes a given value, by marching tetrahedra.

use nalgebra::{Point3, Vector3};

use graspd_geom::{GeometryError, TriangleMesh};

/// Most nodes along one axis: what three coordinates of an edge can be told apart by in memory for two slices.
const MAX_NODES: usize = 4096;

/// How far from either end of a grid's edge a vertex stays, as a part of its length: no face loses its area where
/// the field takes the level exactly at a node.
const END_MARGIN: f64 = 1e-3;

/// The nodes of a box-shaped grid: node (i, j, k) lies at `origin + (i, j, k) * spacing`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeGrid {
    /// Position of node (0, 0, 0) \[m\].
    pub origin: Point3<f64>,
    /// Distance between neighbouring nodes along each axis \[m\].
    pub spacing: Vector3<f64>,
    /// Nodes along each axis.
    pub dims: [usize; 3],
}

impl NodeGrid {
    /// The grid of cubes with sides of `spacing` \[m\] that covers the box from `low` to `high`, centred on it.
    ///
    /// Where a box is so large that an axis would need more nodes than a `usize` can count, [`isosurface`] refuses
    /// the grid.
    pub fn covering(low: Point3<f64>, high: Point3<f64>, spacing: f64) -> Self {
        // A float-to-integer cast saturates, and turns NaN into 0.
        let cells: [usize; 3] =
            std::array::from_fn(|axis| ((high[axis] - low[axis]) / spacing).ceil() as usize);
        let half = Vector3::from_fn(|axis, _| 0.5 * spacing * cells[axis] as f64);
        Self {
            origin: nalgebra::center(&low, &high) - half,
            spacing: Vector3::repeat(spacing),
            dims: cells.map(|n| n.saturating_add(1)),
        }
    }
    /// Position of node (i, j, k).
    pub fn node(&self, index: [usize; 3]) -> Point3<f64> {
        self.origin
            + self
                .spacing
                .zip_map(&index.map(|i| i as f64).into(), |s, i| s * i)
    }
}

/// The boundary of the region where a scalar field is below `level`: closed, oriented towards higher values, and a
/// 2-manifold whatever the values.
///
/// Each cell of the grid is cut into six tetrahedra around its diagonal from the lowest to the highest corner, which
/// fit together across cells; in each, the field is the linear function through the four corners, and a
/// vertex lies on every edge whose ends are on different sides. Each such edge gives one vertex, so that
/// every edge of the mesh has exactly two faces and the faces at every vertex form one ring. The grid is
/// taken to be surrounded by nodes outside the region: what reaches the grid's border is cut off there.
///
/// `value` is called once for every node, i fastest, then j, then k: give a function of [`NodeGrid::node`] or look
/// values up. A value that is not a number counts as outside. Vertices stay 1/1000 of an edge away from nodes.
/// Memory is needed for two slices of the grid and the mesh. The mesh is the piecewise linear one, without smoothing:
/// expect slivers.
///
/// # Errors
/// [`GeometryError::GridResolution`] for an axis without nodes or with more than 4096;
/// [`GeometryError::GridExtent`] for an origin or spacing that is not finite, or a spacing that is not positive.
///
/// # Source
/// Doi and Koide, "An efficient method of triangulating equi-valued surfaces by using tetrahedral cells", IEICE
/// Transactions E74 (1991); the cut of a cube into six tetrahedra is Freudenthal's (Annals of Mathematics 43, 1942).
pub fn isosurface(
    grid: &NodeGrid,
    level: f64,
    mut value: impl FnMut([usize; 3]) -> f64,
) -> Result<TriangleMesh, GeometryError> {
    check(grid)?;
    // A border of one node on each side, which is outside.
    let [nx, ny, nz] = grid.dims.map(|n| n + 2);
    let mut slices = [Slice::new(nx, ny), Slice::new(nx, ny)];
    let mut surface = Surface {
        grid,
        level,
        mesh: TriangleMesh::default(),
    };
    for k in 1..nz {
        slices.swap(0, 1);
        slices[1].vertices.fill([NONE; 8]);
        if k + 1 < nz {
            for j in 1..ny - 1 {
                for i in 1..nx - 1 {
                    let value = value([i - 1, j - 1, k - 1]);
                    slices[1].values[i + nx * j] =
                        if value.is_nan() { f64::INFINITY } else { value };
                }
            }
        } else {
            slices[1].values.fill(f64::INFINITY);
        }
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                surface.march(&mut slices, [i, j, k - 1]);
            }
        }
    }
    Ok(surface.mesh)
}

fn check(grid: &NodeGrid) -> Result<(), GeometryError> {
    if !grid.dims.iter().all(|n| (1..=MAX_NODES).contains(n)) {
        return Err(GeometryError::GridResolution {
            dims: grid.dims,
            max: MAX_NODES,
        });
    }
    let extent = |what: &str| GeometryError::GridExtent { what: what.into() };
    if !grid.origin.iter().all(|x| x.is_finite()) {
        return Err(extent("the origin is not finite"));
    }
    if !grid.spacing.iter().all(|&s| s > 0.0 && s.is_finite()) {
        return Err(extent("the spacing is not positive and finite"));
    }
    Ok(())
}

/// No vertex yet.
const NONE: u32 = u32::MAX;

/// One layer of nodes, border included.
struct Slice {
    nx: usize,
    values: Vec<f64>,
    /// The mesh vertex on the edge from each node towards (node + direction), for directions with bits x, y, z.
    vertices: Vec<[u32; 8]>,
}

impl Slice {
    fn new(nx: usize, ny: usize) -> Self {
        Self {
            nx,
            values: vec![f64::INFINITY; nx * ny],
            vertices: vec![[NONE; 8]; nx * ny],
        }
    }
}

/// The tetrahedra of a cell, by corners as bits x, y, z; all have positive volume.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 1, 7, 5],
    [0, 2, 7, 3],
    [0, 4, 7, 6],
];

/// Even permutations of the corners of a tetrahedron that bring any one, or any two, to the front.
const ONE_FIRST: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
const TWO_FIRST: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [0, 2, 3, 1],
    [0, 3, 1, 2],
    [1, 2, 0, 3],
    [1, 3, 2, 0],
    [2, 3, 0, 1],
];

struct Surface<'a> {
    grid: &'a NodeGrid,
    level: f64,
    mesh: TriangleMesh,
}

impl Surface<'_> {
    /// Adds the faces in the cell whose lowest corner is the (bordered) node `cell`.
    fn march(&mut self, slices: &mut [Slice; 2], cell: [usize; 3]) {
        let nx = slices[0].nx;
        let values: [f64; 8] = std::array::from_fn(|corner| {
            let at = cell[0] + (corner & 1) + nx * (cell[1] + (corner >> 1 & 1));
            slices[corner >> 2].values[at]
        });
        let is_inside = values.map(|value| value < self.level);
        if is_inside.iter().all(|&inside| inside == is_inside[0]) {
            return;
        }
        for corners in TETRAHEDRA {
            let mut on = |a: usize, b: usize| self.vertex(slices, cell, &values, a, b);
            let inside = corners.map(|corner| is_inside[corner]);
            match inside.iter().filter(|&&inside| inside).count() {
                1 => {
                    let first = inside.iter().position(|&one| one).unwrap_or(0);
                    let [a, b, c, d] = ONE_FIRST[first].map(|one| corners[one]);
                    let face = [on(a, b), on(a, c), on(a, d)];
                    self.mesh.faces.push(face);
                }
                2 => {
                    let order = TWO_FIRST.iter().find(|o| inside[o[0]] && inside[o[1]]);
                    let [a, b, c, d] = order.unwrap_or(&TWO_FIRST[0]).map(|one| corners[one]);
                    let ring = [on(a, c), on(a, d), on(b, d), on(b, c)];
                    self.add_quadrilateral(ring);
                }
                3 => {
                    let first = inside.iter().position(|&one| !one).unwrap_or(0);
                    let [a, b, c, d] = ONE_FIRST[first].map(|one| corners[one]);
                    let face = [on(a, b), on(a, d), on(a, c)];
                    self.mesh.faces.push(face);
                }
                _ => {}
            }
        }
    }
    /// Cuts a ring of four along its shorter diagonal.
    fn add_quadrilateral(&mut self, [a, b, c, d]: [u32; 4]) {
        let at = |vertex: u32| self.mesh.vertices[vertex as usize];
        let faces = if (at(a) - at(c)).norm_squared() <= (at(b) - at(d)).norm_squared() {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        };
        self.mesh.faces.extend(faces);
    }
    /// The vertex on the edge between two corners of a cell, of which one is inside.
    fn vertex(
        &mut self,
        slices: &mut [Slice; 2],
        cell: [usize; 3],
        values: &[f64; 8],
        a: usize,
        b: usize,
    ) -> u32 {
        // Along an edge of a tetrahedron no coordinate falls while another rises: one end has all bits of the other.
        let (start, direction) = (a & b, a ^ b);
        let node = [0, 1, 2].map(|axis| cell[axis] + (start >> axis & 1));
        let slice = &mut slices[start >> 2];
        let known = &mut slice.vertices[node[0] + slice.nx * node[1]][direction];
        if *known != NONE {
            return *known;
        }
        *known = self.mesh.vertices.len() as u32;
        let vertex = *known;
        let (from, to) = (values[start], values[start | direction]);
        // An infinite value outside leaves the vertex at the node inside, and the other way round.
        let part = match (from.is_finite(), to.is_finite()) {
            (true, true) => (self.level - from) / (to - from),
            (true, false) => 0.0,
            (false, true) => 1.0,
            (false, false) => 0.5,
        };
        let part = part.clamp(END_MARGIN, 1.0 - END_MARGIN);
        let steps = Vector3::from_fn(|axis, _| {
            // The border's node is number -1 of the grid.
            node[axis] as f64 - 1.0 + part * (direction >> axis & 1) as f64
        });
        self.mesh
            .vertices
            .push(self.grid.origin + self.grid.spacing.component_mul(&steps));
        vertex
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use proptest::prelude::*;

    use super::*;
    use graspd_geom::{require_closed, signed_volume, topology};

    /// Every edge has two faces that run along it in opposite directions, and the faces at every vertex form one
    /// ring.
    fn assert_manifold(mesh: &TriangleMesh) {
        let mut next = HashMap::new();
        for &[a, b, c] in &mesh.faces {
            for (at, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
                assert!(next.insert((at, from), to).is_none(), "edge used twice");
            }
        }
        let mut degree = vec![0; mesh.vertices.len()];
        mesh.faces
            .iter()
            .flatten()
            .for_each(|&v| degree[v as usize] += 1);
        for (&(at, from), &to) in &next {
            let mut around = to;
            let mut count = 1;
            while around != from {
                around = next[&(at, around)];
                count += 1;
            }
            assert_eq!(count, degree[at as usize], "several rings at a vertex");
        }
    }

    fn unit_grid(nodes: usize) -> NodeGrid {
        let half = 0.5 * (nodes - 1) as f64;
        NodeGrid {
            origin: Point3::new(-half, -half, -half),
            spacing: Vector3::repeat(1.0),
            dims: [nodes; 3],
        }
    }

    #[test]
    fn a_ball_is_one_sphere_of_its_volume() {
        let grid = NodeGrid::covering(
            Point3::new(-1.1, -1.2, -1.3),
            Point3::new(1.3, 1.2, 1.1),
            0.05,
        );
        let mesh = isosurface(&grid, 1.0, |at| grid.node(at).coords.norm()).unwrap();
        assert_manifold(&mesh);
        let topology = topology(&mesh);
        assert_eq!((topology.components, topology.euler_number), (1, 2));
        // Second order: a chord of h leaves h^2 / 8 of the radius.
        assert!(
            mesh.vertices
                .iter()
                .all(|p| (p.coords.norm() - 1.0).abs() < 2e-3)
        );
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((signed_volume(&mesh) / exact - 1.0).abs() < 5e-3);
    }

    #[test]
    fn a_torus_keeps_its_hole_and_two_balls_stay_apart() {
        let grid = unit_grid(24);
        let torus = isosurface(&grid, 3.0, |at| {
            let p = grid.node(at);
            (p.x.hypot(p.y) - 7.0).hypot(p.z)
        });
        assert_eq!(topology(&torus.unwrap()).euler_number, 0);
        let balls = isosurface(&grid, 4.0, |at| {
            let p = grid.node(at);
            (p.x.abs() - 5.5).hypot(p.y).hypot(p.z)
        });
        assert_eq!(topology(&balls.unwrap()).components, 2);
    }

    #[test]
    fn a_level_met_exactly_at_nodes_leaves_no_face_without_area() {
        let grid = unit_grid(7);
        // Integer distances: the octahedron's faces pass through nodes.
        let mesh = isosurface(&grid, 2.0, |at| grid.node(at).coords.lp_norm(1)).unwrap();
        assert_manifold(&mesh);
        assert!((0..mesh.faces.len()).all(|face| mesh.area_vector(face).norm() > 1e-8));
        assert!((signed_volume(&mesh) - 32.0 / 3.0).abs() < 0.1);
    }

    #[test]
    fn what_reaches_the_border_is_cut_off_there() {
        let grid = unit_grid(5);
        let mesh = isosurface(&grid, 0.0, |_| -1.0).unwrap();
        assert_manifold(&mesh);
        assert!((signed_volume(&mesh) - 64.0).abs() < 0.2);
        let (low, high) = mesh.bounds().unwrap();
        assert!(low.iter().all(|x| (x + 2.0).abs() < 2e-3));
        assert!(high.iter().all(|x| (x - 2.0).abs() < 2e-3));
    }

    #[test]
    fn values_that_are_no_numbers_are_outside_and_infinite_ones_count() {
        let grid = unit_grid(4);
        let mesh = isosurface(&grid, 0.0, |[i, j, k]| match (i, j, k) {
            (1, 1, 1) => f64::NEG_INFINITY,
            (2, 1, 1) => f64::NAN,
            (1, 2, 1) => -1.0,
            _ => f64::INFINITY,
        })
        .unwrap();
        assert_manifold(&mesh);
        assert!(
            mesh.vertices
                .iter()
                .all(|p| p.iter().all(|x| x.is_finite()))
        );
        assert!(require_closed(&mesh, "field").is_ok() && signed_volume(&mesh) > 0.0);
        let empty = isosurface(&grid, 0.0, |_| f64::NAN).unwrap();
        assert_eq!(empty, TriangleMesh::default());
    }

    #[test]
    fn values_are_asked_for_once_in_order() {
        let grid = NodeGrid {
            dims: [3, 4, 2],
            ..unit_grid(2)
        };
        let mut asked = Vec::new();
        isosurface(&grid, 0.0, |[i, j, k]| {
            asked.push(i + 3 * (j + 4 * k));
            1.0
        })
        .unwrap();
        assert!(asked.into_iter().eq(0..24));
    }

    #[test]
    fn bad_grids_are_refused() {
        let refused = |change: fn(&mut NodeGrid)| {
            let mut grid = unit_grid(3);
            change(&mut grid);
            isosurface(&grid, 0.0, |_| 1.0).unwrap_err().to_string()
        };
        assert!(refused(|grid| grid.dims[1] = 0).contains("[3, 0, 3]"));
        assert!(refused(|grid| grid.dims[2] = 5000).contains("4096"));
        assert!(refused(|grid| grid.origin.x = f64::NAN).contains("origin"));
        assert!(refused(|grid| grid.spacing.z = 0.0).contains("spacing"));
        let endless = NodeGrid::covering(Point3::origin(), Point3::new(1e300, 1.0, 1.0), 1e-3);
        assert!(isosurface(&endless, 0.0, |_| 1.0).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn every_field_has_a_closed_oriented_manifold(
            dims in [1usize..7, 1usize..7, 1usize..7],
            values in prop::collection::vec(prop_oneof![-1.0..1.0, Just(0.0), Just(f64::NAN), Just(-1e300)], 216),
        ) {
            let grid = NodeGrid { dims, ..unit_grid(2) };
            let mesh = isosurface(&grid, 0.0, |[i, j, k]| values[i + 6 * (j + 6 * k)]).unwrap();
            assert_manifold(&mesh);
            if !mesh.faces.is_empty() {
                prop_assert!(require_closed(&mesh, "field").is_ok());
                prop_assert!(signed_volume(&mesh) > 0.0);
            }
        }
    }
}
