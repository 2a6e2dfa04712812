//! Normals at the corners of faces, split where a surface has a crease.

use std::collections::HashMap;

use graspd_geom::TriangleMesh;
use nalgebra::{Point3, Vector3};

/// A face that can be drawn: its corners and the normals there.
pub(crate) struct ShadedFace {
    pub(crate) corners: [Point3<f64>; 3],
    pub(crate) normals: [Vector3<f64>; 3],
}

/// Returns the drawable faces of a mesh: those with three finite corners that span an area.
///
/// A corner's normal is the sum, weighted by the angle there, of the unit normals of those faces about its vertex
/// that turn from the corner's own face by less than the crease angle. Vertices in one place count as one vertex,
/// since many files repeat them.
pub(crate) fn shaded_faces(mesh: &TriangleMesh, crease_angle: f64) -> Vec<ShadedFace> {
    let mut faces: Vec<ShadedFace> = mesh
        .faces
        .iter()
        .filter_map(|face| {
            let [a, b, c] = face.map(|index| mesh.vertices.get(index as usize).copied());
            let corners = [a?, b?, c?];
            let cross = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let normal = cross.try_normalize(0.0)?;
            (normal.norm_squared() > 0.5).then_some(ShadedFace {
                corners,
                normals: [normal; 3],
            })
        })
        .collect();
    smooth(&mut faces, crease_angle.cos());
    faces
}

/// Replaces face normals by corner normals.
fn smooth(faces: &mut [ShadedFace], crease_cosine: f64) {
    /// Beyond this many faces about a vertex (the tip of a cone, a broken file) it is left as a crease: the sums
    /// below are quadratic in the number.
    const MAX_FACES_ABOUT_A_VERTEX: usize = 256;

    let mut place_of = HashMap::with_capacity(faces.len());
    let mut about: Vec<Vec<(u32, f64)>> = Vec::new();
    let mut places = Vec::with_capacity(faces.len());
    for (index, face) in faces.iter().enumerate() {
        places.push(std::array::from_fn::<usize, 3, _>(|corner| {
            let p = face.corners[corner];
            // Adding zero makes -0 and 0 one place.
            let key = [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
            let place = *place_of.entry(key).or_insert_with(|| {
                about.push(Vec::new());
                about.len() - 1
            });
            let [to_next, to_previous] = [1, 2].map(|step| face.corners[(corner + step) % 3] - p);
            about[place].push((index as u32, to_next.angle(&to_previous)));
            place
        }));
    }
    let face_normals: Vec<_> = faces.iter().map(|face| face.normals[0]).collect();
    for (face, places) in faces.iter_mut().zip(&places) {
        let own = face.normals[0];
        for (normal, place) in face.normals.iter_mut().zip(places) {
            if about[*place].len() > MAX_FACES_ABOUT_A_VERTEX {
                continue;
            }
            let sum: Vector3<f64> = about[*place]
                .iter()
                .map(|(other, weight)| (face_normals[*other as usize], *weight))
                .filter(|(other, _)| other.dot(&own) >= crease_cosine)
                .map(|(other, weight)| other * weight)
                .sum();
            *normal = sum.try_normalize(1e-9).unwrap_or(own);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tent(half_angle: f64) -> TriangleMesh {
        let (rise, run) = (half_angle.sin(), half_angle.cos());
        TriangleMesh {
            vertices: vec![
                Point3::new(0.0, 0.0, 0.0),
                Point3::new(0.0, 1.0, 0.0),
                Point3::new(run, 0.5, -rise),
                Point3::new(-run, 0.5, -rise),
            ],
            faces: vec![[0, 2, 1], [0, 1, 3]],
        }
    }

    #[test]
    fn an_edge_is_smooth_below_the_crease_angle_and_sharp_above() {
        let crease_angle = 40f64.to_radians();
        for (half_angle, is_smooth) in [(19f64, true), (21.0, false)] {
            let faces = shaded_faces(&tent(half_angle.to_radians()), crease_angle);
            let [first, second] = [faces[0].normals[0], faces[1].normals[0]];
            assert_eq!((first - second).norm() < 1e-12, is_smooth, "{half_angle}");
            if is_smooth {
                assert!((first - Vector3::z()).norm() < 1e-12);
            }
        }
        let flat = shaded_faces(&tent(0.1), 0.0);
        assert!((flat[0].normals[0] - flat[1].normals[0]).norm() > 0.1);
    }

    #[test]
    fn repeated_vertices_do_not_make_a_crease() {
        let welded = tent(0.1);
        let mut soup = TriangleMesh::default();
        for face in 0..welded.faces.len() {
            soup.append(&TriangleMesh {
                vertices: welded.corners(face).to_vec(),
                faces: vec![[0, 1, 2]],
            });
        }
        let [welded, soup] = [welded, soup].map(|m| shaded_faces(&m, 0.7));
        for (a, b) in welded.iter().zip(&soup) {
            assert_eq!(a.normals, b.normals);
        }
    }

    #[test]
    fn faces_that_cannot_be_drawn_are_left_out() {
        let mut mesh = tent(0.1);
        mesh.vertices.push(Point3::new(f64::NAN, 0.0, 0.0));
        mesh.vertices.push(Point3::new(f64::INFINITY, 0.0, 0.0));
        mesh.vertices.push(Point3::new(1e300, 0.0, 1e300));
        mesh.faces
            .extend([[0, 1, 4], [0, 1, 5], [0, 1, 99], [0, 0, 1], [0, 1, 6]]);
        assert_eq!(shaded_faces(&mesh, 0.7).len(), 2);
    }

    #[test]
    fn a_vertex_with_very_many_faces_takes_no_time() {
        let mut mesh = TriangleMesh::default();
        mesh.vertices.push(Point3::new(0.0, 0.0, 1.0));
        let count = 100_000u32;
        for i in 0..count {
            let angle = f64::from(i) / f64::from(count) * std::f64::consts::TAU;
            mesh.vertices
                .push(Point3::new(angle.cos(), angle.sin(), 0.0));
            mesh.faces.push([0, 1 + i, 1 + (i + 1) % count]);
        }
        assert_eq!(shaded_faces(&mesh, 0.7).len(), mesh.faces.len());
    }
}
