//! Contact area, interpenetration, penetration depth and contacts of solids whose values are known in closed form.

use graspd_geom::{SignedDistance, TriangleMesh};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeSet;
use std::f64::consts::PI;

use crate::contact_area::{contact_area_cm2, voxel_count_area_cm2};
use crate::contacts::contacts;
use crate::penetration::max_penetration_mm;
use crate::test_shapes::{box_mesh, sphere_mesh, together};
use crate::voxels::surface_voxels;
use crate::{Contact, interpenetration_volume_cm3};

/// Contact area \[cm^2\] at threshold 0, penetration \[mm\] and contacts within 0.5 mm.
fn touch(hand: &TriangleMesh, object: &TriangleMesh, size: f64) -> (f64, f64, Vec<Contact>) {
    let (solid, object) = (distance(hand), distance(object));
    let half_diagonal = 0.5 * 3.0_f64.sqrt() * size;
    let voxels = surface_voxels(hand, &solid, &object, size, 0.5e-3 + half_diagonal);
    (
        contact_area_cm2(&voxels, 0.0),
        max_penetration_mm(hand, &voxels, half_diagonal, &object),
        contacts(&voxels, half_diagonal, &object, 0.5e-3),
    )
}

fn distance(mesh: &TriangleMesh) -> SignedDistance {
    SignedDistance::new(mesh).unwrap()
}

fn volume(hand: &TriangleMesh, object: &TriangleMesh, size: f64) -> f64 {
    interpenetration_volume_cm3(&distance(hand), &distance(object), size)
}

/// A motion that aligns nothing with the voxels.
fn tilt() -> Isometry3<f64> {
    Isometry3::new(
        Vector3::new(0.0123, -0.0456, 0.0789),
        Vector3::new(0.4, 0.7, -0.3),
    )
}

/// A 6 x 5 x 4 cm object, and a 4 x 3 x 2 cm box pressed `depth` into its top.
fn pressed_boxes(depth: f64) -> [TriangleMesh; 2] {
    [
        box_mesh([0.003, 0.002, 0.03 - depth], [0.04, 0.03, 0.02]),
        box_mesh([0.0, 0.0, 0.0], [0.06, 0.05, 0.04]),
    ]
}

#[test]
fn overlap_of_boxes() {
    let depth = 3.3e-3;
    let [hand, object] = pressed_boxes(depth);
    let exact = 4.0 * 3.0 * depth * 100.0;
    for motion in [Isometry3::identity(), tilt()] {
        let (hand, object) = (hand.transformed(&motion), object.transformed(&motion));
        for size in [2e-3, 1e-3, 0.5e-3] {
            // A layer of half a voxel on the two large faces, if the worst happens; random tilts do far better.
            let allowed = if motion == Isometry3::identity() {
                0.5
            } else {
                0.05
            };
            let error = volume(&hand, &object, size) - exact;
            assert!(
                error.abs() < allowed * 12.0 * size * 100.0,
                "{size}: {error}"
            );
        }
    }
}

#[test]
fn overlap_of_spheres_converges_to_the_lens() {
    let (a, b, apart) = (0.03, 0.02, 0.04);
    // Facets of about a millimetre: the spheres lose 0.1 % of their volume, and the lens 1 %.
    let (hand, object) = (
        sphere_mesh([0.0; 3], a, 24),
        sphere_mesh([0.0, apart, 0.0], b, 24),
    );
    let (hand, object) = (hand.transformed(&tilt()), object.transformed(&tilt()));
    let sum: f64 = a + b - apart;
    let exact = 1e6 * PI * sum.powi(2) / (12.0 * apart)
        * (apart * apart + 2.0 * apart * (a + b) - 3.0 * (a - b) * (a - b));
    for (size, allowed) in [(4e-3, 0.2), (2e-3, 0.05), (1e-3, 0.03)] {
        let error = volume(&hand, &object, size) / exact - 1.0;
        assert!(error.abs() < allowed, "{size}: {error}");
    }
}

#[test]
fn nothing_in_common_is_zero() {
    let [hand, object] = pressed_boxes(-5e-3);
    assert_eq!(volume(&hand, &object, 1e-3), 0.0);
    let (area, depth, contacts) = touch(&hand, &object, 1e-3);
    assert_eq!((area, depth, contacts.len()), (0.0, 0.0, 0));
}

