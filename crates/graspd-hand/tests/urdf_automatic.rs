//! What is found in URDF files without being told, and what a TOML file beside them decides instead.

mod toy;

use graspd_hand::{
    ArticulatedHand, Hand, HandError, closed_articulation, closing_directions, load_urdf,
};
use nalgebra::Vector3;
use toy::{LIMIT, joint, load_text, robot, small_options};

/// Two plates on a base that slide along y, one of them following the other, as parallel-jaw grippers have them:
/// closed at 0.
fn parallel_jaws(lower: f64, upper: f64) -> String {
    let plate = r#"<collision><origin xyz="0 0 0.03"/><geometry><box size="0.02 0.01 0.06"/></geometry></collision>"#;
    let base = r#"<collision><geometry><box size="0.06 0.2 0.04"/></geometry></collision>"#;
    let limit = format!(r#"<limit lower="{lower}" upper="{upper}"/>"#);
    let left = joint(
        "slide",
        "prismatic",
        ["base", "left"],
        &format!(r#"<origin xyz="0 0.005 0.03"/><axis xyz="0 1 0"/>{limit}"#),
    );
    let right = joint(
        "follow",
        "prismatic",
        ["base", "right"],
        &format!(
            r#"<origin xyz="0 -0.005 0.03"/><axis xyz="0 -1 0"/>{limit}<mimic joint="slide"/>"#
        ),
    );
    format!(
        r#"<robot name="jaws"><link name="base">{base}</link><link name="left">{plate}</link>
            <link name="right">{plate}</link>{left}{right}</robot>"#
    )
}

#[test]
fn a_parallel_gripper_opens_faces_along_its_jaws_and_says_so() {
    let hand = load_text(&parallel_jaws(0.0, 0.04)).unwrap();
    assert_eq!(hand.articulation_names(), ["slide"]);
    assert_eq!(hand.open_articulation(), [0.04]);
    assert_eq!(hand.palm().normal, Vector3::z());
    assert!(hand.palm().fingers.y.abs() > 0.99, "{:?}", hand.palm());
    assert!((hand.palm().center.z - 0.02).abs() < 1e-9);
    assert_eq!(closing_directions(&hand), [-1.0]);
    assert_eq!(closed_articulation(&hand, 1.0), [0.0]);
    let notes = hand.notes().join("; ");
    assert!(
        notes.contains("`slide` is closed at 0") && notes.contains("against each other"),
        "{notes}"
    );
    assert_eq!(hand.coupled_joints(), ["joint of right = 1.0000 slide"]);
}

#[test]
fn a_gripper_with_one_moving_jaw_works() {
    let arm = r#"<collision><origin xyz="0 0 0.04"/><geometry><box size="0.02 0.01 0.08"/></geometry></collision>"#;
    let swing = joint(
        "swing",
        "revolute",
        ["base", "jaw"],
        r#"<origin xyz="0 0.02 0.02"/><axis xyz="1 0 0"/><limit lower="-0.8" upper="0.1"/>"#,
    );
    let text = format!(
        r#"<robot name="jaw"><link name="base"><collision><origin xyz="0 -0.02 0.05"/><geometry>
            <box size="0.02 0.01 0.1"/></geometry></collision></link><link name="jaw">{arm}</link>{swing}</robot>"#
    );
    let hand = load_text(&text).unwrap();
    assert_eq!(hand.articulation_names(), ["swing"]);
    assert_eq!(hand.palm().normal, Vector3::z());
    assert!(!hand.notes().is_empty());
    assert!(hand.contact_points().count > 30);
}

#[test]
fn a_joint_that_cannot_reach_zero_opens_to_its_middle() {
    let swing = r#"<origin xyz="0 0 0.02"/><axis xyz="0 0 1"/><limit lower="0.2" upper="1.0"/>"#;
    let joints = [
        joint("twist", "revolute", ["a", "b"], swing),
        joint(
            "bend",
            "revolute",
            ["b", "c"],
            &format!(r#"<origin xyz="0 0 0.05"/><axis xyz="0 1 0"/>{LIMIT}"#),
        ),
    ];
    let hand = load_text(&robot("abc", &joints.concat())).unwrap();
    assert_eq!(hand.open_articulation(), [0.6, 0.0]);
    for (value, limit) in hand.open_articulation().iter().zip(hand.limits().unwrap()) {
        assert!(limit.contains(*value));
    }
}

fn beside(settings: &str) -> Result<ArticulatedHand, HandError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("jaws.urdf"), parallel_jaws(0.0, 0.04)).unwrap();
    std::fs::write(folder.path().join("jaws.toml"), settings).unwrap();
    load_urdf(folder.path().join("jaws.urdf"), &small_options())
}

#[test]
fn settings_beside_the_urdf_override_what_was_found() {
    let hand = beside(
        r#"name = "pincers"
        package_paths = ["meshes"]
        open = { slide = 0.02 }
        limits = { slide = [0.005, 0.03] }
        closing = { slide = 1 }
        [palm]
        center_m = [0.0, 0, 0.025]
        normal = [2, 0, 0]
        fingers = [1, 0, 1]
        [contacts]
        count = 200
        [self_collision]
        spheres = 6
        allow = [["left", "right"]]"#,
    )
    .unwrap();
    assert_eq!(hand.name(), "pincers");
    assert_eq!(hand.open_articulation(), [0.02]);
    let limit = hand.limits().unwrap()[0];
    assert_eq!((limit.lower, limit.upper), (0.005, 0.03));
    // Both of the hand and of its mirror image; found would be -1.
    assert_eq!(closing_directions(&hand), [1.0]);
    assert_eq!(closing_directions(&hand.mirrored()), [1.0]);
    assert_eq!(closed_articulation(&hand, 1.0), [0.03]);
    assert_eq!(
        (hand.palm().normal, hand.palm().fingers),
        (Vector3::x(), Vector3::z())
    );
    assert_eq!(hand.palm().center.z, 0.025);
    assert!((150..250).contains(&hand.contact_points().count));
    assert!(
        hand.collision_spheres().radius.len() <= 6 && hand.collision_spheres().pairs.is_empty()
    );
    assert!(
        hand.notes()
            .iter()
            .any(|note| note.contains("jaws.toml decides: "))
    );
    // One key alone leaves the rest as found.
    let hand = beside("[palm]\nfingers = [1, 0, 0]").unwrap();
    assert_eq!(
        (hand.palm().normal, hand.palm().fingers),
        (Vector3::z(), Vector3::x())
    );
    assert_eq!(hand.open_articulation(), [0.04]);
}

#[test]
fn faults_beside_the_urdf_are_one_line_that_names_the_nearest_word() {
    for (settings, words) in [
        ("plam = 1", &["`plam`", "did you mean `palm`?"][..]),
        (
            "[palm]\ncentre_m = [0, 0, 0]",
            &["line 2", "`centre_m`", "did you mean `center_m`?"],
        ),
        ("[open]\nslid = 0.01", &["[open]", "`slid`", "`slide`"]),
        ("[open]\nfollow = 0.01", &["`follow`", "moves by itself"]),
        ("[open]\nslide = 1.0", &["open.slide", "0 to 0.04"]),
        ("[limits]\nslide = [1, 0]", &["limits.slide", "above"]),
        ("[limits]\nslide = [1]", &["line 2", "array of length 2"]),
        ("[closing]\nslide = 2", &["closing.slide", "-1"]),
        ("[closing]\nslid = 1", &["[closing]", "`slide`"]),
        ("[palm]\nnormal = [0, 0, 0]", &["palm.normal", "direction"]),
        ("[palm]\nfingers = [0, 0, 1]", &["along palm.normal"]),
        ("[palm]\nnormal = [nan, 0, 1]", &["3 finite"]),
        ("palm = 3", &["line 1", "invalid type: integer `3`"]),
        ("name = 3", &["line 1", "integer `3`", "a string"]),
        ("[contacts]\ncount = 1", &["contact_points", "8 to"]),
        ("[contacts]\ncount = -1", &["line 2", "integer `-1`"]),
        (
            "[self_collision]\nallow = [[\"left\"]]",
            &["line 2", "array of length 2"],
        ),
        (
            "[self_collision]\nallow = [[\"left\", \"rihgt\"]]",
            &["`rihgt`", "`right`"],
        ),
        ("a = [", &["line 1", "jaws.toml"]),
    ] {
        let message = beside(settings).expect_err(settings).to_string();
        assert!(!message.contains('\n'), "{message}");
        for word in words {
            assert!(message.contains(word), "{word} is not in: {message}");
        }
    }
}

#[test]
fn collada_and_ply_meshes_are_parts_and_empty_ones_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let cube = graspd_geom::box_mesh(Vector3::repeat(0.02), 0.02);
    let numbers = |list: Vec<String>| list.join(" ");
    let positions = numbers(
        cube.vertices
            .iter()
            .map(|p| format!("{} {} {}", 1e3 * p.x, 1e3 * p.y, 1e3 * p.z))
            .collect(),
    );
    let corners = numbers(cube.faces.iter().flatten().map(u32::to_string).collect());
    let collada = |faces: &str| {
        format!(
            r##"<COLLADA><asset><unit meter="0.001"/><up_axis>Z_UP</up_axis></asset><library_geometries>
                <geometry id="g"><mesh>
            <source id="p"><float_array>{positions}</float_array></source>
            <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
            <triangles><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles></mesh>
                </geometry></library_geometries></COLLADA>"##
        )
    };
    std::fs::write(folder.path().join("cube.dae"), collada(&corners)).unwrap();
    std::fs::write(folder.path().join("none.dae"), collada("")).unwrap();
    let load = |mesh: &str| {
        let shape = format!(
            r#"<collision><geometry><mesh filename="{mesh}" scale="1 -1 2"/></geometry></collision>"#
        );
        let bend = joint(
            "bend",
            "revolute",
            ["a", "b"],
            &format!(r#"<origin xyz="0 0 0.1"/>{LIMIT}"#),
        );
        let text = format!(
            r#"<robot name="m"><link name="a">{shape}</link><link name="b">{shape}</link>{bend}</robot>"#
        );
        std::fs::write(folder.path().join("m.urdf"), text).unwrap();
        load_urdf(folder.path().join("m.urdf"), &small_options())
    };
    let hand = load("cube.dae").unwrap();
    for part in hand.parts() {
        // Mirrored by the scale, but outward oriented all the same.
        assert!((graspd_geom::signed_volume(&part.mesh) - 2.0 * 8e-6).abs() < 1e-12);
    }
    let message = load("none.dae").unwrap_err().to_string();
    assert!(
        message.contains("none.dae") && message.contains("no faces") && message.contains("`a`"),
        "{message}"
    );
    let message = load("gone.dae").unwrap_err().to_string();
    assert!(
        message.contains("gone.dae") && message.contains("--package-path"),
        "{message}"
    );
}
