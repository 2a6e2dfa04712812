//! The Berkeley layout of YCB captures: five cameras about a turntable, HDF5 files.
//!
//! `calibration.h5`, and for camera k (1 to 5) and angle a (0, 3, ..., 357 degrees) `NPk_a.h5` (depth),
//! `poses/NP5_a_pose.h5` (where camera 5, the reference, stands towards the table) and `masks/NPk_a_mask.pbm`
//! (in the picture of the colour camera). `capture.json` is written with rendered captures only.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix4};
use serde_json::{Value, json};

use super::capture::rigid;
use super::hdf5_file::{Arrays, put, write};
use super::json_file::{JsonFile, matrix_json};
use super::{DepthImage, DepthView, ObjectMask, PinholeCamera, Plane, RgbdCapture, mask_file};
use graspd_geom::GeometryError;
use graspd_mesh::write_whole;

/// Pixels of the depth images.
pub(super) const DEPTH_SIZE: [usize; 2] = [640, 480];
/// Pixels of the colour pictures and so of the masks.
pub(super) const COLOR_SIZE: [usize; 2] = [1280, 1024];
/// Metres for each unit of a depth image, before the calibration's own factor.
pub(super) const RAW_UNIT: f64 = 1e-4;
/// Factors that a calibration may have: any other is a unit in itself.
const POSSIBLE_SCALES: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// What a folder in this layout holds.
const CALIBRATION: &str = "calibration.h5";
const DESCRIPTION: &str = "capture.json";
const SCHEMA: &str = "graspd.capture/1";

/// Which of the matrices in a calibration turns depth pixels into rays: published programs disagree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthIntrinsics {
    /// `NPk_ir_K` and `NPk_ir_d`: the infrared camera, whose image the depths are in.
    #[default]
    Infrared,
    /// `NPk_depth_K`, without distortion.
    Depth,
}

/// Which views are taken from a capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TurntableViews {
    /// Cameras, 1 (near the table) to 5 (overhead).
    pub cameras: Vec<u32>,
    /// Angles of the turntable \[degrees\], 0 to 359.
    pub angles: Vec<u32>,
}

impl Default for TurntableViews {
    /// The 15 of the paper: cameras 1, 3 and 5 at angles 72 degrees apart.
    fn default() -> Self {
        Self::spread(15).unwrap_or(Self {
            cameras: Vec::new(),
            angles: Vec::new(),
        })
    }
}

impl TurntableViews {
    /// `count` views by the cameras 1, 3 and 5 at `count` / 3 angles, evenly spread but for the captures' steps of
    /// 3 degrees; `None` unless `count` is a multiple of 3 from 3 to 360.
    pub fn spread(count: usize) -> Option<Self> {
        let angles = count / 3;
        if !count.is_multiple_of(3) || !(1..=120).contains(&angles) {
            return None;
        }
        Some(Self {
            cameras: vec![1, 3, 5],
            angles: (0..angles).map(|i| (120 * i / angles) as u32 * 3).collect(),
        })
    }

    /// Every camera at every angle, camera by camera.
    pub fn all(&self) -> impl Iterator<Item = (u32, u32)> {
        let pairs = |&camera: &u32| self.angles.iter().map(move |&angle| (camera, angle));
        self.cameras.iter().flat_map(pairs)
    }
}

/// Whether a folder looks like a capture in this layout.
pub(super) fn is_ycb_capture(folder: &Path) -> bool {
    folder.join(CALIBRATION).exists() || folder.join(DESCRIPTION).exists()
}

