//! What cannot be a capture, each with one clear error.

use std::path::Path;

use graspd_geom::GeometryError;
use graspd_mesh::builtin_object;
use graspd_scan::{
    DepthImage, DepthIntrinsics, FusionSettings, ReconstructionSettings, RgbdCapture, fuse,
    read_capture, reconstruct,
};
use hdf5_pure::FileBuilder;
use tempfile::tempdir;

use crate::layouts::{scanned, simple_capture, write_camera};

fn read(folder: &Path) -> Result<RgbdCapture, GeometryError> {
    read_capture(folder, None, DepthIntrinsics::default())
}

/// One line that holds all of `parts` and ends with a remedy.
fn refused<T: std::fmt::Debug>(result: Result<T, GeometryError>, parts: &[&str]) {
    let error = result.unwrap_err().to_string();
    for part in parts {
        assert!(error.contains(part), "no `{part}` in: {error}");
    }
    assert!(error.contains("; ") && !error.contains('\n'), "{error}");
}

#[test]
fn folders_that_hold_no_capture() {
    let folder = tempdir().unwrap();
    refused(
        read(folder.path()),
        &["holds no capture", "calibration.h5", "camera.json"],
    );
    refused(read(&folder.path().join("none")), &["none: no such file"]);
    // A lonely picture.
    simple_capture(folder.path());
    std::fs::remove_file(folder.path().join("camera.json")).unwrap();
    refused(read(folder.path()), &["camera.json: no such file"]);
}

#[test]
fn ycb_files_that_are_damaged() {
    let can = builtin_object("can").unwrap();
    let folder = scanned(&can, 3, 0.0);
    let at = |name: &str| folder.path().join(name);
    let whole = read(folder.path()).unwrap();
    for name in ["NP1_0.h5", "calibration.h5", "poses/NP5_0_pose.h5"] {
        let bytes = std::fs::read(at(name)).unwrap();
        // Cut off anywhere: an error that names the file, or, where only padding was lost, the same capture.
        for length in (0..bytes.len()).step_by(bytes.len() / 40) {
            std::fs::write(at(name), &bytes[..length]).unwrap();
            match read(folder.path()) {
                Ok(capture) => assert_eq!(capture, whole, "{name} cut off at {length}"),
                Err(error) => {
                    let error = error.to_string();
                    assert!(error.contains(name) && error.contains("; "), "{error}");
                }
            }
        }
        std::fs::write(at(name), b"no HDF5").unwrap();
        refused(
            read(folder.path()),
            &[name, "not a whole HDF5 file", "download"],
        );
        std::fs::write(at(name), bytes).unwrap();
    }
    let mask = std::fs::read(at("masks/NP1_0_mask.pbm")).unwrap();
    std::fs::write(at("masks/NP1_0_mask.pbm"), &mask[..1000]).unwrap();
    refused(read(folder.path()), &["NP1_0_mask.pbm", "cut off"]);
    std::fs::write(at("masks/NP1_0_mask.pbm"), b"P4\n64 48\n").unwrap();
    refused(read(folder.path()), &["64 x 48 pixels, not 1280 x 1024"]);
    std::fs::write(at("masks/NP1_0_mask.pbm"), mask).unwrap();
    std::fs::remove_file(at("calibration.h5")).unwrap();
    refused(
        read(folder.path()),
        &["calibration.h5", "intrinsics are not known"],
    );
}

/// Puts the content of a file in place of another's.
fn replace(path: &Path, fill: impl FnOnce(&mut FileBuilder)) {
    let mut builder = FileBuilder::new();
    fill(&mut builder);
    std::fs::write(path, builder.finish().unwrap()).unwrap();
}

