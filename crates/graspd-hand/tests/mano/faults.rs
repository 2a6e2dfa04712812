//! Files that are wrong: one clear line each.

use graspd_hand::{SkinnedHand, SkinnedHandOptions, load_hand, parse_skinned_model};

use crate::pickles::{Extras, Writer, pickled};
use crate::synthetic;

#[track_caller]
fn refused(bytes: &[u8], parts: &[&str]) {
    let error = parse_skinned_model(bytes, "hand")
        .expect_err("it is wrong")
        .to_string();
    assert!(!error.contains('\n') && error.len() < 400, "{error}");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

fn with(change: impl FnOnce(&mut Extras)) -> Vec<u8> {
    let mut extras = Extras::default();
    change(&mut extras);
    pickled(&synthetic::smallest(), &extras)
}

#[test]
fn names_that_mano_does_not_have_are_refused_and_nothing_runs() {
    let trace = std::env::temp_dir().join(format!("graspd-was-here-{}", std::process::id()));
    for (module, name) in [
        ("os", "system"),
        ("__builtin__", "eval"),
        ("numpy", "load"),
        ("copy_reg", "_reconstructor"),
    ] {
        let mut w = Writer::default();
        w.bytes.extend([0x80, 2]);
        w.global(module, name);
        w.string(&format!("touch {}", trace.display()));
        w.bytes.extend([0x85, b'R', b'.']);
        refused(
            &w.bytes,
            &[
                &format!("`{module}.{name}`"),
                "refused, and nothing was run",
            ],
        );
    }
    assert!(!trace.exists());
}

#[test]
fn every_truncation_is_an_error() {
    let whole = with(|_| ());
    assert!(parse_skinned_model(&whole, "hand").is_ok());
    for length in 0..whole.len() {
        assert!(
            parse_skinned_model(&whole[..length], "hand").is_err(),
            "{length} bytes pass"
        );
    }
}

#[test]
fn damaged_pickles() {
    refused(b"", &["ends in the middle"]);
    refused(b"\x80\x04.", &["protocol 4", "protocol 2 or less"]);
    refused(b"\x80\x02K\x01.", &["no dictionary of arrays"]);
    refused(b"\x80\x02\xff", &["unknown instruction 0xff"]);
    refused(b"\x80\x02.", &["takes a value that is not there"]);
    refused(b"\x80\x02h\x07.", &["recalls a value 7"]);
    refused(
        b"\x80\x02}r\xff\xff\xff\xff.",
        &["under the number 4294967295"],
    );
    refused(b"\x80\x02T\xff\xff\xff\x7fabc", &["ends in the middle"]);
    refused(b"\x80\x02}(U\x01au.", &["a key without a value"]);
    refused(b"\x80\x02K\x01K\x02a.", &["neither list nor dictionary"]);
    refused(b"\x80\x02K\x01)R.", &["calls something that is no class"]);
    refused(b"\x80\x02K\x01}b.", &["no object"]);
    refused(b"\x80\x02t.", &["a mark that is not there"]);
    refused(b"\x80\x02Iten\n.", &["`ten` where an integer is due"]);
    refused(b"\x80\x02\x8a\x0901234567890.", &["over 64 bits"]);
    refused(b"S'a\n.", &["not quoted"]);
}

#[test]
fn cycles_and_nesting_end() {
    // A list that holds itself, as an array.
    refused(
        b"\x80\x02}(U\x0av_template]q\x00h\x00au.",
        &["v_template", "not an array"],
    );
    // A million lists in each other.
    let mut deep = b"\x80\x02}(U\x0av_template".to_vec();
    deep.extend(std::iter::repeat_n(b']', 900_000));
    deep.extend(std::iter::repeat_n(b'a', 899_999));
    deep.extend(b"u.");
    refused(&deep, &["v_template", "not an array"]);
    deep.splice(2..2, std::iter::repeat_n(b'N', 1 << 20));
    refused(&deep, &["over 1048576 values"]);
    // A Ch that wraps itself.
    let mut w = Writer::default();
    w.bytes.extend(b"\x80\x02}(U\x0av_template");
    w.global("chumpy.ch", "Ch");
    w.bytes.extend(b")\x81q\x09}U\x01xh\x09sbu.");
    refused(&w.bytes, &["v_template", "wrapped too many times"]);
}

#[test]
fn arrays_of_wrong_shape() {
    for (array, shape, expected) in [
        ("v_template", vec![3, 4], "[3, 4], where [3, 3]"),
        ("v_template", vec![12], "[12], where [12, 3]"),
        ("weights", vec![16, 4], "[16, 4], where [4, 16]"),
        ("hands_mean", vec![5, 9], "[5, 9], where [45]"),
        ("weights", vec![4, 15], "512 bytes, which do not fit"),
        (
            "weights",
            vec![usize::MAX >> 33; 2],
            "512 bytes, which do not fit",
        ),
        ("hands_mean", vec![0, 45], "360 bytes, which do not fit"),
        (
            "hands_mean",
            [vec![45], vec![1; 40]].concat(),
            "360 bytes, which do not fit",
        ),
    ] {
        let bytes = with(|extras| extras.reshaped = Some((array, shape)));
        refused(&bytes, &[&format!("`{array}`"), expected]);
    }
}

#[test]
fn missing_arrays() {
    for array in ["v_template", "weights", "f"] {
        let bytes = with(|extras| extras.missing = Some(array));
        refused(
            &bytes,
            &[&format!("no array `{array}`"), "bs_style", "hands_mean"],
        );
    }
    refused(
        &with(|extras| extras.missing = Some("kintree_table")),
        &["no array `parents`"],
    );
    refused(
        &with(|extras| extras.missing = Some("J_regressor")),
        &["no array `J`"],
    );
}

#[test]
fn numbers_that_cannot_be() {
    for (array, place, value, expected) in [
        ("v_template", 4, f64::NAN, "not finite, at place 4"),
        ("v_template", 4, 50.0, "in millimetres?"),
        ("weights", 17, f64::INFINITY, "not finite"),
        ("weights", 17, 0.9, "row 1 sums to"),
        ("hands_components", 1, f64::NAN, "not finite"),
        (
            "hands_mean",
            44,
            f64::NEG_INFINITY,
            "not finite, at place 44",
        ),
    ] {
        let bytes = with(|extras| extras.changed = Some((array, place, value)));
        refused(&bytes, &[&format!("`{array}`"), expected]);
    }
}

#[test]
fn models_that_cannot_be() {
    let refused = |change: &dyn Fn(&mut graspd_hand::SkinnedModel), parts: &[&str]| {
        let mut model = synthetic::smallest();
        change(&mut model);
        let made = SkinnedHand::new(model, &SkinnedHandOptions::default());
        let error = made.expect_err("it is wrong").to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    refused(
        &|m| m.parents[3] = Some(5),
        &["kintree_table", "joint 3 the parent 5", "no cycle"],
    );
    refused(&|m| m.parents[3] = None, &["joint 3 no parent"]);
    refused(&|m| m.parents[0] = Some(1), &["the wrist"]);
    refused(&|m| m.faces[1] = [0, 1, 9], &["`f` row 1", "beyond the 4"]);
    refused(&|m| m.faces[1] = [0, 1, 1], &["row 1 names a vertex twice"]);
    refused(&|m| m.faces.push([0, 1, 3]), &["`f`", "double triangles"]);
    refused(
        &|m| m.faces[0] = [0, 1, 2],
        &["`f`", "disagree about the outside"],
    );
    refused(&|m| m.faces.clear(), &["no triangles"]);
    refused(&|m| m.pose_components[1] = [0.0; 45], &["row 1 is zero"]);
    refused(&|m| m.pose_components.clear(), &["0 rows, where 1 to 45"]);
    refused(
        &|m| m.shape_directions.truncate(5),
        &["shapedirs", "5 numbers"],
    );
}

#[test]
fn options_that_cannot_be() {
    for (options, expected) in [
        (
            SkinnedHandOptions {
                components: 0,
                ..Default::default()
            },
            "`components` is 0",
        ),
        (
            SkinnedHandOptions {
                shape: vec![0.0; 2],
                ..Default::default()
            },
            "`shape` is 2; it must be 0 to 1",
        ),
        (
            SkinnedHandOptions {
                shape: vec![f64::NAN],
                ..Default::default()
            },
            "`shape` is NaN",
        ),
        (
            SkinnedHandOptions {
                shape: vec![50.0],
                ..Default::default()
            },
            "`shape` is 50",
        ),
    ] {
        let error = SkinnedHand::new(synthetic::smallest(), &options)
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn errors_begin_with_the_files_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.pkl");
    for (bytes, expected) in [
        (&b""[..], "is empty"),
        (b"PK\x03\x04", "no .npz archive"),
        (b"hello", "no pickle"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let error = load_hand(path.to_str().unwrap())
            .err()
            .expect("it is wrong")
            .to_string();
        assert!(
            error.starts_with(path.to_str().unwrap()) && error.contains(expected),
            "{error}"
        );
    }
}
