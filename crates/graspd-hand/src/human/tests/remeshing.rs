//! Even triangles of wanted sizes on a smooth closed surface, by splitting, collapsing and flipping edges.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use graspd_geom::TriangleMesh;

/// Edges longer than this many wanted lengths are split, and shorter than that many are collapsed: what is left by
/// either is no case for the other.
const SPLIT_ABOVE: f64 = 4.0 / 3.0;
const COLLAPSE_BELOW: f64 = 4.0 / 5.0;
/// A collapse or flip may turn no face by more than this (cosine).
const MAX_TURN_COSINE: f64 = 0.3;
/// Passes of collapses in one round.
const MAX_PASSES: usize = 12;
/// Part of the way that a vertex moves to the middle of its neighbours in each round.
const RELAXATION: f64 = 0.7;

/// A smooth surface on which a mesh is laid anew, and how fine the mesh is to be where.
pub(super) trait RemeshTarget {
    /// The point of the surface near `p`.
    fn project(&self, p: &Point3<f64>) -> Point3<f64>;
    /// The wanted length of edges \[m\] around a point of the surface with unit `normal`.
    fn edge_length(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64;
}

/// Lays triangles anew over a closed manifold mesh near a smooth surface: edges of about the wanted length, angles
/// near 60 degrees, vertices on the surface.
///
/// Each of `rounds` splits edges that are too long, collapses those too short, flips those whose opposite angles
/// sum to over 180 degrees, and moves vertices to the middle of their neighbours and back onto the surface. Then, if
/// `vertices` is given, edges are split or collapsed one at a time until there are as many vertices (for a closed
/// surface of Euler number 2; fewer may be left where no edge can be collapsed). The
/// topology stays that of `mesh`, which must be a closed, oriented manifold; the same input gives the same output.
///
/// # Source
/// Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", Symposium on Geometry Processing 2004.
pub(super) fn remesh(
    mesh: &TriangleMesh,
    target: &impl RemeshTarget,
    rounds: usize,
    vertices: Option<usize>,
) -> TriangleMesh {
    let mut work = Remesher::new(mesh, target);
    for _ in 0..rounds {
        work.measure();
        work.split(usize::MAX);
        // Neighbours of a collapsed edge wait for the next pass; where edges are far too short, many passes follow.
        for _ in 0..MAX_PASSES {
            work.measure();
            let before = work.vertex_count();
            if work.collapse(usize::MAX, COLLAPSE_BELOW) * 20 < before {
                break;
            }
            work.flip();
        }
        work.flip();
        work.relax();
    }
    if let Some(wanted) = vertices {
        work.reach(wanted, rounds);
    }
    work.compacted()
}

/// A face as its corners; removed faces have none.
type Corners = Option<[u32; 3]>;

struct Remesher<'a, S> {
    target: &'a S,
    points: Vec<Point3<f64>>,
    faces: Vec<Corners>,
    /// The faces at each vertex; empty for removed vertices.
    around: Vec<Vec<u32>>,
    /// Wanted edge length at each vertex.
    wanted: Vec<f64>,
}

