//! Renders mesh files that share a frame:
//! `cargo run -p graspd-view --example look -- MESH... -o out.png [--size 800x600] [--single] [--flat]`

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use graspd_geom::load_mesh;
use graspd_view::{Camera, Color, Scene, Shading, Surface, render, tile};
use nalgebra::Vector3;

fn main() -> Result<(), Box<dyn Error>> {
    let mut inputs = Vec::new();
    let mut output = PathBuf::from("look.png");
    let (mut width, mut height) = (640, 480);
    let mut is_single = false;
    let mut shading = Shading::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "-o" => output = arguments.next().ok_or("-o needs a file")?.into(),
            "--size" => {
                let size = arguments.next().ok_or("--size needs WIDTHxHEIGHT")?;
                let (w, h) = size.split_once('x').ok_or("--size needs WIDTHxHEIGHT")?;
                (width, height) = (w.parse()?, h.parse()?);
            }
            "--single" => is_single = true,
            "--flat" => shading = Shading::Flat,
            _ => inputs.push(PathBuf::from(argument)),
        }
    }
    if inputs.is_empty() {
        return Err("usage: look MESH... [-o out.png] [--size 800x600] [--single] [--flat]".into());
    }
    let meshes = inputs
        .iter()
        .map(load_mesh)
        .collect::<Result<Vec<_>, _>>()?;
    let mut scene = Scene::default();
    for (mesh, color) in meshes.iter().zip(Color::PALETTE.iter().cycle()) {
        scene.surfaces.push(Surface {
            mesh,
            color: *color,
            shading,
        });
    }
    let start = Instant::now();
    // Front right, back left, from above, from below.
    let views = [
        [0.75, 0.5, 0.4],
        [-0.75, -0.5, 0.4],
        [0.2, 0.0, 1.0],
        [0.5, -0.7, -0.5],
    ];
    let count = if is_single { 1 } else { views.len() };
    let aspect = width as f64 / height as f64;
    let images = views[..count]
        .iter()
        .map(|view| {
            let towards_viewer = Vector3::from(*view);
            let camera = Camera::framing(scene.points(), towards_viewer, Vector3::z(), aspect);
            render(&scene, &camera, width, height)
        })
        .collect::<Result<Vec<_>, _>>()?;
    tile(&images, 2)?.write_png(&output)?;
    let faces: usize = meshes.iter().map(|mesh| mesh.faces.len()).sum();
    eprintln!(
        "{}: {} views of {faces} faces in {:.2} s",
        output.display(),
        images.len(),
        start.elapsed().as_secs_f64()
    );
    Ok(())
}
