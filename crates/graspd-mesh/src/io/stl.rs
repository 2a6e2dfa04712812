//! Stereolithography files (STL), binary and text, parsed by `stl_io` in single precision.
//!
//! A pre-pass decides by content which of the two a file is, and makes one plain solid of a text. `stl_io` goes by
//! the first line alone, with which many binary files pass for text; it stops at the first `endsolid`, knows only
//! lower-case keywords, refuses normals that are not numbers, and its errors name no line.

use std::io::Cursor;
use std::path::Path;

use stl_io::{Triangle, TriangleIterator, Vertex};

use super::assemble::{Assembly, parse_error};
use super::{numbered_lines, quoted, three_numbers};
use graspd_geom::{GeometryError, TriangleMesh};

const COUNT_START: usize = 80;
const HEADER_LEN: usize = 84;
const TRIANGLE_LEN: usize = 50;

/// Reads an STL file; corners with equal coordinates become one vertex, normals and attributes are ignored.
///
/// All solids of a text file are read, as one mesh.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let mut reader = Cursor::new(if is_text(bytes) {
        one_solid(bytes, path)?.into_bytes()
    } else {
        plain_binary(bytes, path)?
    });
    let indexed = stl_io::create_stl_reader(&mut reader)
        .and_then(|triangles| WithoutMinusZero(triangles).as_indexed_triangles())
        .map_err(|error| parse_error(path, None, error.to_string()))?;

    let mut assembly = Assembly::new(path, 0);
    for vertex in indexed.vertices {
        assembly.push_vertex(vertex.0.map(f64::from), None)?;
    }
    for face in indexed.faces {
        assembly.push_polygon(face.vertices.map(|index| index as i64), None);
    }
    assembly.finish()
}

/// Triangles with 0 in place of -0, which lies at the same place but would become another vertex.
struct WithoutMinusZero<I>(I);

impl<I: Iterator<Item = std::io::Result<Triangle>>> Iterator for WithoutMinusZero<I> {
    type Item = std::io::Result<Triangle>;

    fn next(&mut self) -> Option<Self::Item> {
        let plus_zero = |vertex: Vertex| Vertex::new(vertex.0.map(|coordinate| coordinate + 0.0));
        Some(self.0.next()?.map(|triangle| Triangle {
            vertices: triangle.vertices.map(plus_zero),
            ..triangle
        }))
    }
}

impl<I: Iterator<Item = std::io::Result<Triangle>>> TriangleIterator for WithoutMinusZero<I> {}

fn is_text(bytes: &[u8]) -> bool {
    if binary_triangle_count(bytes)
        .is_some_and(|count| bytes.len() as u64 == HEADER_LEN as u64 + count * TRIANGLE_LEN as u64)
    {
        return false;
    }
    let start = bytes.trim_ascii_start();
    let begins_with_solid = start.len() >= 5 && start[..5].eq_ignore_ascii_case(b"solid");
    // The header of a binary file that was cut short may say "solid" too, but no facet follows it as text.
    let head = &bytes[..bytes.len().min(4096)];
    let says = |word: &[u8]| {
        head.windows(word.len())
            .any(|window| window.eq_ignore_ascii_case(word))
    };
    begins_with_solid && (says(b"facet") || says(b"endsolid"))
}

fn binary_triangle_count(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(COUNT_START..HEADER_LEN)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

/// A binary file that holds what it promises, with a header that no reader takes for text.
fn plain_binary(bytes: &[u8], path: &Path) -> Result<Vec<u8>, GeometryError> {
    let Some(count) = binary_triangle_count(bytes) else {
        let fault = "neither a text STL (\"solid ... facet\") nor long enough for a binary one";
        return Err(parse_error(path, None, fault));
    };
    let held = ((bytes.len() - HEADER_LEN) / TRIANGLE_LEN) as u64;
    if count > held {
        let fault = format!("the header promises {count} triangles, but the file holds {held}");
        return Err(parse_error(path, None, fault));
    }
    let mut plain = bytes.to_vec();
    // An empty first line.
    plain[..COUNT_START].fill(b'\n');
    Ok(plain)
}

/// All facets of a checked text as one solid, written in the one way that `stl_io` reads.
fn one_solid(bytes: &[u8], path: &Path) -> Result<String, GeometryError> {
    let mut solid = String::from("solid \n");
    let mut vertex_count = 0;
    let mut corner_count = 0;
    let mut inside_loop = false;
    let mut inside_solid = false;
    for (number, line) in numbered_lines(bytes) {
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else {
            continue;
        };
        let fault = |fault: String| parse_error(path, Some(number), fault);
        match keyword.to_ascii_lowercase().as_str() {
            "solid" => inside_solid = true,
            "endsolid" => inside_solid = false,
            "facet" | "endfacet" if !inside_loop => {}
            "outer" if !inside_loop => {
                inside_loop = true;
                corner_count = 0;
                solid.push_str("facet normal 0 0 0\nouter loop\n");
            }
            "vertex" if inside_loop => {
                solid.push_str("vertex");
                for coordinate in words.clone().take(3) {
                    solid.push(' ');
                    solid.push_str(coordinate);
                }
                solid.push('\n');
                let position = three_numbers(&mut words).map_err(fault)?;
                let value = position.map(|coordinate| f64::from(coordinate as f32));
                if value.iter().any(|coordinate| !coordinate.is_finite()) {
                    return Err(GeometryError::VertexNotFinite {
                        path: path.into(),
                        line: Some(number),
                        vertex: vertex_count,
                        value,
                    });
                }
                vertex_count += 1;
                corner_count += 1;
            }
            "endloop" if inside_loop => {
                if corner_count != 3 {
                    let fault_text = format!("a facet has {corner_count} corners instead of 3");
                    return Err(fault(fault_text));
                }
                solid.push_str("endloop\nendfacet\n");
                inside_loop = false;
            }
            _ => return Err(fault(format!("unexpected {}", quoted(keyword)))),
        }
    }
    if inside_solid || inside_loop {
        let fault = "the file ends before \"endsolid\": it was cut short";
        return Err(parse_error(path, None, fault));
    }
    solid.push_str("endsolid\n");
    Ok(solid)
}