#[test]
fn area_of_a_pressed_box() {
    let depth: f64 = 3.0e-3;
    let [hand, object] = pressed_boxes(depth);
    // Its underside and the lowest 3 mm of its sides.
    let exact = 4.0 * 3.0 + 2.0 * (4.0 + 3.0) * depth * 100.0;
    for motion in [Isometry3::identity(), tilt()] {
        let (hand, object) = (hand.transformed(&motion), object.transformed(&motion));
        for size in [2e-3, 1e-3, 0.5e-3] {
            let (area, deepest, _) = touch(&hand, &object, size);
            // Half a voxel along the 14 cm of the outline on the sides.
            assert!(
                (area - exact).abs() < 14.0 * 0.5 * size * 100.0,
                "{size}: {area} {exact}"
            );
            assert!((deepest - depth * 1e3).abs() < 1e-9, "{deepest}");
        }
    }
}

#[test]
fn a_surface_that_just_touches_counts_by_its_voxels_centres() {
    let motion = tilt();
    let area = |depth: f64| {
        let [hand, object] = pressed_boxes(depth).map(|mesh| mesh.transformed(&motion));
        touch(&hand, &object, 1e-3).0
    };
    let half = area(0.0) / 12.0;
    assert!((half - 0.5).abs() < 0.05, "{half}");
    // Centres of voxels that a surface passes through are at most half a diagonal away from it.
    assert!(area(0.9e-3) >= 12.0);
    assert_eq!(area(-0.9e-3), 0.0);
}

#[test]
fn what_is_buried_in_another_part_does_not_count() {
    let [hand, object] = pressed_boxes(3e-3);
    let parts = together(&[
        box_mesh([-0.005, 0.002, 0.027], [0.024, 0.03, 0.02]),
        box_mesh([0.010, 0.002, 0.027], [0.026, 0.03, 0.02]),
    ]);
    let (whole, parts) = (hand.transformed(&tilt()), parts.transformed(&tilt()));
    let object = object.transformed(&tilt());
    let (expected, depth, _) = touch(&whole, &object, 1e-3);
    let (area, parts_depth, _) = touch(&parts, &object, 1e-3);
    // The parts' coincident undersides each look outward and are both on the outer surface of the union; they
    // are 1 cm of overlap, so this hand shifts one part up a little to bury its underside.
    assert!(area >= expected);
    assert!((depth - parts_depth).abs() < 1e-9);
    let raised = together(&[
        box_mesh([-0.005, 0.002, 0.027], [0.024, 0.03, 0.02]),
        box_mesh([0.010, 0.002, 0.0271], [0.026, 0.0298, 0.0198]),
    ])
    .transformed(&tilt());
    let (area, _, _) = touch(&raised, &object, 1e-3);
    assert!((area / expected - 1.0).abs() < 0.03, "{area} {expected}");
    assert!((volume(&raised, &object, 1e-3) / volume(&whole, &object, 1e-3) - 1.0).abs() < 0.06);
}

#[test]
fn contacts_lie_on_the_object_and_push_into_it() {
    let [hand, object] = pressed_boxes(0.1e-3);
    let (_, _, contacts) = touch(&hand, &object, 1e-3);
    // One for each square millimetre of the underside, and some of the sides' lowest voxels.
    assert!((1200..2000).contains(&contacts.len()), "{}", contacts.len());
    for contact in contacts {
        assert!((contact.point.z - 0.02).abs() < 1e-12);
        assert!((contact.normal + Vector3::z()).norm() < 1e-9);
    }
}

#[test]
fn depth_of_a_sphere_in_the_middle_of_a_face() {
    // No vertex of the hand is near the deepest point of its large face.
    let hand = box_mesh([0.0, 0.0, 0.05], [0.2, 0.2, 0.1]);
    let object = sphere_mesh([0.001, 0.002, -0.0195], 0.02, 20);
    let (_, deepest, _) = touch(&hand, &object, 1e-3);
    // One point a voxel: up to 0.7 mm beside the deepest, where a sphere and its facets fall by 0.02 mm.
    assert!((deepest - 0.5).abs() < 0.04, "{deepest}");
}

/// Winding number of `mesh` about a point by the sum of its triangles' solid angles: shares nothing with the trees.
fn winding_number(mesh: &TriangleMesh, point: &Point3<f64>) -> f64 {
    let solid_angle = |face: usize| {
        let [a, b, c] = mesh.corners(face).map(|corner| corner - point);
        let (x, y, z) = (a.norm(), b.norm(), c.norm());
        let bottom = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
        2.0 * a.dot(&b.cross(&c)).atan2(bottom)
    };
    (0..mesh.faces.len()).map(solid_angle).sum::<f64>() / (4.0 * PI)
}

