//! Hands, objects and records that several tests need, coarse enough to be made in a moment.

use std::sync::LazyLock;

use graspd::{GraspObject, GraspRecord, NamedMesh, RecordedPose, SCHEMA};
use graspd_eval::GraspMetrics;
use graspd_hand::{ArticulatedHand, HandOptions, allegro};

/// Samples of the distance grids along each axis.
const RESOLUTION: usize = 32;
/// Density of the objects \[kg/m^3\].
const DENSITY: f64 = 1000.0;

/// An Allegro hand with a tenth of the paper's contact points.
pub(crate) static HAND: LazyLock<ArticulatedHand> = LazyLock::new(|| {
    allegro(&HandOptions {
        contact_points: 300,
        collision_spheres: 30,
        ..HandOptions::default()
    })
    .expect("these options are in range")
});

/// A can, the cheapest of the built-in objects.
pub(crate) static CAN: LazyLock<GraspObject> = LazyLock::new(|| object("can"));

/// A built-in object on a coarse grid.
pub(crate) fn object(name: &str) -> GraspObject {
    let source = NamedMesh::load(name, 1.0).expect("a built-in object");
    GraspObject::prepare(source, RESOLUTION, DENSITY, &|_| {}).expect("it has a volume")
}

/// A record with nothing in it but what every record has.
pub(crate) fn bare_record(index: usize) -> GraspRecord {
    GraspRecord {
        schema: SCHEMA.into(),
        object: "mug".into(),
        object_path: None,
        object_scale: 1.0,
        object_repair: None,
        hand: "allegro".into(),
        seed: None,
        index,
        pose: RecordedPose {
            translation_m: [0.1, -0.2, 0.3],
            rotation_wxyz: [1.0, 0.0, 0.0, 0.0],
        },
        joints_rad: None,
        mano: None,
        pre_grasp: None,
        squeeze: None,
        metrics: None,
        optimizer: None,
        rank: None,
        seconds: None,
    }
}

/// A record that has been judged.
pub(crate) fn judged_record(index: usize, metrics: GraspMetrics) -> GraspRecord {
    GraspRecord {
        metrics: Some(metrics),
        ..bare_record(index)
    }
}

/// A record with a simulation displacement \[cm\], or judged without one.
pub(crate) fn displaced_record(index: usize, displacement: Option<f64>) -> GraspRecord {
    judged_record(
        index,
        GraspMetrics {
            sim_displacement_cm: displacement,
            ..GraspMetrics::default()
        },
    )
}
