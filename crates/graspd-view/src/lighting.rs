//! Light with soft shadows: many distant lamps, each with its own depth map.
//!
//! The sky is a full sphere of faint lamps and the key light a narrow cone of strong ones, so that ambient
//! occlusion and soft key shadows come out of the one rule: a lamp lights what it sees. Lamps of the sky come in
//! opposite pairs, which share the drawing of their maps.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::camera::PictureAxes;
use crate::normals::ShadedFace;
use crate::projection::GridPoint;
use crate::raster::GridTriangle;

/// Pairs of lamps of the sky.
const SKY_PAIRS: usize = 48;
/// Lamps of the key light, and the half angle of their cone \[rad\].
const KEY_LAMPS: usize = 16;
const KEY_SPREAD: f64 = 0.16;
/// Irradiance that the key light gives a surface that faces it.
const KEY_IRRADIANCE: f32 = 0.8;
/// Irradiance that the open sky gives a surface that faces up, and one that faces down.
const SKY_IRRADIANCE: [f32; 2] = [0.78, 0.40];
/// Light that has been reflected so often that it comes from everywhere.
const BOUNCED_IRRADIANCE: f32 = 0.07;
/// How far a surface is lifted before a lamp looks for it \[texels\], against shadows of a surface on itself.
const LIFT: f32 = 1.4;
/// Blinn's exponent and strength of the key light's reflection.
const SHININESS: i32 = 36;
const SPECULAR: f32 = 0.13;

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
    key: Vec<LampPair>,
    sky: Vec<LampPair>,
    center: Point3<f64>,
}

/// Two lamps in opposite directions and what they see.
struct LampPair {
    /// Unit direction towards the first lamp, and two axes across.
    axes: [Vector3<f32>; 3],
    /// Of the first lamp and of its opposite.
    irradiance: [f32; 2],
    /// Texels on a side of the map.
    side: usize,
    texels_per_metre: f32,
    /// What each lamp sees first under each texel, as heights towards that lamp \[texels\], `[side * side]`;
    /// -infinity where there is nothing.
    heights: Vec<[f32; 2]>,
}

impl Lighting {
    /// Lamps placed relative to the viewer (key light from above left), with depth maps of `faces` that suit a
    /// picture of `pixels` on its longer side.
    pub(crate) fn new(faces: &[ShadedFace], viewer: &PictureAxes, pixels: usize) -> Self {
        let (center, radius) = bounding_sphere(faces);
        let key_side = (pixels / 3).clamp(64, 512);
        let draw = |side| {
            move |(direction, irradiance): (Vector3<f64>, [f32; 2])| {
                LampPair::new(direction, irradiance, side, faces, center, radius)
            }
        };
        Self {
            key: key_lamps(viewer)
                .into_par_iter()
                .map(draw(key_side))
                .collect(),
            // Wider texels blur the border of each faint shadow into the next.
            sky: sky_lamps(viewer)
                .into_par_iter()
                .map(draw(key_side / 2))
                .collect(),
            center,
        }
    }

    /// Returns the light on a point whose face has the unit normal `face_normal`, shaded as if it were `normal`, seen
    /// from the unit direction `to_viewer`; both normals point to the viewer's side.
    pub(crate) fn at(
        &self,
        point: Point3<f64>,
        face_normal: Vector3<f64>,
        normal: Vector3<f64>,
        to_viewer: Vector3<f64>,
    ) -> Light {
        let offset = (point - self.center).cast::<f32>();
        let [lift, normal, to_viewer] =
            [face_normal * f64::from(LIFT), normal, to_viewer].map(|v| v.cast::<f32>());
        let mut light = Light {
            diffuse: BOUNCED_IRRADIANCE,
            specular: 0.0,
        };
        for pair in &self.sky {
            light.diffuse += pair.received(offset, lift, normal);
        }
        for pair in &self.key {
            let received = pair.received(offset, lift, normal);
            if received > 0.0 {
                let half = (pair.axes[0] + to_viewer).normalize();
                light.diffuse += received;
                light.specular += SPECULAR * received * half.dot(&normal).max(0.0).powi(SHININESS);
            }
        }
        light
    }
}