impl<'a, S: RemeshTarget> Remesher<'a, S> {
    fn new(mesh: &TriangleMesh, target: &'a S) -> Self {
        let mut around = vec![Vec::new(); mesh.vertices.len()];
        for (face, corners) in mesh.faces.iter().enumerate() {
            corners
                .iter()
                .for_each(|&v| around[v as usize].push(face as u32));
        }
        Self {
            target,
            points: mesh.vertices.clone(),
            faces: mesh.faces.iter().copied().map(Some).collect(),
            around,
            wanted: Vec::new(),
        }
    }
    fn vertex_count(&self) -> usize {
        self.around.iter().filter(|faces| !faces.is_empty()).count()
    }
    fn area_vector(&self, [a, b, c]: [u32; 3]) -> Vector3<f64> {
        let [a, b, c] = [a, b, c].map(|v| self.points[v as usize]);
        (b - a).cross(&(c - a))
    }
    fn normal(&self, vertex: usize) -> Vector3<f64> {
        let faces = self.around[vertex].iter();
        let sum: Vector3<f64> = faces
            .filter_map(|&face| self.faces[face as usize])
            .map(|corners| self.area_vector(corners))
            .sum();
        sum.try_normalize(0.0).unwrap_or_else(Vector3::x)
    }
    fn measure(&mut self) {
        self.wanted = (0..self.points.len())
            .map(|v| self.target.edge_length(&self.points[v], &self.normal(v)))
            .collect();
    }
    /// Length of an edge in wanted lengths.
    fn relative_length(&self, [a, b]: [u32; 2]) -> f64 {
        let (a, b) = (a as usize, b as usize);
        (self.points[a] - self.points[b]).norm() / (0.5 * (self.wanted[a] + self.wanted[b]))
    }
    /// Every edge once, with its relative length, in the order of its vertices.
    fn edges(&self) -> Vec<([u32; 2], f64)> {
        (self.faces.iter().flatten())
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .filter(|[a, b]| a < b)
            .map(|edge| (edge, self.relative_length(edge)))
            .collect()
    }
    /// The two faces at an edge, each with the corner opposite to it: first the one that runs from `a` to `b`.
    fn wings(&self, [a, b]: [u32; 2]) -> Option<[(u32, u32); 2]> {
        let mut wings = [None; 2];
        for &face in &self.around[a as usize] {
            let corners = self.faces[face as usize]?;
            let at = corners.iter().position(|&v| v == a)?;
            let (next, last) = (corners[(at + 1) % 3], corners[(at + 2) % 3]);
            if next == b {
                wings[0] = Some((face, last));
            } else if last == b {
                wings[1] = Some((face, next));
            }
        }
        Some([wings[0]?, wings[1]?])
    }
    fn neighbours(&self, vertex: u32) -> Vec<u32> {
        let mut found: Vec<u32> = (self.around[vertex as usize].iter())
            .filter_map(|&face| self.faces[face as usize])
            .flatten()
            .filter(|&v| v != vertex)
            .collect();
        found.sort_unstable();
        found.dedup();
        found
    }
    fn replace_face(&mut self, face: u32, corners: [u32; 3]) {
        if let Some(old) = self.faces[face as usize] {
            for v in old {
                self.around[v as usize].retain(|&one| one != face);
            }
        }
        self.faces[face as usize] = Some(corners);
        corners
            .iter()
            .for_each(|&v| self.around[v as usize].push(face));
    }

    /// Splits the longest edges, at most `most`, that are too long; any edge if `most` is a number.
    fn split(&mut self, most: usize) -> usize {
        let mut long = self.edges();
        long.retain(|edge| edge.1 > SPLIT_ABOVE || most < usize::MAX);
        long.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut touched = vec![false; self.faces.len()];
        let mut count = 0;
        for (edge, _) in long {
            let Some([(left, c), (right, d)]) = self.wings(edge) else {
                continue;
            };
            if count == most || touched[left as usize] || touched[right as usize] {
                continue;
            }
            let [a, b] = edge;
            let middle = nalgebra::center(&self.points[a as usize], &self.points[b as usize]);
            let new = self.points.len() as u32;
            self.points.push(self.target.project(&middle));
            self.around.push(Vec::new());
            self.wanted
                .push(0.5 * (self.wanted[a as usize] + self.wanted[b as usize]));
            self.replace_face(left, [a, new, c]);
            self.replace_face(right, [a, d, new]);
            for corners in [[new, b, c], [new, d, b]] {
                self.faces.push(None);
                touched.push(true);
                self.replace_face(self.faces.len() as u32 - 1, corners);
            }
            touched[left as usize] = true;
            touched[right as usize] = true;
            count += 1;
        }
        count
    }

