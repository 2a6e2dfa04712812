//! What can be wrong with a mesh or its file, and what to do about it.

use std::path::PathBuf;

use graspd_settings::OutOfRange;

/// Why a mesh could not be read, written or used; each message is one line: the file, the fault, the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// There is no such file.
    #[error("{path}: no such file; check the path")]
    Missing {
        /// The file asked for.
        path: PathBuf,
    },
    /// The path names a folder, pipe or device.
    #[error("{path}: not a regular file; give the path of a mesh file")]
    NotAFile {
        /// The path asked for.
        path: PathBuf,
    },
    /// The operating system could not read the file.
    #[error("{path}: cannot be read ({source}); check its permissions")]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The operating system could not write the file.
    #[error("{path}: cannot be written ({source}); check that the folder exists and is writable")]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The file holds no bytes.
    #[error("{path}: the file is empty; export or download it again")]
    Empty {
        /// The empty file.
        path: PathBuf,
    },
    /// The file name's extension names no format that can be read or written.
    #[error("{path}: {found} is not a supported mesh format; convert it to one of {supported}")]
    UnsupportedFormat {
        /// The file asked for.
        path: PathBuf,
        /// The extension with its dot, or a phrase where there is none.
        found: String,
        /// The supported extensions.
        supported: &'static str,
    },
    /// The bytes do not follow the format that the extension promises.
    #[error("{path}{}: {fault}; {remedy}", at_line(*line))]
    Parse {
        /// The faulty file.
        path: PathBuf,
        /// The line in question, counted from 1, where the format has lines.
        line: Option<usize>,
        /// What is wrong.
        fault: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A vertex with a coordinate that is NaN or infinite.
    #[error(
        "{path}{}: vertex {vertex} is not finite ({}, {}, {}); export the mesh again or delete the vertex",
        at_line(*line), value[0], value[1], value[2]
    )]
    VertexNotFinite {
        /// The faulty file.
        path: PathBuf,
        /// The line in question, counted from 1, where the format has lines.
        line: Option<usize>,
        /// Index of the vertex, counted from 0.
        vertex: usize,
        /// Its coordinates.
        value: [f64; 3],
    },
    /// A face that refers to a vertex that does not exist.
    #[error(
        "{path}{}: a face refers to vertex {index}, but the file has {vertices} vertices numbered from {first}; \
         the file is damaged: export it again",
        at_line(*line)
    )]
    IndexOutOfRange {
        /// The faulty file.
        path: PathBuf,
        /// The line in question, counted from 1, where the format has lines.
        line: Option<usize>,
        /// The vertex number as the file gives it (relative numbers already resolved).
        index: i64,
        /// How many vertices there are.
        vertices: usize,
        /// The number of the first vertex in this format.
        first: i64,
    },
    /// Vertices only, or none at all.
    #[error(
        "{path}: the mesh has no faces; give a surface mesh rather than a point cloud or curve"
    )]
    NoFaces {
        /// The file without faces.
        path: PathBuf,
    },
    /// More vertices than 32-bit indices can number.
    #[error("{path}: the mesh has more than 4294967295 vertices; simplify it")]
    TooLarge {
        /// The file in question.
        path: PathBuf,
    },
    /// The surface has holes.
    #[error(
        "{name}: the surface is open: {} in {}, {total_mm:.1} mm of boundary in total, the longest \
        {longest_mm:.1} mm, \
         the largest {diameter_mm:.1} mm across; close it with `graspd repair`",
        count(*boundary_edges, "boundary edge"), count(*loops, "loop")
    )]
    Open {
        /// The mesh's file or name.
        name: String,
        /// Edges with unequally many faces on their two sides.
        boundary_edges: usize,
        /// How many closed boundary loops they form.
        loops: usize,
        /// Summed length of the boundary \[mm\].
        total_mm: f64,
        /// Length of the longest loop \[mm\].
        longest_mm: f64,
        /// Greatest distance between two vertices of one loop, over all loops \[mm\].
        diameter_mm: f64,
    },
    /// Neighbouring faces disagree on which side is outside.
    #[error(
        "{name}: the faces are not consistently oriented ({}); orient them alike with \
         `graspd repair`",
        count(*edges, "edge with neighbours that disagree on the outside")
    )]
    NotOriented {
        /// The mesh's file or name.
        name: String,
        /// How many edges are crossed by neighbours of opposite orientation.
        edges: usize,
    },
    /// The same face more than once, which makes volumes and inside tests wrong.
    #[error("{name}: {} more than once; delete the copies with `graspd repair`",
        if *faces == 1 { "1 face occurs".into() } else { format!("{faces} faces occur") })]
    DuplicateFaces {
        /// The mesh's file or name.
        name: String,
        /// How many faces repeat another one.
        faces: usize,
    },
    /// Closed, but with nothing inside, such as a sheet with two sides.
    #[error("{name}: the surface encloses no volume; give a solid object, or thicken the sheet")]
    NoVolume {
        /// The mesh's file or name.
        name: String,
    },
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
        position: [f64; 3],
    },
    /// A face refers to a vertex that does not exist.
    #[error(
        "face {face} refers to vertex {index}, but the mesh has {vertices} vertices; rebuild it or drop the face"
    )]
    FaceOutOfRange {
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
         one of them from {from:?} to {to:?}; close its holes and orient its faces alike, or run a mesh \
         repair tool"
    )]
    NotClosed {
        /// How many edges are open.
        edges: usize,
        /// One end of an open edge.
        from: [f64; 3],
        /// Its other end.
        to: [f64; 3],
    },
    /// The faces' normals point inward.
    #[error("the mesh is inside-out (signed volume {volume:e} m^3); reverse its faces")]
    InsideOut {
        /// Signed volume \[m^3\].
        volume: f64,
    },
    /// A grid's resolution is out of range.
    #[error("a grid of {dims:?} samples was asked for; each axis needs 2 to {max}")]
    GridResolution {
        /// Samples along each axis.
        dims: [usize; 3],
        /// The most that an axis may have.
        max: usize,
    },
    /// A grid would need more memory than can be had.
    #[error("no memory for a grid of {dims:?} samples ({bytes} bytes); ask for a lower resolution")]
    GridMemory {
        /// Samples along each axis.
        dims: [usize; 3],
        /// What the samples need \[bytes\].
        bytes: usize,
    },
    /// A grid's box is empty or not finite.
    #[error("a grid's origin, spacing and padding must be finite and its spacing positive: {what}")]
    GridExtent {
        /// What is wrong.
        what: String,
    },
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// Too few points to tell a surface.
    #[error("the cloud has {}, but a surface needs at least {least}; capture more views or thin the cloud less",
        count(*points, "point"))]
    CloudTooSmall {
        /// How many there are.
        points: usize,
        /// How many are needed.
        least: usize,
    },
    /// A coordinate or normal that is NaN or infinite.
    #[error(
        "point {point} or its normal is not finite: {position:?}; leave out pixels without depth"
    )]
    CloudNotFinite {
        /// Index of the point.
        point: usize,
        /// Its coordinates.
        position: [f64; 3],
    },
    /// Normals that are missing or make no sense.
    #[error("the cloud's normals cannot be used: {fault}; estimate outward normals first")]
    CloudNormals {
        /// What is wrong.
        fault: String,
    },
    /// Numbers that no camera has.
    #[error("the camera cannot be used: {fault}; it must have {wanted}")]
    Camera {
        /// What is wrong.
        fault: String,
        /// What would be right.
        wanted: &'static str,
    },
    /// The points' extent fits no object in metres.
    #[error("the cloud is {extent} m across; {remedy}")]
    CloudExtent {
        /// Its longest extent \[m\].
        extent: f64,
        /// What may be wrong.
        remedy: &'static str,
    },
    /// A reconstruction would need more memory than allowed.
    #[error(
        "a reconstruction of depth {depth} needs about {} MiB, but {} MiB are allowed; each depth less needs a \
        quarter",
        needed >> 20, allowed >> 20
    )]
    ReconstructionMemory {
        /// The depth asked for.
        depth: u32,
        /// What it needs \[bytes\].
        needed: u64,
        /// The limit \[bytes\].
        allowed: u64,
    },
    /// A grid was given the wrong number of samples, or one that is not finite.
    #[error("a grid of {dims:?} samples cannot hold these values: {what}")]
    GridValues {
        /// Samples along each axis.
        dims: [usize; 3],
        /// What is wrong.
        what: String,
    },
}

