//! Files of other projects' grasps in both forms, written here as NumPy's `save` writes them: one dictionary a
//! grasp, and one dictionary of arrays over all grasps.

use std::path::PathBuf;

use graspd::{GraspError, GraspRecord, read_dexgraspnet};
use graspd_hand::Hand;
use nalgebra::{Rotation3, UnitQuaternion};
use tempfile::TempDir;

use crate::fixtures::HAND;

/// Rounding of a rotation on its way through a matrix.
const ROUNDING: f64 = 1e-12;

/// A value as a pickle's instructions (protocol 3), which leave it on the stack.
#[derive(Clone)]
struct Pickled(Vec<u8>);

fn text(text: &str) -> Pickled {
    let length = (text.len() as u32).to_le_bytes();
    Pickled([b"X", &length[..], text.as_bytes()].concat())
}

fn number(number: f64) -> Pickled {
    Pickled([b"G", &number.to_be_bytes()[..]].concat())
}

fn dictionary(entries: &[(&str, Pickled)]) -> Pickled {
    let mut bytes = b"}(".to_vec();
    for (name, value) in entries {
        bytes.extend(text(name).0);
        bytes.extend(&value.0);
    }
    bytes.push(b'u');
    Pickled(bytes)
}

/// `numpy.ndarray` of a type and a shape, with the instructions for what it holds.
fn array(kind: &str, shape: &[usize], content: &[u8]) -> Pickled {
    let mut bytes =
        b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\nK\x00\x85C\x01btR".to_vec();
    bytes.extend(b"(K\x01(");
    for &side in shape {
        bytes.extend([b"J", &(side as u32).to_le_bytes()[..]].concat());
    }
    bytes.extend(b"tcnumpy\ndtype\n(");
    bytes.extend(text(kind).0);
    // dtype(kind, False, True) with the state (3, '<', None, None, None, -1, -1, 0)
    bytes.extend(b"\x89\x88tR(K\x03");
    bytes.extend(text("<").0);
    bytes.extend(b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb\x89");
    bytes.extend(content);
    bytes.extend(b"tb");
    Pickled(bytes)
}

fn doubles(shape: &[usize], values: &[f64]) -> Pickled {
    let content: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let length = (content.len() as u32).to_le_bytes();
    array("f8", shape, &[b"B", &length[..], &content].concat())
}

fn singles(shape: &[usize], values: &[f64]) -> Pickled {
    let content: Vec<u8> = (values.iter())
        .flat_map(|&x| (x as f32).to_le_bytes())
        .collect();
    let length = (content.len() as u32).to_le_bytes();
    array("f4", shape, &[b"B", &length[..], &content].concat())
}

fn objects(shape: &[usize], members: &[Pickled]) -> Pickled {
    let mut list = b"](".to_vec();
    for member in members {
        list.extend(&member.0);
    }
    list.push(b'e');
    array("O8", shape, &list)
}

/// An `.npy` file, called as the object is.
struct File {
    folder: TempDir,
}

impl File {
    /// Of an array of objects of this shape.
    fn new(shape: &[usize], members: &[Pickled]) -> Self {
        let sides: String = shape.iter().map(|side| format!("{side},")).collect();
        let header = format!("{{'descr': '|O', 'fortran_order': False, 'shape': ({sides}), }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(b"\x80\x03");
        bytes.extend(objects(shape, members).0);
        bytes.push(b'.');
        let file = Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        std::fs::write(file.path(), bytes).expect("the folder is ours");
        file
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("core-mug-1a2b.npy")
    }

    fn read(&self) -> Result<Vec<GraspRecord>, GraspError> {
        read_dexgraspnet(&self.path(), &*HAND)
    }

    fn fault(&self) -> String {
        let message = self.read().expect_err("a fault in it").to_string();
        assert!(message.contains("core-mug-1a2b.npy") && !message.contains('\n'));
        message
    }
}

/// Position \[m\], angles about the fixed axes x, y, z in turn \[rad\], and joints \[rad\].
type Grasp = ([f64; 3], [f64; 3], Vec<f64>);

fn grasps() -> Vec<Grasp> {
    let joints = HAND.articulation_names().len();
    (0..5)
        .map(|index| {
            let at = f64::from(index);
            let joints = (0..joints).map(|joint| 0.01 * joint as f64 + 0.1 * at);
            let angles = [0.3 - at, 0.7 * at - 1.0, 1.1 + 0.2 * at];
            ([0.1 * at, -0.05, 0.2 - 0.01 * at], angles, joints.collect())
        })
        .collect()
}

fn as_dictionary((place, angles, joints): &Grasp, scale: Option<f64>) -> Pickled {
    let wrist = ["WRJTx", "WRJTy", "WRJTz", "WRJRx", "WRJRy", "WRJRz"];
    let wrist = wrist.into_iter().zip(place.iter().chain(angles));
    let names = HAND.articulation_names().iter().map(String::as_str);
    let fingers = names.zip(joints);
    let qpos: Vec<_> = (wrist.chain(fingers))
        .map(|(name, &value)| (name, number(value)))
        .collect();
    let mut entries = vec![("qpos", dictionary(&qpos))];
    entries.extend(scale.map(|scale| ("scale", number(scale))));
    // What other programs add is ignored.
    entries.push(("energy", number(1.5)));
    dictionary(&entries)
}

fn matrix([x, y, z]: [f64; 3]) -> Vec<f64> {
    let matrix = Rotation3::from_euler_angles(x, y, z);
    matrix.matrix().transpose().as_slice().to_vec()
}

/// The arrays over all grasps.
fn as_arrays(grasps: &[Grasp], numbers: fn(&[usize], &[f64]) -> Pickled) -> Vec<(&str, Pickled)> {
    let (count, joints) = (grasps.len(), HAND.articulation_names().len());
    let places: Vec<f64> = grasps.iter().flat_map(|grasp| grasp.0).collect();
    let rotations: Vec<f64> = grasps.iter().flat_map(|grasp| matrix(grasp.1)).collect();
    let angles: Vec<f64> = grasps.iter().flat_map(|grasp| grasp.2.clone()).collect();
    vec![
        ("trans", numbers(&[count, 3], &places)),
        ("rot", numbers(&[count, 3, 3], &rotations)),
        ("joint_angles", numbers(&[count, joints], &angles)),
    ]
}

fn assert_are(records: &[GraspRecord], grasps: &[Grasp], tolerance: f64) {
    assert_eq!(records.len(), grasps.len());
    for (index, (record, (place, [x, y, z], joints))) in records.iter().zip(grasps).enumerate() {
        assert_eq!(
            (record.index, record.object.as_str()),
            (index, "core-mug-1a2b")
        );
        assert_eq!(record.hand, HAND.name());
        let near = |a: f64, b: f64| (a - b).abs() <= tolerance;
        let found = &record.pose;
        assert!((0..3).all(|k| near(found.translation_m[k], place[k])));
        let [w, i, j, k] = found.rotation_wxyz;
        let found = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        let expected = UnitQuaternion::from_euler_angles(*x, *y, *z);
        assert!(found.angle_to(&expected) <= 10.0 * tolerance.max(1e-8));
        let found = record.joints_rad.as_ref().expect("a hand of joints");
        for (name, &angle) in HAND.articulation_names().iter().zip(joints) {
            assert!(near(found[name], angle), "{name}");
        }
    }
}

#[test]
fn an_array_of_dictionaries() {
    let grasps = grasps();
    let scales = [None, Some(1.0), Some(0.06), Some(0.15), Some(2.0)];
    let members: Vec<_> = (grasps.iter().zip(scales))
        .map(|(grasp, scale)| as_dictionary(grasp, scale))
        .collect();
    let records = File::new(&[5], &members).read().unwrap();
    assert_are(&records, &grasps, ROUNDING);
    let found: Vec<_> = records.iter().map(|record| record.object_scale).collect();
    assert_eq!(found, scales.map(|scale| scale.unwrap_or(1.0)));
}

#[test]
fn a_dictionary_of_arrays() {
    let grasps = grasps();
    let whole = |numbers| File::new(&[], &[dictionary(&as_arrays(&grasps, numbers))]);
    let records = whole(doubles).read().unwrap();
    assert_are(&records, &grasps, ROUNDING);
    assert!(records.iter().all(|record| record.object_scale == 1.0));
    // In single precision, as networks write them.
    assert_are(&whole(singles).read().unwrap(), &grasps, 1e-6);
}

#[test]
fn both_forms_hold_the_same_grasps() {
    let grasps = grasps();
    let members: Vec<_> = grasps
        .iter()
        .map(|grasp| as_dictionary(grasp, None))
        .collect();
    let listed = File::new(&[5], &members).read().unwrap();
    let arrays = File::new(&[], &[dictionary(&as_arrays(&grasps, doubles))]);
    for (one, other) in listed.iter().zip(arrays.read().unwrap()) {
        assert_eq!(one.joints_rad, other.joints_rad);
        assert_eq!(one.pose.translation_m, other.pose.translation_m);
        let (a, b) = (one.pose.rotation_wxyz, other.pose.rotation_wxyz);
        let sign = (a[0] * b[0]).signum();
        assert!(
            (0..4).all(|k| (a[k] - sign * b[k]).abs() < ROUNDING),
            "{a:?} {b:?}"
        );
    }
}

#[test]
fn faults_of_arrays_are_told_in_a_line() {
    let grasps = grasps();
    let joints = HAND.articulation_names().len();
    let with = |name: &str, value: Option<Pickled>| {
        let mut arrays = as_arrays(&grasps, doubles);
        let at = arrays.iter().position(|(other, _)| *other == name).unwrap();
        match value {
            Some(value) => arrays[at].1 = value,
            None => drop(arrays.remove(at)),
        }
        File::new(&[], &[dictionary(&arrays)]).fault()
    };
    for name in ["trans", "rot", "joint_angles"] {
        assert!(with(name, None).contains(&format!("no array `{name}`")));
        let flat = with(name, Some(doubles(&[2], &[0.0; 2])));
        assert!(flat.contains(&format!("`{name}` of shape [2]")), "{flat}");
    }
    let short = with("trans", Some(doubles(&[4, 3], &[0.0; 12])));
    assert!(short.contains("different numbers of grasps"), "{short}");
    let few = with("joint_angles", Some(doubles(&[5, 2], &[0.0; 10])));
    assert!(few.contains(&format!("[n, {joints}]")), "{few}");
    let nothing = with("trans", Some(doubles(&[5, 3], &[f64::NAN; 15])));
    assert!(nothing.contains("finite"), "{nothing}");
    let sheared = with("rot", Some(doubles(&[5, 3, 3], &[1.0; 45])));
    assert!(
        sheared.contains("grasp 0") && sheared.contains("no rotation"),
        "{sheared}"
    );
    let mirrored: Vec<f64> = (0..5).flat_map(|_| matrix([0.0; 3])).map(|x| -x).collect();
    let mirrored = with("rot", Some(doubles(&[5, 3, 3], &mirrored)));
    assert!(mirrored.contains("no rotation"), "{mirrored}");
}

#[test]
fn faults_of_dictionaries_name_the_grasp() {
    let grasps = grasps();
    let good = as_dictionary(&grasps[0], None);
    let second = |bad: Pickled| File::new(&[2], &[good.clone(), bad]).fault();
    let fault = second(dictionary(&[("scale", number(1.0))]));
    assert!(
        fault.contains("grasp 1 has no dictionary `qpos`"),
        "{fault}"
    );
    let fault = second(dictionary(&[("qpos", number(1.0))]));
    assert!(
        fault.contains("grasp 1") && fault.contains("no dictionary"),
        "{fault}"
    );
    let fault = second(as_dictionary(&grasps[1], Some(f64::INFINITY)));
    assert!(
        fault.contains("grasp 1") && fault.contains("`scale`"),
        "{fault}"
    );
    let mut nowhere = grasps[1].clone();
    nowhere.0[1] = f64::NAN;
    let fault = second(as_dictionary(&nowhere, None));
    assert!(
        fault.contains("grasp 1") && fault.contains("`WRJTy`"),
        "{fault}"
    );
    let fault = second(number(3.0));
    assert!(fault.contains("grasp 1"), "{fault}");
    assert!(File::new(&[0], &[]).fault().contains("no grasps"));
    let numbers = File::new(&[], &[doubles(&[3], &[1.0, 2.0, 3.0])]);
    assert!(numbers.fault().contains("numbers instead of dictionaries"));
}
