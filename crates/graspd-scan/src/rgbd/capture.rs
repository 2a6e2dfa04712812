//! A capture: what one or more depth cameras saw of an object, from known places.

use nalgebra::{Isometry3, Matrix4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::{DepthImage, PinholeCamera};

/// How far a rotation's columns may be from unit vectors at right angles: matrices are written with few digits.
const RIGID_TOLERANCE: f64 = 1e-3;
/// A camera farther away than this \[m\] has its place in millimetres.
const FARTHEST: f64 = 10.0;

/// Side of the blocks of a mask's pixels in which the nearest point is looked for: over twice the distance between
/// depth pixels there, so that points of one surface leave no gaps.
const BLOCK: usize = 4;

/// A plane n . p + offset = 0, with its unit normal on the side that things stand on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Signed distance of the origin \[m\].
    pub offset: f64,
}

impl Plane {
    /// z = 0, upward.
    pub fn horizontal() -> Self {
        Self {
            normal: Vector3::z(),
            offset: 0.0,
        }
    }

    /// The plane after a motion.
    pub fn moved(&self, motion: &Isometry3<f64>) -> Self {
        let normal = motion * self.normal;
        Self {
            normal,
            offset: self.offset - normal.dot(&motion.translation.vector),
        }
    }

    /// How far a point is above the plane \[m\].
    pub fn height(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) + self.offset
    }
}

/// Which pixels show the object, in the image of a camera that need not be the one that measured depths.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectMask {
    /// The camera whose image this is.
    pub camera: PinholeCamera,
    /// From the frame of the depth camera to that of this one.
    pub mask_from_depth: Isometry3<f64>,
    /// Row by row.
    pub is_object: Vec<bool>,
}

impl ObjectMask {
    /// Those of all points that a depth camera saw, in its frame, that this camera sees as the object.
    ///
    /// What is behind another point by more than `jump` \[m\] is hidden from this camera: the mask tells nothing of
    /// it. A pixel counts only if its eight neighbours show the object, too: one at the object's foot shows the
    /// table as well, and seen aslant that reaches several millimetres in front of the object.
    fn shown(&self, points: &[Point3<f64>], jump: f64) -> Vec<Point3<f64>> {
        let columns = self.camera.width.div_ceil(BLOCK);
        let rows = self.camera.height.div_ceil(BLOCK);
        let mut nearest = vec![f64::INFINITY; columns * rows];
        let placed: Vec<(usize, f64, &Point3<f64>)> = (points.iter())
            .filter_map(|p| {
                let moved = self.mask_from_depth * p;
                Some((self.pixel(&moved)?, moved.z, p))
            })
            .collect();
        let block = |pixel: usize| {
            let (column, row) = (pixel % self.camera.width, pixel / self.camera.width);
            (column / BLOCK, row / BLOCK)
        };
        for &(pixel, z, _) in &placed {
            let (column, row) = block(pixel);
            let least = &mut nearest[row * columns + column];
            *least = least.min(z);
        }
        let is_hidden = |pixel: usize, z: f64| {
            let (column, row) = block(pixel);
            (row.saturating_sub(1)..=(row + 1).min(rows - 1)).any(|y| {
                (column.saturating_sub(1)..=(column + 1).min(columns - 1))
                    .any(|x| nearest[y * columns + x] < z - jump)
            })
        };
        (placed.into_iter())
            .filter(|&(pixel, z, _)| self.is_within_object(pixel) && !is_hidden(pixel, z))
            .map(|(_, _, p)| *p)
            .collect()
    }

    /// Whether a pixel and its neighbours in the image show the object.
    fn is_within_object(&self, pixel: usize) -> bool {
        let (width, height) = (self.camera.width, self.camera.height);
        let (column, row) = (pixel % width, pixel / width);
        (row.saturating_sub(1)..=(row + 1).min(height - 1)).all(|y| {
            (column.saturating_sub(1)..=(column + 1).min(width - 1))
                .all(|x| self.is_object[y * width + x])
        })
    }

    /// The pixel at which a point of this camera's frame is seen, if it is in the image.
    fn pixel(&self, p: &Point3<f64>) -> Option<usize> {
        let [u, v] = self.camera.project(p)?;
        let (column, row) = (u.round(), v.round());
        let is_within = column >= 0.0
            && row >= 0.0
            && column < self.camera.width as f64
            && row < self.camera.height as f64;
        is_within.then(|| row as usize * self.camera.width + column as usize)
    }
}

/// One depth image, and where it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthView {
    /// For messages, such as `NP1_72`.
    pub name: String,
    /// The camera.
    pub camera: PinholeCamera,
    /// What it measured.
    pub depth: DepthImage,
    /// From the camera's frame to that of the capture.
    pub world_from_camera: Isometry3<f64>,
    /// Where the object is in it, if that is known.
    pub mask: Option<ObjectMask>,
}

impl DepthView {
    /// Where the camera is, in the frame of the capture.
    pub fn eye(&self) -> Point3<f64> {
        self.world_from_camera * Point3::origin()
    }

    /// The points seen, in the frame of the capture: all with a depth that are not at an edge
    /// ([`DepthImage::without_edges`]) and that the mask shows, where there is one.
    pub fn points(&self, edge_radius: usize, edge_jump: f64) -> Vec<Point3<f64>> {
        let depth = self.depth.without_edges(edge_radius, edge_jump);
        let seen = |pixel: usize| {
            let z = depth.depth(pixel)?;
            let (u, v) = (pixel % depth.width, pixel / depth.width);
            self.camera.unproject(u as f64, v as f64, z)
        };
        let seen: Vec<Point3<f64>> = (0..depth.raw.len())
            .into_par_iter()
            .filter_map(seen)
            .collect();
        let kept = match &self.mask {
            Some(mask) => mask.shown(&seen, edge_jump),
            None => seen,
        };
        kept.iter().map(|p| self.world_from_camera * p).collect()
    }
}

/// Views of one object in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RgbdCapture {
    /// At least one.
    pub views: Vec<DepthView>,
    /// Views that were asked for and are not there, each with the reason.
    pub missing: Vec<String>,
    /// What the object stands on, in the frame of the capture, if that is known.
    pub table: Option<Plane>,
    /// From the frame of the capture to the object's own mesh coordinates, if that is known.
    pub object_from_world: Option<Isometry3<f64>>,
}

/// A rigid motion from its matrix \[m\], or what is wrong with it.
pub(super) fn rigid(matrix: &Matrix4<f64>) -> Result<Isometry3<f64>, String> {
    let turn = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let shift: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    let error = (turn.transpose() * turn - nalgebra::Matrix3::identity()).amax();
    let last = matrix.row(3) - nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0);
    // Also where a number is NaN.
    if !(error < RIGID_TOLERANCE && last.amax() < RIGID_TOLERANCE && turn.determinant() > 0.0) {
        return Err("is not a rigid motion (a rotation and a translation)".into());
    }
    // `amax` passes over NaN.
    if shift.iter().any(|x| x.is_nan() || x.abs() >= FARTHEST) {
        return Err(format!(
            "moves by {:.3} m, which must be millimetres",
            shift.norm()
        ));
    }
    let rotation = Rotation3::from_matrix(&turn);
    Ok(Isometry3::from_parts(
        Translation3::from(shift),
        UnitQuaternion::from_rotation_matrix(&rotation),
    ))
}
