//! Mesh files that are not as they should be: one clear error each, whatever the bytes.

use std::path::Path;

use graspd_geom::{GeometryError, TriangleMesh};
use graspd_mesh::load_mesh;
use tempfile::TempDir;

const EXTENSIONS: [&str; 4] = ["obj", "stl", "ply", "off"];

fn loaded(folder: &Path, extension: &str, bytes: &[u8]) -> Result<TriangleMesh, GeometryError> {
    let path = folder.join(format!("faulty.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    load_mesh(&path)
}

fn assert_message(error: &GeometryError, expected: &str) {
    let message = error.to_string();
    assert!(message.contains(expected), "{message:?} lacks {expected:?}");
    assert!(!message.contains('\n'), "{message:?}");
    assert!(message.contains("faulty"), "{message:?} names no file");
    assert!(message.contains("; "), "{message:?} has no remedy");
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n";

#[test]
fn faults_are_named() {
    let folder = TempDir::new().unwrap();
    let ply = |body: &str| format!("{PLY}{body}");
    let ply_with = |from: &str, to: &str| ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").replace(from, to);
    let binary_ply = |from: &str, to: &str| {
        PLY.replace("ascii", "binary_little_endian")
            .replace(from, to)
    };
    let stl = |corner: &str| {
        format!(
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n{corner}endloop\nendfacet\nendsolid\n"
        )
    };
    let mut huge_stl = vec![b' '; 84];
    huge_stl[80..].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut infinite_stl = vec![0; 134];
    infinite_stl[80] = 1;
    infinite_stl[100..104].copy_from_slice(&f32::INFINITY.to_le_bytes());

    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("obj", b"hello world".to_vec(), "no vertices"),
        ("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec(), "no faces"),
        (
            "obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n".to_vec(),
            "no faces",
        ),
        (
            "obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\n".to_vec(),
            "no faces",
        ),
        (
            "obj",
            b"v 0 0 0\nv 1 x 0\n".to_vec(),
            "line 2: \"x\" is not a number",
        ),
        (
            "obj",
            b"v 0 0 0\nv 1 0\n".to_vec(),
            "line 2: a vertex has fewer",
        ),
        (
            "obj",
            b"v 0 0 0\nv 1 nan 0\n".to_vec(),
            "line 2: vertex 1 is not finite (1, NaN, 0)",
        ),
        (
            "obj",
            b"v 0 0 1e999\n".to_vec(),
            "line 1: vertex 0 is not finite (0, 0, inf)",
        ),
        ("obj", b"v 0 0 0 0\n".to_vec(), "vertex 0 is not finite"),
        (
            "obj",
            b"v 0 0 0\n\nf 1 2 1\n".to_vec(),
            "line 3: a face refers to vertex 2, but the file has 1 vertices",
        ),
        ("obj", b"v 0 0 0\nf 0 1 1\n".to_vec(), "refers to vertex 0"),
        ("obj", b"v 0 0 0\nf -2 1 1\n".to_vec(), "refers to vertex 0"),
        (
            "obj",
            b"v 0 0 0\nf -9223372036854775808 1 1\n".to_vec(),
            "refers to vertex -92233",
        ),
        (
            "obj",
            b"v 0 0 0\nf 1 2 99999999999999999999\n".to_vec(),
            "is not a face corner",
        ),
        (
            "obj",
            b"v 0 0 0\nf 1 //2 3\n".to_vec(),
            "is not a face corner",
        ),
        (
            "obj",
            b"v 0 0 0\nf 1 1 1\nf 1 \\\n/1 1\n".to_vec(),
            "line 4: \"/1\" is not a face corner",
        ),
        (
            "obj",
            b"v 0 0 0\ng\nv 0 0 0 x\n".to_vec(),
            "line 3: \"x\" is not a number",
        ),
        (
            "obj",
            b"v 0 0 0\nv 0 1e300 0 1e-300\nf 1 1 1\n".to_vec(),
            "line 2: vertex 1 is not finite (0, inf, 0)",
        ),
        ("off", b"solid x".to_vec(), "must start with OFF"),
        (
            "off",
            b"OFF BINARY\n".to_vec(),
            "binary OFF is not supported",
        ),
        ("off", b"4OFF\n1 1 0\n".to_vec(), "must start with OFF"),
        ("off", b"# x\n".to_vec(), "only comments"),
        ("off", b"OFF\n".to_vec(), "counts are missing"),
        (
            "off",
            b"OFF\n3 x\n".to_vec(),
            "line 2: expected vertex and face counts",
        ),
        (
            "off",
            b"OFF\n-3 1 0\n".to_vec(),
            "line 2: expected vertex and face counts",
        ),
        (
            "off",
            b"OFF\n18446744073709551615 1 0\n0 0 0\n".to_vec(),
            "ends after 1 of the 18446744073709551615 vertices",
        ),
        (
            "off",
            b"OFF\n1 4294967295 0\n0 0 0\n3 0 0 0\n".to_vec(),
            "ends after 1 of the 4294967295 faces",
        ),
        (
            "off",
            b"OFF\n1 1 0\n0 0 0\n9223372036854775807 0 0 0\n".to_vec(),
            "line 4: a face has fewer corners",
        ),
        (
            "off",
            b"OFF\n1 1 0\n0 0 0\n3 0 1 -1\n".to_vec(),
            "line 4: a face refers to vertex 1",
        ),
        (
            "off",
            b"OFF\n1 1 0\n0 0 inf\n3 0 0 0\n".to_vec(),
            "line 3: vertex 0 is not finite",
        ),
        ("off", b"OFF\n1 0 0\n0 0 0\n".to_vec(), "no faces"),
        ("stl", b"short".to_vec(), "neither a text STL"),
        (
            "stl",
            vec![b' '; 84],
            "promises 538976288 triangles, but the file holds 0",
        ),
        ("stl", huge_stl, "promises 4294967295 triangles"),
        ("stl", infinite_stl, "vertex 0 is not finite"),
        ("stl", vec![0; 84], "no faces"),
        (
            "stl",
            stl("vertex 0 1 nan\n").into_bytes(),
            "line 6: vertex 2 is not finite",
        ),
        (
            "stl",
            stl("vertex 0 1e39 0\n").into_bytes(),
            "line 6: vertex 2 is not finite (0, inf, 0)",
        ),
        ("stl", stl("").into_bytes(), "line 6: a facet has 2 corners"),
        (
            "stl",
            stl("vertex 0 1 0\nvertex 1 1 0\n").into_bytes(),
            "a facet has 4 corners",
        ),
        (
            "stl",
            stl("vertex 0 1\n").into_bytes(),
            "line 6: a vertex has fewer",
        ),
        (
            "stl",
            stl("vertices 0 1 0\n").into_bytes(),
            "line 6: unexpected \"vertices\"",
        ),
        (
            "stl",
            stl("vertex 0 1 0\n").replace("endsolid\n", "").into_bytes(),
            "cut short",
        ),
        ("stl", b"solid\nendsolid\n".to_vec(), "no faces"),
        ("ply", b"plywood".to_vec(), "not a valid PLY file"),
        (
            "ply",
            ply_with("ascii", "ebcdic").into_bytes(),
            "not a valid PLY file",
        ),
        (
            "ply",
            ply("0 0 0\n1 0 0\n").into_bytes(),
            "not a valid PLY file",
        ),
        (
            "ply",
            ply("").into_bytes(),
            "promises 3 elements \"vertex\", but only 0 bytes follow",
        ),
        (
            "ply",
            ply_with("vertex 3", "vertex 4000000000").into_bytes(),
            "promises 4000000000 elements",
        ),
        (
            "ply",
            ply_with("vertex 3", "vertex 99999999999999999999").into_bytes(),
            "not a valid PLY file",
        ),
        (
            "ply",
            ply_with("\n3 0 1 2", "\n4000000000 0 1 2").into_bytes(),
            "not a valid PLY file",
        ),
        (
            "ply",
            ply_with("\n3 0 1 2", "\n3 0 1 -2").into_bytes(),
            "refers to vertex -2",
        ),
        (
            "ply",
            ply_with("\n3 0 1 2", "\n3 0 1 3").into_bytes(),
            "refers to vertex 3",
        ),
        (
            "ply",
            ply_with("1 0 0", "1 0 1e99").into_bytes(),
            "vertex 1 is not finite",
        ),
        (
            "ply",
            ply_with("float z", "float w").into_bytes(),
            "lacks property x, y or z",
        ),
        (
            "ply",
            ply_with("vertex_indices", "corners").into_bytes(),
            "lacks the list",
        ),
        (
            "ply",
            ply_with("uchar int", "uchar float").into_bytes(),
            "not a valid PLY file",
        ),
        (
            "ply",
            ply_with("element face 1", "element face 0").into_bytes(),
            "no faces",
        ),
        (
            "ply",
            binary_ply("vertex 3", "vertex 4294967295").into_bytes(),
            "promises 4294967295 elements",
        ),
        (
            "ply",
            binary_ply(
                "element face 1\n",
                "element empty 4000000000\nelement face 1\n",
            )
            .into_bytes(),
            "elements",
        ),
        (
            "fbx",
            b"glTF".to_vec(),
            ".fbx is not a supported mesh format; convert it to one of .obj",
        ),
    ];
    for (extension, bytes, expected) in cases {
        let error = loaded(folder.path(), extension, &bytes).unwrap_err();
        assert_message(&error, expected);
    }
}

#[test]
fn files_that_cannot_be_opened() {
    let folder = TempDir::new().unwrap();
    let missing = folder.path().join("faulty.obj");
    assert_message(&load_mesh(&missing).unwrap_err(), "no such file");
    std::fs::create_dir(&missing).unwrap();
    assert_message(&load_mesh(&missing).unwrap_err(), "not a regular file");
    std::fs::remove_dir(&missing).unwrap();
    for extension in EXTENSIONS {
        let error = loaded(folder.path(), extension, b"").unwrap_err();
        assert_message(&error, "the file is empty");
    }
    assert_message(
        &load_mesh(folder.path().join("faulty")).unwrap_err(),
        "a name without an extension",
    );
}
