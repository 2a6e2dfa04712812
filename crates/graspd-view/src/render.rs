//! The picture of a scene: which face each sample shows, then what light it sends.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::color::Color;
use crate::lighting::Lighting;
use crate::normals::{ShadedFace, shaded_faces};
use crate::overlay::draw_overlay;
use crate::projection::Projection;
use crate::raster::{GridTriangle, SAMPLES};
use crate::{Background, Camera, Image, Scene, ViewError};

/// Rows of pixels that are drawn together: their samples fit a core's cache.
const BAND: usize = 16;
/// What a sample shows where it shows no face.
const NOTHING: u32 = u32::MAX;

/// A band's pixels: linear light, and the nearness at each centre (for the overlay).
type BandPixels = (Vec<[f32; 3]>, Vec<f32>);

/// Renders `scene` as `camera` sees it, `width` x `height` pixels.
///
/// Faces are drawn into a depth buffer of 3 x 3 samples a pixel and shaded once per face and pixel, with shadows
/// and ambient occlusion from depth maps. Where two faces are equally near, the one that comes first in the scene
/// shows. The result does not depend on the number of threads.
///
/// # Errors
/// [`ViewError::Size`], [`ViewError::Camera`]. Faces that cannot be drawn are no error: see [`crate::Surface`].
pub fn render(
    scene: &Scene<'_>,
    camera: &Camera,
    width: usize,
    height: usize,
) -> Result<Image, ViewError> {
    let mut image = Image::filled(width, height, Color::WHITE)?;
    let projection = Projection::new(camera, width * SAMPLES, height * SAMPLES)?;

    let mut faces = Vec::new();
    let mut colors = Vec::new();
    for surface in &scene.surfaces {
        faces.extend(shaded_faces(surface.mesh, surface.crease_angle));
        colors.resize(faces.len(), surface.color.to_linear());
    }
    let painter = Painter {
        lighting: Lighting::new(&faces, &projection.axes, width.max(height)),
        faces: &faces,
        colors: &colors,
        projection: &projection,
        background: scene.background,
        width,
        height,
    };
    let (triangles, bins) = bin_triangles(&faces, &projection, width, height);
    let bands: Vec<BandPixels> = bins
        .par_iter()
        .enumerate()
        .map(|(band, bin)| {
            let top = band * BAND;
            painter.paint_band(top, (top + BAND).min(height), &triangles, bin)
        })
        .collect();

    let mut light = Vec::with_capacity(width * height);
    let mut nearness = Vec::with_capacity(width * height);
    for (band_light, band_nearness) in bands {
        light.extend(band_light);
        nearness.extend(band_nearness);
    }
    draw_overlay(scene, &projection, width, &mut light, &nearness);
    image
        .pixels_mut()
        .par_iter_mut()
        .zip(&light)
        .for_each(|(pixel, light)| *pixel = Color::from_linear(*light).srgb);
    Ok(image)
}

/// Returns the triangles of all faces on the sample grid, and for each band the indices of those that may touch it.
fn bin_triangles(
    faces: &[ShadedFace],
    projection: &Projection,
    width: usize,
    height: usize,
) -> (Vec<GridTriangle>, Vec<Vec<u32>>) {
    let mut triangles = Vec::with_capacity(faces.len());
    let mut bins = vec![Vec::new(); height.div_ceil(BAND)];
    for (index, face) in faces.iter().enumerate() {
        projection.project_triangle(face.corners, |points| {
            let Some(triangle) = GridTriangle::new(points, index as u32) else {
                return;
            };
            let rows = triangle.span(1, height * SAMPLES);
            if rows.is_empty() || triangle.span(0, width * SAMPLES).is_empty() {
                return;
            }
            let (first, last) = (
                rows.start / (BAND * SAMPLES),
                (rows.end - 1) / (BAND * SAMPLES),
            );
            for bin in &mut bins[first..=last] {
                bin.push(triangles.len() as u32);
            }
            triangles.push(triangle);
        });
    }
    (triangles, bins)
}

/// What is needed to paint any band.
struct Painter<'a> {
    lighting: Lighting,
    faces: &'a [ShadedFace],
    colors: &'a [[f32; 3]],
    projection: &'a Projection,
    background: Background,
    width: usize,
    height: usize,
}

