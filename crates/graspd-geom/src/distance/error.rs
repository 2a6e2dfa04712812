//! What can be wrong with a mesh whose distance is asked for, or with a grid of distances.

use nalgebra::Point3;
use thiserror::Error;

/// Why no distance or distance grid can be computed.
#[derive(Debug, Error, PartialEq)]
pub enum DistanceError {
    /// No faces.
    #[error("the mesh has no faces; load or build one with at least 4 triangles")]
    EmptyMesh,
    /// A coordinate is NaN or infinite.
    #[error(
        "vertex {vertex} has a coordinate that is not finite: {position:?}; repair the mesh first"
    )]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
        /// Its coordinates.
        position: Point3<f64>,
    },
    /// A face refers to a vertex that does not exist.
    #[error("face {face} refers to vertex {index}, but the mesh has {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the face.
        face: usize,
        /// The vertex index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// Inside and outside are not defined.
    #[error(
        "the mesh is not closed: {edges} edges do not have as many faces on one side as on the other, \
         one of them from {from:?} to {to:?}; close its holes and orient its faces alike first"
    )]
    NotClosed {
        /// How many edges are open.
        edges: usize,
        /// One end of an open edge.
        from: Point3<f64>,
        /// Its other end.
        to: Point3<f64>,
    },
    /// The faces' normals point inward.
    #[error("the mesh is inside out (signed volume {volume:e} m^3); reverse its faces")]
    InsideOut {
        /// Signed volume \[m^3\].
        volume: f64,
    },
    /// The closed surface is flat.
    #[error("the mesh encloses no volume ({volume:e} m^3): every point would be outside")]
    NoVolume {
        /// Signed volume \[m^3\].
        volume: f64,
    },
    /// A grid's resolution is out of range.
    #[error("a grid of {dims:?} samples was asked for; each axis needs 2 to {max}")]
    Resolution {
        /// Samples along each axis.
        dims: [usize; 3],
        /// The most that an axis may have.
        max: usize,
    },
    /// A grid would need more memory than can be had.
    #[error("no memory for a grid of {dims:?} samples ({bytes} bytes); ask for a lower resolution")]
    Memory {
        /// Samples along each axis.
        dims: [usize; 3],
        /// What the samples need \[bytes\].
        bytes: usize,
    },
    /// A grid's box is empty or not finite.
    #[error("a grid's origin, spacing and padding must be finite and its spacing positive: {what}")]
    Extent {
        /// What is wrong.
        what: String,
    },
    /// A grid was given the wrong number of samples, or one that is not finite.
    #[error("a grid of {dims:?} samples cannot hold these values: {what}")]
    Values {
        /// Samples along each axis.
        dims: [usize; 3],
        /// What is wrong.
        what: String,
    },
}