impl LampPair {
    fn new(
        direction: Vector3<f64>,
        irradiance: [f32; 2],
        side: usize,
        faces: &[ShadedFace],
        center: Point3<f64>,
        radius: f64,
    ) -> Self {
        let axes = axes_about(direction);
        let texels_per_metre = (side - 2) as f64 / (2.0 * radius);
        let [towards, across, along] = axes.map(|axis| axis * texels_per_metre);
        let middle = 0.5 * side as f64;
        let mut heights = vec![[f32::NEG_INFINITY; 2]; side * side];
        for face in faces {
            let points = face.corners.map(|corner| {
                let offset = corner - center;
                GridPoint {
                    position: [across.dot(&offset) + middle, along.dot(&offset) + middle],
                    nearness: towards.dot(&offset),
                }
            });
            if let Some(triangle) = GridTriangle::new(points, 0) {
                triangle.for_each_sample(side, 0..side, |column, row, height| {
                    let [first, opposite] = &mut heights[row * side + column];
                    *first = first.max(height);
                    *opposite = opposite.max(-height);
                });
            }
        }
        Self {
            axes: axes.map(|axis| axis.cast()),
            irradiance,
            side,
            texels_per_metre: texels_per_metre as f32,
            heights,
        }
    }

    /// Returns the irradiance at a place (by its offset from the scene's centre \[m\], to be lifted by `lift`
    /// \[texels\]) with this unit normal from that lamp of the two which it faces.
    #[inline]
    fn received(&self, offset: Vector3<f32>, lift: Vector3<f32>, normal: Vector3<f32>) -> f32 {
        let cosine = self.axes[0].dot(&normal);
        let (lamp, sign) = if cosine > 0.0 { (0, 1.0) } else { (1, -1.0) };
        let irradiance = self.irradiance[lamp];
        if irradiance == 0.0 {
            return 0.0;
        }
        let place = offset * self.texels_per_metre + lift;
        let height = sign * self.axes[0].dot(&place);
        let middle = 0.5 * (self.side - 1) as f32;
        let last = (self.side - 2) as f32 + 0.999;
        let [u, v] = [1, 2].map(|i| (self.axes[i].dot(&place) + middle).clamp(0.0, last));
        let (column, row) = (u as usize, v as usize);
        let (s, t) = (u - column as f32, v - row as f32);
        let texel = row * self.side + column;
        // A surface half a texel above or below counts in part, so that shadows of faces on themselves fade out.
        let sees = |index: usize| (height - self.heights[index][lamp] + 0.5).clamp(0.0, 1.0);
        let near = sees(texel) * (1.0 - s) + sees(texel + 1) * s;
        let far = sees(texel + self.side) * (1.0 - s) + sees(texel + self.side + 1) * s;
        irradiance * cosine.abs() * (near * (1.0 - t) + far * t)
    }
}

/// Returns a multiple of the golden angle: successive ones spread evenly over a circle.
fn golden_angle(index: usize) -> f64 {
    index as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt())
}

/// Directions and irradiances of the key light: Vogel's sunflower over a disc.
fn key_lamps(viewer: &PictureAxes) -> Vec<(Vector3<f64>, [f32; 2])> {
    let key = viewer.back * 0.72 + viewer.up * 0.75 - viewer.right * 0.52;
    let [key, across, along] = axes_about(key.normalize());
    let lamp = |index| {
        let radius = KEY_SPREAD * ((index as f64 + 0.5) / KEY_LAMPS as f64).sqrt();
        let (sine, cosine) = golden_angle(index).sin_cos();
        let direction = (key + (across * cosine + along * sine) * radius).normalize();
        (direction, [KEY_IRRADIANCE / KEY_LAMPS as f32, 0.0])
    };
    (0..KEY_LAMPS).map(lamp).collect()
}

