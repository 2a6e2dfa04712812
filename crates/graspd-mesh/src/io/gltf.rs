//! glTF 2 (`.glb`, `.gltf`): the geometry of its scene, as one mesh, turned to z up.
//!
//! The crate `gltf` parses and checks the description; the arrays are read here, with their bounds checked, because a
//! description may promise more than its buffers hold.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use base64::Engine;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Accessor, Gltf, Node, Primitive, Semantic};
use nalgebra::{Matrix4, Point3};

use super::assemble::{Assembly, parse_error};
use super::{file_bytes, quoted};
use graspd_geom::{GeometryError, TriangleMesh};

/// Scenes nested deeper than this are taken for nodes that contain themselves.
const DEEPEST: usize = 64;
/// Nodes visited before a scene counts as one that multiplies itself without end.
const MAX_NODES: usize = 100_000;
/// Bytes of a binary file's header, with that of its first chunk.
const HEADER_LEN: usize = 20;

/// Reads triangles, strips and fans of every mesh that the scene shows, under the transforms of their nodes. The
/// format prescribes metres and y up; z goes up here, as with COLLADA. A file without a scene gives its meshes as
/// they are. Buffers may be inside the file, in `data:` addresses or in files beside it. Materials, normals and
/// morph targets are ignored; so are skins, whose meshes come as they were bound.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    check_header(bytes).map_err(|fault| parse_error(path, None, fault))?;
    let file = Gltf::from_slice(bytes)
        .map_err(|error| parse_error(path, None, description_fault(bytes, &error)))?;
    let version = &file.as_json().asset.version;
    if !version.starts_with("2.") {
        let fault = format!("it is glTF of version {}, not 2", quoted(version));
        return Err(parse_error(path, None, fault));
    }
    let buffers = file
        .buffers()
        .map(|buffer| buffer_bytes(&buffer, file.blob.as_deref(), path))
        .collect::<Result<Vec<_>, _>>()?;
    let mut scene = Scene {
        path,
        buffers,
        assembly: Assembly::new(path, 0),
        vertices: 0,
        nodes: 0,
    };
    // x stays, y goes up, and z, which comes out of the front, becomes -y.
    let world = Matrix4::new(
        1.0, 0.0, 0.0, 0.0, //
        0.0, 0.0, -1.0, 0.0, //
        0.0, 1.0, 0.0, 0.0, //
        0.0, 0.0, 0.0, 1.0,
    );
    match file.default_scene().or_else(|| file.scenes().next()) {
        Some(shown) => {
            for node in shown.nodes() {
                scene.push_node(&node, &world, 0)?;
            }
        }
        None => {
            for mesh in file.meshes() {
                scene.push_mesh(&mesh, &world)?;
            }
        }
    }
    scene.assembly.finish()
}

/// What is wrong with the description, in one short line.
fn description_fault(bytes: &[u8], error: &gltf::Error) -> String {
    const LONGEST: usize = 160;
    // The parser knows none of the extensions that change geometry, and does not name the one that it lacks.
    let file = Gltf::from_slice_without_validation(bytes).ok();
    let needed = file
        .as_ref()
        .and_then(|file| file.extensions_required().next());
    if let Some(extension) = needed {
        return format!(
            "it needs the glTF extension {}, which cannot be read",
            quoted(extension)
        );
    }
    let message = error.to_string();
    let words: Vec<&str> = message.split_whitespace().collect();
    let short: String = words.join(" ").chars().take(LONGEST).collect();
    format!("not a valid glTF file: {short}")
}

/// Whether a binary file's length is what its header says; the parser takes that on trust.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let promised = bytes.get(8..12).and_then(|length| length.try_into().ok());
    let promised = promised.map_or(0, u32::from_le_bytes) as usize;
    if bytes.len() < HEADER_LEN || promised < HEADER_LEN {
        return Err("its header is incomplete".into());
    }
    if promised > bytes.len() {
        return Err(format!(
            "the header promises {promised} bytes, but the file holds {}: it was cut short",
            bytes.len()
        ));
    }
    Ok(())
}

