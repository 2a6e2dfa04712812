//! What is to be seen: surfaces, dots and segments in one frame.

use graspd_geom::TriangleMesh;
use nalgebra::Point3;

use crate::Color;

/// A mesh with a colour. Both sides of its faces are drawn; faces with a missing, non-finite or coinciding corner
/// are not.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// The mesh, in the scene's frame.
    pub mesh: &'a TriangleMesh,
    /// Its colour.
    pub color: Color,
    /// Normals are interpolated over edges whose faces turn by less than this angle \[rad\]; sharper edges stay
    /// sharp.
    pub crease_angle: f64,
}

impl<'a> Surface<'a> {
    /// Returns a surface with creases from 40 degrees: boxes look flat and mugs round.
    pub fn new(mesh: &'a TriangleMesh, color: Color) -> Self {
        Self {
            mesh,
            color,
            crease_angle: 40f64.to_radians(),
        }
    }
}

/// A marked point, such as a contact; what a surface hides of it shows faintly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Where it is.
    pub position: Point3<f64>,
    /// Its radius \[m\]; drawn at least one pixel wide.
    pub radius: f64,
    /// Its colour, such as [`Color::heat`] of a force.
    pub color: Color,
}

/// A line, such as an axis of a frame; what a surface hides of it shows faintly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Where it begins.
    pub from: Point3<f64>,
    /// Where it ends.
    pub to: Point3<f64>,
    /// Its width on the picture \[px\].
    pub width: f64,
    /// Its colour.
    pub color: Color,
}

/// What is behind everything: a vertical gradient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Background {
    /// Colour of the upper edge.
    pub top: Color,
    /// Colour of the lower edge.
    pub bottom: Color,
}

impl Default for Background {
    /// Near-white that darkens slightly downwards.
    fn default() -> Self {
        Self {
            top: Color::new(250, 250, 249),
            bottom: Color::new(226, 227, 228),
        }
    }
}

/// Everything that a picture shows, in one frame.
#[derive(Clone, Debug, Default)]
pub struct Scene<'a> {
    /// The surfaces.
    pub surfaces: Vec<Surface<'a>>,
    /// Marked points, drawn over the surfaces.
    pub dots: Vec<Dot>,
    /// Lines, drawn over the surfaces.
    pub segments: Vec<Segment>,
    /// What is behind them.
    pub background: Background,
}

impl Scene<'_> {
    /// Returns the finite points of everything in the scene, to frame it by.
    pub fn points(&self) -> impl Iterator<Item = Point3<f64>> {
        let vertices = self
            .surfaces
            .iter()
            .flat_map(|surface| surface.mesh.vertices.iter().copied());
        let dots = self.dots.iter().map(|dot| dot.position);
        let ends = self
            .segments
            .iter()
            .flat_map(|segment| [segment.from, segment.to]);
        vertices
            .chain(dots)
            .chain(ends)
            .filter(|p| p.coords.iter().all(|c| c.is_finite()))
    }

    /// Adds the three axes of a frame at `origin`, of length `length` \[m\]: x red, y green, z blue.
    pub fn push_axes(&mut self, frame: &nalgebra::Isometry3<f64>, length: f64) {
        let colors = [
            Color::new(204, 62, 58),
            Color::new(78, 150, 72),
            Color::new(60, 102, 190),
        ];
        let origin = frame * Point3::origin();
        for (axis, color) in colors.into_iter().enumerate() {
            let mut tip = Point3::origin();
            tip[axis] = length;
            self.segments.push(Segment {
                from: origin,
                to: frame * tip,
                width: 3.0,
                color,
            });
        }
    }
}
