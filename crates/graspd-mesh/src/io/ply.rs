//! The Polygon File Format (PLY), binary and text.

use std::path::Path;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::OrientedPoints;
use super::assemble::{Assembly, parse_error};
use graspd_geom::{GeometryError, TriangleMesh};

/// Reads the elements `vertex` (properties x, y, z) and `face` (list `vertex_indices` or `vertex_index`).
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let contents = Contents::of(bytes, path)?;
    let mut assembly = Assembly::new(path, 0);
    for vertex in contents.vertices {
        assembly.push_vertex(vertex.position, None)?;
    }
    for face in contents.faces {
        assembly.push_polygon(face.0, None);
    }
    assembly.finish()
}

/// Reads the element `vertex` as points, with their normals if it has nx, ny and nz. Faces do not matter.
pub(super) fn read_points(bytes: &[u8], path: &Path) -> Result<OrientedPoints, GeometryError> {
    let contents = Contents::of(bytes, path)?;
    let vertices = contents.vertices.iter();
    let points = vertices.clone().map(|vertex| vertex.position.into());
    let normals = vertices.filter(|_| contents.has_normals);
    let normals = normals.map(|vertex| vertex.normal.into());
    Ok((points.collect(), normals.collect()))
}

/// What a file holds that is not ignored.
#[derive(Default)]
struct Contents {
    vertices: Vec<Vertex>,
    has_normals: bool,
    faces: Vec<Face>,
}

impl Contents {
    fn of(bytes: &[u8], path: &Path) -> Result<Self, GeometryError> {
        let mut reader = Reader::new(bytes);
        let header = Parser::<Ignored>::new()
            .read_header(&mut reader)
            .map_err(|e| flattened(path, &e))?;
        let mut contents = Self::default();
        for (_, element) in &header.elements {
            check_size(element, &header, reader.get_ref().len())
                .map_err(|fault| parse_error(path, None, fault))?;
            let failed = |e: ParseError| flattened(path, &e);
            match element.name.as_str() {
                "vertex" => {
                    let has = |name: &&str| element.properties.contains_key(&(*name).to_owned());
                    contents.has_normals = ["nx", "ny", "nz"].iter().all(has);
                    contents.vertices = Parser::new()
                        .read_payload_for_element(&mut reader, element, &header)
                        .map_err(failed)?;
                }
                "face" => {
                    contents.faces = Parser::new()
                        .read_payload_for_element(&mut reader, element, &header)
                        .map_err(failed)?;
                }
                _ => {
                    Parser::<Ignored>::new()
                        .read_payload_for_element(&mut reader, element, &header)
                        .map_err(failed)?;
                }
            }
        }
        Ok(contents)
    }
}

/// Whether the rest of the file can hold as many elements as the header promises, and has what a mesh needs.
fn check_size(element: &ElementDef, header: &Header, bytes_left: usize) -> Result<(), String> {
    let has = |name: &str| element.properties.contains_key(&name.to_owned());
    if element.name == "vertex" && !["x", "y", "z"].iter().all(|name| has(name)) {
        return Err("element \"vertex\" lacks property x, y or z".into());
    }
    if element.name == "face" && !FACE_PROPERTIES.iter().any(|name| has(name)) {
        return Err("element \"face\" lacks the list \"vertex_indices\"".into());
    }
    // A text element takes at least a line end; an element without properties would cost nothing in a binary file.
    let least_len: usize = match header.encoding {
        Encoding::Ascii => 1,
        _ => (element.properties.iter())
            .map(|(_, property)| match &property.data_type {
                PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => scalar_len(scalar),
            })
            .sum(),
    };
    // The last line of a text file may lack its end.
    let can_hold = match least_len {
        0 => 0,
        _ => bytes_left / least_len + 1,
    };
    if element.count > can_hold {
        return Err(format!(
            "the header promises {} elements \"{}\", but only {bytes_left} bytes follow",
            element.count, element.name
        ));
    }
    Ok(())
}

fn scalar_len(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// The parser's message, which quotes whole lines, as one short line.
fn flattened(path: &Path, error: &ParseError) -> GeometryError {
    const LONGEST: usize = 160;
    let message = error.to_string();
    let words: Vec<&str> = message.split_whitespace().collect();
    let fault: String = words.join(" ").chars().take(LONGEST).collect();
    parse_error(path, None, format!("not a valid PLY file: {fault}"))
}

struct Vertex {
    position: [f64; 3],
    normal: [f64; 3],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self {
            position: [0.0; 3],
            normal: [0.0; 3],
        }
    }
    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let value = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            _ => return PropertyAccessResult::Ignored,
        };
        *value = match property {
            Property::Char(value) => value.into(),
            Property::UChar(value) => value.into(),
            Property::Short(value) => value.into(),
            Property::UShort(value) => value.into(),
            Property::Int(value) => value.into(),
            Property::UInt(value) => value.into(),
            Property::Float(value) => value.into(),
            Property::Double(value) => value,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

const FACE_PROPERTIES: [&str; 2] = ["vertex_indices", "vertex_index"];

struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }
    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !FACE_PROPERTIES.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match property {
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that is only skipped over.
struct Ignored;

impl PropertyAccess for Ignored {
    fn new() -> Self {
        Self
    }
}
