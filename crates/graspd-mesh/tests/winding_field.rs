//! Generalised winding numbers: against integers of closed meshes, sums over all triangles and analytic angles.

use graspd_geom::{
    SignedDistance, TriangleMesh, TriangleTree, WindingField, box_mesh, shared_file, sphere_mesh,
};
use graspd_mesh::load_mesh;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// What the sum over a few thousand solid angles may lose to rounding.
const ROUNDING: f64 = 1e-12;

fn field(mesh: &TriangleMesh) -> WindingField {
    WindingField::new(TriangleTree::new(mesh).unwrap())
}

/// Every triangle's solid angle by another formula: the spherical excess from the angles between the planes.
fn by_spherical_excess(mesh: &TriangleMesh, p: &Point3<f64>) -> f64 {
    let sum: f64 = (0..mesh.faces.len())
        .map(|face| {
            let [a, b, c] = mesh.corners(face).map(|corner| (corner - p).normalize());
            let angle = |at: &Vector3<f64>, one: &Vector3<f64>, other: &Vector3<f64>| {
                at.cross(one).angle(&at.cross(other))
            };
            let excess = angle(&a, &b, &c) + angle(&b, &c, &a) + angle(&c, &a, &b);
            (excess - std::f64::consts::PI) * a.dot(&b.cross(&c)).signum()
        })
        .sum();
    sum / (4.0 * std::f64::consts::PI)
}

/// A soup: some faces of a sphere left out, some turned round, some doubled.
fn damaged_sphere(removed: usize, flipped: usize, doubled: usize) -> TriangleMesh {
    let mut mesh = sphere_mesh(0.05, 0.006);
    let count = mesh.faces.len();
    for face in 0..flipped {
        mesh.faces[(7 * face) % count].swap(0, 1);
    }
    for face in 0..doubled {
        let again = mesh.faces[(11 * face) % count];
        mesh.faces.push(again);
    }
    mesh.faces.drain(..removed.min(count - 1));
    mesh
}

#[test]
fn a_square_seen_from_a_cubes_middle_is_a_sixth() {
    let square = TriangleMesh {
        vertices: [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]
            .map(Point3::from)
            .to_vec(),
        faces: vec![[0, 1, 2], [0, 2, 3]],
    };
    let field = field(&square);
    let below = field.winding_number(&Point3::new(0.5, 0.5, -0.5), 0.0);
    assert!((below - 1.0 / 6.0).abs() < 1e-15);
    let above = field.winding_number(&Point3::new(0.5, 0.5, 0.5), 0.0);
    assert!((above + 1.0 / 6.0).abs() < 1e-15);
    // Just below and above the square it is half the sphere of directions.
    let jump = field.winding_number(&Point3::new(0.4, 0.3, -1e-9), 0.0)
        - field.winding_number(&Point3::new(0.4, 0.3, 1e-9), 0.0);
    assert!((jump - 1.0).abs() < 1e-8);
}

#[test]
fn closed_scans_wind_as_often_as_exact_predicates_count() {
    for scan in ["024_bowl", "002_master_chef_can"] {
        let Some(file) = shared_file(&format!("data/ycb/{scan}.obj")) else {
            return;
        };
        let mesh = load_mesh(file).unwrap();
        let (surface, field) = (SignedDistance::new(&mesh).unwrap(), field(&mesh));
        let (low, high) = mesh.bounds().unwrap();
        let points: Vec<Point3<f64>> = (0..500)
            .map(|at| {
                let share =
                    [0.754_877, 0.569_840, 0.380_277].map(|step| f64::from(at) * step % 1.0);
                low + (high - low).component_mul(&(Vector3::from(share) * 1.2).add_scalar(-0.1))
            })
            .collect();
        for accuracy in [1e-1, 1e-3, 1e-6] {
            for (p, winding) in points.iter().zip(field.winding_numbers(&points, accuracy)) {
                let exact = f64::from(surface.winding_number(p));
                assert!(
                    (winding - exact).abs() <= accuracy + ROUNDING,
                    "{scan} {p}: {winding}"
                );
                assert_eq!(winding, field.winding_number(p, accuracy));
            }
        }
    }
}

#[test]
fn what_is_not_finite_gives_nan_and_what_is_far_gives_zero() {
    let field = field(&box_mesh(Vector3::repeat(0.1), 1.0));
    assert!(
        field
            .winding_number(&Point3::new(f64::NAN, 0.0, 0.0), 1e-3)
            .is_nan()
    );
    assert!(
        field
            .winding_number(&Point3::new(f64::INFINITY, 0.0, 0.0), 1e-3)
            .is_nan()
    );
    for far in [1e3, 1e9, 1e40, 1e80] {
        let winding = field.winding_number(&Point3::new(far, -far, far), 1e-3);
        assert!(winding.abs() < 1e-3, "{far}: {winding}");
    }
}

#[test]
fn faces_without_area_add_nothing() {
    let mut mesh = box_mesh(Vector3::repeat(0.1), 1.0);
    mesh.faces.extend([[0, 0, 0], [1, 1, 2]]);
    let winding = field(&mesh).winding_number(&Point3::new(0.01, 0.02, 0.03), 0.0);
    assert!((winding - 1.0).abs() < ROUNDING);
    let flat = TriangleMesh {
        faces: vec![[0, 1, 1]; 20],
        ..mesh
    };
    assert_eq!(
        field(&flat).winding_number(&Point3::new(0.01, 0.02, 0.03), 1e-3),
        0.0
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn soups_are_summed_to_the_accuracy_asked_for(
        removed in 0..600_usize,
        flipped in 0..40_usize,
        doubled in 0..40_usize,
        p in prop::array::uniform3(-0.1..0.1_f64),
        exponent in -8.0..0.0_f64,
    ) {
        let mesh = damaged_sphere(removed, flipped, doubled);
        let (p, accuracy) = (Point3::from(p), 10.0_f64.powf(exponent));
        let field = field(&mesh);
        let all = field.winding_number(&p, 0.0);
        // The excess loses digits where triangles are small.
        prop_assert!((all - by_spherical_excess(&mesh, &p)).abs() < 1e-7);
        prop_assert!((field.winding_number(&p, accuracy) - all).abs() <= accuracy + ROUNDING);
    }

    /// Turned round, every face counts the opposite.
    #[test]
    fn flipping_all_faces_changes_the_sign(p in prop::array::uniform3(-0.1..0.1_f64)) {
        let mut mesh = damaged_sphere(100, 0, 0);
        let p = Point3::from(p);
        let winding = field(&mesh).winding_number(&p, 0.0);
        for face in &mut mesh.faces {
            face.swap(1, 2);
        }
        prop_assert!((field(&mesh).winding_number(&p, 0.0) + winding).abs() < ROUNDING);
    }
}
