//! Light with soft shadows: many distant lamps, each with its own depth map.
//!
//! The sky is a full sphere of faint lamps and the key light a narrow cone of strong ones, so that ambient
//! occlusion and soft key shadows come out of the one rule: a lamp lights what it sees.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::camera::PictureAxes;
use crate::normals::ShadedFace;
use crate::projection::GridPoint;
use crate::raster::GridTriangle;

/// Lamps of the sky.
const SKY_LAMPS: usize = 72;
/// Lamps of the key light, and the half angle of their cone \[rad\].
const KEY_LAMPS: usize = 14;
const KEY_SPREAD: f64 = 0.16;
/// Irradiance that the key light gives a surface that faces it.
const KEY_IRRADIANCE: f32 = 0.62;
/// Irradiance that the open sky gives a surface that faces up, and one that faces down.
const SKY_IRRADIANCE: [f32; 2] = [0.62, 0.34];
/// Light that has been reflected so often that it comes from everywhere.
const BOUNCED_IRRADIANCE: f32 = 0.07;
/// Texels on a side of a lamp's depth map.
const TEXELS: usize = 320;
/// How far a surface is lifted before a lamp looks for it \[texels\], against shadows of a surface on itself.
const LIFT: f32 = 1.6;
/// Blinn's exponent and strength of the key light's reflection.
const SHININESS: i32 = 36;
const SPECULAR: f32 = 0.16;

/// What falls on a point of a surface.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Light {
    /// Multiplies the surface's colour.
    pub(crate) diffuse: f32,
    /// Is added as white.
    pub(crate) specular: f32,
}

/// All lamps about a scene.
pub(crate) struct Lighting {
    lamps: Vec<Lamp>,
    center: Point3<f64>,
    /// Length of a texel \[m\].
    texel: f64,
}

struct Lamp {
    /// Unit direction towards the lamp, and two axes across.
    axes: [Vector3<f32>; 3],
    irradiance: f32,
    is_key: bool,
    /// Height towards the lamp \[texels\] of what it sees first, `[TEXELS * TEXELS]`.
    heights: Vec<f32>,
}

impl Lighting {
    /// Lamps placed relative to the viewer (key light from above left), with their depth maps of `faces`.
    pub(crate) fn new(faces: &[ShadedFace], viewer: &PictureAxes) -> Self {
        let (center, radius) = bounding_sphere(faces);
        let texel = 2.0 * radius / (TEXELS - 2) as f64;
        let lamps = directions(viewer)
            .into_par_iter()
            .map(|(direction, irradiance, is_key)| {
                let axes = axes_about(direction);
                Lamp {
                    heights: depth_map(faces, center, texel, &axes),
                    axes: axes.map(|axis| axis.cast()),
                    irradiance,
                    is_key,
                }
            })
            .collect();
        Self {
            lamps,
            center,
            texel,
        }
    }

    /// The light on a point whose face has the unit normal `face_normal`, shaded as if it were `normal`, seen from
    /// the unit direction `to_viewer`; both normals point to the viewer's side.
    pub(crate) fn at(
        &self,
        point: Point3<f64>,
        face_normal: Vector3<f64>,
        normal: Vector3<f64>,
        to_viewer: Vector3<f64>,
    ) -> Light {
        let lifted =
            ((point - self.center) / self.texel).cast::<f32>() + face_normal.cast::<f32>() * LIFT;
        let normal = normal.cast::<f32>();
        let to_viewer = to_viewer.cast::<f32>();
        let mut light = Light {
            diffuse: BOUNCED_IRRADIANCE,
            specular: 0.0,
        };
        for lamp in &self.lamps {
            let cosine = lamp.axes[0].dot(&normal);
            if cosine <= 0.0 {
                continue;
            }
            let received = lamp.irradiance * lamp.visibility(lifted);
            light.diffuse += received * cosine;
            if lamp.is_key && received > 0.0 {
                let half = (lamp.axes[0] + to_viewer).normalize();
                light.specular += SPECULAR * received * half.dot(&normal).max(0.0).powi(SHININESS);
            }
        }
        light
    }
}