fn at_line(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!(", line {line}"))
}

fn count(number: usize, noun: &str) -> String {
    match (number, noun.split_once(' ')) {
        (1, _) => format!("1 {noun}"),
        // "edge with ..." takes its plural on the first word, "boundary edge" on the last.
        (_, Some((head, tail))) if tail.contains(' ') => format!("{number} {head}s {tail}"),
        _ => format!("{number} {noun}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line_with_file_fault_and_remedy() {
        let open = GeometryError::Open {
            name: "cup.obj".into(),
            boundary_edges: 12,
            loops: 1,
            total_mm: 30.0,
            longest_mm: 30.0,
            diameter_mm: 9.54,
        };
        assert_eq!(
            open.to_string(),
            "cup.obj: the surface is open: 12 boundary edges in 1 loop, 30.0 mm of boundary in total, the longest \
             30.0 mm, the largest 9.5 mm across; close it with `graspd repair`"
        );
        let vertex = GeometryError::VertexNotFinite {
            path: "a.off".into(),
            line: Some(7),
            vertex: 4,
            value: [0.0, f64::NAN, 1.0],
        };
        assert_eq!(
            vertex.to_string(),
            "a.off, line 7: vertex 4 is not finite (0, NaN, 1); export the mesh again or delete the vertex"
        );
        let oriented = GeometryError::NotOriented {
            name: "x".into(),
            edges: 3,
        };
        assert!(oriented.to_string().contains("3 edges with neighbours"));
    }
}
