//! Analytic scenes: free simulation, cages, plates that squeeze or support.

use graspd_geom::TriangleMesh;
use graspd_settings::Validate;
use nalgebra::{Matrix3, Point3, Vector3};

use super::*;
use crate::test_shapes::{box_mesh, sphere_mesh, together};

const GRASPD: PhysicsEngine = PhysicsEngine::Graspd;
const SIZE: [f64; 3] = [0.06, 0.08, 0.05];
/// Of the engine's integration: relative error 1 / (35 steps x 10 substeps).
const FREE_FALL_CM: f64 = 10.42;
/// A held object moves by less than this \[cm\]: the squeezing contacts relax by fractions of their depth.
const HELD_CM: f64 = 0.05;

fn box_distance(p: &Point3<f64>) -> f64 {
    let q = p.coords.abs() - Vector3::from(SIZE) * 0.5;
    q.sup(&Vector3::zeros()).norm() + q.max().min(0.0)
}

fn box_object() -> DynamicObject {
    let mesh = box_mesh([0.0; 3], SIZE);
    let pieces = ObjectPieces::new(&mesh, &box_distance, &DecompositionSettings::default());
    let [a, b, c] = SIZE.map(|side| side * side / 12.0);
    let inertia = Matrix3::from_diagonal(&Vector3::new(b + c, a + c, a + b));
    DynamicObject::new(&pieces, Point3::origin(), inertia)
}

/// A plate 1 cm thick, `press` deep in the box's face at +-`axis`, covering all of it.
fn plate(axis: usize, sign: f64, press: f64) -> TriangleMesh {
    let mut center = [0.0; 3];
    let mut size = [0.15; 3];
    size[axis] = 0.01;
    center[axis] = sign * (SIZE[axis] / 2.0 + 0.005 - press);
    box_mesh(center, size)
}

fn displacement(parts: &[TriangleMesh], settings: &DisplacementSettings) -> f64 {
    let hand = FixedHand::new(&together(parts)).unwrap();
    simulate(&box_object(), &hand, settings, GRASPD)
        .unwrap()
        .displacement_cm()
}

#[test]
fn free_fall_without_touch() {
    let settings = DisplacementSettings::default();
    assert!((settings.free_fall() * 100.0 - FREE_FALL_CM).abs() < 0.01);
    let far = [box_mesh([1.0, 0.0, 0.0], [0.1; 3])];
    let fallen = displacement(&far, &settings);
    assert!((fallen / FREE_FALL_CM - 1.0).abs() < 0.005, "{fallen}");
    let hand = FixedHand::new(&far[0]).unwrap();
    let six = simulate_six_directions(&box_object(), &hand, &settings, GRASPD).unwrap();
    for (along, expected) in six.per_direction_cm.iter().zip([fallen; 6]) {
        assert!((along - expected).abs() < 1e-9);
    }
    assert!((six.mean_cm - fallen).abs() < 1e-9);
}

#[test]
fn gravity_pulls_along_its_direction() {
    let hand = FixedHand::new(&box_mesh([1.0, 0.0, 0.0], [0.1; 3])).unwrap();
    let motion = simulate(
        &box_object(),
        &hand,
        &DisplacementSettings::default(),
        GRASPD,
    )
    .unwrap();
    let [x, y, z] = motion.displacement;
    assert!(y > 0.1 && x.abs() < 1e-9 && z.abs() < 1e-9);
    assert!(motion.rotation < 1e-9);
}

#[test]
fn a_caged_object_stays() {
    let cage: Vec<_> = (0..3)
        .flat_map(|axis| [plate(axis, 1.0, 0.0), plate(axis, -1.0, 0.0)])
        .collect();
    let settings = DisplacementSettings::default();
    let hand = FixedHand::new(&together(&cage)).unwrap();
    let six = simulate_six_directions(&box_object(), &hand, &settings, GRASPD).unwrap();
    assert!(six.per_direction_cm.iter().all(|d| *d < HELD_CM), "{six:?}");
}

#[test]
fn two_plates_hold_by_friction_alone() {
    let settings = DisplacementSettings::default();
    let plates = [plate(0, 1.0, 0.2e-3), plate(0, -1.0, 0.2e-3)];
    assert!(displacement(&plates, &settings) < HELD_CM);
    let slippery = DisplacementSettings {
        friction: 0.0,
        ..settings
    };
    let fallen = displacement(&plates, &slippery);
    assert!((fallen / FREE_FALL_CM - 1.0).abs() < 0.01, "{fallen}");
}

