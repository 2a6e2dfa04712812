//! Binary glTF 2 of a grasp: object and hand, for any viewer.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use graspd::write_atomically;
use graspd_geom::TriangleMesh;
use serde_json::{Value, json};

use super::source::GraspSource;

/// Constants of the format.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Colours of object and hand, linear, with opacity.
const COLORS: [[f64; 4]; 2] = [[0.19, 0.27, 0.36, 1.0], [0.78, 0.60, 0.42, 1.0]];
const NAMES: [&str; 2] = ["object", "hand"];

/// A file for each grasp.
pub(super) fn write(source: &mut GraspSource<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    for number in 0..source.len() {
        let run = source.run(number)?;
        let hand = source.hand(&run)?;
        let object = source.object(&run)?;
        for record in &run.records {
            let pose = record.hand_pose(hand.articulation_names());
            let pose = pose.with_context(|| source.context(&run, record))?;
            let scene = binary([&object.mesh, &hand.surface(&pose)])?;
            let path = folder.join(format!("{}.glb", run.file_stem(record)));
            write_atomically(&path, &scene)?;
            written.push(path);
        }
    }
    Ok(written)
}

/// Meshes with z up as a file with y up, as the format wants it.
fn binary(meshes: [&TriangleMesh; 2]) -> Result<Vec<u8>> {
    let mut buffer = Vec::new();
    let (mut views, mut accessors, mut descriptions) = (Vec::new(), Vec::new(), Vec::new());
    for (part, mesh) in meshes.into_iter().enumerate() {
        let first = accessors.len();
        let (low, high) = mesh.bounds().context("a mesh without vertices")?;
        let single = |p: [f64; 3]| p.map(|v| v as f32);
        // Bounds of the rounded coordinates, which rounding in the same way gives.
        let bounds = [single(low.coords.into()), single(high.coords.into())];
        let vertices = mesh.vertices.iter().flat_map(|p| single(p.coords.into()));
        push(
            &mut buffer,
            &mut views,
            ARRAY_BUFFER,
            vertices.map(f32::to_le_bytes),
        );
        accessors.push(json!({
            "bufferView": views.len() - 1, "componentType": FLOAT, "type": "VEC3",
            "count": mesh.vertices.len(), "min": bounds[0], "max": bounds[1],
        }));
        let corners = mesh.faces.iter().flatten();
        push(
            &mut buffer,
            &mut views,
            ELEMENT_ARRAY_BUFFER,
            corners.map(|corner| corner.to_le_bytes()),
        );
        accessors.push(json!({
            "bufferView": views.len() - 1, "componentType": UNSIGNED_INT, "type": "SCALAR",
            "count": 3 * mesh.faces.len(),
        }));
        descriptions.push(json!({
            "name": NAMES[part],
            "primitives": [{"attributes": {"POSITION": first}, "indices": first + 1, "material": part}],
        }));
    }
    let material = |part: usize| {
        json!({
            "name": NAMES[part],
            "pbrMetallicRoughness": {
                "baseColorFactor": COLORS[part], "metallicFactor": 0.0, "roughnessFactor": 0.7,
            },
        })
    };
    // A quarter turn about x takes z up to y up.
    let turn = [
        -std::f64::consts::FRAC_1_SQRT_2,
        0.0,
        0.0,
        std::f64::consts::FRAC_1_SQRT_2,
    ];
    let description = json!({
        "asset": {"version": "2.0", "generator": concat!("graspd ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "grasp", "rotation": turn, "children": [1, 2]},
            {"name": NAMES[0], "mesh": 0},
            {"name": NAMES[1], "mesh": 1},
        ],
        "meshes": descriptions,
        "materials": [material(0), material(1)],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": buffer.len()}],
    });
    let mut text = serde_json::to_vec(&description)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + buffer.len();
    let word = |value: usize| u32::try_from(value).context("a scene beyond 4 GiB");
    let mut file = b"glTF".to_vec();
    file.extend(2u32.to_le_bytes());
    file.extend(word(total)?.to_le_bytes());
    file.extend(word(text.len())?.to_le_bytes());
    file.extend(b"JSON");
    file.extend(text);
    file.extend(word(buffer.len())?.to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(buffer);
    Ok(file)
}

/// Appends words to the buffer, and a view of them.
fn push(
    buffer: &mut Vec<u8>,
    views: &mut Vec<Value>,
    target: u32,
    words: impl Iterator<Item = [u8; 4]>,
) {
    let start = buffer.len();
    buffer.extend(words.flatten());
    views.push(json!({
        "buffer": 0, "byteOffset": start, "byteLength": buffer.len() - start, "target": target,
    }));
}

#[cfg(test)]
mod tests {
    use graspd_mesh::{builtin_object, load_mesh};

    use super::*;

    #[test]
    fn what_is_written_is_read_back_in_the_same_frame() {
        let object = builtin_object("mug").unwrap();
        let hand = builtin_object("box").unwrap();
        let file = tempfile::Builder::new().suffix(".glb").tempfile().unwrap();
        std::fs::write(file.path(), binary([&object, &hand]).unwrap()).unwrap();
        let read = load_mesh(file.path()).unwrap();
        assert_eq!(read.faces.len(), object.faces.len() + hand.faces.len());
        let mut both = object.clone();
        both.append(&hand);
        let (low, high) = both.bounds().unwrap();
        let (read_low, read_high) = read.bounds().unwrap();
        // Single precision of some centimetres.
        assert!((low - read_low).norm() < 1e-7 && (high - read_high).norm() < 1e-7);
    }
}