/// Whether a triangle and a voxel have a point in common: no axis of a face's normal, of an edge,
/// or of a product of both separates them. Shares nothing with the cutting of polygons.
fn meets(corners: &[Point3<f64>; 3], voxel: [i64; 3], size: f64) -> bool {
    let center = Point3::from(voxel.map(|i| (i as f64 + 0.5) * size));
    let [a, b, c] = corners.map(|corner| corner - center);
    let mut axes = vec![(b - a).cross(&(c - a))];
    for unit in [Vector3::x(), Vector3::y(), Vector3::z()] {
        axes.push(unit);
        axes.extend([b - a, c - b, a - c].map(|edge| unit.cross(&edge)));
    }
    axes.iter().all(|axis| {
        let along = [a, b, c].map(|corner| corner.dot(axis));
        let reach = 0.5 * size * axis.abs().sum();
        let (low, high) = along.iter().fold((f64::MAX, f64::MIN), |(low, high), x| {
            (low.min(*x), high.max(*x))
        });
        low < reach && high > -reach
    })
}

/// Voxels of the hand inside the object, of its solid and of its surface, as the definition says: every voxel of the
/// hand's bounds is looked at, by winding numbers and by every triangle.
fn voxels_by_definition(
    hand: &TriangleMesh,
    object: &TriangleMesh,
    size: f64,
) -> [BTreeSet<[i64; 3]>; 2] {
    let (low, high) = hand.bounds().unwrap();
    let first = low.map(|x| (x / size).floor() as i64);
    let last = high.map(|x| (x / size).ceil() as i64);
    let mut found = [BTreeSet::new(), BTreeSet::new()];
    for i in first.x..last.x {
        for j in first.y..last.y {
            for k in first.z..last.z {
                let voxel = [i, j, k];
                let center = Point3::from(voxel.map(|i| (i as f64 + 0.5) * size));
                if winding_number(object, &center) < 0.5 {
                    continue;
                }
                if winding_number(hand, &center) > 0.5 {
                    found[0].insert(voxel);
                }
                if (0..hand.faces.len()).any(|face| meets(&hand.corners(face), voxel, size)) {
                    found[1].insert(voxel);
                }
            }
        }
    }
    found
}

#[test]
fn voxels_are_those_of_a_look_at_every_voxel() {
    let mug = graspd_mesh::builtin_object("mug").unwrap();
    let (low, high) = mug.bounds().unwrap();
    // A finger across the mug's wall, and two overlapping ones that reach into its cavity.
    let side = Point3::new(low.x, 0.5 * (low.y + high.y), 0.5 * (low.z + high.z));
    let finger = graspd_geom::capsule_mesh(0.008, 0.03, 0.004);
    let at = |x: f64, turn: f64| {
        let motion = Isometry3::new(
            side.coords + Vector3::new(x, 0.003, 0.002),
            Vector3::y() * turn,
        );
        finger.transformed(&motion)
    };
    for hand in [at(0.001, 1.2), together(&[at(0.002, 0.4), at(0.006, 0.9)])] {
        let size = 1.7e-3;
        let [solid, surface] = voxels_by_definition(&hand, &mug, size);
        assert!(solid.len() > 20 && surface.len() > 20);
        let (object, hand_solid) = (distance(&mug), distance(&hand));
        let mut common = BTreeSet::new();
        crate::voxels::for_each_common_block(&object, &hand_solid, size, &mut |first, side| {
            for index in 0..side.pow(3) {
                let step = [index % side, index / side % side, index / (side * side)];
                common.insert([0, 1, 2].map(|axis| first[axis] + step[axis]));
            }
        });
        assert_eq!(common, solid);
        let count = crate::voxels::count_common_voxels(&object, &hand_solid, size);
        assert_eq!(count as usize, solid.len());

        let voxels = surface_voxels(&hand, &hand_solid, &object, size, 1e-3);
        let touching: Vec<_> = voxels.iter().filter(|voxel| voxel.distance < 0.0).collect();
        let touched: BTreeSet<[i64; 3]> = touching
            .iter()
            .map(|voxel| [0, 1, 2].map(|axis| (voxel.point[axis] / size).floor() as i64))
            .collect();
        assert_eq!(touched.len(), touching.len());
        // Of two fingers, what is buried in the other does not count, and that alone is missing.
        assert!(touched.is_subset(&surface));
        for voxel in surface.difference(&touched) {
            let center = Point3::from(voxel.map(|i| (i as f64 + 0.5) * size));
            assert!(
                hand_solid.signed_distance(&center) < 0.9 * size,
                "{voxel:?}"
            );
            assert!(
                hand.faces.len() > finger.faces.len(),
                "{voxel:?} is missing"
            );
        }
    }
}