#[test]
fn the_pairs_friction_is_the_setting() {
    // A flat box on a slope slides iff tan(slope) > friction. It is wider than it is high, so it does not tip.
    let floor = [plate(2, 1.0, 0.0)];
    for (tan, slides) in [(1.1, false), (1.3, true)] {
        let settings = DisplacementSettings {
            gravity_direction: [0.0, tan, 1.0],
            ..DisplacementSettings::default()
        };
        let moved = displacement(&floor, &settings);
        assert_eq!(moved > 0.1, slides, "tan {tan}: {moved} cm");
    }
}

#[test]
fn a_palm_supports_from_below_only() {
    let settings = DisplacementSettings::default();
    assert!(displacement(&[plate(1, 1.0, 0.0)], &settings) < HELD_CM);
    let fallen = displacement(&[plate(1, -1.0, 0.0)], &settings);
    assert!((fallen / FREE_FALL_CM - 1.0).abs() < 0.01, "{fallen}");
}

#[test]
fn nothing_tunnels_through_a_thin_plate() {
    // 4 cm below, 1 mm thick: the object arrives at 0.9 m/s.
    let gap = 0.04;
    let thin = box_mesh([0.0, SIZE[1] / 2.0 + gap + 0.5e-3, 0.0], [0.15, 1e-3, 0.15]);
    let moved = displacement(&[thin], &DisplacementSettings::default());
    // It may be found up to 3 mm inside and still be on its way out.
    assert!((moved - 100.0 * gap).abs() < 0.1, "{moved}");
}

#[test]
fn round_fingers_hold_a_pressed_object_and_not_a_distant_one() {
    let fingers = |gap: f64| {
        let radius = 0.01;
        let x = SIZE[0] / 2.0 + radius + gap;
        [
            sphere_mesh([x, 0.005, 0.01], radius, 5),
            sphere_mesh([x, 0.005, -0.01], radius, 5),
            sphere_mesh([-x, 0.005, 0.0], radius, 5),
        ]
    };
    let settings = DisplacementSettings::default();
    assert!(displacement(&fingers(-0.5e-3), &settings) < HELD_CM);
    assert!(displacement(&fingers(1e-3), &settings) > 10.0);
}

#[test]
fn the_same_scene_gives_the_same_bits() {
    let hand = together(&[
        sphere_mesh([0.039, 0.005, 0.01], 0.01, 5),
        sphere_mesh([-0.0395, 0.01, 0.0], 0.01, 5),
    ]);
    let run = move || {
        let hand = FixedHand::new(&hand).unwrap();
        simulate(
            &box_object(),
            &hand,
            &DisplacementSettings::default(),
            GRASPD,
        )
        .unwrap()
    };
    let first = run();
    assert_eq!(first, run());
    assert_eq!(first, std::thread::spawn(run).join().unwrap());
}

#[test]
fn bad_settings_and_empty_hands_are_refused() {
    let settings = DisplacementSettings {
        time_step: -1.0,
        ..DisplacementSettings::default()
    };
    let message = settings.validate().unwrap_err().to_string();
    assert!(message.contains("time_step"), "{message}");
    assert!(FixedHand::new(&TriangleMesh::default()).is_err());
    let mut hand = box_mesh([0.0; 3], SIZE);
    hand.faces[0][0] = 99;
    assert!(FixedHand::new(&hand).is_err());
    let mut hand = box_mesh([0.0; 3], SIZE);
    hand.vertices[0].x = f64::NAN;
    assert!(FixedHand::new(&hand).is_err());
}

#[test]
fn a_box_is_one_exact_piece() {
    let mesh = box_mesh([0.0; 3], SIZE);
    let pieces = ObjectPieces::new(&mesh, &box_distance, &DecompositionSettings::default());
    assert_eq!(pieces.pieces.len(), 1);
    assert!((pieces.volume / SIZE.iter().product::<f64>() - 1.0).abs() < 1e-9);
    assert!(pieces.overfill < 1e-9);
}

