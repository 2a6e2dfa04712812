//! glTF files written for the purpose, and one from elsewhere.

use graspd_geom::{TriangleMesh, closed_surface, shared_file, signed_volume};
use graspd_mesh::load_mesh;
use nalgebra::{Point3, Vector3};
use tempfile::TempDir;

/// A box of 2 x 3 x 4 units from the origin.
const CORNERS: [[f32; 3]; 8] = [
    [0., 0., 0.],
    [2., 0., 0.],
    [2., 3., 0.],
    [0., 3., 0.],
    [0., 0., 4.],
    [2., 0., 4.],
    [2., 3., 4.],
    [0., 3., 4.],
];
const SIDES: [[u16; 4]; 6] = [
    [0, 3, 2, 1],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];
const POSITION_BYTES: usize = 96;
const INDEX_BYTES: usize = 72;

/// Positions, then indices.
fn box_bytes() -> Vec<u8> {
    let positions = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes());
    let indices = SIDES.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
    positions
        .chain(indices.flat_map(u16::to_le_bytes))
        .collect()
}

/// A description of the box with the given nodes, the first of which is the scene.
fn describing(nodes: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[0,0,0],"max":[2,3,4]}},
          {{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{POSITION_BYTES}}},
          {{"buffer":0,"byteOffset":{POSITION_BYTES},"byteLength":{INDEX_BYTES}}}],
        "buffers":[{{"byteLength":168}}]}}"#
    )
}

/// A binary file of a description and its buffer.
fn glb(description: &str, buffer: &[u8]) -> Vec<u8> {
    let mut json = description.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json[..]), (b"BIN\0", buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn load(name: &str, bytes: &[u8]) -> Result<TriangleMesh, String> {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("my shape.bin"), box_bytes()).unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load_mesh(&path).map_err(|error| error.to_string())
}

fn load_nodes(nodes: &str) -> TriangleMesh {
    load("shape.glb", &glb(&describing(nodes), &box_bytes())).unwrap()
}

fn assert_bounds(mesh: &TriangleMesh, low: [f64; 3], high: [f64; 3]) {
    let (l, h) = mesh.bounds().unwrap();
    let miss = (l - Point3::from(low)).norm() + (h - Point3::from(high)).norm();
    // Rotations are in single precision.
    assert!(miss < 1e-5, "{l} {h}");
}