impl Painter<'_> {
    /// Paints the rows `top..bottom`.
    fn paint_band(
        &self,
        top: usize,
        bottom: usize,
        triangles: &[GridTriangle],
        bin: &[u32],
    ) -> BandPixels {
        let columns = self.width * SAMPLES;
        let rows = top * SAMPLES..bottom * SAMPLES;
        let mut shown = vec![(f32::NEG_INFINITY, NOTHING); columns * rows.len()];
        for index in bin {
            let triangle = &triangles[*index as usize];
            triangle.for_each_sample(columns, rows.clone(), |column, row, nearness| {
                let sample = &mut shown[(row - rows.start) * columns + column];
                if nearness > sample.0 {
                    *sample = (nearness, triangle.face);
                }
            });
        }
        let count = self.width * (bottom - top);
        let mut light = Vec::with_capacity(count);
        let mut nearness = Vec::with_capacity(count);
        for y in top..bottom {
            for x in 0..self.width {
                let first = (y - top) * SAMPLES * columns + x * SAMPLES;
                light.push(self.paint_pixel(x, y, |sx, sy| shown[first + sy * columns + sx].1));
                nearness.push(shown[first + SAMPLES / 2 * (columns + 1)].0);
            }
        }
        (light, nearness)
    }

    /// Returns the light of one pixel: every face in it is shaded once, in the middle of the samples that show it.
    fn paint_pixel(&self, x: usize, y: usize, shown: impl Fn(usize, usize) -> u32) -> [f32; 3] {
        const COUNT: usize = SAMPLES * SAMPLES;
        let mut groups = [(NOTHING, 0u32, [0.0f64; 2]); COUNT];
        let mut group_count = 0;
        for sample in 0..COUNT {
            let (sx, sy) = (sample % SAMPLES, sample / SAMPLES);
            let face = shown(sx, sy);
            let group = match groups[..group_count]
                .iter()
                .position(|group| group.0 == face)
            {
                Some(group) => group,
                None => {
                    groups[group_count].0 = face;
                    group_count += 1;
                    group_count - 1
                }
            };
            let (_, count, sum) = &mut groups[group];
            *count += 1;
            sum[0] += (x * SAMPLES + sx) as f64 + 0.5;
            sum[1] += (y * SAMPLES + sy) as f64 + 0.5;
        }
        let mut light = [0.0; 3];
        for (face, count, sum) in &groups[..group_count] {
            let color = if *face == NOTHING {
                self.background_at(y)
            } else {
                self.shade(*face, sum.map(|s| s / f64::from(*count)))
            };
            for (total, channel) in light.iter_mut().zip(color) {
                *total += channel * *count as f32 / COUNT as f32;
            }
        }
        light
    }

    fn background_at(&self, y: usize) -> [f32; 3] {
        let t = (y as f32 + 0.5) / self.height as f32;
        let [top, bottom] = [self.background.top, self.background.bottom].map(Color::to_linear);
        std::array::from_fn(|c| top[c] * (1.0 - t) + bottom[c] * t)
    }

    /// Returns the light that a face sends to the viewer from where the line of sight at `position` meets it.
    fn shade(&self, face: u32, position: [f64; 2]) -> [f32; 3] {
        let ShadedFace { corners, normals } = &self.faces[face as usize];
        let (origin, sight) = self.projection.line_of_sight(position);
        let [a, b, c] = corners;
        let face_normal = (b - a).cross(&(c - a)).normalize();
        let (point, weights) = meet(corners, face_normal, origin, sight);
        let normal: Vector3<f64> = (0..3).map(|i| normals[i] * weights[i]).sum();
        let normal = normal.try_normalize(0.0).unwrap_or(face_normal);
        // Both sides of a face are drawn: the normals are those of the side that is seen.
        let side = if face_normal.dot(&sight) > 0.0 {
            -1.0
        } else {
            1.0
        };
        let light = self
            .lighting
            .at(point, face_normal * side, normal * side, -sight);
        self.colors[face as usize].map(|channel| expose(channel * light.diffuse + light.specular))
    }
}

/// Light as the picture holds it: unchanged up to a knee, then bent so that no highlight is cut off at white.
fn expose(light: f32) -> f32 {
    const KNEE: f32 = 0.6;
    if light <= KNEE {
        light
    } else {
        KNEE + (1.0 - KNEE) * ((light - KNEE) / (1.0 - KNEE)).tanh()
    }
}

/// Returns where a line meets a triangle: the point and its barycentric weights, moved into the triangle where the
/// line passes beside it (as it may at the border of a pixel) or along it.
fn meet(
    corners: &[Point3<f64>; 3],
    normal: Vector3<f64>,
    origin: Point3<f64>,
    direction: Vector3<f64>,
) -> (Point3<f64>, [f64; 3]) {
    let [a, b, c] = corners;
    let along = (a - origin).dot(&normal) / direction.dot(&normal);
    let hit = origin + direction * along;
    let area = (b - a).cross(&(c - a)).dot(&normal);
    let part = |p: &Point3<f64>, q: &Point3<f64>| (p - hit).cross(&(q - hit)).dot(&normal) / area;
    let weights = [part(b, c), part(c, a), part(a, b)].map(|w| w.max(0.0));
    let total: f64 = weights.iter().sum();
    let weights = if total.is_finite() && total > 0.0 {
        weights.map(|w| w / total)
    } else {
        [1.0 / 3.0; 3]
    };
    let point = a + (b - a) * weights[1] + (c - a) * weights[2];
    (point, weights)
}
