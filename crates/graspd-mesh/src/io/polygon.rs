//! Triangulation of the polygons of mesh files.

use nalgebra::{Point3, Vector3};

/// Larger polygons become fans without a look at their shape, to bound the quadratic work of clipping ears.
const LARGEST_CLIPPED: usize = 256;

/// Appends the triangles of a polygon to `faces`; triangles with a repeated vertex are left out.
///
/// A convex polygon becomes a fan about its first corner; another one is cut ear by ear in the plane of its area
/// vector (Newell's), so that a concave planar polygon is covered exactly once. Every edge of the polygon is used
/// exactly once, in its own direction, so a closed surface stays closed. `polygon` is used up as working memory.
pub(super) fn triangulate(
    polygon: &mut Vec<u32>,
    vertices: &[Point3<f64>],
    faces: &mut Vec<[u32; 3]>,
) {
    polygon.dedup();
    while polygon.len() > 1 && polygon.first() == polygon.last() {
        polygon.pop();
    }
    let position = |index: u32| vertices[index as usize];
    let mut push = |face: [u32; 3]| {
        if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
            faces.push(face);
        }
    };
    if (4..=LARGEST_CLIPPED).contains(&polygon.len()) {
        let normal = area_vector(polygon.iter().map(|&index| position(index)));
        while polygon.len() > 3 && !is_convex(polygon, vertices, &normal) {
            let Some(ear) = find_ear(polygon, vertices, &normal) else {
                break;
            };
            let [before, after] = neighbours(polygon, ear);
            push([before, polygon[ear], after]);
            polygon.remove(ear);
        }
    }
    for i in 2..polygon.len() {
        push([polygon[0], polygon[i - 1], polygon[i]]);
    }
}

/// Twice the polygon's area times its unit normal.
fn area_vector(corners: impl Iterator<Item = Point3<f64>>) -> Vector3<f64> {
    let corners: Vec<_> = corners.collect();
    let origin = corners[0];
    corners.windows(2).fold(Vector3::zeros(), |sum, pair| {
        sum + (pair[0] - origin).cross(&(pair[1] - origin))
    })
}

fn neighbours(polygon: &[u32], corner: usize) -> [u32; 2] {
    let count = polygon.len();
    [
        polygon[(corner + count - 1) % count],
        polygon[(corner + 1) % count],
    ]
}

/// Twice the area of triangle abc, positive where it turns left about `normal`; times |normal|.
fn turn(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    (b - a).cross(&(c - a)).dot(normal)
}

fn corner_turn(
    polygon: &[u32],
    corner: usize,
    vertices: &[Point3<f64>],
    normal: &Vector3<f64>,
) -> f64 {
    let [before, after] = neighbours(polygon, corner);
    let [a, b, c] = [before, polygon[corner], after].map(|index| vertices[index as usize]);
    turn(&a, &b, &c, normal)
}

fn is_convex(polygon: &[u32], vertices: &[Point3<f64>], normal: &Vector3<f64>) -> bool {
    (0..polygon.len()).all(|corner| corner_turn(polygon, corner, vertices, normal) >= 0.0)
}

/// A corner whose triangle turns left and holds no other corner of the polygon.
fn find_ear(polygon: &[u32], vertices: &[Point3<f64>], normal: &Vector3<f64>) -> Option<usize> {
    (0..polygon.len()).find(|&corner| {
        if corner_turn(polygon, corner, vertices, normal) <= 0.0 {
            return false;
        }
        let [before, after] = neighbours(polygon, corner);
        let ear = [before, polygon[corner], after];
        let [a, b, c] = ear.map(|index| vertices[index as usize]);
        !polygon
            .iter()
            .filter(|index| !ear.contains(index))
            .map(|&index| vertices[index as usize])
            .any(|p| {
                turn(&a, &b, &p, normal) >= 0.0
                    && turn(&b, &c, &p, normal) >= 0.0
                    && turn(&c, &a, &p, normal) >= 0.0
            })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangulated(outline: &[[f64; 2]]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let vertices: Vec<_> = outline
            .iter()
            .map(|p| Point3::new(p[0], p[1], 0.3))
            .collect();
        let mut faces = Vec::new();
        triangulate(
            &mut (0..outline.len() as u32).collect(),
            &vertices,
            &mut faces,
        );
        (vertices, faces)
    }

    #[test]
    fn concave_polygon_is_covered_once() {
        // An L and a comb: every fan from corner 0 of the comb would leave it.
        for (outline, area) in [
            (
                vec![[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]],
                3.0,
            ),
            (
                vec![
                    [0., 2.],
                    [0., 0.],
                    [5., 0.],
                    [5., 2.],
                    [4., 2.],
                    [4., 1.],
                    [3., 1.],
                    [3., 2.],
                    [2., 2.],
                    [2., 1.],
                    [1., 1.],
                    [1., 2.],
                ],
                8.0,
            ),
        ] {
            let (vertices, faces) = triangulated(&outline);
            assert_eq!(faces.len(), outline.len() - 2);
            let areas: Vec<f64> = faces
                .iter()
                .map(|f| {
                    let [a, b, c] = f.map(|i| vertices[i as usize]);
                    0.5 * (b - a).cross(&(c - a)).z
                })
                .collect();
            assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
            assert!((areas.iter().sum::<f64>() - area).abs() < 1e-12);
        }
    }

    #[test]
    fn repeated_corners_are_dropped() {
        let vertices = vec![Point3::origin(); 4];
        for (polygon, expected) in [
            (vec![0, 0, 1], 0),
            (vec![0, 1, 1, 2, 0], 1),
            (vec![0, 1, 0, 2], 0),
            (vec![], 0),
            (vec![3], 0),
            (vec![2, 2, 2], 0),
        ] {
            let mut faces = Vec::new();
            triangulate(&mut polygon.clone(), &vertices, &mut faces);
            assert_eq!(faces.len(), expected, "{polygon:?}");
        }
    }
}