#[test]
fn ycb_arrays_that_cannot_be() {
    let can = builtin_object("can").unwrap();
    let folder = scanned(&can, 3, 0.0);
    let depth = folder.path().join("NP1_0.h5");
    let good = std::fs::read(&depth).unwrap();
    replace(&depth, |file| {
        file.create_dataset("depth")
            .with_u16_data(&[1; 6])
            .with_shape(&[2, 3]);
    });
    refused(
        read(folder.path()),
        &["NP1_0.h5", "`depth` is 2 x 3 values, not 480 x 640"],
    );
    replace(&depth, |file| {
        file.create_dataset("depth")
            .with_f64_data(&vec![0.5; 480 * 640])
            .with_shape(&[480, 640]);
    });
    refused(read(folder.path()), &["`depth` holds F64, not 16-bit"]);
    replace(&depth, |file| {
        file.create_dataset("dept").with_u16_data(&[1; 6]);
    });
    refused(read(folder.path()), &["no array `depth`"]);
    // Without any depth a view is as good as missing.
    replace(&depth, |file| {
        file.create_dataset("depth")
            .with_u16_data(&vec![0; 480 * 640])
            .with_shape(&[480, 640]);
    });
    let capture = read(folder.path()).unwrap();
    assert_eq!(capture.views.len(), 2);
    assert!(
        capture.missing[0].contains("without any depth"),
        "{:?}",
        capture.missing
    );
    std::fs::write(&depth, good).unwrap();

    let pose = folder.path().join("poses/NP5_0_pose.h5");
    let key = "H_table_from_reference_camera";
    let mut matrix = [0.0; 16];
    for (entry, parts) in [
        ([0.7, 0.0], "not a rigid motion"),
        ([1.0, 700.0], "must be millimetres"),
        ([f64::NAN, 0.0], "holds NaN"),
    ] {
        (0..4).for_each(|i| matrix[5 * i] = 1.0);
        (matrix[0], matrix[3]) = (entry[0], entry[1]);
        replace(&pose, |file| {
            file.create_dataset(key)
                .with_f64_data(&matrix)
                .with_shape(&[4, 4]);
        });
        refused(read(folder.path()), &["NP5_0_pose.h5", key, parts]);
    }
    for name in ["NP1_0.h5", "NP3_0.h5", "NP5_0.h5"] {
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
    refused(
        read(folder.path()),
        &["none of the 3 views can be used", "NP1_0.h5 is not there"],
    );
}

#[test]
fn simple_captures_that_cannot_be() {
    let folder = tempdir().unwrap();
    let good = simple_capture(folder.path());
    let png = std::fs::read(folder.path().join("depth.png")).unwrap();
    let with = |key: &str, value: serde_json::Value| {
        let mut camera = good.clone();
        camera[key] = value;
        write_camera(folder.path(), &camera);
        read(folder.path())
    };
    let null = serde_json::Value::Null;
    refused(
        with("K", null.clone()),
        &["camera.json", "no `K`", "intrinsics"],
    );
    refused(with("K", serde_json::json!([1, 2])), &["`K`", "3 x 3"]);
    refused(with("depth_scale_m", null), &["depth_scale_m"]);
    refused(
        with("depth_scale_m", 0.1.into()),
        &["depth_scale_m", "metres"],
    );
    refused(
        with("width", 161.into()),
        &["depth.png", "160 x 120", "161 x 120"],
    );
    refused(
        with("distortion", serde_json::json!([1e9, 0, 0, 0, 0])),
        &["distortion"],
    );
    write_camera(folder.path(), &good);

    for length in [0, 10, 100, png.len() / 2, png.len() - 20] {
        std::fs::write(folder.path().join("depth.png"), &png[..length]).unwrap();
        refused(read(folder.path()), &["depth.png"]);
    }
    let blank = DepthImage {
        width: 160,
        height: 120,
        raw: vec![0; 160 * 120],
        unit: 1e-4,
    };
    std::fs::write(folder.path().join("depth.png"), blank.to_png().unwrap()).unwrap();
    refused(read(folder.path()), &["depth.png", "no pixel has a depth"]);
    // A picture of 8 bits is a picture of something else.
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 160, 120);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![9; 160 * 120]).unwrap();
    writer.finish().unwrap();
    std::fs::write(folder.path().join("depth.png"), bytes).unwrap();
    refused(read(folder.path()), &["depth.png", "8 bits", "16 bits"]);
    std::fs::write(folder.path().join("camera.json"), "{\"width\": 160,").unwrap();
    refused(read(folder.path()), &["camera.json", "EOF"]);
}

#[test]
fn clouds_that_cannot_be_objects() {
    let folder = tempdir().unwrap();
    simple_capture(folder.path());
    let capture = read(folder.path()).unwrap();
    // Fewer than 100 points.
    let mut sparse = capture.clone();
    for (i, raw) in sparse.views[0].depth.raw.iter_mut().enumerate() {
        *raw *= u16::from(i % 400 == 0);
    }
    refused(
        fuse(&sparse, &FusionSettings::default()),
        &["surface needs at least 100"],
    );
    // Millimetres taken for metres: within the possible units, but not of a possible size.
    let mut large = capture.clone();
    large.views[0].depth.unit = 1e-2;
    large.table = None;
    let settings = FusionSettings {
        edge_jump: 10.0,
        ..FusionSettings::default()
    };
    refused(fuse(&large, &settings), &["m across", "millimetres"]);
    let fused = fuse(&capture, &FusionSettings::default()).unwrap();
    let mut settings = ReconstructionSettings {
        trim: -1.5,
        ..ReconstructionSettings::default()
    };
    assert!(matches!(
        reconstruct(&fused.cloud, fused.table.as_ref(), &settings, "x"),
        Err(GeometryError::Setting(fault)) if fault.setting == "trim"
    ));
    settings = ReconstructionSettings::default();
    settings.poisson.depth = 13;
    assert!(matches!(
        reconstruct(&fused.cloud, fused.table.as_ref(), &settings, "x"),
        Err(GeometryError::ReconstructionMemory { .. })
    ));
}