/// A cup: a box with a smaller one taken out of its top.
fn cup() -> (TriangleMesh, impl Fn(&Point3<f64>) -> f64, f64) {
    let (outer, wall): ([f64; 3], f64) = ([0.08, 0.08, 0.1], 0.002);
    let mut mesh = box_mesh([0.0; 3], outer);
    // Vertices in the order of their corners: bit 0 for x, 1 for y, 2 for z.
    let mut order: Vec<usize> = (0..8).collect();
    let code = |p: &Point3<f64>| (0..3).map(|k| usize::from(p[k] > 0.0) << k).sum::<usize>();
    order.sort_by_key(|&i| code(&mesh.vertices[i]));
    for face in &mut mesh.faces {
        *face = face.map(|i| code(&mesh.vertices[i as usize]) as u32);
    }
    mesh.vertices = order.iter().map(|&i| mesh.vertices[i]).collect();
    // The top face is replaced by the rim and the cavity's faces.
    mesh.faces
        .retain(|f| !f.iter().all(|&i| mesh.vertices[i as usize].z > 0.049));
    let inner = |p: &Point3<f64>| {
        let scale = |v: f64| v - v.signum() * wall;
        Point3::new(
            scale(p.x),
            scale(p.y),
            if p.z > 0.0 { p.z } else { p.z + wall },
        )
    };
    let vertices: Vec<_> = mesh.vertices.iter().map(inner).collect();
    mesh.vertices.extend(vertices);
    let walls: Vec<_> = mesh
        .faces
        .iter()
        .map(|&[a, b, c]| [a + 8, c + 8, b + 8])
        .collect();
    mesh.faces.extend(walls);
    for (a, b) in [(4, 5), (5, 7), (7, 6), (6, 4)] {
        mesh.faces.push([a, b, b + 8]);
        mesh.faces.push([a, b + 8, a + 8]);
    }
    let distance = move |p: &Point3<f64>| {
        let boxed = |p: Point3<f64>, half: Vector3<f64>| {
            let q = p.coords.abs() - half;
            q.sup(&Vector3::zeros()).norm() + q.max().min(0.0)
        };
        // A cavity that reaches out of the top; a lower bound of the distance, exact near the walls.
        let solid = boxed(*p, Vector3::from(outer) * 0.5);
        let half = Vector3::new(0.04 - wall, 0.04 - wall, 0.1);
        let cavity = boxed(p - Vector3::new(0.0, 0.0, 0.05 + wall), half);
        solid.max(-cavity)
    };
    let volume = outer.iter().product::<f64>() - (0.08 - 2.0 * wall).powi(2) * (0.1 - wall);
    (mesh, distance, volume)
}

#[test]
fn a_thin_cup_stays_hollow() {
    let (mesh, distance, volume) = cup();
    let pieces = ObjectPieces::new(&mesh, &distance, &DecompositionSettings::default());
    assert!(
        (pieces.volume / volume - 1.0).abs() < 0.01,
        "{}",
        pieces.volume / volume
    );
    let settings = DisplacementSettings::default();
    let object = DynamicObject::new(&pieces, Point3::origin(), Matrix3::identity() * 1e-3);
    // A ball within the cavity is not a contact.
    let inside = FixedHand::new(&sphere_mesh([0.0, 0.0, 0.0], 0.02, 5)).unwrap();
    let down = DisplacementSettings {
        gravity_direction: [0.0, 0.0, -1.0],
        ..settings
    };
    let moved = simulate(&object, &inside, &down, GRASPD)
        .unwrap()
        .displacement_cm();
    assert!((moved / FREE_FALL_CM - 1.0).abs() < 0.01, "{moved}");
}

