//! How well convex pieces cover objects: `decomposition_cover OBJECT...`, mesh files or names of built-in objects.
//!
//! Points are looked at on the mesh's surface (does a piece cover them?) and 0.25, 0.5, 1 and 2 mm
//! outside of it where the mesh is that far away (is a piece in the way?), thousands of each.

use graspd_eval::ObjectUnderTest;
use graspd_geom::{sample_evenly, signed_volume};
use graspd_mesh::{builtin_object, load_mesh};

/// Distances from the surface \[m\].
const OUTSIDE: [f64; 4] = [0.25e-3, 0.5e-3, 1e-3, 2e-3];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for name in std::env::args().skip(1) {
        let mesh = match builtin_object(&name) {
            Some(mesh) => mesh,
            None => load_mesh(&name)?,
        };
        let object = ObjectUnderTest::new(&mesh)?;
        let started = std::time::Instant::now();
        let pieces = object.pieces();
        let seconds = started.elapsed().as_secs_f64();
        let points = sample_evenly(&mesh, 4000, 0);
        let is_covered = |p: &nalgebra::Point3<f64>, margin: f64| {
            pieces.pieces.iter().any(|piece| piece.contains(p, margin))
        };
        let count = points.len() as f64;
        let bare = points
            .iter()
            .filter(|s| !is_covered(&s.point, 0.1e-3))
            .count();
        let mut shares = Vec::new();
        for distance in OUTSIDE {
            // In a corner the mesh is nearer than that; there nothing can be said.
            let outside: Vec<_> = (points.iter())
                .map(|s| s.point + s.normal * distance)
                .filter(|p| object.signed_distance().signed_distance(p) > 0.99 * distance)
                .collect();
            let filled = outside.iter().filter(|p| is_covered(p, 0.0)).count();
            shares.push(format!(
                "{:.1} %",
                100.0 * filled as f64 / outside.len() as f64
            ));
        }
        println!(
            "{name}: {} pieces in {seconds:.1} s, volume {:.3} of the mesh's, deepest overfill \
             {:.2} mm, {:.1} % of the surface bare, filled outside: {}",
            pieces.pieces.len(),
            pieces.volume / signed_volume(&mesh),
            1e3 * pieces.overfill,
            100.0 * bare as f64 / count,
            shares.join(", ")
        );
    }
    Ok(())
}
