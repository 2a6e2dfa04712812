//! Normals of unorganised points: the plane through each one's neighbours, and which of its sides is outside.

use graspd_settings::between;
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use super::{KdTree, PointCloud};
use graspd_geom::GeometryError;

impl PointCloud {
    /// Estimates the normals from each point and its `neighbours` nearest ones (16 is usual), oriented outward: first
    /// alike between neighbours, along a minimum spanning tree that avoids sharp edges, then each connected part
    /// so that its outermost points in all directions look outward.
    ///
    /// Thin walls need points closer to each other than the wall is thick; where camera positions are known,
    /// [`PointCloud::orient_towards`] is surer. Runs on rayon's current thread pool, with the same result for any
    /// number of threads.
    ///
    /// # Errors
    /// As [`PointCloud::require_points`]; [`GeometryError::Setting`] for fewer than 3 or more than 1000 neighbours.
    ///
    /// # Source
    /// Hoppe et al., "Surface reconstruction from unorganized points", SIGGRAPH 1992, sections 3.2 and 3.3.
    pub fn estimate_normals(&mut self, neighbours: usize) -> Result<(), GeometryError> {
        self.require_points()?;
        between(3.0, 1000.0).check("neighbours", &neighbours)?;
        let tree = KdTree::new(&self.points);
        let near: Vec<Vec<u32>> = (self.points.par_iter())
            .map_init(Vec::new, |found, p| {
                // The point itself is among its nearest.
                tree.nearest(p, neighbours + 1, found);
                found.iter().map(|&(_, number)| number).collect()
            })
            .collect();
        self.normals = (near.par_iter())
            .map(|near| plane_normal(&self.points, near))
            .collect();
        self.orient_alike(&near);
        Ok(())
    }

    /// The normals, of either sign, of the planes through each point and its nearest ones.
    pub(crate) fn plane_normals(&self, tree: &KdTree, neighbours: usize) -> Vec<Vector3<f64>> {
        (self.points.par_iter())
            .map_init(Vec::new, |found, p| {
                tree.nearest(p, neighbours + 1, found);
                let near: Vec<u32> = found.iter().map(|&(_, number)| number).collect();
                plane_normal(&self.points, &near)
            })
            .collect()
    }

    /// Turns each normal towards the camera that saw its point: `cameras` are their positions, one for each point
    /// \[m\].
    ///
    /// # Errors
    /// As [`PointCloud::require_surface`]; [`GeometryError::CloudNormals`] if there is not one camera for each point.
    pub fn orient_towards(&mut self, cameras: &[Point3<f64>]) -> Result<(), GeometryError> {
        self.require_surface()?;
        if cameras.len() != self.points.len() {
            return Err(GeometryError::CloudNormals {
                fault: format!(
                    "{} camera positions were given for {} points",
                    cameras.len(),
                    self.points.len()
                ),
            });
        }
        for ((normal, p), camera) in self.normals.iter_mut().zip(&self.points).zip(cameras) {
            if normal.dot(&(camera - p)) < 0.0 {
                *normal = -*normal;
            }
        }
        Ok(())
    }

    /// Turns normals so that neighbours agree and each part looks outward.
    fn orient_alike(&mut self, near: &[Vec<u32>]) {
        let normals = &self.normals;
        let mut edges: Vec<(f64, u32, u32)> = (near.par_iter().enumerate())
            .flat_map_iter(|(from, near)| {
                let from = from as u32;
                near.iter().filter(move |&&to| to != from).map(move |&to| {
                    let cost = 1.0 - normals[from as usize].dot(&normals[to as usize]).abs();
                    (cost, from.min(to), from.max(to))
                })
            })
            .collect();
        edges.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut sides = Sides::new(normals.len());
        for (_, a, b) in edges {
            sides.join(a, b, normals[a as usize].dot(&normals[b as usize]) < 0.0);
        }
        let parts: Vec<(u32, bool)> = (0..normals.len() as u32)
            .map(|point| sides.root(point))
            .collect();
        for ((normal, _), &(_, is_turned)) in self.normals.iter_mut().zip(&self.points).zip(&parts)
        {
            if is_turned {
                *normal = -*normal;
            }
        }
        let votes = self.outward_votes(&parts);
        for (normal, (part, _)) in self.normals.iter_mut().zip(parts) {
            if votes[part as usize] < 0.0 {
                *normal = -*normal;
            }
        }
    }

    /// For each part, by its root: how much the normals of its outermost points along 26 directions look outward.
    fn outward_votes(&self, parts: &[(u32, bool)]) -> Vec<f64> {
        let mut votes = vec![0.0; parts.len()];
        for code in (0..27).filter(|&code| code != 13) {
            let step = |place: i32| f64::from(code / place % 3 - 1);
            let direction = Vector3::new(step(1), step(3), step(9)).normalize();
            let mut outermost: Vec<Option<(f64, usize)>> = vec![None; parts.len()];
            for (point, (part, _)) in parts.iter().enumerate() {
                let height = self.points[point].coords.dot(&direction);
                let best = &mut outermost[*part as usize];
                if best.is_none_or(|(highest, _)| height > highest) {
                    *best = Some((height, point));
                }
            }
            for (part, best) in outermost.into_iter().enumerate() {
                if let Some((_, point)) = best {
                    votes[part] += self.normals[point].dot(&direction);
                }
            }
        }
        votes
    }
}

/// The direction in which points spread least.
pub(crate) fn plane_normal(points: &[Point3<f64>], near: &[u32]) -> Vector3<f64> {
    let of = |&number: &u32| points[number as usize].coords;
    let mean = near.iter().map(of).sum::<Vector3<f64>>() / near.len() as f64;
    let spread: Matrix3<f64> = (near.iter())
        .map(|number| {
            let offset = of(number) - mean;
            offset * offset.transpose()
        })
        .sum();
    // Scaled, so that no iteration meets denormals; points all in one place have no plane, and any will do.
    let scale = spread.amax();
    if scale <= f64::MIN_POSITIVE {
        return Vector3::z();
    }
    let eigen = SymmetricEigen::new(spread / scale);
    eigen
        .eigenvectors
        .column(eigen.eigenvalues.imin())
        .into_owned()
}

/// Points in sets that grow together (union-find), each point turned or not against its set's root.
struct Sides {
    parent: Vec<(u32, bool)>,
}

impl Sides {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).map(|point| (point, false)).collect(),
        }
    }
    fn root(&mut self, mut point: u32) -> (u32, bool) {
        let mut is_turned = false;
        loop {
            let (parent, turned) = self.parent[point as usize];
            if parent == point {
                return (point, is_turned);
            }
            // Path halving: past the parent to the grandparent.
            let (grandparent, parent_turned) = self.parent[parent as usize];
            self.parent[point as usize] = (grandparent, turned ^ parent_turned);
            is_turned ^= turned ^ parent_turned;
            point = grandparent;
        }
    }
    fn join(&mut self, a: u32, b: u32, are_opposite: bool) {
        let ((a, a_turned), (b, b_turned)) = (self.root(a), self.root(b));
        if a != b {
            let turned = are_opposite ^ a_turned ^ b_turned;
            self.parent[a.max(b) as usize] = (a.min(b), turned);
        }
    }
}