    /// Collapses the shortest edges, at most `most`, that are shorter than `below` wanted lengths.
    fn collapse(&mut self, most: usize, below: f64) -> usize {
        let mut short = self.edges();
        short.retain(|edge| edge.1 < below);
        short.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut touched = vec![false; self.points.len()];
        let mut count = 0;
        for (edge, _) in short {
            let [a, b] = edge;
            if count == most || touched[a as usize] || touched[b as usize] {
                continue;
            }
            if let Some(point) = self.collapsible(edge, most == usize::MAX) {
                for v in self.neighbours(a).into_iter().chain(self.neighbours(b)) {
                    touched[v as usize] = true;
                }
                self.points[a as usize] = point;
                self.merge(edge);
                count += 1;
            }
        }
        count
    }
    /// Where the common vertex of the two ends goes, if they may become one.
    fn collapsible(&self, [a, b]: [u32; 2], keeps_lengths: bool) -> Option<Point3<f64>> {
        let [(left, c), (right, d)] = self.wings([a, b])?;
        let (near_a, near_b) = (self.neighbours(a), self.neighbours(b));
        let common = near_a.iter().filter(|v| near_b.contains(v)).count();
        // Otherwise the surface would pinch itself, or a vertex of three faces be left with two.
        let is_thin = |v: u32| self.around[v as usize].len() <= 3;
        if common != 2 || is_thin(c) || is_thin(d) {
            return None;
        }
        let middle = nalgebra::center(&self.points[a as usize], &self.points[b as usize]);
        let point = self.target.project(&middle);
        for &face in (self.around[a as usize].iter()).chain(&self.around[b as usize]) {
            if face == left || face == right {
                continue;
            }
            let corners = self.faces[face as usize]?;
            let old = self.area_vector(corners);
            let [p, q, r] = corners.map(|v| match v == a || v == b {
                true => point,
                false => self.points[v as usize],
            });
            let new = (q - p).cross(&(r - p));
            if old.dot(&new) < MAX_TURN_COSINE * old.norm() * new.norm() {
                return None;
            }
        }
        let is_long = |&v: &u32| {
            let wanted = 0.5 * (self.wanted[a as usize] + self.wanted[v as usize]);
            (self.points[v as usize] - point).norm() > SPLIT_ABOVE * wanted
        };
        if keeps_lengths && near_a.iter().chain(&near_b).any(is_long) {
            return None;
        }
        Some(point)
    }
    /// Turns vertex `b` into vertex `a`.
    fn merge(&mut self, [a, b]: [u32; 2]) {
        for face in std::mem::take(&mut self.around[b as usize]) {
            let Some(corners) = self.faces[face as usize] else {
                continue;
            };
            if corners.contains(&a) {
                self.faces[face as usize] = None;
                for v in corners {
                    self.around[v as usize].retain(|&one| one != face);
                }
            } else {
                self.faces[face as usize] = Some(corners.map(|v| if v == b { a } else { v }));
                self.around[a as usize].push(face);
            }
        }
    }

    /// Flips edges whose opposite angles sum to over 180 degrees, where no face turns far.
    fn flip(&mut self) {
        for (edge, _) in self.edges() {
            let [a, b] = edge;
            let Some([(left, c), (right, d)]) = self.wings(edge) else {
                continue;
            };
            let at = |v: u32| self.points[v as usize];
            // Cosine and sine of the angles opposite to the edge, both times the same length.
            let opposite = |apex: u32| {
                let (to_a, to_b) = (at(a) - at(apex), at(b) - at(apex));
                (to_a.dot(&to_b), to_a.cross(&to_b).norm())
            };
            let ((cosine_c, sine_c), (cosine_d, sine_d)) = (opposite(c), opposite(d));
            // The sine of their sum is negative beyond 180 degrees.
            let is_bad = sine_c * cosine_d + cosine_c * sine_d < 0.0;
            let is_thin = |v: u32| self.around[v as usize].len() <= 3;
            if !is_bad || is_thin(a) || is_thin(b) {
                continue;
            }
            if self.neighbours(c).contains(&d) {
                continue;
            }
            let old = self.area_vector([a, b, c]) + self.area_vector([b, a, d]);
            let (first, second) = ([a, d, c], [d, b, c]);
            let keeps_side = [first, second].into_iter().all(|corners| {
                let new = self.area_vector(corners);
                new.dot(&old) > MAX_TURN_COSINE * new.norm() * old.norm()
            });
            if keeps_side {
                self.replace_face(left, first);
                self.replace_face(right, second);
            }
        }
    }

    /// Moves vertices towards the middle of their neighbours, along the surface.
    fn relax(&mut self) {
        self.measure();
        for vertex in 0..self.points.len() as u32 {
            if self.around[vertex as usize].is_empty() {
                continue;
            }
            // Neighbours that want longer edges pull harder, so that sizes keep to what is wanted.
            let mut sum = Vector3::zeros();
            let mut weight = 0.0;
            let here = self.points[vertex as usize];
            for v in self.neighbours(vertex) {
                let pull = 1.0 / (self.wanted[v as usize] * self.wanted[v as usize]);
                sum += (self.points[v as usize] - here) * pull;
                weight += pull;
            }
            let normal = self.normal(vertex as usize);
            let step = sum / weight;
            let along = step - normal * normal.dot(&step);
            self.points[vertex as usize] = self.target.project(&(here + along * RELAXATION));
        }
    }