impl Lamp {
    /// The part of the lamp that `position` \[texels\] sees: four neighbouring texels' answers, interpolated.
    fn visibility(&self, position: Vector3<f32>) -> f32 {
        let height = self.axes[0].dot(&position);
        let middle = 0.5 * (TEXELS - 1) as f32;
        let last = (TEXELS - 2) as f32 + 0.999;
        let [u, v] = [1, 2].map(|i| (self.axes[i].dot(&position) + middle).clamp(0.0, last));
        let (column, row) = (u as usize, v as usize);
        let (s, t) = (u - column as f32, v - row as f32);
        let texel = row * TEXELS + column;
        let sees = |index: usize| f32::from(u8::from(height >= self.heights[index]));
        let near = sees(texel) * (1.0 - s) + sees(texel + 1) * s;
        let far = sees(texel + TEXELS) * (1.0 - s) + sees(texel + TEXELS + 1) * s;
        near * (1.0 - t) + far * t
    }
}

/// Direction, irradiance and kind of every lamp.
fn directions(viewer: &PictureAxes) -> Vec<(Vector3<f64>, f32, bool)> {
    let key = (viewer.back * 0.72 + viewer.up * 0.75 - viewer.right * 0.52).normalize();
    let [key, across, along] = axes_about(key);
    let spiral = |index: usize| index as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let mut lamps = Vec::with_capacity(SKY_LAMPS + KEY_LAMPS);
    for index in 0..KEY_LAMPS {
        // Vogel's sunflower: evenly over a disc.
        let radius = KEY_SPREAD * ((index as f64 + 0.5) / KEY_LAMPS as f64).sqrt();
        let (sine, cosine) = spiral(index).sin_cos();
        let direction = (key + (across * cosine + along * sine) * radius).normalize();
        lamps.push((direction, KEY_IRRADIANCE / KEY_LAMPS as f32, true));
    }
    // Of a uniform sphere of N lamps, a surface receives the mean of max(0, cos) = 1/4 each.
    let per_lamp = 4.0 / SKY_LAMPS as f32;
    let [above, below] = SKY_IRRADIANCE;
    for index in 0..SKY_LAMPS {
        // The same spiral on a sphere.
        let height = 1.0 - (2.0 * index as f64 + 1.0) / SKY_LAMPS as f64;
        let (sine, cosine) = spiral(index).sin_cos();
        let ring = (1.0 - height * height).sqrt();
        let direction = viewer.up * height + (viewer.right * cosine + viewer.back * sine) * ring;
        // A radiance linear in the height h has the irradiance (mean + 2/3 slope h): undo the factor.
        let (mean, slope) = (0.5 * (above + below), 0.75 * (above - below));
        let radiance = (mean + slope * height as f32).max(0.0);
        lamps.push((direction, per_lamp * radiance, false));
    }
    lamps
}

/// `direction` and two unit vectors orthogonal to it and to each other.
fn axes_about(direction: Vector3<f64>) -> [Vector3<f64>; 3] {
    let spare = if direction.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let across = direction.cross(&spare).normalize();
    [direction, across, direction.cross(&across)]
}

/// A sphere that holds all faces: centre and radius \[m\], at least a micrometre.
fn bounding_sphere(faces: &[ShadedFace]) -> (Point3<f64>, f64) {
    let corners = || faces.iter().flat_map(|face| face.corners);
    let Some(first) = corners().next() else {
        return (Point3::origin(), 1.0);
    };
    let (low, high) = corners().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    let center = low + 0.5 * (high - low);
    let radius = corners().map(|p| (p - center).norm()).fold(1e-6, f64::max);
    (center, radius)
}

/// The height \[texels\] of the first surface under each texel, -infinity where there is none.
fn depth_map(
    faces: &[ShadedFace],
    center: Point3<f64>,
    texel: f64,
    axes: &[Vector3<f64>; 3],
) -> Vec<f32> {
    let mut heights = vec![f32::NEG_INFINITY; TEXELS * TEXELS];
    for face in faces {
        let points = face.corners.map(|corner| {
            let offset = (corner - center) / texel;
            GridPoint {
                position: [1, 2].map(|i| axes[i].dot(&offset) + 0.5 * TEXELS as f64),
                nearness: axes[0].dot(&offset),
            }
        });
        if let Some(triangle) = GridTriangle::new(points, 0) {
            triangle.for_each_sample(TEXELS, 0..TEXELS, |column, row, height| {
                let seen = &mut heights[row * TEXELS + column];
                *seen = seen.max(height);
            });
        }
    }
    heights
}
