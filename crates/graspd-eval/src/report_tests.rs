//! One grasp through all metrics.

use nalgebra::{Isometry3, Vector3};

use crate::test_shapes::{box_mesh, sphere_mesh, together};
use crate::{
    EvaluationError, EvaluationSettings, GraspMetrics, Metrics, ObjectUnderTest, evaluate,
};

/// Six pads pressed 0.3 mm into the faces of a 5 cm cube.
fn cube_and_pads() -> (graspd_geom::TriangleMesh, graspd_geom::TriangleMesh) {
    let pads: Vec<_> = (0..6)
        .map(|face| {
            let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            let mut center = [0.0; 3];
            center[axis] = sign * (0.025 + 0.005 - 0.3e-3);
            let mut size = [0.02; 3];
            size[axis] = 0.01;
            box_mesh(center, size)
        })
        .collect();
    (box_mesh([0.0; 3], [0.05; 3]), together(&pads))
}

#[test]
fn a_firm_grasp() {
    let (cube, pads) = cube_and_pads();
    // Off the voxels' planes, on which everything here would lie.
    let motion = Isometry3::new(Vector3::new(0.01, 0.02, 0.03), Vector3::new(0.3, 0.2, 0.5));
    let object = ObjectUnderTest::new(&cube.transformed(&motion)).unwrap();
    let settings = EvaluationSettings::default();
    let metrics = evaluate(&object, &pads.transformed(&motion), &settings).unwrap();
    let (area, volume) = (
        metrics.contact_area_cm2.unwrap(),
        metrics.interpenetration_volume_cm3.unwrap(),
    );
    // Pressed by 0.3 of a voxel: between half and all of 6 x 4 cm^2.
    assert!((14.0..26.0).contains(&area), "{area}");
    assert!((volume - 6.0 * 4.0 * 0.03).abs() < 0.1, "{volume}");
    assert_eq!(metrics.ca_over_iv, Some(area / volume));
    assert!((metrics.max_penetration_mm.unwrap() - 0.3).abs() < 1e-6);
    assert!(metrics.sim_displacement_cm.unwrap() < 0.05);
    assert!(metrics.sim_displacement_mean6_cm.unwrap() < 0.05);
    assert_eq!(metrics.shake_withstood, Some(6));
    assert_eq!(metrics.shake_success, Some(true));
    assert!(metrics.epsilon.unwrap() > 0.2);
    assert!(metrics.gws_volume.unwrap() > 0.1);
    assert!(metrics.contacts.unwrap() > 2400);
    let again = evaluate(&object, &pads.transformed(&motion), &settings).unwrap();
    assert_eq!(metrics, again);
}

#[test]
fn records_name_every_metric_and_keep_absent_ones_null() {
    let (cube, pads) = cube_and_pads();
    let object = ObjectUnderTest::new(&cube).unwrap();
    let settings = EvaluationSettings {
        metrics: "iv, pd".parse().unwrap(),
        ..EvaluationSettings::default()
    };
    let far = pads.transformed(&Isometry3::translation(1.0, 0.0, 0.0));
    let metrics = evaluate(&object, &far, &settings).unwrap();
    assert_eq!(metrics.interpenetration_volume_cm3, Some(0.0));
    assert_eq!(metrics.max_penetration_mm, Some(0.0));
    let json = serde_json::to_value(&metrics).unwrap();
    let names: Vec<_> = json.as_object().unwrap().keys().cloned().collect();
    for name in [
        "contact_area_cm2",
        "interpenetration_volume_cm3",
        "ca_over_iv",
        "epsilon",
        "gws_volume",
        "sim_displacement_cm",
        "sim_displacement_mean6_cm",
        "shake_withstood",
        "shake_success",
        "max_penetration_mm",
        "contacts",
    ] {
        assert!(names.iter().any(|n| n == name), "{name}");
    }
    assert!(json["sim_displacement_cm"].is_null() && json["ca_over_iv"].is_null());
    let read: GraspMetrics = serde_json::from_value(json).unwrap();
    assert_eq!(read, metrics);
}

#[test]
fn a_hand_far_away_holds_nothing() {
    let (cube, pads) = cube_and_pads();
    let object = ObjectUnderTest::new(&cube).unwrap();
    let far = pads.transformed(&Isometry3::translation(1.0, 0.0, 0.0));
    let metrics = evaluate(&object, &far, &EvaluationSettings::default()).unwrap();
    assert_eq!(metrics.contact_area_cm2, Some(0.0));
    assert_eq!(metrics.ca_over_iv, None);
    assert_eq!(metrics.epsilon, Some(0.0));
    assert_eq!(metrics.contacts, Some(0));
    assert!((metrics.sim_displacement_cm.unwrap() - 10.42).abs() < 0.05);
    assert_eq!(metrics.shake_withstood, Some(0));
    assert_eq!(metrics.shake_success, Some(false));
}

#[test]
fn bad_input_is_named() {
    let (cube, pads) = cube_and_pads();
    let mut open = cube.clone();
    open.faces.pop();
    let error = ObjectUnderTest::new(&open).err().unwrap();
    assert!(
        matches!(error, EvaluationError::BadMesh { mesh: "object", .. }),
        "{error}"
    );
    let object = ObjectUnderTest::new(&cube).unwrap();
    let settings = EvaluationSettings::default();
    let error = evaluate(&object, &open, &settings).unwrap_err();
    assert!(
        matches!(error, EvaluationError::BadMesh { mesh: "hand", .. }),
        "{error}"
    );
    let error = evaluate(&object, &pads.scaled(1000.0), &settings).unwrap_err();
    assert!(error.to_string().contains("metres"), "{error}");
    let settings = EvaluationSettings {
        voxel_size: f64::NAN,
        ..settings
    };
    let error = evaluate(&object, &pads, &settings).unwrap_err();
    assert!(error.to_string().contains("voxel_size"), "{error}");
    let error = "ca,epsilom".parse::<Metrics>().unwrap_err();
    assert!(error.to_string().contains("epsilom"), "{error}");
}

#[test]
fn torque_scale_and_center_are_those_of_the_solid() {
    let object = ObjectUnderTest::new(&sphere_mesh([0.1, 0.2, 0.3], 0.04, 8)).unwrap();
    assert!((object.center_of_mass() - nalgebra::Point3::new(0.1, 0.2, 0.3)).norm() < 1e-9);
    assert!((object.torque_scale() - 0.04).abs() < 1e-9);
}
