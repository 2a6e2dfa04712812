//! Fitting a hand's skin to an object.

use graspd::Validate;
use graspd::{
    ExecutionSettings, GraspObject, NamedMesh, RunSettings, SynthesisSettings, draw_start,
    synthesize_grasps,
};
use graspd_eval::{EvaluationSettings, interpenetration_volume_cm3};
use graspd_fit::{DepthSettings, FittedHand, HandFitter, SkinFitSettings, SkinSamples};
use graspd_geom::SignedDistance;
use graspd_hand::{Hand, HandPose, SkinnedHandOptions, human};

use crate::fixtures::{CAN, HAND};

/// Friction of the contacts by which fits are rated.
const FRICTION: f64 = 0.8;

/// Few points, for tests that need no good grasp.
fn quick() -> SkinFitSettings {
    let default = SkinFitSettings::default();
    SkinFitSettings {
        candidates: 2,
        coarse_samples: 300,
        fine_samples: 600,
        soft: DepthSettings {
            dense_samples: 20_000,
            ..default.soft
        },
        rigid: DepthSettings {
            dense_samples: 40_000,
            ..default.rigid
        },
        ..default
    }
}

/// The same without iterations: hands are only looked at.
fn idle(settings: &SkinFitSettings) -> SkinFitSettings {
    SkinFitSettings {
        iterations: 0,
        projection_iterations: 0,
        ..settings.clone()
    }
}

fn start(hand: &dyn Hand, index: usize) -> HandPose {
    draw_start(&CAN, hand, &SynthesisSettings::default(), 0, index).expect("it has a surface")
}

fn fit(fitter: &HandFitter<'_>, object: &GraspObject, start: &HandPose) -> FittedHand {
    fitter.fit(object.simulated.sdf(), start, &mut |_, _| {})
}

fn refine(fitter: &HandFitter<'_>, pose: &HandPose) -> FittedHand {
    fitter.refine(CAN.simulated.sdf(), pose, &mut |_, _| {})
}

fn is_within_limits(hand: &dyn Hand, pose: &HandPose) -> bool {
    let limits = hand.limits().expect("this hand has limits");
    let mut joints = pose.articulation.iter().zip(limits);
    joints.all(|(value, limit)| limit.contains(*value))
}

#[test]
fn hands_from_afar_wrap_the_object_and_stay_within_their_limits() {
    /// The grid of 32 samples a side cuts corners by some tenths of a millimetre, and so do 600 points.
    const DEEPEST: f64 = 2.5e-3;
    let human = human(&SkinnedHandOptions::default()).expect("the options are in range");
    // A tenth of the surface of a hand is a third of what can touch.
    let settings = quick();
    for (hand, least_area) in [(&*HAND as &dyn Hand, 10e-4), (&human, 10e-4)] {
        let fitter = HandFitter::new(hand, &settings).unwrap();
        // Single starts end anywhere from 3 to 25 cm^2.
        let mut areas = [0.0; 4];
        for (index, area) in areas.iter_mut().enumerate() {
            let start = start(hand, index);
            let fitted = fit(&fitter, &CAN, &start);
            let rating = fitter.rating(&CAN.simulated, &fitted, FRICTION);
            *area = fitted.contact_area;
            assert!(fitted.deepest < DEEPEST, "{}", fitted.deepest);
            assert!(fitted.cost < 0.0 && fitted.cost <= rating && rating <= 0.0);
            assert!(is_within_limits(hand, &fitted.pose));
            let q = fitted.pose.rotation;
            let norm = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
            assert!((norm - 1.0).abs() < 1e-12);
        }
        let mean = areas.iter().sum::<f64>() / 4.0;
        assert!(mean > least_area, "{areas:?}");
    }
}

#[test]
fn a_deep_hand_is_pushed_out() {
    /// As above.
    const DEEPEST: f64 = 2.5e-3;
    let settings = quick();
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let touching = fit(&fitter, &CAN, &start(&*HAND, 0)).pose;
    // 4 mm towards the middle of the can.
    let inwards = CAN.simulated.center_of_mass() - touching.translation;
    let mut deep = touching;
    deep.translation += inwards.normalize_or_zero() * 4e-3;
    let looked_at = idle(&settings);
    let before = refine(&HandFitter::new(&*HAND, &looked_at).unwrap(), &deep);
    assert_eq!(before.pose, deep);
    let after = refine(&fitter, &deep);
    assert!(before.deepest > 3e-3, "{}", before.deepest);
    assert!(after.deepest < DEEPEST, "{}", after.deepest);
}

