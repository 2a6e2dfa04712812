//! COLLADA files written for the purpose.

use graspd_geom::{TriangleMesh, closed_surface, signed_volume};
use graspd_mesh::load_mesh;
use nalgebra::{Point3, Vector3};

/// A box of 2 x 3 x 4 units from the origin, as six quadrangles.
const BOX: &str = r##"<geometry id="box"><mesh>
  <source id="p"><float_array id="a" count="24">0 0 0 2 0 0 2 3 0 0 3 0 0 0 4 2 0 4 2 3 4 0 3 4</float_array>
    <technique_common><accessor source="#a" count="8" stride="3"/></technique_common></source>
  <source id="n"><float_array count="3">0 0 1</float_array></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <polylist count="6"><input semantic="VERTEX" source="#v" offset="0"/>
    <input semantic="NORMAL" source="#n" offset="1"/>
    <vcount>4 4 4 4 4 4</vcount>
    <p>0 0 3 0 2 0 1 0  4 0 5 0 6 0 7 0  0 0 1 0 5 0 4 0  1 0 2 0 6 0 5 0
      2 0 3 0 7 0 6 0  3 0 0 0 4 0 7 0</p></polylist>
</mesh></geometry>"##;

fn collada(asset: &str, geometry: &str, nodes: &str) -> String {
    format!(
        r##"<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
        <asset>{asset}</asset><library_geometries>{geometry}</library_geometries>
        <library_nodes><node id="again"><instance_node url="#again"/></node>
          <node id="kept"><instance_geometry url="#box"/></node></library_nodes>
        <library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
        <scene><instance_visual_scene url="#s"/></scene></COLLADA>"##
    )
}

fn load(text: &str) -> Result<TriangleMesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shape.dae");
    std::fs::write(&path, text).unwrap();
    load_mesh(&path).map_err(|error| error.to_string())
}

fn assert_bounds(mesh: &TriangleMesh, low: [f64; 3], high: [f64; 3]) {
    let (l, h) = mesh.bounds().unwrap();
    let miss = (l - Point3::from(low)).norm() + (h - Point3::from(high)).norm();
    assert!(miss < 1e-12, "{l} {h}");
}

const SHOWN: &str = r##"<node><instance_geometry url="#box"/></node>"##;

