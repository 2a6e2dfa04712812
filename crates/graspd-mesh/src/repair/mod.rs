//! Any triangles into one closed, consistently oriented surface near the outer surface that they show.

mod deviation;
mod field;
mod halfedge;
mod inner;
mod mend;
mod patch;
mod report;
mod resurface;
mod sheets;
mod slivers;
mod stitch;
mod triangulate;
mod tunnels;

use graspd_settings::Validate;

use graspd_geom::check_finite;
use graspd_geom::encloses_volume;
use graspd_geom::{GeometryError, TriangleMesh, TriangleTree, signed_volume};

use deviation::farthest;
use halfedge::is_edge_manifold;
use inner::misplaced_part;
use mend::{Mended, mend};
pub use report::{FilledHole, RepairReport, RepairSettings, RepairTier};
use resurface::{has_area, resurface};
use slivers::degenerate_faces;

/// A mended surface that overlaps itself or lies the wrong way round on more than this part of its area is made
/// anew. Good scans cross themselves in a few faces, too.
const MAX_MISPLACED: f64 = 0.03;
/// So is one more of which is patch than this, beside the input's area.
const MAX_PATCHED: f64 = 0.5;
/// So is one when parts that enclose nothing have more than this part of the input's area.
const MAX_FLAT: f64 = 0.05;
/// Where a new surface is made and patches have less than this part of the input's area, they help to tell inside from
/// outside; more of them hide it.
const MAX_TRUSTED_PATCHES: f64 = 0.3;

/// A closed surface, and what was done to get it.
#[derive(Clone, Debug, PartialEq)]
pub struct RepairedMesh {
    /// Every edge has exactly two faces, which agree on the outside, and the volume is positive. If the input was not
    /// closed, no face is without area.
    pub mesh: TriangleMesh,
    /// What changed.
    pub report: RepairReport,
}

/// Makes one closed, consistently oriented surface of any triangles: open, doubled, nested, inside out, intersecting,
/// not manifold, unconnected.
///
/// * A mesh that is closed (every edge has two faces that agree on the outside, and the volume is positive) is
///   returned as it is, bit for bit.
/// * Otherwise defects are mended where they are: superfluous faces are dropped, open edges that lie upon each other
///   are welded, manifolds that share edges or vertices are cut apart, faces are turned to agree
///   with their neighbours, holes are filled with smooth patches of the density around them, parts are turned
///   outward, and small, flat and inner parts are dropped. The rest of the surface keeps its vertices and faces.
/// * If what comes of that overlaps itself, is patch for the most part or leaves out too much, a new surface is made:
///   the isosurface of the generalised winding number at one half, drawn to the input where that is near. Sheets
///   that enclose nothing become thin shells.
///
/// A hole is filled whatever its size: a bowl made of a single sheet becomes a solid with a lid. A bowl with an inner
/// and an outer surface keeps its hollow.
///
/// `name`: the mesh's file or name, for errors.
///
/// # Errors
/// A mesh without faces, with coordinates that are not finite or indices out of range; settings out of range;
/// [`GeometryError::NoVolume`] if all faces lie in one point or line.
///
/// # Source
/// Boundary cutting after Guéziec, Taubin, Lazarus & Horn, "Cutting and Stitching", IEEE TVCG 7(2), 2001; patches
/// after Liepa, "Filling Holes in Meshes", SGP 2003; winding numbers after Jacobson, Kavan & Sorkine-Hornung,
/// SIGGRAPH 2013.
pub fn repair(
    mesh: &TriangleMesh,
    settings: &RepairSettings,
    name: &str,
) -> Result<RepairedMesh, GeometryError> {
    settings.validate()?;
    check_finite(mesh)?;
    if !settings.resurface && is_edge_manifold(mesh) && encloses_volume(signed_volume(mesh), mesh) {
        return Ok(RepairedMesh {
            mesh: mesh.clone(),
            report: RepairReport::of(RepairTier::Untouched),
        });
    }
    let Mended {
        closed,
        oriented,
        flat,
        patched_area,
        mut report,
    } = mend(mesh, settings);
    let area = mesh.area();
    let is_patchwork = patched_area > MAX_PATCHED * area || flat.area() > MAX_FLAT * area;
    let is_sound = !settings.resurface
        && !is_patchwork
        && degenerate_faces(&closed) == 0
        && is_edge_manifold(&closed)
        && encloses_volume(signed_volume(&closed), &closed)
        && misplaced_part(&closed) <= MAX_MISPLACED;
    let mesh_after = if is_sound {
        closed
    } else {
        let source = if patched_area <= MAX_TRUSTED_PATCHES * area {
            let mut source = closed;
            source.append(&flat);
            source
        } else {
            oriented
        };
        if !has_area(&source) {
            return Err(GeometryError::NoVolume { name: name.into() });
        }
        let new = resurface(&source, settings)?;
        report.tier = RepairTier::Resurfaced;
        report.spacing = Some(new.spacing);
        report.thickened = new.thickened;
        new.mesh
    };
    if !is_edge_manifold(&mesh_after) || !encloses_volume(signed_volume(&mesh_after), &mesh_after) {
        return Err(GeometryError::NoVolume { name: name.into() });
    }
    report.input_to_result = farthest(mesh, &TriangleTree::new(&mesh_after)?);
    report.result_to_input = farthest(&mesh_after, &TriangleTree::new(mesh)?);
    Ok(RepairedMesh {
        mesh: mesh_after,
        report,
    })
}