#[test]
fn a_count_of_voxels_overestimates_inclined_surfaces() {
    // Inside a larger box all of its surface is in contact.
    let around = box_mesh([0.0; 3], [0.2; 3]);
    let body = box_mesh([0.0; 3], [0.04, 0.03, 0.02]);
    let size = 0.25e-3;
    for turn in [
        Vector3::zeros(),
        Vector3::new(0.4, 0.7, -0.3),
        Vector3::new(0.0, 0.0, PI / 4.0),
    ] {
        let motion = Isometry3::new(Vector3::new(1.03e-4, -0.57e-4, 0.91e-4), turn);
        let hand = body.transformed(&motion);
        let object = distance(&around.transformed(&motion));
        let voxels = surface_voxels(&hand, &distance(&hand), &object, size, 0.0);
        let area = contact_area_cm2(&voxels, 0.0);
        assert!((area / body.area() * 1e-4 - 1.0).abs() < 1e-9, "{area}");
        let count = voxel_count_area_cm2(&voxels, 0.0, size);
        let expected: f64 = (0..hand.faces.len())
            .map(|face| 0.5 * hand.area_vector(face).abs().sum() * 1e4)
            .sum();
        // At its edges voxels of two faces are one.
        assert!((count / expected - 1.0).abs() < 0.03, "{count} {expected}");
    }
}

/// Root mean square over some motions of the relative error of `measure` at a voxel size.
fn error_at(size: f64, exact: f64, measure: impl Fn(&Isometry3<f64>, f64) -> f64) -> f64 {
    let count = 12;
    // From 1: unmoved, faces would lie exactly on the centres of voxels.
    let squares = (1..=count).map(|k| {
        // Irrational steps, so that no two are alike to the voxels.
        let step = |factor: f64| (factor * f64::from(k)).fract();
        let shift = Vector3::new(step(0.618), step(0.414), step(0.732)) * 0.01;
        let turn = Vector3::new(step(0.236), step(0.317), step(0.873)) * 2.0;
        (measure(&Isometry3::new(shift, turn), size) / exact - 1.0).powi(2)
    });
    (squares.sum::<f64>() / f64::from(count)).sqrt()
}

#[test]
fn volumes_and_areas_converge_at_first_order_or_faster() {
    // Bodies wholly inside a larger one: the volume in common is their own, that of their meshes.
    let around = box_mesh([0.0; 3], [0.2; 3]);
    for body in [
        sphere_mesh([0.0; 3], 0.012, 10),
        box_mesh([0.0; 3], [0.021, 0.017, 0.013]),
    ] {
        let exact = graspd_geom::signed_volume(&body) * 1e6;
        let measure = |motion: &Isometry3<f64>, size: f64| {
            volume(&body.transformed(motion), &around.transformed(motion), size)
        };
        let [coarse, fine] = [4e-3, 1e-3].map(|size| error_at(size, exact, measure));
        // A quarter of the size, a quarter of the error or less.
        assert!(fine < 0.25 * coarse && fine < 5e-3, "{coarse} {fine}");
    }
    let [hand, object] = pressed_boxes(3e-3);
    let exact = 4.0 * 3.0 + 2.0 * (4.0 + 3.0) * 0.3;
    let measure = |motion: &Isometry3<f64>, size: f64| {
        touch(&hand.transformed(motion), &object.transformed(motion), size).0
    };
    let [coarse, fine] = [3e-3, 0.75e-3].map(|size| error_at(size, exact, measure));
    assert!(fine < 0.25 * coarse && fine < 1e-2, "{coarse} {fine}");
    // A cap of a sphere, 4 mm high, in the top of a box: 2 pi R h.
    let ball = sphere_mesh([0.003, 0.002, 0.02 + 0.02 - 0.004], 0.02, 40);
    let exact = 2.0 * PI * 2.0 * 0.4;
    let measure = |motion: &Isometry3<f64>, size: f64| {
        touch(&ball.transformed(motion), &object.transformed(motion), size).0
    };
    let [coarse, fine] = [3e-3, 0.75e-3].map(|size| error_at(size, exact, measure));
    assert!(fine < 0.25 * coarse && fine < 1e-2, "{coarse} {fine}");
}
