//! The simple layout: one depth picture and its camera.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Matrix4, Vector3};

use super::capture::rigid;
use super::json_file::JsonFile;
use super::{DepthImage, DepthView, PinholeCamera, Plane, RgbdCapture};
use graspd_geom::GeometryError;

/// Units of depth that a picture may be in \[m\]: from a hundredth of a millimetre to a centimetre.
const POSSIBLE_UNITS: std::ops::RangeInclusive<f64> = 1e-5..=1e-2;

/// Reads a folder with `depth.png` (16 bits, 0 where there is no depth) and `camera.json`:
///
/// * `width`, `height`; `K` (3 x 3); `depth_scale_m` (metres for each unit of the picture);
/// * optional: `distortion` (k1, k2, p1, p2, k3), `invalid_depth` (another value that means none),
///   `table_plane_cam` (n and d of n . p + d = 0 in the camera's frame, n upward), and
///   `T_world_from_camera` (4 x 4): without it the capture is in the camera's frame.
///
/// # Errors
/// A file that is absent, damaged or contradicts the other; a picture without any depth.
pub fn read_simple_capture(folder: &Path) -> Result<RgbdCapture, GeometryError> {
    let file = JsonFile::open(&folder.join("camera.json"))?;
    let size = |key: &str| -> Result<usize, GeometryError> {
        let number = file.value[key]
            .as_u64()
            .and_then(|n| usize::try_from(n).ok());
        number.ok_or_else(|| file.fault(format!("`{key}` is missing or not a whole number")))
    };
    if !file.has("K") {
        return Err(file.fault("there is no `K`, so the camera's intrinsics are not known".into()));
    }
    let k = Matrix3::from_row_slice(&file.matrix("K", 3, 3)?);
    let mut camera = PinholeCamera::from_matrix(size("width")?, size("height")?, &k)
        .map_err(|error| file.fault(error.to_string()))?;
    if file.has("distortion") {
        let d = file.numbers("distortion", 5)?;
        camera = camera.with_distortion([d[0], d[1], d[2], d[3], d[4]]);
        camera
            .validate()
            .map_err(|error| file.fault(error.to_string()))?;
    }
    let unit = file.number("depth_scale_m")?;
    if !POSSIBLE_UNITS.contains(&unit) {
        return Err(file.fault(format!(
            "`depth_scale_m` is {unit}, but it is the metres for each unit of the picture, 0.001 or 0.0001 as a rule"
        )));
    }
    let invalid = if file.has("invalid_depth") {
        file.number("invalid_depth")? as u16
    } else {
        0
    };
    let world_from_camera = if file.has("T_world_from_camera") {
        let matrix = Matrix4::from_row_slice(&file.matrix("T_world_from_camera", 4, 4)?);
        rigid(&matrix).map_err(|what| file.fault(format!("`T_world_from_camera` {what}")))?
    } else {
        Isometry3::identity()
    };
    let table = if file.has("table_plane_cam") {
        let plane = file.numbers("table_plane_cam", 4)?;
        let normal = Vector3::new(plane[0], plane[1], plane[2]);
        let length = normal.norm();
        if length.is_nan() || length <= 0.0 {
            return Err(file.fault("`table_plane_cam` has no normal".into()));
        }
        let plane = Plane {
            normal: normal / length,
            offset: plane[3] / length,
        };
        Some(plane.moved(&world_from_camera))
    } else {
        None
    };

    let path = folder.join("depth.png");
    let depth = DepthImage::load_png(&path, unit, invalid)?;
    let fault = |fault: String, remedy| GeometryError::Parse {
        path: path.clone(),
        line: None,
        fault,
        remedy,
    };
    if [depth.width, depth.height] != [camera.width, camera.height] {
        return Err(fault(
            format!(
                "the picture has {} x {} pixels, but camera.json says {} x {}",
                depth.width, depth.height, camera.width, camera.height
            ),
            "give the camera of this picture",
        ));
    }
    if depth.valid() == 0 {
        return Err(fault(
            "no pixel has a depth".into(),
            "capture again, nearer or farther, and not against the sun",
        ));
    }
    Ok(RgbdCapture {
        views: vec![DepthView {
            name: "depth.png".into(),
            camera,
            depth,
            world_from_camera,
            mask: None,
        }],
        table,
        ..RgbdCapture::default()
    })
}

/// Reads a capture of either layout: YCB's if there is a `calibration.h5` or `capture.json`, else the simple one.
///
/// # Errors
/// As [`read_ycb_capture`](crate::read_ycb_capture) and [`read_simple_capture`]; a folder that holds neither.
pub fn read_capture(
    folder: &Path,
    views: Option<&super::TurntableViews>,
    intrinsics: super::DepthIntrinsics,
) -> Result<RgbdCapture, GeometryError> {
    if !folder.is_dir() {
        return Err(GeometryError::Missing {
            path: folder.into(),
        });
    }
    if super::ycb::is_ycb_capture(folder) {
        return super::read_ycb_capture(folder, views, intrinsics);
    }
    if folder.join("camera.json").exists() || folder.join("depth.png").exists() {
        return read_simple_capture(folder);
    }
    Err(GeometryError::Parse {
        path: folder.into(),
        line: None,
        fault: "the folder holds no capture".into(),
        remedy: "give one with calibration.h5 (YCB layout), or with depth.png and camera.json",
    })
}
