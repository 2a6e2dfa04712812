//! Wavefront OBJ.
//!
//! Only `v` and `f` lines matter here. A reader that follows materials, groups and texture coordinates gives each
//! group its own copy of the vertices, which tears a closed surface open along every group and texture seam.

use std::path::Path;

use super::assemble::Assembly;
use super::{numbered_lines, quoted, three_numbers};
use crate::{GeometryError, TriangleMesh};

/// Reads the faces of all objects and groups over the one list of vertices that an OBJ file has.
///
/// A fourth number of a vertex is its weight, by which the others are divided; six numbers are a position and a
/// colour. Negative vertex numbers count back from the latest vertex.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let mut assembly = Assembly::new(path, 1);
    let mut continued = String::new();
    for (number, line) in numbered_lines(bytes) {
        let line = line.trim_end();
        if let Some(head) = line.strip_suffix('\\') {
            continued.push_str(head);
            continued.push(' ');
            continue;
        }
        if continued.is_empty() {
            read_line(line, number, &mut assembly)?;
        } else {
            continued.push_str(line);
            read_line(&continued, number, &mut assembly)?;
            continued.clear();
        }
    }
    read_line(&continued, numbered_lines(bytes).count(), &mut assembly)?;
    if assembly.vertex_count() == 0 {
        return Err(assembly.parse_error(None, "no vertices (lines \"v x y z\") found"));
    }
    assembly.finish()
}

fn read_line(line: &str, number: usize, assembly: &mut Assembly) -> Result<(), GeometryError> {
    let content = line.split('#').next().unwrap_or_default();
    let mut tokens = content.split_whitespace();
    match tokens.next() {
        Some("v") => {
            let vertex = vertex(&mut tokens).map_err(|e| assembly.parse_error(Some(number), e))?;
            assembly.push_vertex(vertex, Some(number))
        }
        Some("f") => {
            let latest = assembly.vertex_count() as i64;
            let corners: Result<Vec<i64>, String> =
                tokens.map(|token| corner(token, latest)).collect();
            let corners = corners.map_err(|e| assembly.parse_error(Some(number), e))?;
            assembly.push_polygon(corners, Some(number));
            Ok(())
        }
        _ => Ok(()),
    }
}

fn vertex<'a>(tokens: &mut impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let position = three_numbers(tokens)?;
    match (tokens.next(), tokens.next()) {
        (Some(token), None) => {
            let weight: f64 = token
                .parse()
                .map_err(|_| format!("{} is not a number", quoted(token)))?;
            Ok(position.map(|coordinate| coordinate / weight))
        }
        _ => Ok(position),
    }
}

/// The vertex number of a face corner such as `7`, `7/1`, `7//3`, `-1/-1/-1`.
fn corner(token: &str, latest: i64) -> Result<i64, String> {
    let digits = token.split('/').next().unwrap_or_default();
    let number: i64 = digits
        .parse()
        .map_err(|_| format!("{} is not a face corner", quoted(token)))?;
    // -1 is the latest vertex; one that counts back too far stays below 1, hence out of range.
    Ok(match number {
        ..0 => number.saturating_add(latest).saturating_add(1),
        _ => number,
    })
}
