//! How the faces of a mesh hang together: holes, orientation, components, genus.

use std::collections::HashMap;

use nalgebra::Point3;

use crate::TriangleMesh;

/// A closed walk along the boundary of an open surface.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundaryLoop {
    /// Its vertices in order (in either direction), each once.
    pub vertices: Vec<u32>,
    /// Summed length of its edges \[m\].
    pub length: f64,
    /// Greatest distance between two of its vertices \[m\]; on loops of over 1000 vertices, between every k-th.
    pub diameter: f64,
}

/// How the faces of a mesh hang together, as indexed.
///
/// An edge here is a pair of different vertices that follow each other in some face, whichever way.
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    /// Edges with exactly one face.
    pub boundary_edges: usize,
    /// Edges with more than two faces.
    pub non_manifold_edges: usize,
    /// Edges with an even number of faces, of which more run one way than the other: neighbours that disagree on
    /// which side is outside.
    pub misoriented_edges: usize,
    /// Edges with an odd number of faces, as closed walks (at every vertex their number is even).
    pub boundary_loops: Vec<BoundaryLoop>,
    /// Faces that repeat an earlier one, with the same orientation: they would count twice in every integral.
    pub duplicate_faces: usize,
    /// Groups of faces connected through vertices.
    pub components: usize,
    /// V - E + F, over vertices that belong to a face. 2 for a sphere, 0 for a torus.
    pub euler_number: i64,
}

impl Topology {
    /// Whether every directed edge has as many opposite ones and no face is there twice: the surface then divides
    /// space into inside and outside, even where it touches or crosses itself.
    pub fn is_closed(&self) -> bool {
        self.boundary_loops.is_empty() && self.misoriented_edges == 0 && self.duplicate_faces == 0
    }
}

/// One use of an edge by a face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct EdgeUse {
    /// The edge's vertices, the lower number first.
    edge: [u32; 2],
    /// Whether the face runs from the lower number to the higher.
    is_upward: bool,
}

/// Examines how the faces of a mesh hang together, in O(n log n).
///
/// # Panics
/// If an index of a face is out of range.
pub fn topology(mesh: &TriangleMesh) -> Topology {
    let uses = edge_uses(mesh);
    let vertex_count;
    let mut result = Topology {
        boundary_edges: 0,
        non_manifold_edges: 0,
        misoriented_edges: 0,
        boundary_loops: Vec::new(),
        duplicate_faces: duplicates(mesh).len(),
        components: 0,
        euler_number: mesh.faces.len() as i64,
    };
    let mut odd_edges = Vec::new();
    for edge in uses.chunk_by(|a, b| a.edge == b.edge) {
        result.euler_number -= 1;
        result.boundary_edges += usize::from(edge.len() == 1);
        result.non_manifold_edges += usize::from(edge.len() > 2);
        if !edge.len().is_multiple_of(2) {
            odd_edges.push(edge[0].edge);
        } else if 2 * edge.iter().filter(|one| one.is_upward).count() != edge.len() {
            result.misoriented_edges += 1;
        }
    }
    (result.components, vertex_count) = connected_vertices(mesh);
    result.euler_number += vertex_count as i64;
    result.boundary_loops = closed_walks(&odd_edges)
        .into_iter()
        .map(|vertices| boundary_loop(vertices, &mesh.vertices))
        .collect();
    result
}

/// All uses of all edges, sorted by edge.
fn edge_uses(mesh: &TriangleMesh) -> Vec<EdgeUse> {
    let mut uses: Vec<EdgeUse> = (mesh.faces.iter())
        .flat_map(|&[a, b, c]| {
            [[a, b], [b, c], [c, a]].map(|[from, to]| EdgeUse {
                edge: [from.min(to), from.max(to)],
                is_upward: from < to,
            })
        })
        .filter(|one| one.edge[0] != one.edge[1])
        .collect();
    uses.sort_unstable();
    uses
}