/// Reads views of a capture, in the frame of its table.
///
/// A view whose depth or pose file is absent, or without any depth, is left out and listed as missing. Views
/// without a mask are kept whole. `views`: by default those that `capture.json` lists, or else the paper's 15.
///
/// metres = raw * 1e-4 * `NPk_ir_depth_scale`; table_from_depth = `H_table_from_reference_camera` .
/// inv(`H_NPk_ir_from_NP5`).
///
/// # Errors
/// No calibration; a file that is damaged, cut off or holds arrays of other shapes; no view at all.
pub fn read_ycb_capture(
    folder: &Path,
    views: Option<&TurntableViews>,
    intrinsics: DepthIntrinsics,
) -> Result<RgbdCapture, GeometryError> {
    let described = Description::read(folder)?;
    let listed = described.as_ref().map(|d| d.views.clone());
    let views = views.cloned().or(listed).unwrap_or_default();
    let path = folder.join(CALIBRATION);
    if !path.exists() {
        return Err(GeometryError::Parse {
            path,
            line: None,
            fault: "no such file, so the cameras' intrinsics are not known".into(),
            remedy: "give the folder of a whole capture, with its calibration",
        });
    }
    let calibration = Arrays::open(&path)?;
    let mut capture = RgbdCapture {
        table: described.is_some().then(Plane::horizontal),
        object_from_world: described.map(|d| d.object_from_table),
        ..RgbdCapture::default()
    };
    for &camera in &views.cameras {
        let rig = Rig::read(&calibration, camera, intrinsics)?;
        for &angle in &views.angles {
            match read_view(folder, &rig, camera, angle)? {
                Ok(view) => capture.views.push(view),
                Err(reason) => capture.missing.push(reason),
            }
        }
    }
    if capture.views.is_empty() {
        return Err(GeometryError::Parse {
            path: folder.into(),
            line: None,
            fault: match capture.missing.first() {
                Some(first) => format!(
                    "none of the {} views can be used ({first})",
                    capture.missing.len()
                ),
                None => "no views were asked for".into(),
            },
            remedy: "give a folder that holds NPk_a.h5 and poses/NP5_a_pose.h5",
        });
    }
    Ok(capture)
}

/// One of the five places of cameras.
struct Rig {
    depth: PinholeCamera,
    color: PinholeCamera,
    unit: f64,
    depth_from_reference: Isometry3<f64>,
    color_from_reference: Isometry3<f64>,
}

impl Rig {
    fn read(
        calibration: &Arrays,
        camera: u32,
        intrinsics: DepthIntrinsics,
    ) -> Result<Self, GeometryError> {
        let lens = |key: &str, [width, height]: [usize; 2], bends: bool| {
            let (k_key, d_key) = (format!("NP{camera}_{key}_K"), format!("NP{camera}_{key}_d"));
            let distortion = if bends && calibration.has(&d_key) {
                let d = calibration.values(&d_key, &[5])?;
                [d[0], d[1], d[2], d[3], d[4]]
            } else {
                [0.0; 5]
            };
            PinholeCamera::from_matrix(width, height, &calibration.matrix3(&k_key)?)
                .map(|camera| camera.with_distortion(distortion))
                .and_then(|camera| camera.validate().map(|()| camera))
                .map_err(|error| calibration.fault(format!("`{k_key}`: {error}")))
        };
        let depth = match intrinsics {
            DepthIntrinsics::Infrared => lens("ir", DEPTH_SIZE, true)?,
            DepthIntrinsics::Depth => lens("depth", DEPTH_SIZE, false)?,
        };
        let scale_key = format!("NP{camera}_ir_depth_scale");
        let scale = calibration.number(&scale_key)?;
        if !POSSIBLE_SCALES.contains(&scale) {
            return Err(calibration.fault(format!(
                "`{scale_key}` is {scale}, but raw depths are tenths of millimetres, give or take little"
            )));
        }
        Ok(Self {
            depth,
            color: lens("rgb", COLOR_SIZE, true)?,
            unit: RAW_UNIT * scale,
            depth_from_reference: calibration.motion(&format!("H_NP{camera}_ir_from_NP5"))?,
            color_from_reference: calibration.motion(&format!("H_NP{camera}_from_NP5"))?,
        })
    }
}

