//! Files that NumPy wrote: by `numpy.save` of version 1.26 (pickle protocol 3) and 2.4 (protocol 4).

use graspd_hand::{NumpyValue, read_npy};

/// A list of the same dictionary twice, of values of every kind.
const OBJECTS: [&[u8]; 2] = [
    include_bytes!("objects_numpy1.npy"),
    include_bytes!("objects_numpy2.npy"),
];
/// One dictionary of arrays, the second stored first index fastest.
const DICTIONARIES: [&[u8]; 2] = [
    include_bytes!("dictionary_numpy1.npy"),
    include_bytes!("dictionary_numpy2.npy"),
];
const NUMBERS: &[u8] = include_bytes!("numbers.npy");

fn array(shape: &[usize], values: &[f64]) -> NumpyValue {
    NumpyValue::Array {
        shape: shape.to_vec(),
        values: values.to_vec(),
    }
}

#[test]
fn objects_of_every_kind() {
    for bytes in OBJECTS {
        let NumpyValue::List(objects) = read_npy(bytes).unwrap() else {
            panic!("an array of objects is a list");
        };
        assert_eq!(objects.len(), 2);
        assert_eq!(objects[0], objects[1]);
        let get = |key: &str| objects[0].get(key).unwrap();
        assert_eq!(get("qpos").get("joint"), Some(&NumpyValue::Number(0.25)));
        assert_eq!(
            get("qpos").get("WRJTx").and_then(NumpyValue::number),
            Some(-1.5)
        );
        assert_eq!(get("scale"), &NumpyValue::Number(0.06));
        assert_eq!(get("count").number(), Some(3.0));
        assert_eq!(get("flag").number(), Some(1.0));
        assert_eq!(get("none"), &NumpyValue::Null);
        assert_eq!(get("single").number(), Some(0.5));
        assert_eq!(get("big").number(), Some(2f64.powi(40)));
        assert_eq!(
            get("array"),
            &array(&[2, 3], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
        );
        let pair = vec![NumpyValue::Number(1.0), NumpyValue::Text("two".into())];
        assert_eq!(get("tuple"), &NumpyValue::List(pair));
        assert_eq!(objects[0].get("missing"), None);
        let NumpyValue::Dict(entries) = &objects[0] else {
            panic!("a dictionary");
        };
        // All but the key that is no string.
        assert_eq!(entries.len(), 9);
    }
}

#[test]
fn a_dictionary_of_arrays_and_an_array_of_numbers() {
    for bytes in DICTIONARIES {
        let dictionary = read_npy(bytes).unwrap();
        assert_eq!(dictionary.get("trans"), Some(&array(&[2, 3], &[0.0; 6])));
        assert_eq!(
            dictionary.get("name"),
            Some(&NumpyValue::Text("object".into()))
        );
        let one = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let identities = array(&[2, 3, 3], &[one, one].concat());
        assert_eq!(dictionary.get("rot"), Some(&identities));
    }
    let numbers = array(&[2, 2], &[1.0, 2.0, 3.0, 4.0]);
    assert_eq!(read_npy(NUMBERS), Ok(numbers));
}

#[test]
fn every_truncation_is_an_error_and_every_changed_byte_a_value_or_an_error() {
    for whole in [OBJECTS, DICTIONARIES].concat() {
        for length in 0..whole.len() {
            assert!(read_npy(&whole[..length]).is_err(), "{length} bytes pass");
        }
        for at in 0..whole.len() {
            for value in [0, 1, b'.', b'R', 0x93, 0xff] {
                let mut bytes = whole.to_vec();
                bytes[at] = value;
                // Either is fine; a panic is not.
                let _ = read_npy(&bytes);
            }
        }
    }
}

/// An `.npy` file of an object, with any pickle in it.
fn with_pickle(pickle: &[u8]) -> Vec<u8> {
    let header = b"{'descr': '|O', 'fortran_order': False, 'shape': (), }\n";
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header, pickle].concat()
}

#[test]
fn nothing_is_run() {
    let trace = std::env::temp_dir().join(format!("graspd-npy-ran-{}", std::process::id()));
    let command = format!("touch {}", trace.display());
    let string = [b"\x8c", &[command.len() as u8][..], command.as_bytes()].concat();
    let old = [b"\x80\x03cos\nsystem\n", &string[..], b"\x85R."].concat();
    let new = [
        b"\x80\x04\x8c\x02os\x8c\x06system\x93",
        &string[..],
        b"\x85R.",
    ]
    .concat();
    for pickle in [old, new] {
        let error = read_npy(&with_pickle(&pickle)).unwrap_err();
        assert!(
            error.contains("`os.system`: refused, and nothing was run"),
            "{error}"
        );
    }
    assert!(!trace.exists());
}

#[test]
fn small_files_do_not_fill_the_memory() {
    // Each list holds the one before it a hundred times.
    let mut pickle = b"\x80\x03]q\x00".to_vec();
    for level in 1..13u8 {
        pickle.extend([b']', b'q', level, b'(']);
        for _ in 0..100 {
            pickle.extend([b'h', level - 1]);
        }
        pickle.push(b'e');
    }
    pickle.push(b'.');
    let error = read_npy(&with_pickle(&pickle)).unwrap_err();
    assert!(error.contains("more than 128 MiB"), "{error}");
    // A list that holds itself.
    let error = read_npy(&with_pickle(b"\x80\x03]q\x00h\x00a.")).unwrap_err();
    assert!(error.contains("deeper than"), "{error}");
    for (bytes, part) in [
        (&b"nothing"[..], "no .npy array"),
        (&with_pickle(b"\x80\x09."), "protocol 9"),
        (&with_pickle(b"\x80\x03\xfe."), "0xfe"),
        (&with_pickle(b"\x80\x03FNaught\n."), "where a number is due"),
    ] {
        let error = read_npy(bytes).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
}
