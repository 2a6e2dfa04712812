//! A new surface for meshes beyond mending: an isosurface of the winding number.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::field::Field;
use super::halfedge::compacted;
use super::slivers::is_degenerate;
use super::tunnels::close_tunnels;
use super::{RepairSettings, mend::diagonal};
use crate::{NodeGrid, isosurface};
use graspd_geom::{
    GeometryError, SurfaceSampler, TriangleMesh, TriangleTree, WindingField, signed_volume,
};
use graspd_geom::{components, submesh};

/// Shells are at least this many cells thick to either side of a sheet: more than half a cell's diagonal, so that
/// no gap appears between nodes.
const HALF_SHELL: f64 = 0.9;
/// A face farther than this many cells from the new surface is not represented by it.
const REPRESENTED: f64 = 1.0;
/// Sheets with less than this part of the area are left out.
const NEGLIGIBLE: f64 = 1e-3;
/// Vertices are projected onto the input from at most this many cells away.
const PROJECTED: f64 = 1.0;

/// Gaps of up to twice this many cells are closed where tunnels run through them.
const TUNNELS: [usize; 2] = [1, 2];
/// The field in closed tunnels, in cells.
const FILLING: f64 = -0.3;

/// What came of it.
pub(super) struct Resurfaced {
    pub(super) mesh: TriangleMesh,
    /// Distance between grid nodes \[m\].
    pub(super) spacing: f64,
    /// Part of the input's area that was given a thickness.
    pub(super) thickened: f64,
}

/// The boundary of the points about which the faces wind more than half a time, and of shells around faces that
/// enclose nothing.
pub(super) fn resurface(
    mesh: &TriangleMesh,
    settings: &RepairSettings,
) -> Result<Resurfaced, GeometryError> {
    let tree = TriangleTree::new(mesh)?;
    let (low, high) = tree.bounds();
    let spacing = (high - low).max() / settings.resolution as f64;
    let half_shell = (0.5 * settings.sheet_thickness).max(HALF_SHELL * spacing);
    let margin = Vector3::repeat(half_shell + 2.0 * spacing);
    let winding = WindingField::new(tree);
    let field = Field {
        grid: NodeGrid::covering(low - margin, high + margin, spacing),
        winding: &winding,
    };
    let mut values = field.values();
    let mut new = surface_of(&field.grid, &values, settings)?;
    let sheets = unrepresented(mesh, &new, &winding, spacing);
    let thickened = sheets.area() / mesh.area().max(f64::MIN_POSITIVE);
    let mut shell = None;
    if new.faces.is_empty() || thickened > NEGLIGIBLE {
        let source = if sheets.faces.is_empty() {
            mesh
        } else {
            &sheets
        };
        let tree = TriangleTree::new(source)?;
        field.add_shells(&mut values, &tree, half_shell);
        shell = Some((tree, half_shell));
    }
    let filling = (FILLING * spacing) as f32;
    let closed: usize = TUNNELS
        .iter()
        .map(|&reach| close_tunnels(&mut values, field.grid.dims, reach, filling))
        .sum();
    if closed > 0 || shell.is_some() {
        new = surface_of(&field.grid, &values, settings)?;
    }
    project(&mut new, winding.tree(), shell.as_ref(), spacing);
    Ok(Resurfaced {
        mesh: new,
        spacing,
        thickened: if shell.is_some() { thickened } else { 0.0 },
    })
}

/// The isosurface, without cavities and small parts.
fn surface_of(
    grid: &NodeGrid,
    values: &[f32],
    settings: &RepairSettings,
) -> Result<TriangleMesh, GeometryError> {
    let [nx, ny, _] = grid.dims;
    let mesh = isosurface(grid, 0.0, |[i, j, k]| {
        f64::from(values[i + nx * (j + ny * k)])
    })?;
    let smallest = settings.smallest_component * diagonal(&mesh);
    let mut kept: Vec<u32> = Vec::new();
    for faces in components(&mesh.faces, mesh.vertices.len()) {
        let one = submesh(&mesh, &faces);
        if signed_volume(&one) > 0.0 && diagonal(&one) >= smallest {
            kept.extend(faces);
        }
    }
    kept.sort_unstable();
    Ok(compacted(TriangleMesh {
        faces: kept.iter().map(|&face| mesh.faces[face as usize]).collect(),
        vertices: mesh.vertices,
    }))
}

/// The faces that lie outside of the new surface and away from it.
fn unrepresented(
    mesh: &TriangleMesh,
    new: &TriangleMesh,
    winding: &WindingField,
    spacing: f64,
) -> TriangleMesh {
    let Ok(tree) = TriangleTree::new(new) else {
        return mesh.clone();
    };
    let limit = REPRESENTED * spacing;
    let is_lost = |face: u32| {
        let [a, b, c] = mesh.corners(face as usize);
        // Middles of the face and of the triangles between it and each side's middle stand for it.
        let centre = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let probes = [
            centre,
            centre + (a - centre) * 0.7,
            centre + (b - centre) * 0.7,
            centre + (c - centre) * 0.7,
        ];
        let normal = mesh.area_vector(face as usize);
        let step = normal.try_normalize(0.0).unwrap_or_else(Vector3::zeros) * (0.1 * spacing);
        let lost = probes.iter().filter(|&&p| {
            tree.closest_within(&p, limit).is_none()
                && winding
                    .winding_number(&(p + step), 0.05)
                    .min(winding.winding_number(&(p - step), 0.05))
                    < 0.5
        });
        2 * lost.count() >= probes.len()
    };
    let faces: Vec<u32> = (0..mesh.faces.len() as u32)
        .into_par_iter()
        .with_min_len(64)
        .filter(|&face| is_lost(face))
        .collect();
    submesh(mesh, &faces)
}

/// Moves vertices onto the input where it is near and no face folds or flattens.
fn project(
    mesh: &mut TriangleMesh,
    tree: &TriangleTree,
    shell: Option<&(TriangleTree, f64)>,
    spacing: f64,
) {
    let targets: Vec<Option<Point3<f64>>> = mesh
        .vertices
        .par_iter()
        .map(|p| {
            if shell.is_some_and(|(sheet, half)| sheet.closest_within(p, half + spacing).is_some())
            {
                return None;
            }
            Some(tree.closest_within(p, PROJECTED * spacing)?.point)
        })
        .collect();
    let mut faces_at = vec![Vec::new(); mesh.vertices.len()];
    for (index, face) in (0u32..).zip(&mesh.faces) {
        for &vertex in face {
            faces_at[vertex as usize].push(index);
        }
    }
    for (vertex, target) in targets.into_iter().enumerate() {
        let Some(target) = target else { continue };
        let old = mesh.vertices[vertex];
        let before: Vec<Vector3<f64>> = faces_at[vertex]
            .iter()
            .map(|&face| mesh.area_vector(face as usize))
            .collect();
        mesh.vertices[vertex] = target;
        let is_sound = faces_at[vertex].iter().zip(before).all(|(&face, before)| {
            let after = mesh.area_vector(face as usize);
            after.dot(&before) > 0.5 * after.norm() * before.norm()
                && after.norm() > 0.1 * before.norm()
                && !is_degenerate(&mesh.corners(face as usize))
        });
        if !is_sound {
            mesh.vertices[vertex] = old;
        }
    }
}

/// Whether a mesh has any area.
pub(super) fn has_area(mesh: &TriangleMesh) -> bool {
    SurfaceSampler::new(mesh).is_some()
}