/// A view, or why there is none.
fn read_view(
    folder: &Path,
    rig: &Rig,
    camera: u32,
    angle: u32,
) -> Result<Result<DepthView, String>, GeometryError> {
    let name = format!("NP{camera}_{angle}");
    let (depth_path, pose_path) = (depth_path(folder, camera, angle), pose_path(folder, angle));
    for path in [&depth_path, &pose_path] {
        if !path.exists() {
            return Ok(Err(format!("{name}: {} is not there", path.display())));
        }
    }
    let [width, height] = DEPTH_SIZE;
    let depth = DepthImage {
        width,
        height,
        raw: Arrays::open(&depth_path)?.image("depth", width, height)?,
        unit: rig.unit,
    };
    if depth.valid() == 0 {
        return Ok(Err(format!(
            "{name}: {} is without any depth",
            depth_path.display()
        )));
    }
    let table_from_reference = Arrays::open(&pose_path)?.motion("H_table_from_reference_camera")?;
    let mask_path = mask_path(folder, camera, angle);
    let mask = if mask_path.exists() {
        let [width, height] = COLOR_SIZE;
        Some(ObjectMask {
            camera: rig.color.clone(),
            mask_from_depth: rig.color_from_reference * rig.depth_from_reference.inverse(),
            is_object: mask_file::read(&mask_path, width, height)?,
        })
    } else {
        None
    };
    Ok(Ok(DepthView {
        name,
        camera: rig.depth.clone(),
        depth,
        world_from_camera: table_from_reference * rig.depth_from_reference.inverse(),
        mask,
    }))
}

/// What `capture.json` tells of a rendered capture.
struct Description {
    views: TurntableViews,
    object_from_table: Isometry3<f64>,
}

impl Description {
    fn read(folder: &Path) -> Result<Option<Self>, GeometryError> {
        let path = folder.join(DESCRIPTION);
        if !path.exists() {
            return Ok(None);
        }
        let file = JsonFile::open(&path)?;
        if file.value["schema"] != SCHEMA {
            return Err(file.fault(format!("its schema is not {SCHEMA}")));
        }
        let list = |key: &str| -> Result<Vec<u32>, GeometryError> {
            let values = file.value[key].as_array().into_iter().flatten();
            let numbers: Option<Vec<u32>> = values
                .map(|v| v.as_u64().and_then(|n| u32::try_from(n).ok()))
                .collect();
            numbers.ok_or_else(|| file.fault(format!("`{key}` is not a list of whole numbers")))
        };
        let matrix = Matrix4::from_row_slice(&file.matrix("T_object_from_table", 4, 4)?);
        Ok(Some(Self {
            views: TurntableViews {
                cameras: list("cameras")?,
                angles: list("angles_deg")?,
            },
            object_from_table: rigid(&matrix)
                .map_err(|what| file.fault(format!("`T_object_from_table` {what}")))?,
        }))
    }
}

/// A rendered capture, to be written in this layout.
pub(super) struct RenderedCapture {
    /// For each camera: number, depth camera, colour camera, and their places in the room.
    pub(super) rigs: Vec<RenderedRig>,
    /// Camera 5 in the room, the table at rest.
    pub(super) room_from_reference: Isometry3<f64>,
    pub(super) object_from_table: Isometry3<f64>,
    pub(super) views: TurntableViews,
    /// What else `capture.json` is to tell.
    pub(super) notes: Value,
}

pub(super) struct RenderedRig {
    pub(super) camera: u32,
    pub(super) depth: PinholeCamera,
    pub(super) color: PinholeCamera,
    pub(super) room_from_depth: Isometry3<f64>,
    pub(super) room_from_color: Isometry3<f64>,
}