fn buffer_bytes<'a>(
    buffer: &gltf::Buffer<'_>,
    blob: Option<&'a [u8]>,
    path: &Path,
) -> Result<Cow<'a, [u8]>, GeometryError> {
    let fault = |fault: String| parse_error(path, None, fault);
    let number = buffer.index();
    let bytes: Cow<'a, [u8]> = match buffer.source() {
        Source::Bin => blob
            .ok_or_else(|| fault(format!("buffer {number} has neither an address nor bytes")))?
            .into(),
        Source::Uri(address) => match address.strip_prefix("data:") {
            Some(data) => embedded(data)
                .ok_or_else(|| fault(format!("buffer {number} holds no valid base64")))?
                .into(),
            None if address.contains("://") || Path::new(address).is_absolute() => {
                let address = quoted(address);
                return Err(fault(format!(
                    "buffer {number} is at {address}; only files beside the mesh are read"
                )));
            }
            None => file_bytes(&path.with_file_name(percent_decoded(address)))?.into(),
        },
    };
    if bytes.len() < buffer.length() {
        let (promised, held) = (buffer.length(), bytes.len());
        return Err(fault(format!(
            "buffer {number} promises {promised} bytes, but there are {held}: it was cut short"
        )));
    }
    Ok(bytes)
}

/// The bytes of what follows `data:`, for example `application/octet-stream;base64,AAAA`.
fn embedded(data: &str) -> Option<Vec<u8>> {
    let (kind, text) = data.split_once(',')?;
    let lenient = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    let base64 = GeneralPurpose::new(&base64::alphabet::STANDARD, lenient);
    kind.ends_with(";base64")
        .then(|| base64.decode(text).ok())
        .flatten()
}

