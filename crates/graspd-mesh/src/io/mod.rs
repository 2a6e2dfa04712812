//! Mesh files: which reader or writer serves which extension.

mod assemble;
mod dae;
mod gltf;
mod obj;
mod off;
mod ply;
mod polygon;
mod save;
mod stl;

use std::path::Path;

use nalgebra::{Point3, Vector3};

use graspd_geom::{GeometryError, TriangleMesh};

pub use assemble::parse_error;
pub use save::{require_mesh_format, save_mesh, save_obj, write_whole};

/// Positions and normals, `[n, 3]` each; no normals where the file has none.
pub type OrientedPoints = (Vec<Point3<f64>>, Vec<Vector3<f64>>);

/// The extensions that [`load_mesh`] knows.
const READABLE: &str = ".obj, .stl, .ply, .off, .glb, .gltf, .dae";

/// Reads a triangle mesh; the format follows from the extension, whose case does not matter.
///
/// * OBJ: all objects and groups as one mesh, vertices as indexed in the file; texture, normals, colours and
///   materials are ignored.
/// * STL, binary or text, in single precision: corners at the same position become one vertex.
/// * PLY, binary or text: the elements `vertex` and `face`.
/// * OFF, also COFF, NOFF and the like: colours and normals are ignored.
/// * glTF 2, binary or text: what its scene shows, as one mesh, turned to z up (the format has y up and metres).
/// * COLLADA: what its scene shows, as one mesh, turned to z up and converted to metres as the file itself says.
///
/// Polygons are triangulated, faces with a repeated vertex are dropped, vertices without faces are kept.
/// Coordinates are taken as they are, in metres by convention.
///
/// # Errors
/// Whatever is wrong with the file, as a [`GeometryError`] that names it.
pub fn load_mesh(path: impl AsRef<Path>) -> Result<TriangleMesh, GeometryError> {
    let path = path.as_ref();
    let read = reader(path)?;
    read(&file_bytes(path)?, path)
}

/// The triangle mesh in the bytes of a file called `name`, which need not exist, as [`load_mesh`] reads it.
///
/// # Errors
/// As [`load_mesh`].
pub fn parse_mesh(bytes: &[u8], name: impl AsRef<Path>) -> Result<TriangleMesh, GeometryError> {
    let path = name.as_ref();
    let read = reader(path)?;
    if bytes.is_empty() {
        return Err(GeometryError::Empty { path: path.into() });
    }
    read(bytes, path)
}

/// Reads the element `vertex` of a PLY file, binary or text: positions, and normals if it has nx,
/// ny and nz (else empty).
///
/// # Errors
/// Another extension, or whatever is wrong with the file, as a [`GeometryError`] that names it.
pub fn load_points(path: impl AsRef<Path>) -> Result<OrientedPoints, GeometryError> {
    let path = path.as_ref();
    if extension(path) != "ply" {
        return Err(unsupported(path, ".ply"));
    }
    ply::read_points(&file_bytes(path)?, path)
}

type Reader = fn(&[u8], &Path) -> Result<TriangleMesh, GeometryError>;

/// What reads a file of this name.
fn reader(path: &Path) -> Result<Reader, GeometryError> {
    Ok(match extension(path).as_str() {
        "obj" => obj::read,
        "stl" => stl::read,
        "ply" => ply::read,
        "off" => off::read,
        "dae" => dae::read,
        "glb" | "gltf" => gltf::read,
        _ => return Err(unsupported(path, READABLE)),
    })
}

/// Reads a regular file that is not empty.
///
/// # Errors
/// If it is missing, empty, no regular file, or cannot be read.
pub fn file_bytes(path: &Path) -> Result<Vec<u8>, GeometryError> {
    let failed = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => GeometryError::Missing { path: path.into() },
        _ => GeometryError::Read {
            path: path.into(),
            source,
        },
    };
    // A pipe or device could make the reader wait for ever.
    if !std::fs::metadata(path).map_err(failed)?.is_file() {
        return Err(GeometryError::NotAFile { path: path.into() });
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    if bytes.is_empty() {
        return Err(GeometryError::Empty { path: path.into() });
    }
    Ok(bytes)
}

fn extension(path: &Path) -> String {
    path.extension()
        .map(|extension| extension.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

fn unsupported(path: &Path, supported: &'static str) -> GeometryError {
    let extension = extension(path);
    GeometryError::UnsupportedFormat {
        path: path.into(),
        found: if extension.is_empty() {
            "a name without an extension".into()
        } else {
            format!(".{extension}")
        },
        supported,
    }
}

/// The lines of a text file with their numbers from 1, whatever their line ends are.
///
/// Bytes that are not UTF-8 (a name in Latin-1, say) become replacement characters rather than errors.
fn numbered_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    // A byte order mark would hide the first line's keyword.
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    text.split(|&byte| byte == b'\n')
        .enumerate()
        .map(|(index, line)| (index + 1, String::from_utf8_lossy(line)))
}

/// A token of a file for an error message: without control characters, and not too long.
fn quoted(token: &str) -> String {
    const LONGEST: usize = 40;
    let mut text: String = token
        .chars()
        .take(LONGEST)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect();
    if token.chars().nth(LONGEST).is_some() {
        text.push_str("...");
    }
    format!("\"{text}\"")
}

/// Reads exactly three numbers off the front of `tokens`.
fn three_numbers<'a>(tokens: &mut impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let mut point = [0.0; 3];
    for coordinate in &mut point {
        let token = tokens
            .next()
            .ok_or_else(|| "a vertex has fewer than three coordinates".to_string())?;
        *coordinate = token
            .parse()
            .map_err(|_| format!("{} is not a number", quoted(token)))?;
    }
    Ok(point)
}
