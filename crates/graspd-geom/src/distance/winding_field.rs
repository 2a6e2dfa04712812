//! Generalised winding numbers of any triangles, to any accuracy.

use nalgebra::Point3;
use rayon::prelude::*;

use super::cluster::{Cluster, triangle_winding};
use super::tree::TriangleTree;

/// Clusters of at most this many triangles are summed triangle by triangle.
const LEAF: u32 = 8;
/// Points that one task takes.
const TASK: usize = 256;

/// A node of the tree of clusters, stored depth first.
#[derive(Clone, Debug)]
struct ClusterNode {
    cluster: Cluster,
    /// The node after this one's subtree.
    end: u32,
    triangles: std::ops::Range<u32>,
}

/// The generalised winding number of a triangle soup: how often the surface winds about a point, counted as a solid
/// angle over 4 pi, so that holes, flipped and doubled faces change it smoothly.
///
/// For a closed, outward oriented mesh it is the integer that [`SignedDistance::winding_number`] counts: 1 inside a
/// simple solid and 0 outside. For an open one, the points where it exceeds 1/2 are a robust guess at the inside. On
/// the surface itself it jumps; there the result is anything between the two sides' values. It is harmonic
/// elsewhere.
///
/// Needs about 300 bytes for every four triangles beside the tree. Queries allocate nothing and can run on many
/// threads at once.
///
/// [`SignedDistance::winding_number`]: crate::SignedDistance::winding_number
///
/// ```
/// use graspd_geom::{TriangleTree, WindingField, box_mesh};
/// use nalgebra::{Point3, Vector3};
///
/// let mut cup = box_mesh(Vector3::repeat(1.0), 1.0);
/// // Without the two faces of one side: from the middle, one sixth of all directions is open.
/// cup.faces.truncate(10);
/// let field = WindingField::new(TriangleTree::new(&cup)?);
/// let winding = field.winding_number(&Point3::origin(), 1e-3);
/// assert!((winding - 5.0 / 6.0).abs() < 1e-3);
/// # Ok::<(), graspd_geom::GeometryError>(())
/// ```
///
/// # Source
/// Jacobson, Kavan & Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized Winding Numbers",
/// SIGGRAPH 2013; Barill, Dickson, Schmidt, Levin & Jacobson, "Fast Winding Numbers for Soups and Clouds", SIGGRAPH
/// 2018. Other than the latter's, the expansion stops by a bound of its error and not by a ratio of distances.
#[derive(Clone, Debug)]
pub struct WindingField {
    tree: TriangleTree,
    nodes: Vec<ClusterNode>,
}

impl WindingField {
    /// Prepares the triangles of a tree, open or closed, for queries.
    pub fn new(tree: TriangleTree) -> Self {
        // Where each kept node was, and the number that each old node has or that follows it.
        let mut kept = Vec::new();
        let mut number = vec![0; tree.nodes.len() + 1];
        let mut index = 0;
        while index < tree.nodes.len() {
            number[index] = kept.len() as u32;
            kept.push(index);
            let node = &tree.nodes[index];
            index = if node.count <= LEAF {
                node.end as usize
            } else {
                index + 1
            };
        }
        number[tree.nodes.len()] = kept.len() as u32;
        let nodes = kept
            .par_iter()
            .map(|&index| {
                let node = &tree.nodes[index];
                ClusterNode {
                    cluster: Cluster::new(&tree.corners[node.triangles()]),
                    end: number[node.end as usize],
                    triangles: node.first..node.first + node.count,
                }
            })
            .collect();
        Self { tree, nodes }
    }

    /// The triangles, for closest points.
    pub fn tree(&self) -> &TriangleTree {
        &self.tree
    }

    /// The winding number about `p`, off by at most `accuracy` (and by rounding, some 1e-13).
    ///
    /// Far clusters of triangles count by the first three terms of their multipole expansion, where a bound of the
    /// remainder allows it; each may take a share of the error as large as its share of the surface. With an
    /// accuracy of 0 every triangle is looked at. NaN where `p` is not finite.
    pub fn winding_number(&self, p: &Point3<f64>, accuracy: f64) -> f64 {
        let per_area = accuracy / self.nodes[0].cluster.area.max(f64::MIN_POSITIVE);
        let mut winding = 0.0;
        let mut index = 0;
        while index < self.nodes.len() {
            let node = &self.nodes[index];
            if let Some(far) = node.cluster.seen_from(p, per_area * node.cluster.area) {
                winding += far;
                index = node.end as usize;
            } else {
                if node.end as usize == index + 1 {
                    let triangles = node.triangles.start as usize..node.triangles.end as usize;
                    for corners in &self.tree.corners[triangles] {
                        winding += triangle_winding(corners, p);
                    }
                }
                index += 1;
            }
        }
        winding
    }

    /// The winding number about each point, in the same bits as [`WindingField::winding_number`], on rayon's current
    /// thread pool.
    pub fn winding_numbers(&self, points: &[Point3<f64>], accuracy: f64) -> Vec<f64> {
        points
            .par_iter()
            .with_min_len(TASK)
            .map(|p| self.winding_number(p, accuracy))
            .collect()
    }
}