#[test]
fn y_up_becomes_z_up() {
    let mesh = load_nodes(r#"{"mesh":0}"#);
    // What was y goes up, and what was z comes out of the front, which is -y.
    assert_bounds(&mesh, [0.0, -4.0, 0.0], [2.0, 0.0, 3.0]);
    let mesh = closed_surface(&mesh, "box").unwrap();
    assert_eq!((mesh.vertices.len(), mesh.faces.len()), (8, 12));
    assert!((signed_volume(&mesh) - 24.0).abs() < 1e-12);
}

#[test]
fn nested_nodes_apply_their_transforms_from_the_inside_out() {
    // Shifted by (1, 0, 0), then turned by 90 degrees about z, then doubled, then shifted by (0, 0, 10).
    let mesh = load_nodes(
        r#"{"translation":[0,0,10],"scale":[2,2,2],"children":[1]},
        {"rotation":[0,0,0.70710678,0.70710678],"children":[2]},
        {"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 1,0,0,1],"mesh":0}"#,
    );
    assert_bounds(&mesh, [-6.0, -18.0, 2.0], [0.0, -10.0, 6.0]);
    // Two instances, one of them mirrored: both face outwards.
    let mesh = load_nodes(
        r#"{"children":[1,2]},{"mesh":0},{"scale":[-1,1,1],"translation":[-5,0,0],"mesh":0}"#,
    );
    assert_bounds(&mesh, [-7.0, -4.0, 0.0], [2.0, 0.0, 3.0]);
    assert_eq!(mesh.faces.len(), 24);
    assert!((signed_volume(&mesh) - 48.0).abs() < 1e-9);
}

#[test]
fn without_a_scene_all_meshes_count() {
    let text = describing(r#"{"mesh":0}"#)
        .replace(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "")
        .replace(r#""nodes":[{"mesh":0}],"#, "");
    assert_eq!(
        load("a.glb", &glb(&text, &box_bytes()))
            .unwrap()
            .faces
            .len(),
        12
    );
}

#[test]
fn every_primitive_gives_the_same_triangles() {
    // A unit square, twelve bytes of something else after each corner.
    let mut bytes = Vec::new();
    for corner in [[0.0_f32, 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]] {
        bytes.extend(corner.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([7; 12]);
    }
    let positions = bytes.len();
    for (primitives, indices, kind) in [
        (
            r#"{"attributes":{"POSITION":0},"indices":1}"#,
            vec![0, 1, 2, 0, 2, 3],
            5121,
        ),
        (
            r#"{"attributes":{"POSITION":0},"indices":1,"mode":5}"#,
            vec![1, 2, 0, 3],
            5123,
        ),
        (
            r#"{"attributes":{"POSITION":0},"indices":1,"mode":6}"#,
            vec![0, 1, 2, 3],
            5125,
        ),
        // Corners in order; and lines, which are left out.
        (
            r#"{"attributes":{"POSITION":0},"mode":6},{"attributes":{"POSITION":0},"indices":1,"mode":1}"#,
            vec![0, 1],
            5121,
        ),
    ] {
        let size = match kind {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        let mut bytes = bytes.clone();
        for index in &indices {
            bytes.extend(&u32::to_le_bytes(*index)[..size]);
        }
        let total = bytes.len();
        bytes.resize(total.next_multiple_of(4), 0);
        let (count, length) = (indices.len(), indices.len() * size);
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{primitives}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
              {{"bufferView":1,"componentType":{kind},"count":{count},"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":{positions},"byteStride":24}},
              {{"buffer":0,"byteOffset":{positions},"byteLength":{length}}}],
            "buffers":[{{"byteLength":{total}}}]}}"#
        );
        let mesh = load("a.glb", &glb(&text, &bytes)).unwrap();
        let area: Vector3<f64> = (0..mesh.faces.len())
            .map(|face| mesh.area_vector(face))
            .sum();
        assert_eq!(
            (mesh.vertices.len(), mesh.faces.len()),
            (4, 2),
            "{primitives}"
        );
        // The normal was z, which is now -y.
        assert!(
            (mesh.area() - 1.0).abs() < 1e-12 && area.y < -0.9,
            "{primitives}"
        );
    }
}

#[test]
fn buffers_may_be_beside_the_file_or_in_it() {
    let beside = describing(r#"{"mesh":0}"#).replace(
        r#"{"byteLength":168}"#,
        r#"{"byteLength":168,"uri":"my%20shape.bin"}"#,
    );
    assert_eq!(
        load("a.gltf", beside.as_bytes()).unwrap(),
        load_nodes(r#"{"mesh":0}"#)
    );
    // Three corners (0, 0, 0), (1, 0, 0), (0, 1, 0).
    let embedded = r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,
        "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let mesh = load("a.gltf", embedded.as_bytes()).unwrap();
    let corners = [[0., 0., 0.], [1., 0., 0.], [0., 0., 1.]];
    assert_eq!(mesh.vertices, corners.map(Point3::from));
    assert_eq!(mesh.faces, [[0, 1, 2]]);
}

#[test]
fn faults_are_one_line() {
    let whole = describing(r#"{"mesh":0}"#);
    let change = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        glb(&whole.replacen(from, to, 1), &box_bytes())
    };
    let cut = glb(&whole, &box_bytes());
    let mut short_header = cut.clone();
    short_header[8..12].copy_from_slice(&[5, 0, 0, 0]);
    let mut nan = box_bytes();
    nan[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut beyond = box_bytes();
    beyond[POSITION_BYTES] = 8;
    let draco =
        r#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"],"#;
    for (bytes, word) in [
        (b"{".to_vec(), "glTF"),
        (b"glTF".to_vec(), "header"),
        (short_header, "header"),
        (cut[..cut.len() - 7].to_vec(), "cut short"),
        (change(r#""2.0""#, r#""1.0""#), "glTF"),
        (
            change(r#"{"asset":{"version":"2.0"},"#, draco),
            "KHR_draco_mesh_compression",
        ),
        (change(r#""mesh":0"#, r#""mesh":9"#), "glTF"),
        (
            change(r#"{"mesh":0}"#, r#"{"mesh":0,"children":[0]}"#),
            "contain themselves",
        ),
        (
            change(r#""byteLength":168"#, r#""byteLength":999"#),
            "cut short",
        ),
        (change(r#""count":36"#, r#""count":37"#), "beyond the end"),
        (
            change(r#""count":8"#, r#""count":18446744073709551615"#),
            "beyond the end",
        ),
        (change("5126", "5123"), "floating-point"),
        (change("5123", "5126"), "whole numbers"),
        (
            change(r#""indices":1"#, r#""indices":1,"mode":0"#),
            "no faces",
        ),
        (
            change(
                r#""byteLength":168"#,
                r#""byteLength":168,"uri":"none.bin""#,
            ),
            "none.bin",
        ),
        (
            change(
                r#""byteLength":168"#,
                r#""byteLength":168,"uri":"https://x.org/a.bin""#,
            ),
            "beside the mesh",
        ),
        (
            change(
                r#""byteLength":168"#,
                r#""byteLength":168,"uri":"data:a;base64,?""#,
            ),
            "base64",
        ),
        (glb(&whole, &nan), "not finite"),
        (glb(&whole, &beyond), "vertex 8"),
    ] {
        let message = load("shape.glb", &bytes).expect_err(word);
        assert!(
            message.contains(word) && message.contains("; ") && !message.contains('\n'),
            "{word}: {message}"
        );
        assert!(
            message.contains("shape.glb") || message.contains("none.bin"),
            "{message}"
        );
    }
}

#[test]
fn a_rigged_hand_is_read_as_it_was_bound() {
    let Some(path) = shared_file("data/human_hand/right.glb") else {
        return;
    };
    let mesh = load_mesh(path).unwrap();
    let (low, high) = mesh.bounds().unwrap();
    let length = (high - low).max();
    // A hand in metres.
    assert!((0.15..0.25).contains(&length), "{length}");
    assert!(mesh.faces.len() > 1000);
}