#[test]
fn the_projection_bounds_the_depth_and_keeps_the_contact() {
    // What a fit knows of the surface has to be nearly right for the projection to keep its contact.
    let source = NamedMesh::load("can", 1.0).unwrap();
    let can = GraspObject::prepare(source, 96, 1000.0, &|_| {}).unwrap();
    let sdf = can.simulated.sdf();
    let settings = SkinFitSettings {
        fine_samples: 3000,
        ..quick()
    };
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let looked_at = idle(&settings);
    let idle_fitter = HandFitter::new(&*HAND, &looked_at).unwrap();
    let (mut shallow_before, mut shallow_after) = (0, 0);
    let (mut area_before, mut area_after) = (0.0, 0.0);
    for index in 0..8 {
        let fitted = fit(&fitter, &can, &start(&*HAND, index));
        // As deep as it is, seen by many points and by the mesh instead of a grid.
        let before = idle_fitter.project(sdf, &can.distance, &fitted.pose);
        assert_eq!(before.pose, fitted.pose);
        let after = fitter.project(sdf, &can.distance, &fitted.pose);
        shallow_before += usize::from(fitter.is_shallow(&before));
        shallow_after += usize::from(fitter.is_shallow(&after));
        area_before += before.contact_area;
        area_after += after.contact_area;
    }
    // Others hold on by the can's thin rim; in a synthesis the next candidate takes their place.
    assert!(
        shallow_before == 0 && shallow_after >= 4,
        "{shallow_before} {shallow_after}"
    );
    assert!(area_after > 0.5 * area_before, "{area_after} {area_before}");
}

