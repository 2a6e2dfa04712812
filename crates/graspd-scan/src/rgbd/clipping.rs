//! A surface cut off at the table that the object stands on.

use std::collections::HashMap;

use super::Plane;
use graspd_geom::TriangleMesh;

/// The part of a mesh above a plane, open there: faces that cross it are cut. Vertices nearer to it than `snap`
/// \[m\] are moved onto it first, so that no sliver is left.
pub(super) fn above(mesh: &TriangleMesh, plane: &Plane, snap: f64) -> TriangleMesh {
    let mut cut = TriangleMesh {
        vertices: mesh.vertices.clone(),
        faces: Vec::new(),
    };
    let heights: Vec<f64> = (cut.vertices.iter_mut())
        .map(|p| {
            let height = plane.height(p);
            if height.abs() >= snap {
                return height;
            }
            *p -= plane.normal * height;
            0.0
        })
        .collect();
    // On each crossed edge one vertex, whichever face asks for it.
    let mut crossings: HashMap<[u32; 2], u32> = HashMap::new();
    for face in &mesh.faces {
        let mut corners = Vec::with_capacity(4);
        for side in 0..3 {
            let (a, b) = (face[side], face[(side + 1) % 3]);
            let (high, low) = (heights[a as usize], heights[b as usize]);
            if high >= 0.0 {
                corners.push(a);
            }
            if (high > 0.0 && low < 0.0) || (high < 0.0 && low > 0.0) {
                let ends = [a.min(b), a.max(b)];
                corners.push(*crossings.entry(ends).or_insert_with(|| {
                    let [from, to] = ends.map(|v| cut.vertices[v as usize]);
                    let [start, end] = ends.map(|v| heights[v as usize]);
                    cut.vertices
                        .push(from + (to - from) * (start / (start - end)));
                    cut.vertices.len() as u32 - 1
                }));
            }
        }
        let is_above = face.iter().any(|&v| heights[v as usize] > 0.0);
        for last in 2..corners.len() {
            if is_above {
                cut.faces
                    .push([corners[0], corners[last - 1], corners[last]]);
            }
        }
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_geom::{box_mesh, require_closed, signed_volume, sphere_mesh};
    use graspd_mesh::{RepairSettings, repair};

    #[test]
    fn what_is_cut_off_is_closed_by_a_flat_patch() {
        // A ball of 50 mm, cut 20 mm below its middle: h = 70 mm, V = pi h^2 (3 r - h) / 3.
        let ball = sphere_mesh(0.05, 0.004);
        let plane = Plane {
            offset: 0.02,
            ..Plane::horizontal()
        };
        let cut = above(&ball, &plane, 1e-4);
        assert!(require_closed(&cut, "cut").is_err());
        assert!(
            cut.faces
                .iter()
                .flatten()
                .all(|&v| { plane.height(&cut.vertices[v as usize]) >= -1e-12 })
        );
        let closed = repair(&cut, &RepairSettings::default(), "cut").unwrap();
        assert_eq!(closed.report.holes.len(), 1);
        let expected = std::f64::consts::PI * 0.07 * 0.07 * 0.08 / 3.0;
        let ratio = signed_volume(&closed.mesh) / expected;
        assert!((0.99..1.0).contains(&ratio), "{ratio}");
        assert!((closed.mesh.bounds().unwrap().0.z + 0.02).abs() < 1e-12);
    }

    #[test]
    fn faces_on_the_plane_go_and_those_above_stay() {
        let cube = box_mesh([0.1; 3].into(), 0.05);
        // Its underside, within the snap.
        let plane = Plane {
            offset: 0.05 - 1e-5,
            ..Plane::horizontal()
        };
        let cut = above(&cube, &plane, 1e-4);
        assert_eq!(cut.faces.len(), cube.faces.len() * 5 / 6);
        let far = Plane {
            offset: 1.0,
            ..Plane::horizontal()
        };
        assert_eq!(above(&cube, &far, 1e-4).faces, cube.faces);
    }
}
