//! Where the mesh files are that a URDF names.

use std::path::{Path, PathBuf};

use crate::HandError;

/// Finds mesh files by the names that a URDF gives them.
pub(crate) struct MeshFinder {
    /// Folders that relative paths may start from, nearest first.
    roots: Vec<PathBuf>,
}

impl MeshFinder {
    /// Looks in the URDF file's folder, then in `search_paths`, then in the folders above the file's.
    pub(crate) fn new(urdf: &Path, search_paths: &[PathBuf]) -> Self {
        let absolute = std::path::absolute(urdf).unwrap_or_else(|_| urdf.into());
        let mut folders = absolute.ancestors().skip(1).map(Path::to_path_buf);
        let own = folders.next();
        let roots = own.into_iter().chain(search_paths.iter().cloned());
        Self {
            roots: roots.chain(folders).collect(),
        }
    }

    /// Returns the file that `name` means: `package://package/path`, `model://package/path`, `file:///path`, an
    /// absolute or a relative path. Packages are folders of that name, or any root that has the rest of the path.
    ///
    /// # Errors
    /// [`HandError::MissingMesh`], said of `link`.
    pub(crate) fn find(&self, name: &str, link: &str) -> Result<PathBuf, HandError> {
        let package = ["package://", "model://"]
            .iter()
            .find_map(|scheme| name.strip_prefix(scheme));
        let relative: Vec<&str> = match package {
            Some(path) => {
                let without_package = path.split_once('/').map(|(_, rest)| rest);
                [Some(path), without_package]
                    .into_iter()
                    .flatten()
                    .collect()
            }
            None => vec![name.strip_prefix("file://").unwrap_or(name)],
        };
        // Joining an absolute path to a root gives that path.
        let candidates = relative
            .iter()
            .flat_map(|path| self.roots.iter().map(move |root| root.join(path)));
        candidates
            .into_iter()
            .find(|candidate| candidate.is_file())
            .ok_or_else(|| HandError::MissingMesh {
                link: link.into(),
                mesh: name.into(),
                looked_in: self
                    .roots
                    .iter()
                    .map(|root| root.display().to_string())
                    .collect(),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_and_paths_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let at = |path: &str| folder.path().join(path);
        for path in [
            "ws/arm/urdf/x",
            "ws/arm/meshes",
            "ws/tool/meshes",
            "elsewhere",
        ] {
            std::fs::create_dir_all(at(path)).unwrap();
        }
        for file in [
            "ws/arm/meshes/a.stl",
            "ws/tool/meshes/b.stl",
            "elsewhere/c.stl",
        ] {
            std::fs::write(at(file), "solid").unwrap();
        }
        let finder = MeshFinder::new(&at("ws/arm/urdf/x/arm.urdf"), &[at("elsewhere")]);
        let found = |name: &str| finder.find(name, "link");
        assert_eq!(
            found("package://arm/meshes/a.stl").unwrap(),
            at("ws/arm/meshes/a.stl")
        );
        assert_eq!(
            found("package://renamed/meshes/a.stl").unwrap(),
            at("ws/arm/meshes/a.stl")
        );
        assert_eq!(
            found("package://tool/meshes/b.stl").unwrap(),
            at("ws/tool/meshes/b.stl")
        );
        assert_eq!(
            found("../../meshes/a.stl").unwrap().canonicalize().unwrap(),
            at("ws/arm/meshes/a.stl").canonicalize().unwrap()
        );
        assert_eq!(found("c.stl").unwrap(), at("elsewhere/c.stl"));
        let absolute = format!("file://{}", at("elsewhere/c.stl").display());
        assert_eq!(found(&absolute).unwrap(), at("elsewhere/c.stl"));
        for missing in ["d.stl", "package://arm", "package://", "", "meshes"] {
            assert!(
                matches!(found(missing), Err(HandError::MissingMesh { .. })),
                "{missing}"
            );
        }
    }
}
