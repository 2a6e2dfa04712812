//! The reconstruction as its callers see it.

use graspd_settings::Validate;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::density::{self, Density};
use super::extract;
use super::octree::Level;
use super::samples::{Cube, Sample, merged};
use super::settings::PoissonSettings;
use super::solve::{FINER, Implicit};
use super::thin_walls;
use crate::PointCloud;
use graspd_geom::{GeometryError, TriangleMesh};

/// Memory for each square of a cell's side on the surface \[bytes\]: about 5.5 cells around it with their field,
/// nodes, matrix and vectors, those of the coarser levels, and the mesh.
const BYTES_PER_SURFACE_CELL: f64 = 2300.0;
/// Memory for each row of cells of the finest level, whether there are cells in it or not \[bytes\].
const BYTES_PER_ROW: f64 = 16.0;
/// Memory for each cell that the surface passes through away from samples \[bytes\].
const BYTES_PER_CROSSED_CELL: u64 = 200;
/// Part of the cube's border inside the surface above which the normals must look inward.
const MOSTLY: f64 = 0.9;

/// A closed surface through a point cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct PoissonSurface {
    /// Closed, without edges of more than two faces, oriented outward.
    pub mesh: TriangleMesh,
    /// How many points per area of surface there are around each vertex \[1/m^2\]; 0 far from all.
    pub density: Vec<f64>,
    /// The value of the implicit function on the surface: its mean at the points (less their targets), inside about
    /// -0.5, outside 0.5.
    pub isovalue: f64,
}

impl PoissonSurface {
    /// The mesh without the faces around which there are fewer than `least` points per area \[1/m^2\]: an open surface
    /// that does not bridge what was not seen. Vertices without faces are left out.
    pub fn trimmed(&self, least: f64) -> TriangleMesh {
        let mut number = vec![None; self.mesh.vertices.len()];
        let mut trimmed = TriangleMesh::default();
        for face in &self.mesh.faces {
            let density: f64 = face.iter().map(|&v| self.density[v as usize]).sum();
            if density < 3.0 * least {
                continue;
            }
            trimmed.faces.push(face.map(|v| {
                *number[v as usize].get_or_insert_with(|| {
                    trimmed.vertices.push(self.mesh.vertices[v as usize]);
                    trimmed.vertices.len() as u32 - 1
                })
            }));
        }
        trimmed
    }
}

/// Reconstructs a closed surface from points with outward normals.
///
/// The surface is where a function chi, on an octree refined around the points, has its mean value at the points;
/// chi minimises
///
///   integral |grad chi - V|^2 + (weight / cell side) * sum over points of area * (chi(point) - target)^2,
///
/// V being the points' normals, each times the area of surface that the point stands for, spread over cells with
/// about one point each; the target is 0, or slightly inside where the wall is thinner than a cell. The basis is
/// trilinear; the border of the cube is free (Neumann). Levels are solved from the coarsest to the finest, each by
/// conjugate gradients from the one before: around the points they need 10 to 30 iterations at any depth, where a
/// factorisation would fill in. The mesh is always closed: where the surface would leave the cube, it is cut off
/// along its faces.
///
/// Points with a zero normal are left out. Runs on rayon's current thread pool; the result does not depend on
/// the number of threads.
///
/// # Errors
/// Settings out of range; a cloud with fewer than 100 points, coordinates or normals that are not finite, no normals,
/// normals that look inward or contradict each other, points all in the same place, or so large that
/// its unit cannot be the metre; [`GeometryError::ReconstructionMemory`] for a depth that would need more
/// memory than allowed.
///
/// # Source
/// Kazhdan and Hoppe, "Screened Poisson surface reconstruction", ACM Transactions on Graphics 32 (2013). Differences:
/// a point's density counts only neighbours that look the same way, so that thin walls keep their full weight;
/// targets other than 0.
pub fn poisson_surface(
    cloud: &PointCloud,
    settings: &PoissonSettings,
) -> Result<PoissonSurface, GeometryError> {
    settings.validate()?;
    cloud.require_surface()?;
    let cube = Cube::around(&cloud.points, settings.scale);
    let mut samples = merged(&oriented(cloud, &cube), settings.depth + FINER);
    if samples.is_empty() {
        return Err(GeometryError::CloudNormals {
            fault: "all normals are zero".into(),
        });
    }
    let density = Density::new(&samples, settings.depth);
    density::assign(
        &mut samples,
        &density,
        settings.depth,
        settings.samples_per_cell,
    );
    require_memory(&samples, settings)?;
    thin_walls::aim(&mut samples, settings.depth);

    let implicit = Implicit::new(&samples, settings.depth, settings.point_weight);
    let isovalue = implicit.mean_at(&samples);
    require_outward(&implicit, isovalue)?;
    let most_cells = (settings.max_memory / BYTES_PER_CROSSED_CELL) as usize;
    let mesh = extract::surface(&implicit, isovalue, &cube, most_cells).map_err(|cells| {
        GeometryError::ReconstructionMemory {
            depth: settings.depth,
            needed: cells as u64 * BYTES_PER_CROSSED_CELL,
            allowed: settings.max_memory,
        }
    })?;
    if mesh.faces.is_empty() {
        return Err(GeometryError::CloudNormals {
            fault: "the normals contradict each other, so that they have no inside".into(),
        });
    }
    let per_area = 1.0 / (cube.side * cube.side);
    let density = (mesh.vertices.par_iter())
        .zip(vertex_normals(&mesh))
        .map(|(p, normal)| density.at(&cube.inward(p), &normal.into()) * per_area)
        .collect();
    Ok(PoissonSurface {
        mesh,
        density,
        isovalue,
    })
}

