//! The Object File Format (OFF) of Geomview, as text.

use std::path::Path;

use super::assemble::{Assembly, parse_error};
use super::{numbered_lines, quoted, three_numbers};
use graspd_geom::{GeometryError, TriangleMesh};

/// Reads `OFF` and its relatives with normals, colours or texture coordinates, which are ignored.
///
/// One vertex or face a line; `#` starts a comment. Nothing is allocated on the word of the header's counts.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let mut lines = numbered_lines(bytes).filter_map(|(number, line)| {
        let content = line.split('#').next().unwrap_or_default().trim().to_owned();
        (!content.is_empty()).then_some((number, content))
    });
    let (number, first) = lines
        .next()
        .ok_or_else(|| parse_error(path, None, "only comments and blank lines found"))?;
    let rest = keyword_stripped(&first).map_err(|e| parse_error(path, Some(number), e))?;
    let (number, counts) = match rest {
        "" => lines
            .next()
            .ok_or_else(|| parse_error(path, None, "the vertex and face counts are missing"))?,
        rest => (number, rest.to_owned()),
    };
    let [vertex_count, face_count] =
        element_counts(&counts).map_err(|e| parse_error(path, Some(number), e))?;

    let mut assembly = Assembly::new(path, 0);
    for read in 0..vertex_count {
        let (number, line) = lines
            .next()
            .ok_or_else(|| truncated(path, "vertices", vertex_count, read))?;
        let vertex = three_numbers(&mut line.split_whitespace())
            .map_err(|e| parse_error(path, Some(number), e))?;
        assembly.push_vertex(vertex, Some(number))?;
    }
    for read in 0..face_count {
        let (number, line) = lines
            .next()
            .ok_or_else(|| truncated(path, "faces", face_count, read))?;
        let corners = polygon(&line).map_err(|e| parse_error(path, Some(number), e))?;
        assembly.push_polygon(corners, Some(number));
    }
    assembly.finish()
}

fn truncated(path: &Path, what: &str, claimed: u64, read: u64) -> GeometryError {
    parse_error(
        path,
        None,
        format!("the file ends after {read} of the {claimed} {what} that its header promises"),
    )
}

/// What follows the keyword on its line; some writers put the counts there, even without a space.
fn keyword_stripped(line: &str) -> Result<&str, String> {
    const WITHOUT_FOURTH_COORDINATE: [&str; 8] = [
        "OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF",
    ];
    let keyword_len = line
        .find(|c: char| !c.is_ascii_alphabetic())
        .unwrap_or(line.len());
    let (keyword, rest) = line.split_at(keyword_len);
    if !WITHOUT_FOURTH_COORDINATE.contains(&keyword) {
        return Err(format!(
            "the first line must start with OFF, not {}",
            quoted(line)
        ));
    }
    let rest = rest.trim();
    if rest.starts_with("BINARY") {
        return Err("binary OFF is not supported".into());
    }
    Ok(rest)
}

fn element_counts(line: &str) -> Result<[u64; 2], String> {
    let mut tokens = line.split_whitespace();
    let mut count = || {
        let token = tokens.next().unwrap_or_default();
        token
            .parse()
            .map_err(|_| format!("expected vertex and face counts, not {}", quoted(line)))
    };
    Ok([count()?, count()?])
}

fn polygon(line: &str) -> Result<Vec<i64>, String> {
    let mut tokens = line.split_whitespace();
    let mut number = || {
        let token = tokens
            .next()
            .ok_or_else(|| "a face has fewer corners than it promises".to_string())?;
        token
            .parse::<i64>()
            .map_err(|_| format!("{} is not a vertex number", quoted(token)))
    };
    let count = number()?;
    (0..count).map(|_| number()).collect()
}