#[test]
fn walls_do_not_cut_into_fingers() {
    let source = NamedMesh::load("bowl", 1.0).unwrap();
    let bowl = GraspObject::prepare(source, 64, 1000.0, &|_| {}).unwrap();
    let judge = SignedDistance::new(&bowl.source.mesh).unwrap();
    // How much of the object is inside the hand, with and without the medial spheres [cm^3].
    let volume = |factor: f64| {
        let mut settings = quick();
        settings.medial_weight *= factor;
        let fitter = HandFitter::new(&*HAND, &settings).unwrap();
        let volumes = (0..2).map(|index| {
            let start = draw_start(&bowl, &*HAND, &SynthesisSettings::default(), 0, index).unwrap();
            let fitted = fit(&fitter, &bowl, &start);
            let hand = SignedDistance::new(&HAND.surface(&fitted.pose)).unwrap();
            interpenetration_volume_cm3(&hand, &judge, 1.5e-3)
        });
        volumes.sum::<f64>()
    };
    let (without, with) = (volume(0.0), volume(1.0));
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn the_same_fit_gives_the_same_bits_and_starts_beyond_the_limits_are_taken_in() {
    let settings = quick();
    let mut beyond = start(&*HAND, 1);
    beyond.articulation.fill(9.0);
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let (once, again) = (fit(&fitter, &CAN, &beyond), fit(&fitter, &CAN, &beyond));
    assert_eq!(once.pose, again.pose);
    assert_eq!(once.cost, again.cost);
    assert!(is_within_limits(&*HAND, &once.pose));
}

#[test]
fn a_hand_out_of_reach_stays_where_it_is() {
    let mut far = start(&*HAND, 0);
    far.translation.x += 50.0;
    // No preference of posture either.
    let settings = SkinFitSettings {
        posture_weight: 0.0,
        ..quick()
    };
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let fitted = fit(&fitter, &CAN, &far);
    assert_eq!(fitted.pose.translation, far.translation);
    assert_eq!((fitted.contact_area, fitted.deepest), (0.0, 0.0));
    assert_eq!(
        fitter.rating(&CAN.simulated, &fitted, FRICTION),
        fitted.cost
    );
}

#[test]
fn a_hand_that_closes_its_grasp_is_rated_above_one_that_leans() {
    let settings = quick();
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let rating = |fitted: &FittedHand, friction| fitter.rating(&CAN.simulated, fitted, friction);
    // What the forces leave of a motion, by the discount.
    let motion = |fitted: &FittedHand| 1.0 - rating(fitted, FRICTION) / fitted.cost;
    let fits: Vec<_> = (0..8)
        .map(|index| fit(&fitter, &CAN, &start(&*HAND, index)))
        .collect();
    let firmest = (fits.iter()).min_by(|a, b| motion(a).total_cmp(&motion(b)));
    let firmest = firmest.expect("eight");
    assert!(motion(firmest) < 0.7, "{}", motion(firmest));
    // Without friction no hand holds a can along its axis.
    let (firm, slippery) = (rating(firmest, FRICTION), rating(firmest, 0.0));
    assert!(
        firmest.cost < firm && firm < slippery && slippery <= 0.0,
        "{firm} {slippery}"
    );
    // Pulled back, so that it touches nothing: all motion remains.
    let mut away = firmest.clone();
    away.pose.translation.x += 1.0;
    assert!((motion(&away) - 1.0).abs() < 1e-9, "{}", motion(&away));
}

#[test]
fn the_force_step_stops_an_object_that_is_held() {
    let settings = quick();
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let simulation = SynthesisSettings::default().simulation();
    let limit = SynthesisSettings::default().task_limit;
    let task = |pose: &HandPose| {
        let targets = fitter.force_step(&CAN.simulated, &simulation, pose, limit);
        assert_eq!(targets.len(), simulation.velocities.len());
        targets.iter().map(|target| target.task).sum::<f64>()
    };
    let least = (0..8).map(|index| task(&fit(&fitter, &CAN, &start(&*HAND, index)).pose));
    assert!(least.fold(f64::INFINITY, f64::min) < limit);
    let mut away = start(&*HAND, 0);
    away.translation.x += 1.0;
    let speeds = simulation
        .velocities
        .iter()
        .map(|twist| twist.linear.norm_squared());
    assert!((task(&away) - speeds.sum::<f64>()).abs() < 1e-12);
}

#[test]
fn samples_are_spread_over_the_outer_surface() {
    let samples = SkinSamples::new(&*HAND, 500).unwrap();
    assert!(!samples.is_empty() && samples.len() < 500, "links overlap");
    let surface = HAND.surface(&start(&*HAND, 0)).area();
    let sampled = samples.len() as f64 * samples.area();
    assert!((0.3..1.0).contains(&(sampled / surface)));
}

#[test]
fn settings_out_of_range_are_named() {
    let default = SkinFitSettings::default();
    default.validate().unwrap();
    type Change = fn(&mut SkinFitSettings);
    let wrong: [(&str, Change); 14] = [
        ("candidates", |s| s.candidates = 0),
        ("promising", |s| s.promising = 0),
        ("start_smoothing", |s| s.start_smoothing = 1e-4),
        ("end_smoothing", |s| s.end_smoothing = 0.0),
        ("coarse_samples", |s| s.coarse_samples = 0),
        ("fine_samples", |s| s.fine_samples = 1 << 30),
        ("tail", |s| s.tail = -1.0),
        ("posture_weight", |s| s.posture_weight = -1.0),
        ("intersection_weight", |s| {
            s.intersection_weight = f64::INFINITY;
        }),
        ("medial_weight", |s| s.medial_weight = f64::NAN),
        ("soft.target_depth", |s| s.soft.target_depth = 0.0),
        ("soft.depth_limit", |s| s.soft.depth_limit = 1e-4),
        ("rigid.depth_limit", |s| s.rigid.depth_limit = f64::NAN),
        ("rigid.dense_samples", |s| s.rigid.dense_samples = 0),
    ];
    for (field, change) in wrong {
        let mut skin_fit = default.clone();
        change(&mut skin_fit);
        let settings = SynthesisSettings {
            skin_fit: Some(skin_fit),
            ..SynthesisSettings::default()
        };
        let fault = settings.validate().unwrap_err().to_string();
        assert!(fault.contains(field), "{field}: {fault}");
    }
}

#[test]
fn grasps_of_the_default_preset_do_not_depend_on_threads() {
    let settings = |projection_iterations| SynthesisSettings {
        skin_fit: Some(SkinFitSettings {
            candidates: 4,
            projection_iterations,
            ..quick()
        }),
        ..SynthesisSettings::default()
    };
    let run = RunSettings {
        seed: 3,
        count: 2,
        trajectory_every: None,
        execution: ExecutionSettings::default(),
        evaluation: EvaluationSettings {
            metrics: "ca,pd".parse().unwrap(),
            ..EvaluationSettings::default()
        },
    };
    let on = |threads, settings: &SynthesisSettings| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let run = || synthesize_grasps(&CAN, &*HAND, settings, &run, &()).unwrap();
        pool.unwrap().install(run)
    };
    let projected = settings(3);
    let (one, two) = (on(1, &projected), on(2, &projected));
    for (a, b) in one.iter().zip(&two) {
        assert_eq!((&a.pose, &a.record.metrics), (&b.pose, &b.record.metrics));
    }
    // The projection costs contact, and on so coarse a grid much of it: the area is that before it.
    let fitted = settings(0);
    let (one, two) = (on(1, &fitted), on(2, &fitted));
    assert_eq!(one.len(), 2);
    for (a, b) in one.iter().zip(&two) {
        assert_eq!(a.pose, b.pose);
        assert_eq!(a.record.metrics, b.record.metrics);
        let area = a.record.metrics.as_ref().unwrap().contact_area_cm2.unwrap();
        assert!(area > 5.0, "{area}");
    }
    assert_ne!(one[0].pose, one[1].pose);
}
