//! Faces and edges of a convex polyhedron, clustered so that the axis test can skip most of them.

use parry3d_f64::math::Vector;

use super::lanes::{LANES, Lanes, in_blocks};

/// Blocks of faces or edges in a cluster.
pub(super) const BLOCKS: usize = 4;
/// Polyhedra with more blocks of edges are tested only against the edges near a triangle.
const MAX_EDGE_BLOCKS: usize = 48;
/// Largest distance of a vertex of a convex surface beyond a face, by rounding \[m\].
const MAX_DENT: f64 = 1e-5;
/// Triangles whose normals make an angle with at least this cosine are one face.
const SAME_FACE: f64 = 1.0 - 1e-12;

/// A face of the polyhedron: coplanar triangles.
struct Face {
    /// Outward unit normal.
    normal: Vector,
    /// Projection of its own first corner onto the normal \[m\].
    own_height: f64,
    /// Largest projection of any vertex onto the normal \[m\].
    height: f64,
    /// Mean of its triangles' centroids.
    middle: Vector,
}

/// Faces and edges of a convex polyhedron in clusters.
#[derive(Clone, Default)]
pub(in super::super) struct FaceClusters {
    /// Outward unit normals and heights: [`BLOCKS`] for each cluster, padded with faces at infinity.
    pub(super) faces: Vec<[Lanes; 4]>,
    /// For each cluster: the componentwise bounds of its normals, a point of the polyhedron, and
    /// the least distance of the faces' planes beyond that point.
    pub(super) bounds: Vec<[Lanes; 10]>,
    /// Start point and the normals of both faces: [`BLOCKS`] for each cluster, padded with edges
    /// between faces of equal normals.
    pub(super) edges: Vec<[Lanes; 9]>,
    /// Bounding box of each edge, padded with boxes at infinity ...
    pub(super) edge_boxes: Vec<[Lanes; 6]>,
    /// ... and of each cluster of edges.
    pub(super) cluster_boxes: Vec<[Lanes; 6]>,
}

impl FaceClusters {
    /// Clusters the faces and edges of a closed convex surface; of one that is not convex, nothing
    /// is kept (a few of parry's hulls have a sliver with an arbitrary normal).
    pub(in super::super) fn new(vertices: &[Vector], triangles: &[[u32; 3]]) -> Self {
        let in_cluster = BLOCKS * LANES;
        let (faces, face_of) = find_faces(vertices, triangles);
        if faces
            .iter()
            .any(|face| face.height - face.own_height > MAX_DENT)
        {
            return Self::default();
        }
        let mut order: Vec<usize> = (0..faces.len()).collect();
        sort_into_clusters(&mut order, &|face| faces[face].normal);
        let mut rows: Vec<[f64; 4]> = (order.iter().map(|face| &faces[*face]))
            .map(|face| [face.normal.x, face.normal.y, face.normal.z, face.height])
            .collect();
        let clusters = order.len().div_ceil(in_cluster);
        let endless = [0.0, 0.0, 0.0, f64::MAX];
        rows.resize(clusters * in_cluster, endless);
        let bounds: Vec<_> = (order.chunks(in_cluster))
            .map(|members| bounds_of(members, &faces))
            .collect();
        let mut never = [0.0; 10];
        never[9] = f64::MAX;

        let edges = find_edges(vertices, triangles, &face_of);
        let mut order: Vec<usize> = (0..edges.len()).collect();
        sort_into_clusters(&mut order, &|edge| edges[edge].0[0] + edges[edge].0[1]);
        let (mut starts, mut boxes, mut cluster_boxes) = (vec![], vec![], vec![]);
        for members in order.chunks(in_cluster) {
            let mut about = [Vector::MAX, Vector::MIN];
            for edge in members {
                let ([a, b], of_edge) = edges[*edge];
                let [one, other] = of_edge.map(|face| faces[face].normal);
                starts.push(joined([a, one, other]));
                boxes.push(joined([a.min(b), a.max(b)]));
                about = [about[0].min(a).min(b), about[1].max(a).max(b)];
            }
            cluster_boxes.push(joined(about));
        }
        let clusters = order.len().div_ceil(in_cluster);
        starts.resize(clusters * in_cluster, [0.0; 9]);
        boxes.resize(clusters * in_cluster, [f64::MAX; 6]);
        Self {
            faces: in_blocks(&rows, endless),
            bounds: in_blocks(&bounds, never),
            edges: in_blocks(&starts, [0.0; 9]),
            edge_boxes: in_blocks(&boxes, [f64::MAX; 6]),
            cluster_boxes: in_blocks(&cluster_boxes, [f64::MAX; 6]),
        }
    }

