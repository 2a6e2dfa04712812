//! Mesh files that are as they should be, in all their variants.

use std::path::{Path, PathBuf};

use graspd_geom::{GeometryError, TriangleMesh, box_mesh, shared_file, signed_volume, topology};
use graspd_mesh::{builtin_object, load_mesh, save_mesh, save_obj};
use nalgebra::{Point3, Vector3};
use tempfile::TempDir;

fn loaded(name: &str, bytes: impl AsRef<[u8]>) -> Result<TriangleMesh, GeometryError> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load_mesh(&path)
}

/// A tetrahedron of volume 1/6.
const TETRAHEDRON: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];

fn is_tetrahedron(mesh: &TriangleMesh) -> bool {
    mesh.vertices == TETRAHEDRON.map(Point3::from)
        && mesh.faces == [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
        && (signed_volume(mesh) - 1.0 / 6.0).abs() < 1e-15
}

#[test]
fn obj_variants() {
    const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    const FACES: &str = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    for (what, text) in [
        ("plain", format!("{VERTICES}{FACES}")),
        (
            "byte order mark, Windows line ends, no line end at the end",
            format!("\u{feff}{VERTICES}{FACES}")
                .replace('\n', "\r\n")
                .trim_end()
                .to_owned(),
        ),
        (
            "objects, groups, materials and a missing library",
            format!("mtllib none.mtl\no a\n{VERTICES}usemtl x\n{FACES}")
                .replace("f 2", "g b\nusemtl y\ns off\nf 2"),
        ),
        (
            "relative",
            format!("{VERTICES}f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -4 -1 -2\n"),
        ),
        ("faces first", format!("{FACES}{VERTICES}")),
        (
            "texture and normal numbers, points, lines, comments",
            format!(
                "{VERTICES}vt 0 0\nvn 0 0 1\nf 1/1 3/1 2/1\nf 1//1 2//1 4//1 # x\nf 2/1/1 3/1/1 4/1/1\nf 1 4 3\n\
                p 1\nl 1 2\n"
            ),
        ),
        (
            "texture and normal numbers out of every range",
            format!(
                "{VERTICES}vt 0 0\nf 1/9223372036854775807 3/-9 2/0\nf 1//-9223372036854775808 2 4/x/\n\
                f 2/1/1/1 3 4\nf 1 4 3\n"
            ),
        ),
        (
            "two and four numbers behind a position",
            VERTICES
                .replacen('\n', " 1 2\n", 1)
                .replacen("1\n", "1 1 2 3 4\n", 1)
                + FACES,
        ),
        ("colours", VERTICES.replace('\n', " 0.5 0.5 1\n") + FACES),
        (
            "weights",
            VERTICES.replace('\n', " 2\n").replace(" 1 ", " 2 ") + FACES,
        ),
        (
            "continued lines",
            format!("{VERTICES}{FACES}").replace(" 1 ", " \\\n1 "),
        ),
        (
            "repeated corners",
            format!("{VERTICES}{FACES}f 1 1 2\nf 3 4 4\nf 2 2 2\nf 1 2\n"),
        ),
        ("Latin-1", format!("o na\u{ef}ve\n{VERTICES}{FACES}")),
    ] {
        let bytes = if what == "Latin-1" {
            text.chars().map(|c| c as u8).collect()
        } else {
            text.clone().into_bytes()
        };
        let mesh = loaded("A.OBJ", bytes).unwrap();
        assert!(is_tetrahedron(&mesh), "{what}: {mesh:?}");
    }
}

#[test]
fn obj_vertices_are_kept_as_indexed() {
    // Every face in a group of its own, the first vertex doubled, the last without a face.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 0\nv 9 9 9\n\
                g a\nf 4 3 2\ng b\nusemtl x\nf 1 2 4 \\\n3 # a quadrilateral\no c\nf 5 2 3\n";
    let mesh = loaded("a.obj", text).unwrap();
    assert_eq!(mesh.vertices.len(), 6);
    assert_eq!(mesh.vertices[..4], TETRAHEDRON.map(Point3::from));
    assert_eq!(mesh.vertices[4], Point3::origin());
    assert_eq!(mesh.vertices[5], Point3::new(9.0, 9.0, 9.0));
    assert_eq!(mesh.faces, [[3, 2, 1], [0, 1, 3], [0, 3, 2], [4, 1, 2]]);
    // Few vertices make the file's first polygon a point, a line or a triangle.
    let mesh = loaded("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 3 1 2\n").unwrap();
    assert_eq!(mesh.faces, [[2, 0, 1]]);
}

#[test]
fn off_variants() {
    for text in [
        "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
        "# c\nOFF # x\n\n4 4 0\n0 0 0\n#\n1 0 0\n0 1 0\n0 0 1\n\n3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3\n3 0 3 2",
        "OFF 4 4 0\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n0 0 1\r\n3 0 2 1\r\n3 0 1 3\r\n3 1 2 3\r\n3 0 3 2\r\n",
        "OFF4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
        "COFF\n4 4 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 0 0 0 1\n0 0 1 0 0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n\
        3 0 3 2\n",
    ] {
        assert!(is_tetrahedron(&loaded("a.off", text).unwrap()), "{text}");
    }
}

fn ply_header(format: &str, list: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nelement face 4\nproperty list {list} vertex_indices\nend_header\n"
    )
}