#[test]
fn units_and_axes_become_metres_with_z_up() {
    let asset = |up: &str| format!(r#"<unit meter="0.01"/><up_axis>{up}</up_axis>"#);
    let read = |up: &str| load(&collada(&asset(up), BOX, SHOWN)).unwrap();
    assert_bounds(&read("Z_UP"), [0.0; 3], [0.02, 0.03, 0.04]);
    // What was y goes up, and what was z comes out of the front, which is -y.
    assert_bounds(&read("Y_UP"), [0.0, -0.04, 0.0], [0.02, 0.0, 0.03]);
    assert_bounds(&read("X_UP"), [-0.03, -0.04, 0.0], [0.0, 0.0, 0.02]);
    for up in ["X_UP", "Y_UP", "Z_UP"] {
        let mesh = closed_surface(&read(up), "box").unwrap();
        assert!((signed_volume(&mesh) - 24e-6).abs() < 1e-15);
    }
    // Without a word about either, the format has metres and y up.
    assert_bounds(
        &load(&collada("", BOX, SHOWN)).unwrap(),
        [0.0, -4.0, 0.0],
        [2.0, 0.0, 3.0],
    );
}

#[test]
fn nested_nodes_apply_their_transforms_from_the_inside_out() {
    let up = "<up_axis>Z_UP</up_axis>";
    // Shifted by (1, 0, 0), then turned by 90 degrees about z, then doubled, then shifted by (0, 0, 10).
    let nodes = r##"<node><translate>0 0 10</translate><scale>2 2 2</scale>
        <node><rotate>0 0 1 90</rotate><matrix>1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
        <instance_node url="#kept"/></node></node>"##;
    let mesh = load(&collada(up, BOX, nodes)).unwrap();
    assert_bounds(&mesh, [-6.0, 2.0, 10.0], [0.0, 6.0, 18.0]);
    // Two instances, one of them mirrored: both face outwards.
    let nodes = r##"<node><instance_geometry url="#box"/></node>
        <node><scale>-1 1 1</scale><translate>5 0 0</translate><instance_geometry url="#box"/></node>"##;
    let mesh = load(&collada(up, BOX, nodes)).unwrap();
    assert_eq!(mesh.faces.len(), 24);
    assert_bounds(&mesh, [-7.0, 0.0, 0.0], [2.0, 3.0, 4.0]);
    assert!((signed_volume(&mesh) - 48.0).abs() < 1e-12);
}

#[test]
fn every_primitive_gives_the_same_triangles() {
    let mesh = |primitive: &str| {
        let geometry = format!(
            r##"<geometry id="box"><mesh><source id="p"><float_array>9 0 0 0  9 1 0 0  9 1 1 0  9 0 1 0</float_array>
            <technique_common><accessor count="4" stride="4" offset="1"/></technique_common></source>
            <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{primitive}</mesh></geometry>"##
        );
        load(&collada("<up_axis>Z_UP</up_axis>", &geometry, SHOWN)).unwrap()
    };
    let input = r##"<input semantic="VERTEX" source="#v" offset="0"/>"##;
    for primitive in [
        format!("<triangles>{input}<p>0 1 2 0 2 3</p></triangles>"),
        format!("<polygons>{input}<p>0 1 2 3</p></polygons>"),
        format!("<tristrips>{input}<p>1 2 0 3</p></tristrips>"),
        format!("<trifans>{input}<p>0 1 2 3</p></trifans>"),
    ] {
        let mesh = mesh(&primitive);
        let area: Vector3<f64> = (0..mesh.faces.len())
            .map(|face| mesh.area_vector(face))
            .sum();
        assert!(
            mesh.faces.len() == 2 && (mesh.area() - 1.0).abs() < 1e-12,
            "{primitive}"
        );
        assert!(area.z > 0.9, "{primitive}");
    }
}

#[test]
fn faults_are_one_line() {
    let up = "<up_axis>Z_UP</up_axis>";
    for (text, word) in [
        ("<COLLADA>".to_owned(), "XML"),
        ("<html/>".to_owned(), "COLLADA"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><COLLADA/>".to_owned(), "XML"),
        (collada("<unit meter='0'/>", BOX, SHOWN), "metres"),
        (collada("<up_axis>W_UP</up_axis>", BOX, SHOWN), "W_UP"),
        (collada(up, BOX, ""), "no faces"),
        (
            collada(
                up,
                BOX,
                r##"<node><instance_geometry url="#gone"/></node>"##,
            ),
            "#gone",
        ),
        (
            collada(up, BOX, r##"<node><instance_node url="#again"/></node>"##),
            "contain themselves",
        ),
        (
            collada(up, BOX, "<node><skew>1 2 3 4 5 6 7</skew></node>"),
            "skew",
        ),
        (collada(up, BOX, "<node><matrix>1 2</matrix></node>"), "16"),
        (
            collada(up, &BOX.replace("4 4 4 4 4 4", "4 4 4 4 4 5"), SHOWN),
            "vcount",
        ),
        (
            collada(up, &BOX.replace("7 0 6 0", "8 0 6 0"), SHOWN),
            "beyond the 8",
        ),
        (
            collada(up, &BOX.replace("0 0 0 2", "0 nan 0 2"), SHOWN),
            "not finite",
        ),
        (
            collada(up, &BOX.replace("0 0 0 2", "0 x 0 2"), SHOWN),
            "not a number",
        ),
    ] {
        let message = load(&text).expect_err(&text);
        assert!(
            message.contains(word) && message.contains("shape.dae") && !message.contains('\n'),
            "{message}"
        );
    }
}
