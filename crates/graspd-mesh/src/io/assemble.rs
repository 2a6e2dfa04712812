//! From the vertices and polygons of a file to a checked triangle mesh.

use std::path::Path;

use nalgebra::Point3;

use super::polygon::triangulate;
use graspd_geom::{GeometryError, TriangleMesh};

const EXPORT_AGAIN: &str = "the file is damaged or of another format: export it again";

/// Collects what a file holds, and checks it.
pub(super) struct Assembly<'a> {
    path: &'a Path,
    /// The number that the format gives to its first vertex.
    first_index: i64,
    vertices: Vec<Point3<f64>>,
    /// Vertex numbers of all polygons one after the other, counted from `first_index`.
    corners: Vec<i64>,
    /// For each polygon, where its corners end, and the line that it stands on.
    polygons: Vec<(usize, Option<usize>)>,
}

impl<'a> Assembly<'a> {
    pub(super) fn new(path: &'a Path, first_index: i64) -> Self {
        Self {
            path,
            first_index,
            vertices: Vec::new(),
            corners: Vec::new(),
            polygons: Vec::new(),
        }
    }

    /// Adds a vertex.
    pub(super) fn push_vertex(
        &mut self,
        value: [f64; 3],
        line: Option<usize>,
    ) -> Result<(), GeometryError> {
        if value.iter().any(|coordinate| !coordinate.is_finite()) {
            return Err(GeometryError::VertexNotFinite {
                path: self.path.into(),
                line,
                vertex: self.vertices.len(),
                value,
            });
        }
        if self.vertices.len() >= u32::MAX as usize {
            return Err(GeometryError::TooLarge {
                path: self.path.into(),
            });
        }
        self.vertices.push(value.into());
        Ok(())
    }

    /// Adds a polygon by vertex numbers as the file gives them; they may refer to vertices still to come.
    pub(super) fn push_polygon(
        &mut self,
        corners: impl IntoIterator<Item = i64>,
        line: Option<usize>,
    ) {
        self.corners.extend(corners);
        self.polygons.push((self.corners.len(), line));
    }

    /// The mesh: indices checked, polygons triangulated, degenerate ones dropped.
    pub(super) fn finish(self) -> Result<TriangleMesh, GeometryError> {
        let mut faces = Vec::with_capacity(self.polygons.len());
        let mut polygon: Vec<u32> = Vec::new();
        let mut start = 0;
        for (end, line) in self.polygons {
            polygon.clear();
            for &number in &self.corners[start..end] {
                let index = number.saturating_sub(self.first_index);
                if index < 0 || index >= self.vertices.len() as i64 {
                    return Err(GeometryError::IndexOutOfRange {
                        path: self.path.into(),
                        line,
                        index: number,
                        vertices: self.vertices.len(),
                        first: self.first_index,
                    });
                }
                polygon.push(index as u32);
            }
            start = end;
            triangulate(&mut polygon, &self.vertices, &mut faces);
        }
        if faces.is_empty() {
            return Err(GeometryError::NoFaces {
                path: self.path.into(),
            });
        }
        Ok(TriangleMesh {
            vertices: self.vertices,
            faces,
        })
    }
}

/// The error for bytes that do not follow the format.
pub fn parse_error(path: &Path, line: Option<usize>, fault: impl Into<String>) -> GeometryError {
    GeometryError::Parse {
        path: path.into(),
        line,
        fault: fault.into(),
        remedy: EXPORT_AGAIN,
    }
}