#[test]
fn ply_variants() {
    const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let mut text = ply_header("ascii", "uchar int");
    let mut little = ply_header("binary_little_endian", "uchar uint").into_bytes();
    let mut big = ply_header("binary_big_endian", "int ushort").into_bytes();
    for p in TETRAHEDRON {
        text += &format!("{} {} {} 7\n", p[0], p[1], p[2]);
        for coordinate in p {
            little.extend((coordinate as f32).to_le_bytes());
            big.extend((coordinate as f32).to_be_bytes());
        }
        little.push(7);
        big.push(7);
    }
    for face in FACES {
        text += &format!("3 {} {} {}\n", face[0], face[1], face[2]);
        little.push(3);
        big.extend(3_i32.to_be_bytes());
        for index in face {
            little.extend(index.to_le_bytes());
            big.extend((index as u16).to_be_bytes());
        }
    }
    for bytes in [
        text.replace('\n', "\r\n").into_bytes(),
        text.into_bytes(),
        little,
        big,
    ] {
        assert!(is_tetrahedron(&loaded("a.ply", &bytes).unwrap()));
    }
}

#[test]
fn stl_text_variants_and_minus_zero() {
    let mut text = String::from("solid a\n");
    for (i, face) in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
        .into_iter()
        .enumerate()
    {
        if i == 2 {
            text += "endsolid a\nsolid\n"; // a second solid, without a name
        }
        text += "  facet normal 0 0 0\n    outer loop\n";
        for corner in face.map(|index: usize| TETRAHEDRON[index]) {
            text += &format!("      vertex {} {} {}\n", corner[0], corner[1], corner[2]);
        }
        text += "    endloop\n  endfacet\n";
    }
    text += "endsolid\n";
    for text in [
        text.clone(),
        text.to_uppercase(),
        text.replace('\n', "\r\n"),
        text.replacen(" 0 ", " -0 ", 1),
        text.replace("normal 0 0 0", "normal nan nan nan"),
    ] {
        let mesh = loaded("a.stl", text).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.faces.len()), (4, 4));
        assert!((signed_volume(&mesh) - 1.0 / 6.0).abs() < 1e-15);
    }
}

#[test]
fn binary_stl_may_begin_with_solid_and_end_with_padding() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("box.stl");
    save_mesh(&box_mesh(Vector3::new(1.0, 2.0, 3.0), 9.0), &path).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    // A whole line of text, as far as a reader can see that stops there.
    bytes[..12].copy_from_slice(b"solid facet\n");
    assert_eq!(loaded("a.stl", &bytes).unwrap().faces.len(), 12);
    bytes[..12].copy_from_slice(b"solid thing ");
    bytes.extend([0; 3]);
    assert_eq!(loaded("a.stl", &bytes).unwrap().faces.len(), 12);
}

#[test]
fn saved_meshes_come_back() {
    let mug = builtin_object("mug").unwrap();
    let folder = TempDir::new().unwrap();
    for name in ["mug.obj", "mug.off", "mug.ply", "mug.stl"] {
        let path = folder.path().join(name);
        // Twice: the second time replaces the first.
        save_mesh(&TriangleMesh::default(), &path).unwrap();
        save_mesh(&mug, &path).unwrap();
        let back = load_mesh(&path).unwrap();
        if name == "mug.stl" {
            assert_eq!(topology(&back), topology(&mug));
            assert!((signed_volume(&back) / signed_volume(&mug) - 1.0).abs() < 1e-6);
        } else {
            assert_eq!(back, mug, "{name}");
        }
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        4,
        "leftovers"
    );
    let missing = folder.path().join("no/such/folder.obj");
    let error = save_obj(&mug, &missing).unwrap_err();
    assert!(matches!(error, GeometryError::Write { .. }), "{error}");
    let error = save_mesh(&mug, folder.path().join("mug.glb")).unwrap_err();
    assert!(
        error.to_string().contains(".glb is not a supported"),
        "{error}"
    );
}

fn corner_positions(mesh: &TriangleMesh) -> Vec<Point3<f64>> {
    (0..mesh.faces.len())
        .flat_map(|face| mesh.corners(face))
        .collect()
}

/// Triangles as the parser sees them when it is given the whole file, in order.
fn without_pre_pass(path: &Path) -> Vec<Point3<f64>> {
    if path.extension().is_some_and(|extension| extension == "obj") {
        let (models, _) = tobj::load_obj(path, &tobj::LoadOptions::default()).unwrap();
        let corner = |model: &tobj::Model, i: u32| {
            let p = &model.mesh.positions[3 * i as usize..][..3];
            Point3::new(p[0], p[1], p[2])
        };
        (models.iter())
            .flat_map(|model| model.mesh.indices.iter().map(move |&i| corner(model, i)))
            .collect()
    } else {
        let mesh = stl_io::read_stl(&mut std::fs::File::open(path).unwrap()).unwrap();
        (mesh.faces.iter())
            .flat_map(|face| {
                face.vertices
                    .map(|i| mesh.vertices[i].0.map(f64::from).into())
            })
            .collect()
    }
}

#[test]
fn the_pre_pass_loses_no_triangle() {
    for name in [
        "data/ycb/025_mug.obj",
        "data/ycb/005_tomato_soup_can.obj",
        "data/hands/allegro_hand/meshes/visual/base_link.obj",
        "data/hands/leap_hand/meshes/visual/palm_lower.obj",
        "data/hands/barrett_hand/meshes/visual/base_link.obj",
        "data/hands/simlab_allegro_hand_ros/allegro_hand_description/meshes/link_3.0.STL",
        "data/meshes_to_repair/camera_gopro.stl",
    ] {
        let Some(path): Option<PathBuf> = shared_file(name) else {
            return;
        };
        let ours = corner_positions(&load_mesh(&path).unwrap());
        assert!(ours == without_pre_pass(&path), "{name}");
    }
}
