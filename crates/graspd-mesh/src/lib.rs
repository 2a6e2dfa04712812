//! Mesh files, mesh repair, isosurfaces and built-in objects.
//!
//! ```
//! use graspd_mesh::{RepairSettings, builtin_object, load_mesh, repair, save_obj};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("mug.obj");
//! // A mesh file, here one made from a built-in object without its last face.
//! let mut mug = builtin_object("mug").ok_or("no such object")?;
//! mug.faces.pop();
//! save_obj(&mug, &path)?;
//!
//! let repaired = repair(&load_mesh(&path)?, &RepairSettings::default(), "mug.obj")?;
//! assert_eq!(repaired.mesh.faces.len(), mug.faces.len() + 1);
//! # Ok(())
//! # }
//! ```
//!
//! | | module |
//! |---|---|
//! | OBJ, STL, PLY, OFF, glTF, COLLADA | `io` |
//! | one closed surface of any triangles | `repair` |
//! | isosurface of a function on a grid | `isosurface` |
//! | built-in objects | `objects` |

mod io;
mod isosurface;
mod objects;
mod repair;

pub use io::{
    OrientedPoints, file_bytes, load_mesh, load_points, parse_error, parse_mesh,
    require_mesh_format, save_mesh, save_obj, write_whole,
};
pub use isosurface::{NodeGrid, isosurface};
pub use objects::{BUILTIN_OBJECTS, BuiltinObject, builtin_object};
pub use repair::{FilledHole, RepairReport, RepairSettings, RepairTier, RepairedMesh, repair};
