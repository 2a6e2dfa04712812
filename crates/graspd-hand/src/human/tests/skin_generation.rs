//! How the skin is made: a closed triangle mesh on the zero level of the flesh, finest where hands touch things.
//!
//! Making it takes a second, so the result is kept in `skin.bin`, beside this file. A test makes it again; after a
//! change of the proportions or the flesh, `cargo test -p graspd-hand --lib write_the_skin -- --ignored` writes it.

use graspd_geom::TriangleMesh;
use graspd_mesh::{NodeGrid, isosurface};
use nalgebra::{Point3, Vector3};

use super::implicit_surface::ImplicitHand;
use super::remeshing::{RemeshTarget, remesh};
use crate::human::proportions::{Chain, RAYS, THUMB, chains};
use crate::human::skin::SKIN_VERTICES;

/// Spacing of the grid that the first surface is found on \[mm\].
const GRID_SPACING: f64 = 5.0;
/// Rounds of remeshing.
const ROUNDS: usize = 9;
/// Wanted edge length \[mm\] where the density is 1; set so that nearly the wanted number of vertices results.
const EDGE: f64 = 8.6;

/// Returns the skin of the rest pose \[mm\].
fn generated_skin() -> TriangleMesh {
    let flesh = ImplicitHand::new();
    let low = Point3::new(-200.0, -55.0, -80.0);
    let high = Point3::new(26.0, 30.0, 100.0);
    let grid = NodeGrid::covering(low, high, GRID_SPACING);
    let rough = isosurface(&grid, 0.0, |at| flesh.value(&grid.node(at)))
        .expect("the grid is a valid constant");
    let target = Skin {
        flesh,
        chains: chains(),
    };
    remesh(&rough, &target, ROUNDS, Some(SKIN_VERTICES))
}

struct Skin {
    flesh: ImplicitHand,
    chains: [Chain; 5],
}

impl RemeshTarget for Skin {
    fn project(&self, p: &Point3<f64>) -> Point3<f64> {
        let mut p = *p;
        for _ in 0..3 {
            let gradient = self.flesh.gradient(&p);
            let step = self.flesh.value(&p) / gradient.norm_squared().max(0.1);
            p -= gradient * step;
            if step.abs() < 1e-3 {
                break;
            }
        }
        p
    }
    fn edge_length(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        // How far out on a finger the point is: 0 at its first joint, 3 at the end of its last bone.
        let (mut outness, mut pad, mut nearest) =
            (0.0, Vector3::new(0.0, -1.0, 0.0), f64::INFINITY);
        for (ray, chain) in self.chains.iter().enumerate() {
            for bone in 0..3 {
                let from = p - chain.joints[bone];
                let part = (from.dot(&chain.along[bone]) / RAYS[ray].lengths[bone]).clamp(0.0, 1.3);
                let distance = (from - chain.along[bone] * (part * RAYS[ray].lengths[bone])).norm();
                if distance < nearest {
                    nearest = distance;
                    let first = if ray == THUMB { 0.4 } else { 0.0 };
                    outness = bone as f64 + part.max(0.0) * (1.0 - first) - first;
                    pad = chain.pads[bone];
                }
            }
        }
        let outness = outness.clamp(0.0, 3.0);
        // 1 on the side that touches things, 0 on the back.
        let facing = 0.5 + 0.5 * normal.dot(&pad);
        let on_palm = 1.45 - 0.35 * facing;
        let on_finger = 0.98 - 0.26 * facing;
        let at_tip = 0.78 - 0.24 * facing;
        let blend = |a: f64, b: f64, t: f64| a + (b - a) * t.clamp(0.0, 1.0);
        let relative = blend(
            blend(on_palm, on_finger, outness / 0.7),
            at_tip,
            outness - 1.7,
        );
        // Nothing is held with the wrist.
        EDGE * blend(relative, 1.7, (p.x + 25.0) / 30.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::human::skin::{UNIT, encoded, skin};

    #[test]
    #[ignore = "writes a source file"]
    fn write_the_skin() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/src/human/skin.bin");
        std::fs::write(file, encoded(&generated_skin())).unwrap();
    }

    #[test]
    fn the_kept_skin_is_the_one_that_is_made() {
        let (kept, made) = (skin(), generated_skin());
        assert_eq!(kept.faces, made.faces);
        for (kept, made) in kept.vertices.iter().zip(&made.vertices) {
            assert!((kept - made * 1e-3).norm() <= UNIT, "{kept} {made}");
        }
    }

    #[test]
    fn the_skin_lies_on_the_flesh() {
        // Half a unit of the kept coordinates in each direction, and what is left by the search.
        const TOLERANCE_MM: f64 = 0.03;
        let flesh = ImplicitHand::new();
        for p in &skin().vertices {
            let distance = flesh.value(&(p * 1e3)) / flesh.gradient(&(p * 1e3)).norm();
            assert!(distance.abs() < TOLERANCE_MM, "{distance}");
        }
    }
}
