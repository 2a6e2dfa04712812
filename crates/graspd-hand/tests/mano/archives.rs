//! The same arrays from `.npz`.

use std::io::{Cursor, Write};

use graspd_hand::{JointPlacement, SKINNED_JOINTS, SkinnedModel, parse_skinned_model};
use zip::write::SimpleFileOptions;

use crate::synthetic;

/// A `.npy` file of format 1.
pub(crate) fn npy(descr: &str, fortran: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    let sides: String = shape.iter().map(|side| format!("{side},")).collect();
    let mut header =
        format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': ({sides}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn doubles(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    npy("'<f8'", "False", shape, &data)
}

pub(crate) fn zipped(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        writer
            .start_file(format!("{name}.npy"), SimpleFileOptions::default())
            .unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn entries(model: &SkinnedModel) -> Vec<(&'static str, Vec<u8>)> {
    let vertices = model.template.len();
    let JointPlacement::Regressed(rows) = &model.joints else {
        panic!("only regressed joints are written here");
    };
    let mut regressor = vec![0.0; SKINNED_JOINTS * vertices];
    for (joint, row) in rows.iter().enumerate() {
        for &(vertex, factor) in row {
            regressor[joint * vertices + vertex as usize] += factor;
        }
    }
    // First index fastest, in 4 bytes, as NumPy writes the transpose of an array.
    let faces = (0..3).flat_map(|k| model.faces.iter().map(move |face| face[k]));
    let faces: Vec<u8> = faces.flat_map(|i| i.to_be_bytes()).collect();
    let parents = model.parents.iter().map(|p| p.map_or(-1, |p| p as i32));
    let parents: Vec<u8> = parents.flat_map(i32::to_le_bytes).collect();
    let mut entries = vec![
        (
            "v_template",
            doubles(&[vertices, 3], &model.template.concat()),
        ),
        ("f", npy("'>u4'", "True", &[model.faces.len(), 3], &faces)),
        ("weights", doubles(&[vertices, 16], &model.weights.concat())),
        ("parents", npy("'<i4'", "False", &[16], &parents)),
        ("J_regressor", doubles(&[16, vertices], &regressor)),
        (
            "hands_components",
            doubles(
                &[model.pose_components.len(), 45],
                &model.pose_components.concat(),
            ),
        ),
        ("hands_mean", doubles(&[45], &model.pose_mean)),
    ];
    let shapes = model.shape_directions.len() / vertices / 3;
    entries.push((
        "shapedirs",
        doubles(&[vertices, 3, shapes], &model.shape_directions),
    ));
    if let Some(directions) = &model.pose_directions {
        entries.push(("posedirs", doubles(&[vertices, 3, 135], directions)));
    }
    entries
}

/// The model as an archive.
pub(crate) fn archived(model: &SkinnedModel) -> Vec<u8> {
    zipped(&entries(model))
}

#[test]
fn a_model_is_read_back_as_it_was_written() {
    let mut model = synthetic::model(1);
    // As the file has them, sorted by vertex.
    if let JointPlacement::Regressed(rows) = &mut model.joints {
        rows.iter_mut()
            .for_each(|row| row.sort_by_key(|entry| entry.0));
    }
    assert_eq!(
        parse_skinned_model(&archived(&model), "made-up").unwrap(),
        model
    );
}

#[track_caller]
fn refused(entries: &[(&str, Vec<u8>)], parts: &[&str]) {
    let error = parse_skinned_model(&zipped(entries), "hand")
        .expect_err("it is wrong")
        .to_string();
    assert!(
        parts.iter().all(|part| error.contains(part)) && !error.contains('\n'),
        "{error}"
    );
}

#[test]
fn faults() {
    let model = synthetic::smallest();
    let all = entries(&model);
    let without = |name: &str| {
        all.iter()
            .filter(|e| e.0 != name)
            .cloned()
            .collect::<Vec<_>>()
    };
    refused(
        &without("weights"),
        &["no array `weights`; it has v_template, f, parents"],
    );
    refused(&[], &["no array `v_template`; it has none"]);
    let with = |name: &'static str, bytes: Vec<u8>| [without(name), vec![(name, bytes)]].concat();
    refused(
        &with("f", npy("'|O'", "False", &[4, 3], b"")),
        &["`f` has the type `|O`"],
    );
    refused(
        &with("f", npy("'<\ni4'", "False", &[4, 3], b"")),
        &["`f` has the type"],
    );
    refused(
        &with("f", npy("[('a', '<f8')]", "False", &[4, 3], b"")),
        &["records or objects"],
    );
    refused(&with("f", b"PK".to_vec()), &["`f` is no .npy array"]);
    refused(
        &with("f", doubles(&[4, 3], &[0.5; 12])),
        &["row 0 is no triangle of vertex numbers"],
    );
    refused(
        &with("f", doubles(&[4, 3], &[-1.0; 12])),
        &["row 0 is no triangle of vertex numbers"],
    );
    let huge = npy("'<f8'", "False", &[usize::MAX / 2, 3], &[0; 24]);
    refused(
        &with("v_template", huge),
        &["`v_template`", "24 bytes, which do not fit"],
    );
    refused(
        &with("weights", doubles(&[16, 4], &[0.0; 64])),
        &["`weights` has the shape [16, 4], where [4, 16]"],
    );
    let backward: Vec<f64> = (0..16).map(|joint| f64::from(15 - joint)).collect();
    refused(
        &with("parents", doubles(&[16], &backward)),
        &["kintree_table", "joint 1 the parent 14"],
    );
}

#[test]
fn zeros_without_end_are_not_unpacked() {
    let mut entries = entries(&synthetic::smallest());
    entries[0].1.resize(30 << 20, 0);
    let bytes = zipped(&entries);
    assert!(bytes.len() < 200_000);
    let error = parse_skinned_model(&bytes, "hand").unwrap_err().to_string();
    assert!(
        error.contains("`v_template` unpacks to over 16 MiB"),
        "{error}"
    );
}
