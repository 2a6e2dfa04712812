//! RGB-D captures: depth images into a closed mesh, and a mesh into depth images.

mod camera;
mod capture;
mod clipping;
mod depth_image;
mod fusing;
mod hdf5_file;
mod json_file;
mod mask_file;
mod noise;
mod reconstruction;
mod registration;
mod render;
mod simple;
mod smoothing;
mod tabletop;
mod turntable;
mod ycb;

pub use camera::PinholeCamera;
pub use capture::{DepthView, ObjectMask, Plane, RgbdCapture};
pub use depth_image::DepthImage;
pub use fusing::{FusedCloud, FusedView, FusionSettings, fuse};
pub use noise::DepthNoise;
pub use reconstruction::{Reconstruction, ReconstructionSettings, align_to_mesh, reconstruct};
pub use registration::Registration;
pub use render::DepthScene;
pub use simple::{read_capture, read_simple_capture};
pub use turntable::{ScanSettings, scan_on_turntable};
pub use ycb::{DepthIntrinsics, TurntableViews, read_ycb_capture};
