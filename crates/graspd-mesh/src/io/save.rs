//! Mesh writers; a file appears whole or not at all.

use std::io::Write;
use std::path::Path;

use graspd_geom::{GeometryError, TriangleMesh, write_atomically};

const WRITABLE: &str = ".obj, .stl, .ply, .off";

/// Writes a mesh in the format that the extension names (`.obj`, `.stl`, `.ply`, `.off`).
///
/// # Errors
/// An unsupported extension, or what [`save_obj`] gives.
pub fn save_mesh(mesh: &TriangleMesh, path: impl AsRef<Path>) -> Result<(), GeometryError> {
    let path = path.as_ref();
    require_mesh_format(path)?;
    match super::extension(path).as_str() {
        "obj" => save_obj(mesh, path),
        "stl" => save_stl(mesh, path),
        "ply" => save_ply(mesh, path),
        _ => save_off(mesh, path),
    }
}

/// Whether [`save_mesh`] knows the format that the extension names: to be asked before a mesh is computed.
///
/// # Errors
/// [`GeometryError::UnsupportedFormat`].
pub fn require_mesh_format(path: impl AsRef<Path>) -> Result<(), GeometryError> {
    let path = path.as_ref();
    match super::extension(path).as_str() {
        "obj" | "stl" | "ply" | "off" => Ok(()),
        _ => Err(super::unsupported(path, WRITABLE)),
    }
}

/// Writes a mesh as Wavefront OBJ, every coordinate to its last bit.
///
/// The mesh is written beside `path` under another name that then replaces `path`, so that no reader and no
/// interruption ever meets half a file.
///
/// # Errors
/// [`GeometryError::Write`] if the folder is missing, not writable or full; `path` is then as it was.
pub fn save_obj(mesh: &TriangleMesh, path: impl AsRef<Path>) -> Result<(), GeometryError> {
    write_whole(path.as_ref(), |out| {
        for p in &mesh.vertices {
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for face in &mesh.faces {
            let [a, b, c] = face.map(|index| u64::from(index) + 1);
            writeln!(out, "f {a} {b} {c}")?;
        }
        Ok(())
    })
}

/// Writes a mesh as OFF, otherwise as [`save_obj`].
fn save_off(mesh: &TriangleMesh, path: &Path) -> Result<(), GeometryError> {
    write_whole(path, |out| {
        writeln!(out, "OFF\n{} {} 0", mesh.vertices.len(), mesh.faces.len())?;
        for p in &mesh.vertices {
            writeln!(out, "{} {} {}", p.x, p.y, p.z)?;
        }
        for [a, b, c] in &mesh.faces {
            writeln!(out, "3 {a} {b} {c}")?;
        }
        Ok(())
    })
}

/// Writes a mesh as binary PLY in double precision, otherwise as [`save_obj`].
fn save_ply(mesh: &TriangleMesh, path: &Path) -> Result<(), GeometryError> {
    write_whole(path, |out| {
        let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n\
             property double x\nproperty double y\nproperty double z\n\
             element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
        )?;
        for coordinate in mesh.vertices.iter().flat_map(|p| p.iter()) {
            out.write_all(&coordinate.to_le_bytes())?;
        }
        for face in &mesh.faces {
            out.write_all(&[3])?;
            for index in face {
                out.write_all(&index.to_le_bytes())?;
            }
        }
        Ok(())
    })
}

/// Writes a mesh as binary STL, which keeps single precision and no shared vertices; otherwise as [`save_obj`].
fn save_stl(mesh: &TriangleMesh, path: &Path) -> Result<(), GeometryError> {
    write_whole(path, |out| {
        out.write_all(&[0; 80])?;
        out.write_all(&(mesh.faces.len() as u32).to_le_bytes())?;
        for face in 0..mesh.faces.len() {
            let normal = mesh
                .area_vector(face)
                .try_normalize(0.0)
                .unwrap_or_default();
            let corners = mesh.corners(face);
            for vector in [
                normal,
                corners[0].coords,
                corners[1].coords,
                corners[2].coords,
            ] {
                for coordinate in vector.iter() {
                    out.write_all(&(*coordinate as f32).to_le_bytes())?;
                }
            }
            out.write_all(&[0; 2])?;
        }
        Ok(())
    })
}

/// Writes a file under another name and renames it, so that it is there as a whole or not at all.
///
/// # Errors
/// [`GeometryError::Write`] with the system's reason.
pub fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), GeometryError> {
    write_atomically(path, content).map_err(|source| GeometryError::Write {
        path: path.into(),
        source,
    })
}