    /// Returns whether the surface was not convex.
    pub(super) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Returns whether there are so few edges that all can be tested.
    pub(super) fn has_few_edges(&self) -> bool {
        self.edges.len() <= MAX_EDGE_BLOCKS
    }
}

/// Concatenates the components of vectors.
fn joined<const N: usize, const M: usize>(vectors: [Vector; N]) -> [f64; M] {
    std::array::from_fn(|k| vectors[k / 3].to_array()[k % 3])
}

/// Returns the faces of a surface, and for each triangle the index of its face; `None` for triangles without a normal.
fn find_faces(vertices: &[Vector], triangles: &[[u32; 3]]) -> (Vec<Face>, Vec<Option<usize>>) {
    let mut faces: Vec<Face> = Vec::new();
    let mut counts: Vec<f64> = Vec::new();
    let face_of = (triangles.iter())
        .map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
            let normal = (b - a).cross(c - a).try_normalize()?;
            let known = (faces.iter()).position(|face| face.normal.dot(normal) > SAME_FACE);
            let face = known.unwrap_or_else(|| {
                // The largest projection of any vertex, so that rounding leaves none beyond.
                let heights = vertices.iter().map(|vertex| vertex.dot(normal));
                faces.push(Face {
                    normal,
                    own_height: a.dot(normal),
                    height: heights.fold(f64::MIN, f64::max),
                    middle: Vector::ZERO,
                });
                counts.push(0.0);
                faces.len() - 1
            });
            faces[face].middle += (a + b + c) / 3.0;
            counts[face] += 1.0;
            Some(face)
        })
        .collect();
    for (face, count) in faces.iter_mut().zip(counts) {
        face.middle /= count;
    }
    (faces, face_of)
}

/// Returns the end points of each edge and the indices of the faces beside it.
fn find_edges(
    vertices: &[Vector],
    triangles: &[[u32; 3]],
    face_of: &[Option<usize>],
) -> Vec<([Vector; 2], [usize; 2])> {
    let mut beside: Vec<([u32; 2], usize)> = (triangles.iter().enumerate())
        .flat_map(|(face, &[a, b, c])| {
            [[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], face))
        })
        .collect();
    beside.sort_unstable();
    (beside.chunk_by(|a, b| a.0 == b.0))
        .filter_map(|pair| {
            let &[(ends, one), (_, other)] = pair else {
                return None;
            };
            let faces = [face_of[one]?, face_of[other]?];
            let ends = ends.map(|vertex| vertices[vertex as usize]);
            (faces[0] != faces[1]).then_some((ends, faces))
        })
        .collect()
}

/// Sorts so that each run of a cluster's size has similar keys, by recursive bisection along the widest axis.
fn sort_into_clusters(order: &mut [usize], key: &impl Fn(usize) -> Vector) {
    let in_cluster = BLOCKS * LANES;
    if order.len() <= in_cluster {
        return;
    }
    let keys = order.iter().map(|item| key(*item));
    let (low, high) = keys.fold((Vector::MAX, Vector::MIN), |(low, high), key| {
        (low.min(key), high.max(key))
    });
    let axis = (high - low).max_position();
    order.sort_by(|a, b| key(*a)[axis].total_cmp(&key(*b)[axis]));
    let half = order.len().div_ceil(2 * in_cluster) * in_cluster;
    let (one, other) = order.split_at_mut(half);
    sort_into_clusters(one, key);
    sort_into_clusters(other, key);
}

/// Returns the row of [`FaceClusters::bounds`] of a cluster.
fn bounds_of(members: &[usize], faces: &[Face]) -> [f64; 10] {
    let members = members.iter().map(|face| &faces[*face]);
    let place = members.clone().map(|face| face.middle).sum::<Vector>() / members.len() as f64;
    let (mut low, mut high, mut beyond) = (Vector::MAX, Vector::MIN, f64::MAX);
    for face in members {
        (low, high) = (low.min(face.normal), high.max(face.normal));
        beyond = beyond.min(face.height - face.normal.dot(place));
    }
    let [[a, b, c], [d, e, f], [g, h, i]] = [low, high, place].map(|vector| vector.to_array());
    [a, b, c, d, e, f, g, h, i, beyond]
}
