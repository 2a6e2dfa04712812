//! Wavefront OBJ, parsed by `tobj`.
//!
//! A pre-pass hands `tobj` only what a shape consists of: the lines `v` and `f`, with position numbers alone. From a
//! whole file `tobj` makes one model per group and material, each with its own copy of the vertices, which tears a
//! closed surface open along every seam. It also refuses continued lines, comments behind a face and names that are
//! not UTF-8, and its arithmetic on texture numbers can overflow. Its errors name no line, so a file that it refuses
//! is searched for the first fault.

use std::borrow::Cow;
use std::fmt::Write;
use std::io::Read;
use std::path::Path;

use super::assemble::{Assembly, parse_error};
use super::{numbered_lines, quoted, three_numbers};
use graspd_geom::{GeometryError, TriangleMesh};

/// Reads the faces of all objects and groups over the one list of vertices that an OBJ file has.
///
/// A fourth number of a vertex is its weight, by which the others are divided; six numbers are a position and a
/// colour. Negative vertex numbers count back from the latest vertex.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let (shape, vertex_count) = shape_lines(bytes);
    if vertex_count == 0 {
        let fault = "no vertices (lines \"v x y z\") found";
        return Err(parse_error(path, None, fault));
    }
    // The vertices of a model are those of its faces, in the order of their first use: a first face through all of
    // them keeps them as they are in the file.
    let mut all_vertices = String::from("f");
    for number in 1..=vertex_count {
        let _ = write!(all_vertices, " {number}");
    }
    all_vertices.push('\n');

    let loaded = tobj::load_obj_buf(
        &mut all_vertices.as_bytes().chain(shape.as_bytes()),
        // Polygons as they are: `tobj` would make fans of them, wrong for concave ones.
        &tobj::LoadOptions::default(),
        |_| Err(tobj::LoadError::OpenFileFailed),
    );
    let is_finite = |mesh: &tobj::Mesh| mesh.positions.iter().all(|x| x.is_finite());
    let model = loaded.ok().and_then(|(mut models, _)| models.pop());
    let Some(mesh) = model.map(|model| model.mesh).filter(is_finite) else {
        return Err(first_fault(bytes, path, vertex_count));
    };

    let mut assembly = Assembly::new(path, 0);
    for position in mesh.positions.chunks_exact(3) {
        assembly.push_vertex([position[0], position[1], position[2]], None)?;
    }
    let mut arities = mesh.face_arities;
    if arities.is_empty() {
        // Triangles only.
        arities = vec![3; mesh.indices.len() / 3];
    }
    let mut corners = mesh.indices[vertex_count..].iter().map(|&i| i64::from(i));
    for &arity in &arities[1..] {
        assembly.push_polygon(corners.by_ref().take(arity as usize), None);
    }
    assembly.finish()
}

/// The vertices and faces of a file as lines for `tobj`, and the number of vertices.
fn shape_lines(bytes: &[u8]) -> (String, usize) {
    let mut shape = String::new();
    let mut vertex_count = 0;
    for (_, line) in logical_lines(bytes) {
        let mut words = words(&line);
        match words.next() {
            Some("v") => {
                vertex_count += 1;
                shape.push('v');
                let has_weight = words.clone().count() == 4;
                for number in words.take(if has_weight { 4 } else { 3 }) {
                    shape.push(' ');
                    shape.push_str(number);
                }
            }
            Some("f") => {
                shape.push('f');
                for corner in words {
                    shape.push(' ');
                    // A corner without a vertex must not vanish: `tobj` refuses it as it is.
                    shape.push_str(match vertex_digits(corner) {
                        "" => corner,
                        digits => digits,
                    });
                }
            }
            _ => continue,
        }
        shape.push('\n');
    }
    (shape, vertex_count)
}

/// The lines of a file with the numbers that they end at, each with the lines that continue it after a backslash.
fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = numbered_lines(bytes);
    std::iter::from_fn(move || {
        let (mut number, mut line) = lines.next()?;
        let mut joined = String::new();
        while let Some(head) = line.trim_end().strip_suffix('\\') {
            joined.push_str(head);
            joined.push(' ');
            (number, line) = lines.next().unwrap_or((number, Cow::Borrowed("")));
        }
        if !joined.is_empty() {
            joined.push_str(&line);
            line = joined.into();
        }
        Some((number, line))
    })
}

/// The words of a line up to its comment.
fn words(line: &str) -> std::str::SplitWhitespace<'_> {
    line.split_once('#')
        .map_or(line, |(content, _)| content)
        .split_whitespace()
}

/// The vertex number of a face corner such as `7`, `7/1`, `7//3`, `-1/-1/-1`.
fn vertex_digits(corner: &str) -> &str {
    corner.split_once('/').map_or(corner, |(digits, _)| digits)
}

/// What is wrong with a file that cannot be read, and on which line.
fn first_fault(bytes: &[u8], path: &Path, vertices: usize) -> GeometryError {
    let mut latest = 0;
    let mut out_of_range = None;
    for (number, line) in logical_lines(bytes) {
        let mut words = words(&line);
        match words.next() {
            Some("v") => match position(&mut words) {
                Ok(value) if value.iter().all(|coordinate| coordinate.is_finite()) => latest += 1,
                Ok(value) => {
                    return GeometryError::VertexNotFinite {
                        path: path.into(),
                        line: Some(number),
                        vertex: latest,
                        value,
                    };
                }
                Err(fault) => return parse_error(path, Some(number), fault),
            },
            Some("f") => {
                for corner in words {
                    let index = match vertex_number(corner, latest as i64) {
                        Ok(index) => index,
                        Err(fault) => return parse_error(path, Some(number), fault),
                    };
                    if index < 1 || index > vertices as i64 {
                        out_of_range.get_or_insert_with(|| GeometryError::IndexOutOfRange {
                            path: path.into(),
                            line: Some(number),
                            index,
                            vertices,
                            first: 1,
                        });
                    }
                }
            }
            _ => {}
        }
    }
    out_of_range.unwrap_or_else(|| parse_error(path, None, "not a valid OBJ file"))
}

/// The vertex number of a face corner, counted from the start of the file.
fn vertex_number(corner: &str, latest: i64) -> Result<i64, String> {
    let number: i64 = vertex_digits(corner)
        .parse()
        .map_err(|_| format!("{} is not a face corner", quoted(corner)))?;
    // -1 is the latest vertex; one that counts back too far stays below 1, hence out of range.
    Ok(match number {
        ..0 => number.saturating_add(latest + 1),
        _ => number,
    })
}

/// The position on a `v` line, divided by the weight if there is one.
fn position<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let position = three_numbers(words)?;
    match (words.next(), words.next()) {
        (Some(word), None) => {
            let weight: f64 = word
                .parse()
                .map_err(|_| format!("{} is not a number", quoted(word)))?;
            Ok(position.map(|coordinate| coordinate / weight))
        }
        _ => Ok(position),
    }
}
