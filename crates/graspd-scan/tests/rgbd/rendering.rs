//! Rays and rendered depth images against formulas.

use graspd_geom::{TriangleTree, box_mesh, sphere_mesh};
use graspd_mesh::builtin_object;
use graspd_scan::{DepthNoise, DepthScene, PinholeCamera};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NO_NOISE: DepthNoise = DepthNoise {
    scale: 0.0,
    seed: 0,
};
const UNIT: f64 = 1e-4;

fn camera() -> PinholeCamera {
    PinholeCamera {
        width: 160,
        height: 120,
        focal: [150.0, 150.0],
        center: [79.5, 59.5],
        distortion: [-0.06, 0.08, 0.0005, -0.0004, 0.0],
    }
}

/// 0.5 m above the table's frame, looking straight down.
fn overhead() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.5), turn)
}

#[test]
fn first_hits_are_those_of_a_search_through_all_triangles() {
    let mesh = builtin_object("mug").unwrap();
    let tree = TriangleTree::new(&mesh).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut hits = 0;
    for _ in 0..300 {
        let mut vector = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0_f64));
        let (origin, target) = (Point3::from(0.2 * vector()), Point3::from(0.05 * vector()));
        let direction = target - origin;
        // The definition: solve origin + t direction = a + u (b - a) + v (c - a).
        let brute = (0..mesh.faces.len()).filter_map(|face| {
            let [a, b, c] = mesh.corners(face);
            let matrix = nalgebra::Matrix3::from_columns(&[-direction, b - a, c - a]);
            let x = matrix.lu().solve(&(origin - a))?;
            (x[0] > 0.0 && x[1] >= 0.0 && x[2] >= 0.0 && x[1] + x[2] <= 1.0).then_some(x[0])
        });
        let brute = brute.fold(f64::INFINITY, f64::min);
        let found = tree.first_hit(&origin, &direction);
        match found {
            Some(hit) => {
                hits += 1;
                assert!((hit.length - brute).abs() < 1e-9, "{} {brute}", hit.length);
                let normal = mesh.area_vector(hit.face).normalize();
                assert!((hit.normal - normal).norm() < 1e-12);
            }
            None => assert_eq!(brute, f64::INFINITY),
        }
    }
    assert!((50..300).contains(&hits), "{hits} of 300 rays met the mug");
}

#[test]
fn a_closed_mesh_has_no_cracks_along_edges_and_vertices() {
    let mesh = box_mesh([0.1, 0.1, 0.1].into(), 0.02);
    let tree = TriangleTree::new(&mesh).unwrap();
    let origin = Point3::new(0.31, 0.17, 0.23);
    for face in 0..mesh.faces.len() {
        let [a, b, c] = mesh.corners(face);
        for target in [a, nalgebra::center(&a, &b), nalgebra::center(&b, &c)] {
            // Past the point and through the solid: silhouette edges aside, every such ray enters it.
            let inward = target + (Point3::origin() - target) * 1e-3;
            assert!(tree.first_hit(&origin, &(inward - origin)).is_some());
        }
    }
}

#[test]
fn depths_of_a_ball_on_a_table_are_those_of_the_formula() {
    let radius = 0.06;
    let mesh = sphere_mesh(radius, 0.003);
    let tree = TriangleTree::new(&mesh).unwrap();
    let scene = DepthScene {
        object: &tree,
        // The ball's centre is a radius above the table.
        object_from_table: Isometry3::translation(0.0, 0.0, -radius),
        table_radius: 0.1,
    };
    let camera = camera();
    let image = scene.depth_image(&camera, &overhead(), &NO_NOISE, 0, UNIT);
    let mask = scene.mask(&camera, &overhead());
    let center = Point3::new(0.0, 0.0, 0.5 - radius);
    let (mut on_ball, mut on_table, mut nothing) = (0, 0, 0);
    for pixel in 0..image.raw.len() {
        let (u, v) = ((pixel % 160) as f64, (pixel / 160) as f64);
        let ray = camera.ray(u, v).unwrap();
        let closest = center.coords.cross(&ray).norm() / ray.norm();
        if (closest - radius).abs() < 0.001 {
            // The mesh's silhouette is a little within the ball's.
            continue;
        }
        let at_table = 0.5 * ray;
        let expected = if closest < radius {
            on_ball += 1;
            // z |ray| is the nearer root of the quadratic.
            let along = ray.normalize().dot(&center.coords);
            Some((along - (radius * radius - closest * closest).sqrt()) / ray.norm())
        } else if at_table.xy().norm() < 0.1 {
            on_table += 1;
            Some(0.5)
        } else {
            nothing += 1;
            None
        };
        if expected.is_some() && (at_table.xy().norm() - 0.1).abs() < 1e-9 {
            continue;
        }
        assert_eq!(mask[pixel], closest < radius, "{u} {v}");
        match (image.depth(pixel), expected) {
            (Some(z), Some(expected)) => {
                // Half a unit of rounding; facets of 3 mm are up to 0.02 mm inside the ball, more where grazed.
                assert!((z - expected).abs() < 0.0008, "{u} {v}: {z} {expected}");
            }
            (found, expected) => assert_eq!(found, expected, "{u} {v}"),
        }
    }
    assert!(
        on_ball > 500 && on_table > 500 && nothing > 500,
        "{on_ball} {on_table} {nothing}"
    );
}

#[test]
fn noise_depends_on_the_seed_and_not_on_threads() {
    let mesh = builtin_object("can").unwrap();
    let tree = TriangleTree::new(&mesh).unwrap();
    let scene = DepthScene {
        object: &tree,
        object_from_table: Isometry3::identity(),
        table_radius: 0.2,
    };
    let image = |seed, view, threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let noise = DepthNoise { scale: 1.0, seed };
        pool.install(|| scene.depth_image(&camera(), &overhead(), &noise, view, UNIT))
    };
    let first = image(1, 1, 1);
    assert_eq!(first, image(1, 1, 4));
    assert_ne!(first, image(2, 1, 1));
    assert_ne!(first, image(1, 2, 1));
    let exact = scene.depth_image(&camera(), &overhead(), &NO_NOISE, 1, UNIT);
    assert!(first.valid() < exact.valid(), "some pixels are lost");
    assert!(first.valid() > exact.valid() / 2, "and not most");
}

#[test]
fn edges_are_left_out_with_their_neighbours_and_slopes_stay() {
    let (width, height) = (20, 10);
    // A slope of 2 mm a pixel, and a step of 50 mm between columns 9 and 10.
    let raw = (0..width * height)
        .map(|i| (6000 + 20 * (i % width) + if i % width >= 10 { 500 } else { 0 }) as u16)
        .collect();
    let image = graspd_scan::DepthImage {
        width,
        height,
        raw,
        unit: UNIT,
    };
    for (radius, lost) in [(0, 0..0), (1, 9..11), (2, 8..12)] {
        let kept = image.without_edges(radius, 0.02);
        for (i, (&before, &after)) in image.raw.iter().zip(&kept.raw).enumerate() {
            let expected = if lost.contains(&(i % width)) {
                0
            } else {
                before
            };
            assert_eq!(after, expected, "radius {radius}, column {}", i % width);
        }
    }
}
