//! Stereolithography files (STL), binary and text.

use std::collections::HashMap;
use std::path::Path;

use super::assemble::{Assembly, parse_error};
use super::{numbered_lines, quoted, three_numbers};
use crate::{GeometryError, TriangleMesh};

const HEADER_LEN: usize = 84;
const TRIANGLE_LEN: usize = 50;

/// Reads an STL file; corners with equal coordinates become one vertex, normals and attributes are ignored.
///
/// Whether it is text is decided by content, since many binary files also begin with `solid`. All solids of a text
/// file are read, as one mesh.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let mut welded = Welded {
        assembly: Assembly::new(path, 0),
        index_of: HashMap::new(),
    };
    if is_text(bytes) {
        read_text(bytes, &mut welded)?;
    } else {
        read_binary(bytes, path, &mut welded)?;
    }
    welded.assembly.finish()
}

/// An assembly that merges vertices at the same position.
struct Welded<'a> {
    assembly: Assembly<'a>,
    index_of: HashMap<[u64; 3], i64>,
}

impl Welded<'_> {
    fn push_triangle(
        &mut self,
        corners: [[f64; 3]; 3],
        lines: [Option<usize>; 3],
    ) -> Result<(), GeometryError> {
        let mut indices = [0; 3];
        for i in 0..3 {
            // Adding zero turns -0 into 0, which lies at the same place.
            let key = corners[i].map(|coordinate| (coordinate + 0.0).to_bits());
            indices[i] = match self.index_of.get(&key) {
                Some(&index) => index,
                None => {
                    let index = self.assembly.vertex_count() as i64;
                    self.assembly.push_vertex(corners[i], lines[i])?;
                    self.index_of.insert(key, index);
                    index
                }
            };
        }
        self.assembly.push_polygon(indices, lines[2]);
        Ok(())
    }
}

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
    let count = bytes.get(HEADER_LEN - 4..HEADER_LEN)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

fn read_binary(bytes: &[u8], path: &Path, welded: &mut Welded) -> Result<(), GeometryError> {
    let Some(count) = binary_triangle_count(bytes) else {
        return Err(parse_error(
            path,
            None,
            "neither a text STL (\"solid ... facet\") nor long enough for a binary one",
        ));
    };
    let triangles = &bytes[HEADER_LEN..];
    let held = (triangles.len() / TRIANGLE_LEN) as u64;
    if count > held {
        return Err(parse_error(
            path,
            None,
            format!("the header promises {count} triangles, but the file holds {held}"),
        ));
    }
    for triangle in triangles.chunks_exact(TRIANGLE_LEN).take(count as usize) {
        // Twelve numbers: the normal, then three corners.
        let number = |i: usize| {
            let bytes = &triangle[4 * i..4 * i + 4];
            f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        };
        let corner = |i: usize| [number(i), number(i + 1), number(i + 2)];
        welded.push_triangle([corner(3), corner(6), corner(9)], [None; 3])?;
    }
    Ok(())
}

fn read_text(bytes: &[u8], welded: &mut Welded) -> Result<(), GeometryError> {
    let mut corners: Vec<([f64; 3], Option<usize>)> = Vec::new();
    let mut inside_loop = false;
    let mut inside_solid = false;
    for (number, line) in numbered_lines(bytes) {
        let mut tokens = line.split_whitespace();
        let Some(keyword) = tokens.next() else {
            continue;
        };
        let fault = |fault: String| welded.assembly.parse_error(Some(number), fault);
        match keyword.to_ascii_lowercase().as_str() {
            "solid" => inside_solid = true,
            "endsolid" => inside_solid = false,
            "facet" | "endfacet" if !inside_loop => {}
            "outer" if !inside_loop => inside_loop = true,
            "vertex" if inside_loop => {
                let position = three_numbers(&mut tokens).map_err(fault)?;
                corners.push((position, Some(number)));
            }
            "endloop" if inside_loop => {
                let [a, b, c] = corners[..] else {
                    return Err(fault(format!(
                        "a facet has {} corners instead of 3",
                        corners.len()
                    )));
                };
                welded.push_triangle([a.0, b.0, c.0], [a.1, b.1, c.1])?;
                corners.clear();
                inside_loop = false;
            }
            _ => return Err(fault(format!("unexpected {}", quoted(keyword)))),
        }
    }
    if inside_solid || inside_loop {
        return Err(welded
            .assembly
            .parse_error(None, "the file ends before \"endsolid\": it was cut short"));
    }
    Ok(())
}
