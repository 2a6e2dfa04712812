//! Mesh files of random content: an error or a sound mesh, never a panic.

use std::path::Path;
use std::sync::LazyLock;

use graspd_geom::{GeometryError, TriangleMesh, box_mesh};
use graspd_mesh::{load_mesh, save_mesh};
use nalgebra::Vector3;
use proptest::prelude::*;
use tempfile::TempDir;

const EXTENSIONS: [&str; 6] = ["obj", "stl", "ply", "off", "glb", "gltf"];

fn loaded(folder: &Path, extension: &str, bytes: &[u8]) -> Result<TriangleMesh, GeometryError> {
    let path = folder.join(format!("faulty.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    load_mesh(&path)
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n";

/// Whatever was read must be safe to use.
fn assert_sound(result: Result<TriangleMesh, GeometryError>) {
    match result {
        Ok(mesh) => {
            assert!(!mesh.faces.is_empty());
            assert!(
                mesh.vertices
                    .iter()
                    .all(|p| p.coords.iter().all(|x| x.is_finite()))
            );
            for &[a, b, c] in &mesh.faces {
                assert!(
                    [a, b, c]
                        .iter()
                        .all(|&i| (i as usize) < mesh.vertices.len())
                );
                assert!(a != b && b != c && c != a);
            }
        }
        Err(error) => {
            let message = error.to_string();
            assert!(
                message.contains("faulty") && message.contains("; "),
                "{message}"
            );
            assert!(!message.contains('\n'), "{message}");
        }
    }
}

/// Sound files of every kind that can be read.
static SOUND_FILES: LazyLock<Vec<(&'static str, Vec<u8>)>> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let mesh = box_mesh(Vector3::new(0.1, 0.2, 0.3), 0.2);
    let mut files: Vec<_> = ["obj", "stl", "ply", "off"]
        .map(|extension| {
            let path = folder.path().join(format!("sound.{extension}"));
            save_mesh(&mesh, &path).unwrap();
            (extension, std::fs::read(path).unwrap())
        })
        .into();
    let text = format!("{PLY}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let mut binary = PLY.replace("ascii", "binary_little_endian").into_bytes();
    binary.extend([0; 36]);
    binary.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    files.extend([
        ("ply", text.into_bytes()),
        ("ply", binary),
        ("glb", binary_gltf()),
        ("stl", format!("solid s\n{facet}endsolid s\n").into_bytes()),
    ]);
    for (extension, bytes) in &files {
        assert!(
            loaded(folder.path(), extension, bytes).is_ok(),
            "{extension}"
        );
    }
    files
});

/// A triangle.
fn binary_gltf() -> Vec<u8> {
    let json = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"scale":[1,2,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
        {"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":4}],
        "buffers":[{"byteLength":40}]}"#;
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((68 + json.len() as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(b"\x28\0\0\0BIN\0");
    for coordinate in [0.0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
        bytes.extend(coordinate.to_le_bytes());
    }
    bytes.extend([0, 1, 2, 0]);
    bytes
}

/// Words that the formats are made of, and numbers at the edge of what they allow.
const WORDS: &[&str] = &[
    "v",
    "f",
    "vt",
    "o",
    "#",
    "\\\n",
    "\n",
    "\n",
    "\n",
    "1",
    "2",
    "3",
    "-1",
    "0",
    "4294967295",
    "4294967296",
    "1e308",
    "-1e-320",
    "nan",
    "inf",
    "1/2/3",
    "-1//-1",
    "OFF",
    "COFF",
    "solid",
    "facet normal",
    "outer loop",
    "vertex",
    "endloop",
    "endfacet",
    "endsolid",
    "ply\n",
    "format ascii 1.0\n",
    "format binary_big_endian 1.0\n",
    "element vertex 3\n",
    "element face 2\n",
    "element face 18446744073709551615\n",
    "property float x\n",
    "property double y\n",
    "property float z\n",
    "property list uchar int vertex_indices\n",
    "end_header\n",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 1..400)) {
        let folder = TempDir::new().unwrap();
        for extension in EXTENSIONS {
            assert_sound(loaded(folder.path(), extension, &bytes));
        }
    }

    #[test]
    fn random_words(words in prop::collection::vec(prop::sample::select(WORDS), 1..80)) {
        let folder = TempDir::new().unwrap();
        for (extension, start) in [
            ("obj", ""),
            ("off", "OFF 3 2 0\n"),
            ("ply", "ply\nformat ascii 1.0\n"),
            ("ply", "ply\nformat binary_little_endian 1.0\n"),
            ("stl", "solid facet\n"),
        ] {
            let text = format!("{start}{}", words.join(" "));
            assert_sound(loaded(folder.path(), extension, text.as_bytes()));
        }
    }

    #[test]
    fn mutated_files(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let folder = TempDir::new().unwrap();
        for (extension, bytes) in SOUND_FILES.iter() {
            let mut bytes = bytes.clone();
            for (index, value) in &changes {
                let index = index.index(bytes.len());
                bytes[index] = *value;
            }
            if is_cut {
                bytes.truncate(cut.index(bytes.len()).max(1));
            }
            assert_sound(loaded(folder.path(), extension, &bytes));
        }
    }
}