    /// Splits or collapses a few edges at a time until there are `wanted` vertices.
    fn reach(&mut self, wanted: usize, rounds: usize) {
        const MAX_AT_ONCE: usize = 16;
        let mut last = [0; 2];
        loop {
            let count = self.vertex_count();
            self.measure();
            let changed = if count > wanted {
                self.collapse(MAX_AT_ONCE.min(count - wanted), f64::INFINITY)
            } else if count < wanted {
                self.split(MAX_AT_ONCE.min(wanted - count))
            } else {
                break;
            };
            self.flip();
            self.relax();
            if changed == 0 || last[0] == count {
                break;
            }
            last = [last[1], count];
        }
        for _ in 0..rounds {
            self.flip();
            self.relax();
        }
    }

    fn compacted(&self) -> TriangleMesh {
        let mut index = BTreeMap::new();
        let mut mesh = TriangleMesh::default();
        for vertex in 0..self.points.len() {
            if !self.around[vertex].is_empty() {
                index.insert(vertex as u32, mesh.vertices.len() as u32);
                mesh.vertices.push(self.points[vertex]);
            }
        }
        let faces = self.faces.iter().flatten();
        mesh.faces = faces.map(|corners| corners.map(|v| index[&v])).collect();
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_geom::{require_closed, topology};
    use graspd_mesh::{NodeGrid, isosurface};

    /// A torus around the z axis, with edges half as long where x is positive.
    struct Torus;

    const RADII: [f64; 2] = [3.0, 1.0];
    const EDGE: f64 = 0.5;

    impl RemeshTarget for Torus {
        fn project(&self, p: &Point3<f64>) -> Point3<f64> {
            let ring = Vector3::new(p.x, p.y, 0.0).normalize() * RADII[0];
            Point3::from(ring + (p.coords - ring).normalize() * RADII[1])
        }
        fn edge_length(&self, p: &Point3<f64>, _: &Vector3<f64>) -> f64 {
            if p.x > 0.0 { 0.5 * EDGE } else { EDGE }
        }
    }

    fn rough_torus() -> TriangleMesh {
        let grid = NodeGrid::covering(
            Point3::new(-4.1, -4.1, -1.1),
            Point3::new(4.1, 4.1, 1.1),
            0.3,
        );
        isosurface(&grid, RADII[1], |at| {
            let p = grid.node(at);
            (p.x.hypot(p.y) - RADII[0]).hypot(p.z)
        })
        .unwrap()
    }

    fn edge_lengths(mesh: &TriangleMesh, side: f64) -> Vec<f64> {
        let corners = (0..mesh.faces.len()).map(|face| mesh.corners(face));
        corners
            .filter(|corners| corners.iter().all(|p| p.x * side > 0.5))
            .flat_map(|[a, b, c]| [(b - a).norm(), (c - b).norm(), (a - c).norm()])
            .collect()
    }

    #[test]
    fn triangles_become_even_and_of_the_wanted_size() {
        let mesh = remesh(&rough_torus(), &Torus, 8, None);
        require_closed(&mesh, "torus").unwrap();
        let topology = topology(&mesh);
        assert_eq!((topology.euler_number, topology.non_manifold_edges), (0, 0));
        for p in &mesh.vertices {
            assert!((p - Torus.project(p)).norm() < 1e-12);
        }
        for (side, wanted) in [(1.0, 0.5 * EDGE), (-1.0, EDGE)] {
            let lengths = edge_lengths(&mesh, side);
            let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
            assert!((mean / wanted - 1.0).abs() < 0.15, "{mean} {wanted}");
            assert!(lengths.iter().all(|l| (0.4..1.9).contains(&(l / wanted))));
        }
        for face in 0..mesh.faces.len() {
            let [a, b, c] = mesh.corners(face);
            for [apex, p, q] in [[a, b, c], [b, c, a], [c, a, b]] {
                assert!((p - apex).angle(&(q - apex)).to_degrees() > 12.0);
            }
        }
    }

    #[test]
    fn a_wanted_number_of_vertices_is_reached_from_both_sides() {
        for wanted in [500, 1500] {
            let mesh = remesh(&rough_torus(), &Torus, 4, Some(wanted));
            assert_eq!(mesh.vertices.len(), wanted);
            assert_eq!(mesh.faces.len(), 2 * wanted);
            require_closed(&mesh, "torus").unwrap();
        }
        assert_eq!(
            remesh(&rough_torus(), &Torus, 2, Some(600)),
            remesh(&rough_torus(), &Torus, 2, Some(600))
        );
    }
}