/// Directions and irradiances of the pairs of the sky: the same spiral over a half sphere and its opposite.
fn sky_lamps(viewer: &PictureAxes) -> Vec<(Vector3<f64>, [f32; 2])> {
    let [above, below] = SKY_IRRADIANCE;
    // A radiance mean + slope h, linear in the height h of the lamp, has irradiance mean + 2/3 slope h on a surface
    // whose normal has height h.
    let (mean, slope) = (0.5 * (above + below), 0.75 * (above - below));
    // Of a uniform sphere of N lamps, a surface receives the mean of max(0, cos) = 1/4 each.
    let per_lamp = 4.0 / (2 * SKY_PAIRS) as f32;
    let pair = |index| {
        let height = (index as f64 + 0.5) / SKY_PAIRS as f64;
        let (sine, cosine) = golden_angle(index).sin_cos();
        let ring = (1.0 - height * height).sqrt();
        let direction = viewer.up * height + (viewer.right * cosine + viewer.back * sine) * ring;
        let rise = slope * height as f32;
        (
            direction,
            [mean + rise, mean - rise].map(|radiance| per_lamp * radiance),
        )
    };
    (0..SKY_PAIRS).map(pair).collect()
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

/// Returns a sphere that holds all faces: centre and radius \[m\].
fn bounding_sphere(faces: &[ShadedFace]) -> (Point3<f64>, f64) {
    let corners = || faces.iter().flat_map(|face| face.corners);
    let Some(first) = corners().next() else {
        return (Point3::origin(), 1.0);
    };
    let (low, high) = corners().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    let center = low + 0.5 * (high - low);
    let radius = corners().map(|p| (p - center).norm()).fold(0.0, f64::max);
    (center, radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWER: fn() -> PictureAxes = || PictureAxes {
        right: Vector3::x(),
        up: Vector3::z(),
        back: -Vector3::y(),
    };

    fn triangle(corners: [[f64; 3]; 3]) -> ShadedFace {
        ShadedFace {
            corners: corners.map(Point3::from),
            normals: [Vector3::z(); 3],
        }
    }

    #[test]
    fn the_open_sky_gives_the_irradiance_that_it_is_meant_to() {
        let sky = sky_lamps(&VIEWER());
        for (normal, expected) in [
            (Vector3::z(), SKY_IRRADIANCE[0]),
            (-Vector3::z(), SKY_IRRADIANCE[1]),
            (Vector3::x(), 0.5 * (SKY_IRRADIANCE[0] + SKY_IRRADIANCE[1])),
        ] {
            let sum: f32 = sky
                .iter()
                .map(|(direction, [first, opposite])| {
                    let cosine = direction.dot(&normal) as f32;
                    first * cosine.max(0.0) + opposite * (-cosine).max(0.0)
                })
                .sum();
            // The error of some 100 directions in place of all.
            assert!((sum - expected).abs() < 0.02, "{sum} {expected}");
        }
    }

    #[test]
    fn a_roof_takes_the_light_from_above_only() {
        let floor = triangle([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.5, 0.0]]);
        let roof = triangle([[-9.0, -9.0, 0.3], [9.0, -9.0, 0.3], [0.0, 9.0, 0.3]]);
        let up = Vector3::z();
        let open = Lighting::new(&[floor], &VIEWER(), 900);
        let bare = open.at(Point3::origin(), up, up, up).diffuse;
        let unshaded = SKY_IRRADIANCE[0] + BOUNCED_IRRADIANCE;
        assert!(bare > unshaded, "{bare}");
        let floor = triangle([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.5, 0.0]]);
        let covered = Lighting::new(&[floor, roof], &VIEWER(), 900);
        let below = covered.at(Point3::origin(), up, up, up).diffuse;
        assert!(below < 0.25 * bare, "{below} {bare}");
        let on_top = covered.at(Point3::new(0.0, 0.0, 0.3), up, up, up).diffuse;
        assert!((on_top - bare).abs() < 0.02, "{on_top} {bare}");
    }
}
