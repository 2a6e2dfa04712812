//! Mending defects where they are.

use std::collections::HashMap;

use super::halfedge::{compacted, ends, is_edge_manifold};
use super::inner::{inner_parts, lies_inside};
use super::patch::fill;
use super::report::{FilledHole, RepairReport, RepairSettings, RepairTier};
use super::sheets::Sheets;
use super::slivers::remove_degenerate;
use super::stitch::{drop_useless_faces, stitch};
use super::triangulate::{EdgeSet, edge};
use graspd_geom::{SignedDistance, TriangleMesh};
use graspd_geom::{components, submesh};

/// Small parts go only if together they have at most this part of the area.
const SMALL_AREA: f64 = 0.05;
/// A part that is mostly patch (by this part of its area) and encloses less than this times area^1.5 is a sheet: a
/// ball encloses 0.094 area^1.5, a thin bowl 0.002.
const SHEET_PATCH: f64 = 0.25;
const SHEET_VOLUME: f64 = 2e-3;
/// Any part that encloses less than this times area^1.5 encloses nothing.
const NO_VOLUME: f64 = 1e-9;

/// A surface as far as it could be mended.
pub(super) struct Mended {
    /// Closed parts, all outward oriented and none inside another.
    pub(super) closed: TriangleMesh,
    /// The input's faces, welded and turned alike, without patches.
    pub(super) oriented: TriangleMesh,
    /// Those of its parts that enclose nothing.
    pub(super) flat: TriangleMesh,
    /// Area of all patches of the closed parts \[m^2\].
    pub(super) patched_area: f64,
    pub(super) report: RepairReport,
}

/// Welds, cuts into oriented manifolds, drops small parts, fills holes, turns parts outward and drops inner ones.
pub(super) fn mend(mesh: &TriangleMesh, settings: &RepairSettings) -> Mended {
    let mut report = RepairReport::of(RepairTier::Mended);
    let mut soup = mesh.clone();
    clean(&mut soup, &mut report);
    let diagonal = diagonal(&soup);
    for tolerance in [0.0, settings.weld_distance * diagonal] {
        if !is_edge_manifold(&soup) {
            report.vertices_welded += stitch(&mut soup, tolerance);
            clean(&mut soup, &mut report);
        }
    }
    let mut sheets = Sheets::new(&soup);
    report.vertices_split = sheets.split_vertices;
    report.small_components_dropped = drop_small(&mut sheets, settings, diagonal);
    let oriented = sheets.mesh.clone();
    let input_faces = oriented.faces.len();
    let holes = fill_holes(&mut sheets);
    let mut work = sheets.mesh;

    let mut kept: Vec<TriangleMesh> = Vec::new();
    let mut volumes = Vec::new();
    let mut flat_parts = Vec::new();
    let mut part_of = vec![None; work.faces.len()];
    let mut flipped = Vec::new();
    for faces in components(&work.faces, work.vertices.len()) {
        let one = submesh(&work, &faces);
        let (area, volume) = (one.area(), graspd_geom::signed_volume(&one));
        let patch: f64 = faces
            .iter()
            .filter(|&&face| face as usize >= input_faces)
            .map(|&face| 0.5 * work.area_vector(face as usize).norm())
            .sum();
        let relative = volume.abs() / (area * area.sqrt()).max(f64::MIN_POSITIVE);
        if relative <= NO_VOLUME || (patch >= SHEET_PATCH * area && relative <= SHEET_VOLUME) {
            let own: Vec<u32> = faces
                .iter()
                .copied()
                .filter(|&face| (face as usize) < input_faces)
                .collect();
            flat_parts.push(submesh(&work, &own));
            continue;
        }
        let is_inside_out = volume < 0.0;
        for &face in &faces {
            part_of[face as usize] = Some(kept.len());
            if is_inside_out {
                work.faces[face as usize].swap(1, 2);
            }
        }
        flipped.push(
            faces
                .iter()
                .filter(|&&face| {
                    (face as usize) < input_faces
                        && sheets.is_flipped[face as usize] != is_inside_out
                })
                .count(),
        );
        kept.push(submesh(&work, &faces));
        volumes.push(volume.abs());
    }
    let is_inner = inner_parts(&kept, &volumes);
    report.inner_components_dropped = is_inner.iter().filter(|&&inner| inner).count();
    report.faces_flipped = flipped
        .iter()
        .zip(&is_inner)
        .filter(|(_, inner)| !**inner)
        .map(|(count, _)| count)
        .sum();
    let is_kept = |face: usize| part_of[face].is_some_and(|number: usize| !is_inner[number]);
    let mut patched_area = 0.0;
    for (range, hole) in holes {
        if is_kept(range.start) {
            patched_area += hole.area;
            report.holes.push(hole);
        }
    }
    report.holes.sort_by(|a, b| b.length.total_cmp(&a.length));
    let faces = (0..work.faces.len())
        .filter(|&face| is_kept(face))
        .map(|face| work.faces[face]);
    let mut closed = TriangleMesh {
        faces: faces.collect(),
        vertices: work.vertices,
    };
    report.slivers_removed = remove_degenerate(&mut closed);
    let closed = compacted(closed);
    let mut flat = TriangleMesh::default();
    let solid = if flat_parts.is_empty() {
        None
    } else {
        SignedDistance::new(&closed).ok()
    };
    for one in flat_parts {
        // A wall within a solid is no sheet that anyone could touch.
        if solid.as_ref().is_some_and(|solid| lies_inside(&one, solid)) {
            report.inner_components_dropped += 1;
        } else {
            report.flat_components_dropped += 1;
            flat.append(&one);
        }
    }
    Mended {
        closed,
        oriented,
        flat,
        patched_area,
        report,
    }
}

