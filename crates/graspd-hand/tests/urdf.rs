//! URDF files written for the purpose: what they mean.

mod toy;

use graspd_geom::{Quaternion, Vec3, box_mesh};
use graspd_hand::{Hand, HandError, HandPose, Limit, LoadOptions, load_hand_from, load_urdf};
use graspd_mesh::{save_mesh, save_obj};
use nalgebra::Vector3;
use std::path::Path;
use toy::{LIMIT, joint, load_text, robot, small_options};

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
            r#"<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/>
                <mimic joint="bend" multiplier="-2" offset="0.5"/>"#,
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
    save_mesh(&cube, meshes.join("cube.stl")).unwrap();
    let mut open = cube.clone();
    open.faces.truncate(8);
    save_obj(&open, meshes.join("open.obj")).unwrap();
    let mesh = |tag: &str, file: &str| {
        format!(
            r#"<{tag}><geometry>
                <mesh filename="package://toy_description/meshes/{file}" scale="0.001 -0.001 0.002"/>
                </geometry></{tag}>"#
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
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert!(notes[0].contains("`b`") && notes[0].contains("visual"));
    assert!(notes[1].contains("`c`") && notes[1].contains("bounding box"));
    // One finger has no palm to close towards.
    assert!(notes[2].contains("palm"));
}

#[test]
fn hands_are_loaded_by_name_or_path() {
    let options = LoadOptions {
        hand: small_options().hand,
        ..LoadOptions::default()
    };
    assert_eq!(
        load_hand_from("allegro", &options).unwrap().name(),
        "allegro"
    );
    let message = |name: &str| match load_hand_from(name, &options) {
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
    let hand = load_hand_from(path.to_str().unwrap(), &options).unwrap();
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
