//! Pictures of meshes and grasps, drawn in software: no GPU, no window, the same bytes on every machine of a kind.
//!
//! A [`Scene`] holds surfaces, dots and segments in one frame; a [`Camera`] looks at it; [`render`] gives an
//! [`Image`]. [`render_hand_pose`] does all of it for a hand on an object:
//!
//! ```
//! use graspd_geom::TriangleMesh;
//! use graspd_view::{Camera, Color, Scene, Surface, render};
//! use nalgebra::{Point3, Vector3};
//!
//! let tetrahedron = TriangleMesh {
//!     vertices: [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]].map(Point3::from).to_vec(),
//!     faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
//! };
//! let mut scene = Scene::default();
//! scene.surfaces.push(Surface::new(&tetrahedron, Color::SLATE));
//! let camera = Camera::three_quarter(&scene, 160.0 / 120.0);
//! let image = render(&scene, &camera, 160, 120)?;
//! assert_eq!((image.width(), image.height()), (160, 120));
//! # Ok::<(), graspd_view::ViewError>(())
//! ```

mod camera;
mod caption;
mod color;
mod contact;
mod error;
mod grasp;
mod hand;
mod image;
mod lighting;
mod normals;
mod overlay;
mod page;
mod projection;
mod raster;
mod render;
mod scene;
mod sheet;

pub use camera::Camera;
pub use color::Color;
pub use contact::{ContactForce, contact_dots};
pub use error::ViewError;
pub use grasp::render_hand_pose;
pub use hand::render_hand;
pub use image::{Image, tile};
pub use page::{GraspPage, Keyframe, LossName, MetricColumn, Optimization, PageGrasp, page_html};
pub use render::render;
pub use scene::{Background, Dot, Scene, Segment, Surface};
pub use sheet::{Captioned, SheetGrasp, captioned, contact_sheet, trajectory_strip};
