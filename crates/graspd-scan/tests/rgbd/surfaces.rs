//! What is reconstructed from rendered captures, against the mesh that was rendered.

use graspd_geom::{SignedDistance, SurfaceSampler, TriangleMesh, require_closed, topology};
use graspd_mesh::builtin_object;
use graspd_scan::{
    DepthIntrinsics, FusionSettings, ReconstructionSettings, align_to_mesh, fuse, read_capture,
    reconstruct,
};
use nalgebra::{Isometry3, Vector3};
use rand::SeedableRng;

use crate::layouts::scanned;

/// Mean of both directions' mean distance between two surfaces [m].
fn chamfer(a: &TriangleMesh, b: &TriangleMesh) -> f64 {
    let one_way = |from: &TriangleMesh, to: &TriangleMesh| {
        let distance = SignedDistance::new(to).unwrap();
        let sampler = SurfaceSampler::new(from).unwrap();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let distances =
            (0..5000).map(|_| distance.tree().distance(&sampler.sample(&mut rng).point));
        distances.sum::<f64>() / 5000.0
    };
    0.5 * (one_way(a, b) + one_way(b, a))
}

#[test]
fn a_noisy_turntable_scan_gives_the_object_back() {
    let can = builtin_object("can").unwrap();
    let folder = scanned(&can, 15, 1.0);
    let capture = read_capture(folder.path(), None, DepthIntrinsics::default()).unwrap();
    let fused = fuse(&capture, &FusionSettings::default()).unwrap();
    assert_eq!(fused.views.len(), 15);
    let result = reconstruct(
        &fused.cloud,
        fused.table.as_ref(),
        &ReconstructionSettings::default(),
        "can",
    )
    .unwrap();
    require_closed(&result.mesh, "can").unwrap();
    assert_eq!(topology(&result.mesh).components, 1);
    // The underside, a tenth of a can, is not seen.
    assert!((0.02..0.3).contains(&result.trimmed), "{}", result.trimmed);
    let motion = capture.object_from_world.unwrap();
    let mesh = result.mesh.transformed(&motion);
    let error = chamfer(&mesh, &can);
    // Cells of depth 5 are 3.5 mm, the camera's noise at 0.7 m is 0.8 mm.
    assert!(error < 0.0012, "{error}");

    // The same cloud finds its way onto the mesh from a frame of its own, but for turns about the can's axis.
    let elsewhere = Isometry3::new(Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.4, 0.3, 1.0));
    let mut moved = fused.cloud.clone();
    for p in &mut moved.points {
        *p = elsewhere * *p;
    }
    let up = elsewhere * Vector3::z();
    let found = align_to_mesh(&moved, &up, &can).unwrap();
    assert!(found.rms < 0.0015, "{}", found.rms);
    let axis = (found.motion * elsewhere * Vector3::z()).normalize();
    assert!((axis - Vector3::z()).norm() < 0.02, "{axis}");
}
