//! Rendered captures of a mesh on a turntable, with cameras like those of the YCB set.

use std::path::Path;

use graspd_settings::{Ranges, Validate, between};
use nalgebra::{Isometry3, Point3, Vector3};
use serde_json::json;

use super::ycb::{
    COLOR_SIZE, DEPTH_SIZE, RAW_UNIT, RenderedCapture, RenderedRig, table_turned_back,
};
use super::{DepthNoise, DepthScene, PinholeCamera, TurntableViews};
use graspd_geom::{GeometryError, TriangleMesh, TriangleTree};

/// From the cameras to what they look at \[m\].
const DISTANCE: f64 = 0.7;
/// Height above the table of the point that all cameras look at \[m\].
const AIM: f64 = 0.08;
/// Angle of the line of sight above the table for cameras 1 to 5 \[degrees\].
const ELEVATIONS: [f64; 5] = [5.0, 25.0, 45.0, 65.0, 85.0];
/// Focal lengths of depth and colour cameras \[pixels\].
const DEPTH_FOCAL: f64 = 570.0;
const COLOR_FOCAL: f64 = 1081.0;
/// How far the colour camera is to the right of the depth camera \[m\].
const BASELINE: f64 = 0.025;
/// Lenses: k1, k2, p1, p2, k3.
const DEPTH_LENS: [f64; 5] = [-0.06, 0.08, 0.0005, -0.0004, 0.0];
const COLOR_LENS: [f64; 5] = [0.05, -0.1, 0.0003, 0.0002, 0.0];
/// The table \[m\].
const TABLE_RADIUS: f64 = 0.2;
/// The farthest that an object may reach from the point looked at, to be whole in every picture \[m\].
const MAX_REACH: f64 = 0.25;

/// How a mesh is scanned.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanSettings {
    /// Which views are taken.
    pub views: TurntableViews,
    /// The depth cameras' noise.
    pub noise: DepthNoise,
}

impl Validate for ScanSettings {
    fn ranges(&self) -> Ranges {
        let TurntableViews { cameras, angles } = &self.views;
        Ranges::default()
            .with("noise scale", &self.noise.scale, between(0.0, 100.0))
            .with("camera", cameras, between(1.0, 5.0))
            .with("angle", angles, between(0.0, 359.0))
            .with(
                "number of views",
                &(cameras.len() * angles.len()),
                between(1.0, 1800.0),
            )
    }
}

/// Where a mesh stands on the table: its lowest point on it, the middle of its box above the axis. From the frame of
/// the table (z up) to the mesh's.
fn standing_on_table(mesh: &TriangleMesh) -> Result<Isometry3<f64>, GeometryError> {
    let (low, high) = mesh.bounds().ok_or(GeometryError::EmptyMesh)?;
    let middle = nalgebra::center(&low, &high);
    Ok(Isometry3::translation(middle.x, middle.y, low.z))
}

/// Takes depth images of a mesh on a turntable, and writes them into `folder` (made if need be) in the layout that
/// [`read_ycb_capture`](crate::read_ycb_capture) reads, `capture.json` among them. Files of another capture in it
/// are replaced where they have the same name.
///
/// The mesh stands as it is, z up. Five cameras on a quarter arc look at a point 8 cm above the table from 0.7 m, 5
/// to 85 degrees above it; depth images have 640 x 480 pixels (focal length 570), masks 1280 x 1024. The table is
/// seen, too; the object's underside is not. `progress` is told the fraction done.
///
/// # Errors
/// Settings out of range; a mesh that is empty or larger than the pictures; files that cannot be written.
pub fn scan_on_turntable(
    mesh: &TriangleMesh,
    name: &str,
    settings: &ScanSettings,
    folder: &Path,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(), GeometryError> {
    settings.validate()?;
    let tree = TriangleTree::new(mesh)?;
    let object_from_table = standing_on_table(mesh)?;
    let aim = object_from_table * Point3::new(0.0, 0.0, AIM);
    let reach = (mesh.vertices.iter())
        .map(|p| (p - aim).norm())
        .fold(0.0, f64::max);
    let what = "the object's reach from the point that the cameras look at";
    between(0.0, MAX_REACH).unit("m").check(what, &reach)?;
    let capture = RenderedCapture {
        rigs: settings.views.cameras.iter().map(|&k| rig(k)).collect(),
        room_from_reference: rig(5).room_from_color,
        object_from_table,
        views: settings.views.clone(),
        notes: json!({
            "object": name,
            "rendered": true,
            "noise_scale": settings.noise.scale,
            "seed": settings.noise.seed,
        }),
    };
    capture.write_frame(folder)?;
    let scene = DepthScene {
        object: &tree,
        object_from_table,
        table_radius: TABLE_RADIUS,
    };
    let count = settings.views.all().count() as f64;
    let mut done = 0.0;
    for rig in &capture.rigs {
        for &angle in &settings.views.angles {
            let turned = table_turned_back(angle);
            // The same noise in a view whichever others are taken.
            let view = u64::from(1000 * rig.camera + angle);
            let table_from_depth = turned * rig.room_from_depth;
            let depth = scene.depth_image(
                &rig.depth,
                &table_from_depth,
                &settings.noise,
                view,
                RAW_UNIT,
            );
            let mask = scene.mask(&rig.color, &(turned * rig.room_from_color));
            RenderedCapture::write_view(folder, rig.camera, angle, &depth, &mask)?;
            done += 1.0;
            progress(done / count);
        }
    }
    Ok(())
}

fn rig(camera: u32) -> RenderedRig {
    let elevation = ELEVATIONS[(camera as usize - 1).min(4)].to_radians();
    let aim = Point3::new(0.0, 0.0, AIM);
    let eye = aim + DISTANCE * Vector3::new(elevation.cos(), 0.0, elevation.sin());
    let forward = (aim - eye).normalize();
    let right = Vector3::y();
    let down = forward.cross(&right);
    let turn = nalgebra::Rotation3::from_basis_unchecked(&[right, down, forward]);
    let room_from_depth = Isometry3::from_parts(eye.into(), turn.into());
    RenderedRig {
        camera,
        depth: camera_of(DEPTH_SIZE, DEPTH_FOCAL, DEPTH_LENS),
        color: camera_of(COLOR_SIZE, COLOR_FOCAL, COLOR_LENS),
        room_from_depth,
        room_from_color: room_from_depth * Isometry3::translation(BASELINE, 0.0, 0.0),
    }
}

fn camera_of([width, height]: [usize; 2], focal: f64, distortion: [f64; 5]) -> PinholeCamera {
    PinholeCamera {
        width,
        height,
        focal: [focal; 2],
        center: [0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)],
        distortion,
    }
}
