//! Dots and segments, drawn over the surfaces; what is behind a surface shows faintly.

use crate::projection::Projection;
use crate::raster::SAMPLES;
use crate::{Dot, Scene, Segment};

/// Opacity of what a surface hides.
const HIDDEN_OPACITY: f32 = 0.22;

/// Draws the scene's segments and then its dots, far ones first, into linear light.
///
/// `nearness` is that of the surfaces at the pixels' centres, -infinity where there is none.
pub(crate) fn draw_overlay(
    scene: &Scene<'_>,
    projection: &Projection,
    width: usize,
    light: &mut [[f32; 3]],
    nearness: &[f32],
) {
    let mut canvas = Canvas {
        projection,
        width,
        height: light.len() / width,
        light,
        nearness,
    };
    for segment in &scene.segments {
        canvas.draw_segment(segment);
    }
    let mut dots: Vec<_> = scene
        .dots
        .iter()
        .filter_map(|dot| Some((projection.project_point(dot.position)?, dot)))
        .collect();
    // A stable sort: dots of equal depth keep their order.
    dots.sort_by(|((_, a), _), ((_, b), _)| b.total_cmp(a));
    for ((place, depth), dot) in dots {
        canvas.draw_dot(dot, place.position, depth);
    }
}

struct Canvas<'a> {
    projection: &'a Projection,
    width: usize,
    height: usize,
    light: &'a mut [[f32; 3]],
    nearness: &'a [f32],
}

impl Canvas<'_> {
    /// Draws a ball: a disc that darkens towards its rim.
    fn draw_dot(&mut self, dot: &Dot, place: [f64; 2], depth: f64) {
        if !(dot.radius >= 0.0 && dot.radius.is_finite()) {
            return;
        }
        let center = place.map(|c| c / SAMPLES as f64);
        let radius =
            (dot.radius * self.projection.samples_per_metre(depth) / SAMPLES as f64).max(1.0);
        let color = dot.color.to_linear();
        // The nearest point of the ball decides, so that a dot on a surface is not half swallowed by it.
        let front = depth - dot.radius;
        self.blend_within([center, center], radius, |x, y| {
            let distance = (x - center[0]).hypot(y - center[1]);
            let fall = (distance / radius).min(1.0);
            let shade = (1.0 - 0.55 * fall.powi(3)) as f32;
            (distance, front, color.map(|c| c * shade))
        });
    }

    fn draw_segment(&mut self, segment: &Segment) {
        let Some([from, to]) = self.projection.project_segment([segment.from, segment.to]) else {
            return;
        };
        if !(segment.width > 0.0 && segment.width.is_finite()) {
            return;
        }
        let ends = [from, to].map(|end| end.position.map(|c| c / SAMPLES as f64));
        let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let length_squared = along[0] * along[0] + along[1] * along[1];
        let color = segment.color.to_linear();
        self.blend_within(ends, 0.5 * segment.width, |x, y| {
            let offset = [x - ends[0][0], y - ends[0][1]];
            let t = if length_squared > 0.0 {
                ((offset[0] * along[0] + offset[1] * along[1]) / length_squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let distance = (offset[0] - t * along[0]).hypot(offset[1] - t * along[1]);
            let depth = 1.0 / (from.nearness + t * (to.nearness - from.nearness));
            (distance, depth, color)
        });
    }

    /// Blends in all pixels within `radius` \[px\] of the box about `ends`, where `look` gives the distance of a
    /// pixel from the mark's axis \[px\], the mark's depth \[m\] and its colour there.
    fn blend_within(
        &mut self,
        ends: [[f64; 2]; 2],
        radius: f64,
        look: impl Fn(f64, f64) -> (f64, f64, [f32; 3]),
    ) {
        let reach = radius + 1.0;
        let range = |axis: usize, count: usize| {
            let low = ends[0][axis].min(ends[1][axis]) - reach;
            let high = ends[0][axis].max(ends[1][axis]) + reach;
            // Casts saturate: what is off the picture gives an empty range.
            (low.max(0.0) as usize).min(count)..(high.max(0.0).ceil() as usize).min(count)
        };
        for row in range(1, self.height) {
            for column in range(0, self.width) {
                let (distance, depth, color) = look(column as f64 + 0.5, row as f64 + 0.5);
                let coverage = (radius + 0.5 - distance).clamp(0.0, 1.0) as f32;
                if coverage == 0.0 {
                    continue;
                }
                let pixel = row * self.width + column;
                let behind = self.nearness[pixel];
                let is_hidden =
                    behind > f32::NEG_INFINITY && depth > 1.0 / f64::from(behind) * (1.0 + 1e-4);
                let opacity = coverage * if is_hidden { HIDDEN_OPACITY } else { 1.0 };
                for (light, channel) in self.light[pixel].iter_mut().zip(color) {
                    *light += opacity * (channel - *light);
                }
            }
        }
    }
}
