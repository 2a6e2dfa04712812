//! URDF files written for the purpose: what they mean, and what is wrong with them.

use graspd_geom::{Quaternion, Vec3, box_mesh, save_obj, save_stl};
use graspd_hand::{
    ArticulatedHand, Hand, HandError, HandOptions, HandPose, Limit, UrdfOptions, load_hand_with,
    load_urdf,
};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::path::Path;

const BOX: &str = r#"<collision><geometry><box size="0.02 0.02 0.02"/></geometry></collision>"#;

fn small_options() -> UrdfOptions {
    UrdfOptions {
        search_paths: Vec::new(),
        hand: HandOptions {
            contact_points: 64,
            collision_spheres: 8,
            ..HandOptions::default()
        },
    }
}

fn load_text(text: &str) -> Result<ArticulatedHand, HandError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.urdf");
    std::fs::write(&path, text).unwrap();
    load_urdf(path, &small_options())
}

/// A robot of links `a`, `b`, ... with a box each, and the given joints.
fn robot(links: &str, joints: &str) -> String {
    let links: String = links
        .chars()
        .map(|name| format!(r#"<link name="{name}">{BOX}</link>"#))
        .collect();
    format!(r#"<?xml version="1.0"?><robot name="toy">{links}{joints}</robot>"#)
}

fn joint(name: &str, kind: &str, links: [&str; 2], rest: &str) -> String {
    let [parent, child] = links;
    format!(
        r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{rest}</joint>"#
    )
}

const LIMIT: &str = r#"<limit lower="-1" upper="2"/>"#;

#[test]
fn every_kind_of_joint_moves_as_it_should() {
    let joints = [
        joint(
            "slide",
            "prismatic",
            ["a", "b"],
            r#"<origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/><axis xyz="5 0 0"/><limit lower="0" upper="0.5"/>"#,
        ),
        joint("wheel", "continuous", ["b", "c"], r#"<axis xyz="0 0 2"/>"#),
        joint("weld", "fixed", ["c", "d"], r#"<origin xyz="0.1 0 0"/>"#),
        joint(
            "bend",
            "revolute",
            ["d", "e"],
            &format!(r#"<axis xyz="0 1 0"/>{LIMIT}"#),
        ),
        joint(
            "follow",
            "revolute",
            ["e", "f"],
            r#"<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/><mimic joint="bend" multiplier="-2" offset="0.5"/>"#,
        ),
    ];
    let hand = load_text(&robot("abcdef", &joints.concat())).unwrap();
    assert_eq!(hand.name(), "toy");
    assert_eq!(hand.articulation_names(), ["slide", "wheel", "bend"]);
    // d is welded to c, and -2 bend + 0.5 must stay within -1 and 1.
    assert_eq!(hand.body_names(), ["a", "b", "c", "e", "f"]);
    let limit = |lower, upper| Limit { lower, upper };
    let expected = [limit(0.0, 0.5), Limit::UNLIMITED, limit(-0.25, 0.75)];
    assert_eq!(hand.limits().unwrap(), expected);

    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: vec![0.3, std::f64::consts::FRAC_PI_2, 0.25],
    };
    let at = |link: &str| hand.link_pose(&pose, link).unwrap();
    let close = |a: Vec3<f64>, b: [f64; 3]| (a - Vec3::from(b)).norm() < 1e-12;
    // Turned by a quarter about z, x becomes y; the wheel turns another quarter.
    assert!(close(at("b").translation, [0.0, 0.3, 1.0]));
    assert!(close(at("d").translation, [-0.1, 0.3, 1.0]));
    // The bend is about -y by now: z leans to -x ... and the follower, at -2 . 0.25 + 0.5 = 0, adds nothing.
    let (sine, cosine) = 0.25_f64.sin_cos();
    let f = at("f").translation;
    assert!(
        close(f, [-0.1 - 0.2 * sine, 0.3, 1.0 + 0.2 * cosine]),
        "{f:?}"
    );
    assert_eq!(at("f").rotation, at("e").rotation);
    assert!(hand.link_pose(&pose, "nowhere").is_none());
}

#[test]
fn a_follower_pulls_back_to_what_it_follows() {
    use graspd_hand::{Kinematics, PointBuffer, PoseGradient};
    let follow = format!(
        r#"<origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>{LIMIT}<mimic joint="bend" multiplier="3"/>"#
    );
    let joints = [
        joint(
            "bend",
            "revolute",
            ["a", "b"],
            &format!(r#"<axis xyz="0 1 0"/>{LIMIT}"#),
        ),
        joint("follow", "revolute", ["b", "c"], &follow),
    ];
    let hand = load_text(&robot("abc", &joints.concat())).unwrap();
    let n = hand.contact_points().weight.len();
    let s = hand.collision_spheres().radius.len();
    let height = |angle: f64| -> (f64, f64) {
        let pose = HandPose {
            translation: Vec3::zero(),
            rotation: Quaternion::identity(),
            articulation: vec![angle],
        };
        let mut scratch = hand.new_scratch();
        let (mut points, mut spheres) = (PointBuffer::<f64>::zeros(n), PointBuffer::zeros(s));
        hand.forward(&pose, &mut scratch, &mut points, &mut spheres);
        let mut up = PointBuffer::zeros(n);
        up.z.fill(1.0);
        let mut gradient = PoseGradient::zero(1);
        let none = PointBuffer::zeros(s);
        hand.pullback(
            &pose,
            &mut scratch,
            &points,
            &up,
            &spheres,
            &none,
            &mut gradient,
        );
        (points.z.iter().sum(), gradient.articulation[0])
    };
    let step = 1e-6;
    let difference = (height(0.3 + step).0 - height(0.3 - step).0) / (2.0 * step);
    assert!((difference - height(0.3).1).abs() < 1e-6 * difference.abs());
}

#[test]
fn meshes_are_found_scaled_mended_and_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let meshes = folder.path().join("toy_description/meshes");
    std::fs::create_dir_all(&meshes).unwrap();
    let cube = box_mesh(Vector3::repeat(20.0), 20.0);
    save_stl(&cube, meshes.join("cube.stl")).unwrap();
    let mut open = cube.clone();
    open.faces.truncate(8);
    save_obj(&open, meshes.join("open.obj")).unwrap();
    let mesh = |tag: &str, file: &str| {
        format!(
            r#"<{tag}><geometry><mesh filename="package://toy_description/meshes/{file}" scale="0.001 -0.001 0.002"/></geometry></{tag}>"#
        )
    };
    let link = |name: &str, geometry: &str| format!(r#"<link name="{name}">{geometry}</link>"#);
    let text = format!(
        "<robot name='m'>{}{}{}{}{}</robot>",
        link("a", &mesh("collision", "cube.stl")),
        // A closed visual mesh stands in for an open collision mesh, a box for one without.
        link(
            "b",
            &[mesh("visual", "cube.stl"), mesh("collision", "open.obj")].concat()
        ),
        link("c", &mesh("visual", "open.obj")),
        joint(
            "j",
            "revolute",
            ["a", "b"],
            &format!(r#"<origin xyz="0 0 0.1"/>{LIMIT}"#)
        ),
        joint(
            "k",
            "revolute",
            ["b", "c"],
            &format!(r#"<origin xyz="0 0 0.1"/>{LIMIT}"#)
        ),
    );
    let urdf = folder.path().join("toy_description/urdf");
    std::fs::create_dir_all(&urdf).unwrap();
    std::fs::write(urdf.join("toy.urdf"), text).unwrap();
    let hand = load_urdf(urdf.join("toy.urdf"), &small_options()).unwrap();
    for part in hand.parts() {
        let (low, high) = part.mesh.bounds().unwrap();
        assert!((high - low - Vector3::new(0.02, 0.02, 0.04)).norm() < 1e-6);
        // Mirrored by the scale, but still outward oriented.
        assert!(graspd_geom::signed_volume(&part.mesh) > 1.5e-5);
    }
    assert_eq!(hand.parts().len(), 3);
    let notes = hand.notes();
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("`b`") && notes[0].contains("visual"));
    assert!(notes[1].contains("`c`") && notes[1].contains("bounding box"));
}

/// The fault of a file, and what its message must mention besides the file.
fn check_fault(text: &str, is_expected: impl Fn(&HandError) -> bool, mentions: &[&str]) {
    let error = load_text(text).expect_err(text);
    let message = error.to_string();
    let HandError::InFile { error, .. } = &error else {
        panic!("{message} does not name the file");
    };
    assert!(is_expected(error), "{message}");
    assert!(
        !message.contains('\n') && message.contains("hand.urdf"),
        "{message}"
    );
    for word in mentions {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
}

macro_rules! fault {
    ($text:expr, $pattern:pat, $($word:expr),*) => {
        check_fault(&$text, |error| matches!(error, $pattern), &[$($word),*])
    };
}

#[test]
fn each_fault_has_its_message() {
    let bend = |links, rest: &str| joint("bend", "revolute", links, &format!("{rest}{LIMIT}"));
    let ab = |rest: &str| robot("ab", &bend(["a", "b"], rest));
    fault!("", HandError::Empty, "empty");
    fault!(" \n", HandError::Empty, "empty");
    fault!("# a mesh", HandError::NotUrdf(_), "URDF");
    fault!("<robot><link></robot>", HandError::NotUrdf(_), "URDF");
    fault!("<robot><link/></robot>", HandError::NotUrdf(_), "name");
    fault!(ab("")[..150], HandError::NotUrdf(_), "cut off");
    fault!(
        "<robot><xacro:macro/></robot>",
        HandError::Xacro { .. },
        "xacro",
        "expand"
    );
    fault!("<robot/>", HandError::NoLinks, "links");
    fault!(robot("a", ""), HandError::NoMovableJoints, "joint");
    fault!(
        robot("ab", &joint("weld", "fixed", ["a", "b"], "")),
        HandError::NoMovableJoints,
        "joint"
    );
    fault!(
        robot("aab", &bend(["a", "b"], "")),
        HandError::DuplicateName { .. },
        "`a`"
    );
    fault!(
        robot("a", &bend(["a", "b"], "")),
        HandError::MissingLink { .. },
        "`bend`",
        "`b`"
    );
    fault!(
        robot("abc", &bend(["a", "b"], "")),
        HandError::SeveralRoots { .. },
        "a, c"
    );
    let ring = [bend(["a", "b"], ""), joint("back", "fixed", ["b", "a"], "")].concat();
    fault!(robot("ab", &ring), HandError::Cycle { .. }, "cycle");
    fault!(robot("abc", &ring), HandError::Cycle { .. }, "cycle");
    fault!(
        robot("a", &bend(["a", "a"], "")),
        HandError::Cycle { .. },
        "cycle"
    );
    let two = [bend(["a", "c"], ""), joint("weld", "fixed", ["b", "c"], "")].concat();
    fault!(
        robot("abc", &two),
        HandError::TwoParents { .. },
        "`c`",
        "`bend`",
        "`weld`"
    );
    fault!(
        ab(r#"<axis xyz="0 0 0"/>"#),
        HandError::ZeroAxis { .. },
        "`bend`"
    );
    fault!(
        ab(r#"<axis xyz="0 nan 0"/>"#),
        HandError::NotFinite { .. },
        "axis",
        "`bend`"
    );
    fault!(
        ab(r#"<origin xyz="0 inf 0"/>"#),
        HandError::NotFinite { .. },
        "origin"
    );
    let reversed = joint(
        "bend",
        "revolute",
        ["a", "b"],
        r#"<limit lower="1" upper="-1"/>"#,
    );
    fault!(
        robot("ab", &reversed),
        HandError::ReversedLimits { .. },
        "`bend`",
        "lower"
    );
    let planar = joint("p", "planar", ["a", "b"], "");
    fault!(
        robot("ab", &planar),
        HandError::UnsupportedJoint { .. },
        "planar"
    );
    fault!(
        ab(r#"<mimic joint="c"/>"#),
        HandError::NoMovableJoints,
        "joint"
    );
    let follow = |followed: &str| {
        let mimic = format!(r#"{LIMIT}<mimic joint="{followed}"/>"#);
        [
            bend(["a", "b"], ""),
            joint("follow", "revolute", ["b", "c"], &mimic),
            joint("weld", "fixed", ["c", "d"], ""),
        ]
        .concat()
    };
    for followed in ["nobody", "weld", "follow"] {
        fault!(
            robot("abcd", &follow(followed)),
            HandError::BadMimic { .. },
            "`follow`"
        );
    }
    let bad_size = ab("").replacen("0.02 0.02 0.02", "0.02 0 0.02", 1);
    fault!(bad_size, HandError::BadSize { .. }, "`a`", "box");
    let mesh = |file: &str| {
        ab("").replacen(
            r#"<box size="0.02 0.02 0.02"/>"#,
            &format!(r#"<mesh filename="{file}"/>"#),
            1,
        )
    };
    fault!(
        mesh("package://x/none.stl"),
        HandError::MissingMesh { .. },
        "none.stl",
        "`a`"
    );
    fault!(mesh("hand.urdf"), HandError::BadMesh { .. }, "`a`", ".urdf");
    fault!(ab("").replace(BOX, ""), HandError::NoGeometry, "geometry");
}

#[test]
fn hands_are_loaded_by_name_or_path() {
    let options = small_options().hand;
    assert_eq!(
        load_hand_with("allegro", &options).unwrap().name(),
        "allegro"
    );
    let message = |name: &str| match load_hand_with(name, &options) {
        Ok(_) => panic!("{name} is a hand"),
        Err(error) => error.to_string(),
    };
    assert!(message("alegro").contains("allegro"));
    assert!(message("Cargo.toml").contains(".urdf"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("toy.URDF");
    let joints = joint(
        "bend",
        "revolute",
        ["a", "b"],
        &format!(r#"<origin xyz="0 0 1"/>{LIMIT}"#),
    );
    std::fs::write(&path, robot("ab", &joints)).unwrap();
    let hand = load_hand_with(path.to_str().unwrap(), &options).unwrap();
    assert_eq!(hand.articulation_names(), ["bend"]);
    assert!(matches!(
        load_urdf(folder.path(), &small_options()),
        Err(HandError::Read { .. })
    ));
    let absent = Path::new("absent.urdf");
    assert!(matches!(
        load_urdf(absent, &small_options()),
        Err(HandError::Read { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Damaged files give a hand or an error that names the file, whatever was damaged.
    #[test]
    fn damaged_files_are_errors(at in 0.0..1.0, length in 0_usize..40, junk in ".{0,12}") {
        let joints = joint("bend", "revolute", ["a", "b"], &format!(r#"<origin xyz="0 0 1"/>{LIMIT}"#));
        let mut text: Vec<char> = robot("ab", &joints).chars().collect();
        let start = (at * text.len() as f64) as usize;
        let end = (start + length).min(text.len());
        text.splice(start..end, junk.chars());
        let text: String = text.into_iter().collect();
        if let Err(error) = load_text(&text) {
            let message = error.to_string();
            prop_assert!(message.contains("hand.urdf") && !message.contains('\n'), "{message}");
        }
    }
}