fn clean(mesh: &mut TriangleMesh, report: &mut RepairReport) {
    let [degenerate, copies] = drop_useless_faces(mesh);
    report.degenerate_dropped += degenerate;
    report.copies_dropped += copies;
}

/// The diagonal of the box around a mesh's faces.
pub(super) fn diagonal(mesh: &TriangleMesh) -> f64 {
    let mut corners = mesh
        .faces
        .iter()
        .flatten()
        .map(|&v| mesh.vertices[v as usize]);
    let Some(first) = corners.next() else {
        return 0.0;
    };
    let (low, high) = corners.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    (high - low).norm()
}

/// Leaves out parts that are small, if all together they are little; gives how many.
fn drop_small(sheets: &mut Sheets, settings: &RepairSettings, diagonal: f64) -> usize {
    let mesh = &sheets.mesh;
    let area = |faces: &[u32]| -> f64 {
        faces
            .iter()
            .map(|&face| mesh.area_vector(face as usize).norm())
            .sum()
    };
    let extent = |faces: &[u32]| {
        let corners = || faces.iter().flat_map(|&face| mesh.corners(face as usize));
        corners().next().map_or(0.0, |first| {
            let (low, high) =
                corners().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
            (high - low).norm()
        })
    };
    let small: Vec<Vec<u32>> = components(&mesh.faces, mesh.vertices.len())
        .into_iter()
        .filter(|faces| extent(faces) < settings.smallest_component * diagonal)
        .collect();
    let total = 2.0 * mesh.area();
    if small.is_empty() || small.iter().map(|faces| area(faces)).sum::<f64>() > SMALL_AREA * total {
        return 0;
    }
    let mut is_dropped = vec![false; mesh.faces.len()];
    for &face in small.iter().flatten() {
        is_dropped[face as usize] = true;
    }
    sheets.drop_faces(&is_dropped);
    small.len()
}

/// Appends patches over all boundary loops; gives for each the range of its faces and its size.
fn fill_holes(sheets: &mut Sheets) -> Vec<(std::ops::Range<usize>, FilledHole)> {
    let loops = sheets.boundary_loops();
    let mesh = &mut sheets.mesh;
    let mut is_open = vec![false; mesh.vertices.len()];
    for &side in loops.iter().flatten() {
        is_open[ends(&mesh.faces, side)[0] as usize] = true;
    }
    let mut taken = EdgeSet::new();
    // Summed length and number of the edges at each open vertex.
    let mut edges: HashMap<u32, (f64, f64)> = HashMap::new();
    for side in 0..3 * mesh.faces.len() as u32 {
        let [from, to] = ends(&mesh.faces, side);
        let length = || (mesh.vertices[from as usize] - mesh.vertices[to as usize]).norm();
        if is_open[from as usize] && is_open[to as usize] {
            taken.insert(edge(from, to));
        }
        for vertex in [from, to] {
            if is_open[vertex as usize] {
                let entry = edges.entry(vertex).or_default();
                *entry = (entry.0 + length(), entry.1 + 1.0);
            }
        }
    }
    let mut holes = Vec::with_capacity(loops.len());
    for walk in loops {
        // The patch runs along every open side the other way.
        let ring: Vec<u32> = walk
            .iter()
            .rev()
            .map(|&side| ends(&mesh.faces, side)[0])
            .collect();
        let spacing = ring
            .iter()
            .map(|vertex| {
                let (length, count) = edges.get(vertex).copied().unwrap_or((0.0, 1.0));
                (*vertex, length / count)
            })
            .collect();
        let patch = fill(&ring, &mesh.vertices, &spacing, &taken);
        let size = graspd_geom::boundary_loop(ring, &mesh.vertices);
        let first = mesh.faces.len();
        mesh.vertices.extend(patch.vertices);
        mesh.faces.extend(patch.faces);
        let range = first..mesh.faces.len();
        let area = range
            .clone()
            .map(|face| 0.5 * mesh.area_vector(face).norm())
            .sum();
        let hole = FilledHole {
            edges: size.vertices.len(),
            length: size.length,
            diameter: size.diameter,
            area,
        };
        holes.push((range, hole));
    }
    holes
}