#[test]
fn a_scanned_mug_stays_hollow() {
    let Some(file) = graspd_geom::shared_file("data/ycb/025_mug.obj") else {
        return;
    };
    let mesh = graspd_mesh::load_mesh(file).unwrap();
    let exact = graspd_geom::SignedDistance::new(&mesh).unwrap();
    let settings = DecompositionSettings {
        max_pieces: 160,
        ..DecompositionSettings::default()
    };
    let pieces = ObjectPieces::new(&mesh, &|p| exact.signed_distance(p), &settings);
    // A wall of 3 mm around 138 cm^3; V-HACD at resolution 128 leaves 5 mm and a ratio of 1.2.
    let ratio = pieces.volume / graspd_geom::signed_volume(&mesh);
    assert!((1.0..1.25).contains(&ratio), "{ratio}");
    assert!(pieces.overfill < 3e-3, "{}", pieces.overfill);
    // The pieces cover the surface up to the simplification.
    let shrunk = settings.simplification_tolerance * 1.01;
    for vertex in mesh.vertices.iter().step_by(97) {
        assert!(
            pieces
                .pieces
                .iter()
                .any(|piece| piece.contains(vertex, shrunk)),
            "{vertex}"
        );
    }
    let text = serde_json::to_string(&pieces).unwrap();
    let read: ObjectPieces = serde_json::from_str(&text).unwrap();
    assert_eq!(read.pieces.len(), pieces.pieces.len());
    // JSON keeps 17 digits, but its reader may round the last.
    assert!((read.overfill / pieces.overfill - 1.0).abs() < 1e-14);
}

fn shaken(parts: &[TriangleMesh], settings: &ShakeSettings) -> [bool; 6] {
    let hand = FixedHand::new(&together(parts)).unwrap();
    shake(&box_object(), &hand, settings, GRASPD)
        .unwrap()
        .withstood
}

/// Plates pressed in by 0.1 mm hold the box whatever friction there is along their normals, and
/// with it along the plates, too, as long as it carries the weight.
#[test]
fn plates_withstand_the_forces_that_their_friction_carries() {
    let settings = ShakeSettings::default();
    let plates = [plate(0, 1.0, 0.1e-3), plate(0, -1.0, 0.1e-3)];
    let all = ShakeOutcome {
        withstood: shaken(&plates, &settings),
    };
    assert!(all.is_success() && all.count() == 6, "{all:?}");
    let slippery = ShakeSettings {
        friction: 0.0,
        ..settings.clone()
    };
    let along_x = [true, true, false, false, false, false];
    assert_eq!(shaken(&plates, &slippery), along_x);
    // Pushed a hundred times as hard, no friction of so light a squeeze is enough.
    let hard = ShakeSettings {
        acceleration: 980.0,
        ..settings
    };
    assert_eq!(shaken(&plates, &hard), along_x);
}

#[test]
fn one_plate_withstands_one_force_and_nothing_none() {
    let settings = ShakeSettings::default();
    let floor = [plate(2, -1.0, 0.0)];
    let down_alone = [false, false, false, false, false, true];
    let slippery = ShakeSettings {
        friction: 0.0,
        ..settings.clone()
    };
    assert_eq!(shaken(&floor, &slippery), down_alone);
    let far = [box_mesh([1.0, 0.0, 0.0], [0.1; 3])];
    assert_eq!(shaken(&far, &settings), [false; 6]);
}

#[test]
fn an_object_that_turns_or_slips_far_enough_is_lost() {
    // A plate below half of the box alone: the box tips over its edge.
    let half = [box_mesh([0.0, 0.0525, -0.03], [0.15, 0.1, 0.01])];
    let settings = ShakeSettings::default();
    assert!(!shaken(&half, &settings)[5]);
    let patient = ShakeSettings {
        duration: 0.02,
        ..settings.clone()
    };
    // It has not gone far by then; nor has anything.
    assert_eq!(shaken(&half, &patient), [true; 6]);
    // A gap of 2 cm on either side: 2 cm are allowed, 1 cm is not.
    let cage: Vec<_> = (0..3)
        .flat_map(|axis| [plate(axis, 1.0, -0.02), plate(axis, -1.0, -0.02)])
        .collect();
    assert_eq!(shaken(&cage, &settings), [true; 6]);
    let strict = ShakeSettings {
        max_displacement: 0.01,
        ..settings
    };
    assert_eq!(shaken(&cage, &strict), [false; 6]);
}

#[test]
fn shakes_with_nonsense_are_refused() {
    let hand = FixedHand::new(&box_mesh([1.0, 0.0, 0.0], [0.1; 3])).unwrap();
    for bad in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        let settings = ShakeSettings {
            duration: bad,
            ..ShakeSettings::default()
        };
        let message = shake(&box_object(), &hand, &settings, GRASPD).unwrap_err();
        assert!(message.to_string().contains("`duration`"), "{message}");
    }
}