/// A relative address as a file name: `%20` is a space.
fn percent_decoded(address: &str) -> String {
    let mut bytes = Vec::with_capacity(address.len());
    let mut rest = address.as_bytes();
    while let [first, others @ ..] = rest {
        let digits = others.get(..2).and_then(|d| std::str::from_utf8(d).ok());
        let code = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match code {
            Some(code) if *first == b'%' => {
                bytes.push(code);
                rest = &others[2..];
            }
            _ => {
                bytes.push(*first);
                rest = others;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

struct Scene<'a, 'p> {
    path: &'p Path,
    buffers: Vec<Cow<'a, [u8]>>,
    assembly: Assembly<'p>,
    /// How many vertices have been pushed.
    vertices: usize,
    nodes: usize,
}

impl Scene<'_, '_> {
    fn fault(&self, fault: impl Into<String>) -> GeometryError {
        parse_error(self.path, None, fault)
    }

    fn push_node(
        &mut self,
        node: &Node<'_>,
        outer: &Matrix4<f64>,
        depth: usize,
    ) -> Result<(), GeometryError> {
        self.nodes += 1;
        if depth > DEEPEST || self.nodes > MAX_NODES {
            return Err(self.fault("its nodes contain themselves"));
        }
        let own = node.transform().matrix();
        let own = Matrix4::from_fn(|row, column| f64::from(own[column][row]));
        let placement = outer * own;
        if let Some(mesh) = node.mesh() {
            self.push_mesh(&mesh, &placement)?;
        }
        for child in node.children() {
            self.push_node(&child, &placement, depth + 1)?;
        }
        Ok(())
    }

    fn push_mesh(
        &mut self,
        mesh: &gltf::Mesh<'_>,
        placement: &Matrix4<f64>,
    ) -> Result<(), GeometryError> {
        // A mirrored placement turns faces inside out.
        let is_mirrored = placement.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        // Primitives with different materials often share their positions.
        let mut first_of = HashMap::new();
        for primitive in mesh.primitives() {
            let mode = primitive.mode();
            if !matches!(
                mode,
                Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
            ) {
                continue;
            }
            let Some(positions) = primitive.get(&Semantic::Positions) else {
                continue;
            };
            let first = match first_of.get(&positions.index()) {
                Some(&first) => first,
                None => {
                    let first = self.vertices;
                    self.push_positions(&positions, placement)?;
                    first_of.insert(positions.index(), first);
                    first
                }
            };
            let corners = self.corners(&primitive, positions.count())?;
            for [a, b, c] in triangles(mode, &corners) {
                let face = if is_mirrored { [a, c, b] } else { [a, b, c] };
                self.assembly
                    .push_polygon(face.map(|corner| first as i64 + i64::from(corner)), None);
            }
        }
        Ok(())
    }

    fn push_positions(
        &mut self,
        positions: &Accessor<'_>,
        placement: &Matrix4<f64>,
    ) -> Result<(), GeometryError> {
        if (positions.data_type(), positions.dimensions()) != (DataType::F32, Dimensions::Vec3) {
            return Err(self.fault("its positions are not three floating-point numbers each"));
        }
        let places = self.elements(positions)?;
        for place in places {
            let buffer = &self.buffers[place.buffer];
            let number = |axis: usize| {
                let start = place.start + 4 * axis;
                let bytes = buffer[start..start + 4].try_into().unwrap_or_default();
                f64::from(f32::from_le_bytes(bytes))
            };
            let point = Point3::new(number(0), number(1), number(2));
            let placed = placement.transform_point(&point);
            self.assembly.push_vertex(placed.coords.into(), None)?;
            self.vertices += 1;
        }
        Ok(())
    }

    /// The vertices of a primitive, in the order in which its triangles use them.
    fn corners(
        &self,
        primitive: &Primitive<'_>,
        vertices: usize,
    ) -> Result<Vec<u32>, GeometryError> {
        let Some(indices) = primitive.indices() else {
            return Ok((0..vertices as u32).collect());
        };
        let size = match (indices.data_type(), indices.dimensions()) {
            (DataType::U8, Dimensions::Scalar) => 1,
            (DataType::U16, Dimensions::Scalar) => 2,
            (DataType::U32, Dimensions::Scalar) => 4,
            _ => return Err(self.fault("its indices are not whole numbers")),
        };
        let corners: Vec<u32> = (self.elements(&indices)?)
            .map(|place| {
                let bytes = &self.buffers[place.buffer][place.start..place.start + size];
                let digits = bytes.iter().rev();
                digits.fold(0, |number, &digit| number << 8 | u32::from(digit))
            })
            .collect();
        match corners.iter().find(|&&corner| corner as usize >= vertices) {
            Some(corner) => Err(self.fault(format!(
                "a face refers to vertex {corner}, but its mesh has {vertices} numbered from 0"
            ))),
            None => Ok(corners),
        }
    }

    /// Where each element of an array starts, all of them within their buffer.
    fn elements(
        &self,
        accessor: &Accessor<'_>,
    ) -> Result<impl Iterator<Item = Place> + use<>, GeometryError> {
        let view = match (accessor.view(), accessor.sparse()) {
            (Some(view), None) => view,
            _ => return Err(self.fault("sparse arrays are not supported")),
        };
        let (buffer, size) = (view.buffer().index(), accessor.size());
        let stride = view.stride().unwrap_or(size);
        let count = accessor.count();
        let start = view.offset().checked_add(accessor.offset());
        let end = count.checked_sub(1).map_or(Some(0), |last| {
            last.checked_mul(stride)?
                .checked_add(size)?
                .checked_add(start?)
        });
        let limit = (view.offset().checked_add(view.length()))
            .map(|limit| limit.min(self.buffers[buffer].len()));
        match (start, end, limit) {
            (Some(start), Some(end), Some(limit)) if end <= limit && stride > 0 => Ok((0..count)
                .map(move |index| Place {
                    buffer,
                    start: start + index * stride,
                })),
            _ => Err(self.fault(format!(
                "array {} reaches beyond the end of its buffer",
                accessor.index()
            ))),
        }
    }
}

/// Where an array's element is.
struct Place {
    buffer: usize,
    start: usize,
}

fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => (corners.windows(3).enumerate())
            // Every other triangle of a strip runs backwards.
            .map(|(i, c)| {
                if i % 2 == 0 {
                    [c[0], c[1], c[2]]
                } else {
                    [c[1], c[0], c[2]]
                }
            })
            .collect(),
        Mode::TriangleFan => (corners.windows(2).skip(1))
            .map(|c| [corners[0], c[0], c[1]])
            .collect(),
        _ => (corners.chunks_exact(3))
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    }
}