/// The points that have a normal, in the unit cube.
fn oriented(cloud: &PointCloud, cube: &Cube) -> Vec<Sample> {
    (cloud.points.iter().zip(&cloud.normals))
        .filter_map(|(p, normal)| {
            Some(Sample {
                position: cube.inward(p),
                normal: normal.try_normalize(f64::MIN_POSITIVE)?,
                count: 1.0,
                area: 0.0,
                spread: 0.0,
                target: 0.0,
            })
        })
        .collect()
}

fn require_memory(samples: &[Sample], settings: &PoissonSettings) -> Result<(), GeometryError> {
    let area: f64 = samples.iter().map(|sample| sample.area).sum();
    let squares = 4.0_f64.powi(settings.depth as i32);
    let needed = (squares * (area * BYTES_PER_SURFACE_CELL + BYTES_PER_ROW)) as u64;
    if needed > settings.max_memory {
        return Err(GeometryError::ReconstructionMemory {
            depth: settings.depth,
            needed,
            allowed: settings.max_memory,
        });
    }
    Ok(())
}

/// Whether the cube's border is outside, looked at on the finest level that has all of it.
fn require_outward(implicit: &Implicit, isovalue: f64) -> Result<(), GeometryError> {
    let full = (implicit.levels.iter().zip(&implicit.values))
        .take_while(|(level, _)| level.is_full())
        .last();
    let Some((level, values)) = full else {
        return Ok(());
    };
    let last = level.nodes.side() - 1;
    let (mut inside, mut all) = (0, 0);
    for (point, value) in level.nodes.points().zip(values) {
        let is_border = point.iter().any(|&x| x == 1 || x as usize + 1 == last);
        if is_border && !point.iter().any(|&x| Level::is_outside(x as usize, last)) {
            all += 1;
            inside += usize::from(*value < isovalue);
        }
    }
    if inside as f64 > MOSTLY * f64::from(all) {
        return Err(GeometryError::CloudNormals {
            fault: "the normals look inward".into(),
        });
    }
    Ok(())
}

/// The mean normal of the faces around each vertex, weighted by area.
fn vertex_normals(mesh: &TriangleMesh) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.vertices.len()];
    for (index, face) in mesh.faces.iter().enumerate() {
        let area = mesh.area_vector(index);
        for &vertex in face {
            normals[vertex as usize] += area;
        }
    }
    for normal in &mut normals {
        *normal = normal.try_normalize(0.0).unwrap_or_default();
    }
    normals
}
