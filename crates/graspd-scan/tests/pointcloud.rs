//! Normals, stray points and thinning of point clouds.

use graspd_geom::{GeometryError, SurfaceSampler, TriangleMesh, box_mesh, sphere_mesh};
use graspd_scan::{KdTree, PointCloud};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn sampled(mesh: &TriangleMesh, count: usize) -> PointCloud {
    let sampler = SurfaceSampler::new(mesh).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (points, normals) = (0..count)
        .map(|_| sampler.sample(&mut rng))
        .map(|sample| (sample.point, sample.normal))
        .unzip();
    PointCloud { points, normals }
}

#[test]
fn estimated_normals_look_outward() {
    let mut both = sphere_mesh(0.05, 0.005);
    // A second part, which no neighbourhood joins to the first.
    let mut other = box_mesh(Vector3::new(0.04, 0.05, 0.06), 1.0);
    other.vertices.iter_mut().for_each(|p| p.x += 0.2);
    both.append(&other);
    let truth = sampled(&both, 8000);
    let mut cloud = PointCloud::from_points(truth.points.clone());
    cloud.estimate_normals(12).unwrap();
    let cosines: Vec<f64> = truth
        .normals
        .iter()
        .zip(&cloud.normals)
        .map(|(a, b)| a.dot(b))
        .collect();
    assert!(cosines.iter().all(|&cosine| cosine > 0.0));
    let mean = cosines.iter().sum::<f64>() / cosines.len() as f64;
    assert!(mean > 0.98, "{mean}");
}

#[test]
fn cameras_say_which_side_is_outside() {
    let truth = sampled(&sphere_mesh(0.05, 0.005), 2000);
    let mut cloud = truth.clone();
    cloud.normals.iter_mut().step_by(2).for_each(|n| *n = -*n);
    let cameras: Vec<Point3<f64>> = truth.points.iter().map(|p| p * 10.0).collect();
    cloud.orient_towards(&cameras).unwrap();
    assert_eq!(cloud, truth);
    assert!(matches!(
        cloud.orient_towards(&cameras[1..]),
        Err(GeometryError::CloudNormals { .. })
    ));
}

#[test]
fn stray_points_are_left_out() {
    let mut cloud = sampled(&sphere_mesh(0.05, 0.005), 3000);
    for i in 0..20 {
        cloud
            .points
            .push(Point3::new(0.1, 0.01 * f64::from(i), 0.1));
        cloud.normals.push(Vector3::x());
    }
    let clean = cloud.without_outliers(16, 2.0);
    assert!(clean.points.iter().all(|p| p.coords.norm() < 0.06));
    assert!(clean.points.len() > 2900 && clean.normals.len() == clean.points.len());
}

#[test]
fn thinning_leaves_one_point_a_cell() {
    let cloud = sampled(&sphere_mesh(0.05, 0.005), 20_000);
    let thin = cloud.thinned(0.005).unwrap();
    assert!(
        (1000..4000).contains(&thin.points.len()),
        "{}",
        thin.points.len()
    );
    for (p, normal) in thin.points.iter().zip(&thin.normals) {
        assert!((p.coords.norm() - 0.05).abs() < 5e-4);
        assert!(normal.dot(&p.coords.normalize()) > 0.98);
    }
    // Averaging again changes nothing: every mean lies in its own cell.
    assert_eq!(thin.thinned(0.005).unwrap().points.len(), thin.points.len());
    assert!(cloud.thinned(0.0).is_err() && cloud.thinned(f64::NAN).is_err());
}

#[test]
fn points_without_a_plane_get_some_normal() {
    let mut cloud = PointCloud::from_points(vec![Point3::origin(); 150]);
    cloud.points[3].x = 0.1;
    cloud.estimate_normals(8).unwrap();
    assert!(cloud.normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-9));
    assert!(cloud.estimate_normals(2).is_err());
}

proptest! {
    #[test]
    fn neighbours_are_those_of_a_full_search(
        // A coarse lattice: many equal coordinates and equal distances.
        points in prop::collection::vec((0_i32..6, 0_i32..6, 0_i32..6), 1..200),
        p in (0_i32..12, 0_i32..12, 0_i32..12),
        count in 1_usize..12,
    ) {
        let at = |(x, y, z): (i32, i32, i32), scale: f64| Point3::new(x, y, z).cast::<f64>() * scale;
        let points: Vec<Point3<f64>> = points.into_iter().map(|p| at(p, 1.0)).collect();
        let p = at(p, 0.5);
        let mut found = Vec::new();
        KdTree::new(&points).nearest(&p, count, &mut found);
        let mut expected: Vec<(f64, u32)> = points.iter().zip(0..).map(|(q, i)| ((q - p).norm_squared(), i)).collect();
        expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        expected.truncate(count);
        prop_assert_eq!(found, expected);
    }
}