impl RenderedCapture {
    /// Writes everything but the images.
    pub(super) fn write_frame(&self, folder: &Path) -> Result<(), GeometryError> {
        for inner in ["poses", "masks"] {
            let path = folder.join(inner);
            std::fs::create_dir_all(&path)
                .map_err(|source| GeometryError::Write { path, source })?;
        }
        write(&folder.join(CALIBRATION), |file| {
            for rig in &self.rigs {
                let np = format!("NP{}", rig.camera);
                for (key, camera) in [
                    ("rgb", &rig.color),
                    ("ir", &rig.depth),
                    ("depth", &rig.depth),
                ] {
                    let k = camera.matrix().transpose();
                    put(file, &format!("{np}_{key}_K"), 3, k.as_slice());
                    file.create_dataset(&format!("{np}_{key}_d"))
                        .with_f64_data(&camera.distortion);
                }
                for (key, value) in [
                    ("ir_depth_scale", 1.0),
                    ("ir_depth_bias", 0.0),
                    ("depth_scale", 1.0),
                ] {
                    file.create_dataset(&format!("{np}_{key}"))
                        .with_f64_data(&[value]);
                }
                let reference = self.room_from_reference;
                let color = rig.room_from_color.inverse() * reference;
                let depth = rig.room_from_depth.inverse() * reference;
                put_motion(file, &format!("H_{np}_from_NP5"), &color);
                put_motion(file, &format!("H_{np}_ir_from_NP5"), &depth);
            }
        })?;
        for &angle in &self.views.angles {
            let pose = table_turned_back(angle) * self.room_from_reference;
            write(&pose_path(folder, angle), |file| {
                put_motion(file, "H_table_from_reference_camera", &pose);
                file.create_dataset("board_frame_offset")
                    .with_f64_data(&[0.0; 3]);
            })?;
        }
        write(&folder.join("poses/turntable.h5"), |file| {
            file.create_dataset("center").with_f64_data(&[0.0; 3]);
            file.create_dataset("normal")
                .with_f64_data(&[0.0, 0.0, 1.0]);
        })?;
        let mut text = json!({
            "schema": SCHEMA,
            "cameras": self.views.cameras,
            "angles_deg": self.views.angles,
            "T_object_from_table": matrix_json(&self.object_from_table.to_homogeneous()),
        });
        if let (Some(text), Some(notes)) = (text.as_object_mut(), self.notes.as_object()) {
            text.extend(notes.clone());
        }
        let text = format!("{text:#}\n");
        write_whole(&folder.join(DESCRIPTION), |out| {
            out.write_all(text.as_bytes())
        })
    }

    /// Writes the images of one view.
    pub(super) fn write_view(
        folder: &Path,
        camera: u32,
        angle: u32,
        depth: &DepthImage,
        mask: &[bool],
    ) -> Result<(), GeometryError> {
        let shape = [depth.height as u64, depth.width as u64];
        write(&depth_path(folder, camera, angle), |file| {
            file.create_dataset("depth")
                .with_u16_data(&depth.raw)
                .with_shape(&shape)
                .with_chunks(&shape)
                .with_deflate(4);
        })?;
        mask_file::write(&mask_path(folder, camera, angle), COLOR_SIZE[0], mask)
    }
}

/// From the room to the frame of the table, which has turned by `angle` degrees.
pub(super) fn table_turned_back(angle: u32) -> Isometry3<f64> {
    let angle = -f64::from(angle).to_radians();
    Isometry3::rotation(nalgebra::Vector3::z() * angle)
}

fn depth_path(folder: &Path, camera: u32, angle: u32) -> PathBuf {
    folder.join(format!("NP{camera}_{angle}.h5"))
}

fn pose_path(folder: &Path, angle: u32) -> PathBuf {
    folder.join(format!("poses/NP5_{angle}_pose.h5"))
}

fn mask_path(folder: &Path, camera: u32, angle: u32) -> PathBuf {
    folder.join(format!("masks/NP{camera}_{angle}_mask.pbm"))
}

fn put_motion(file: &mut hdf5_pure::FileBuilder, key: &str, motion: &Isometry3<f64>) {
    put(file, key, 4, motion.to_homogeneous().transpose().as_slice());
}