/// Faces that repeat an earlier one with the same orientation, by index, ascending.
pub(crate) fn duplicates(mesh: &TriangleMesh) -> Vec<usize> {
    let mut faces: Vec<([u32; 3], usize)> = (mesh.faces.iter().enumerate())
        .map(|(index, &[a, b, c])| ([[a, b, c], [b, c, a], [c, a, b]], index))
        .map(|(rotations, index)| (rotations.into_iter().min().unwrap_or_default(), index))
        .collect();
    faces.sort_unstable();
    let mut repeated: Vec<usize> = faces
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0)
        .map(|pair| pair[1].1)
        .collect();
    repeated.sort_unstable();
    repeated
}

/// How many groups of faces there are that share no vertex, and how many vertices belong to a face.
fn connected_vertices(mesh: &TriangleMesh) -> (usize, usize) {
    let mut sets = DisjointSets::new(mesh.vertices.len());
    let mut is_used = vec![false; mesh.vertices.len()];
    for &[a, b, c] in &mesh.faces {
        sets.join(a, b);
        sets.join(b, c);
        for index in [a, b, c] {
            is_used[index as usize] = true;
        }
    }
    let used = is_used.iter().filter(|&&used| used).count();
    (sets.count() - (mesh.vertices.len() - used), used)
}

/// Splits undirected edges, of which an even number meet at every vertex, into closed walks without repeated
/// vertices.
fn closed_walks(edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    // The edges out of each vertex, as a sorted list of (vertex, neighbour, edge).
    let mut ends: Vec<(u32, u32, usize)> = (edges.iter().enumerate())
        .flat_map(|(edge, &[a, b])| [(a, b, edge), (b, a, edge)])
        .collect();
    ends.sort_unstable();
    let mut is_walked = vec![false; edges.len()];
    // For the first end of each vertex, the first end that may still be unwalked.
    let mut next_end: Vec<usize> = (0..ends.len()).collect();
    let mut position_on_path = HashMap::new();
    let mut walks = Vec::new();
    for &(start, ..) in &ends {
        let mut path = vec![start];
        position_on_path.insert(start, 0);
        while let Some(&vertex) = path.last() {
            let first = ends.partition_point(|end| end.0 < vertex);
            let next = &mut next_end[first];
            while ends
                .get(*next)
                .is_some_and(|end| end.0 == vertex && is_walked[end.2])
            {
                *next += 1;
            }
            let Some(&(_, neighbour, edge)) = ends.get(*next).filter(|end| end.0 == vertex) else {
                // Every vertex has an even number of edges, so only the start can be a dead end.
                position_on_path.remove(&vertex);
                path.pop();
                continue;
            };
            is_walked[edge] = true;
            match position_on_path.get(&neighbour) {
                Some(&position) => {
                    let walk: Vec<u32> = path[position..].to_vec();
                    for vertex in path.drain(position + 1..) {
                        position_on_path.remove(&vertex);
                    }
                    walks.push(walk);
                }
                None => {
                    position_on_path.insert(neighbour, path.len());
                    path.push(neighbour);
                }
            }
        }
    }
    walks
}

/// Measures a boundary loop given by its vertices in order.
///
/// # Panics
/// If the loop is empty or has a vertex that does not exist.
pub fn boundary_loop(loop_vertices: Vec<u32>, vertices: &[Point3<f64>]) -> BoundaryLoop {
    const MAX_COMPARED: usize = 1000;
    let points: Vec<_> = (loop_vertices.iter())
        .map(|&index| vertices[index as usize])
        .collect();
    let length = (0..points.len())
        .map(|i| (points[(i + 1) % points.len()] - points[i]).norm())
        .sum();
    let stride = points.len().div_ceil(MAX_COMPARED);
    let compared: Vec<_> = points.iter().step_by(stride).collect();
    let squared_diameter = (compared.iter().enumerate())
        .flat_map(|(i, a)| compared[..i].iter().map(move |b| (*a - *b).norm_squared()))
        .fold(0.0, f64::max);
    BoundaryLoop {
        vertices: loop_vertices,
        length,
        diameter: squared_diameter.sqrt(),
    }
}

/// Sets of vertices that grow together (union-find with path halving).
struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }
    fn root(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
    fn count(&self) -> usize {
        (self.parent.iter().enumerate())
            .filter(|&(member, &parent)| member as u32 == parent)
            .count()
    }
}
