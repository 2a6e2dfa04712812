//! Fitting a hand's skin to an object.

use graspd::Validate;
use graspd::{
    ExecutionSettings, GraspObject, NamedMesh, RunSettings, SynthesisSettings, draw_start,
    synthesize_grasps,
};
use graspd_eval::{
    Contact, EpsilonSettings, EvaluationSettings, FingerModel, ferrari_canny,
    interpenetration_volume_cm3, largest_radius,
};
use graspd_fit::{DepthSettings, FitStage, HandFitter, SkinFitSettings, SkinSamples, fit_hand};
use graspd_geom::SignedDistance;
use graspd_hand::{Hand, HandPose, SkinnedHandOptions, human};

use crate::fixtures::{CAN, HAND};

/// Few points and iterations, for tests that need no good grasp.
/// A closure at which nothing is discounted.
const FIRM: f64 = 1.0;

fn quick() -> SkinFitSettings {
    let default = SkinFitSettings::default();
    SkinFitSettings {
        candidates: 2,
        coarse_samples: 300,
        fine_samples: 600,
        coarse_medial_spheres: 300,
        fine_medial_spheres: 700,
        soft: DepthSettings {
            projection_samples: 20_000,
            check_samples: 20_000,
            ..default.soft
        },
        rigid: DepthSettings {
            projection_samples: 20_000,
            check_samples: 40_000,
            ..default.rigid
        },
        ..default
    }
}

fn with_iterations(stage: &FitStage, iterations: usize) -> FitStage {
    FitStage {
        iterations,
        ..stage.clone()
    }
}

fn start(hand: &dyn Hand, index: usize) -> HandPose {
    draw_start(&CAN, hand, &SynthesisSettings::default(), 0, index).expect("it has a surface")
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
            let fitted = fit_hand(hand, CAN.simulated.sdf(), &start, &settings).unwrap();
            let rating = fitter.rating(&fitted, FIRM);
            *area = fitted.contact_area;
            assert!(fitted.deepest < DEEPEST, "{}", fitted.deepest);
            assert!(fitted.cost < 0.0 && fitted.cost <= rating && rating < 0.0);
            assert!(
                (0.0..1.0).contains(&fitted.imbalance),
                "{}",
                fitted.imbalance
            );
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
    let sdf = CAN.simulated.sdf();
    let touching = fitter.coarse(sdf, &start(&*HAND, 0)).pose;
    // 4 mm towards the middle of the can.
    let inwards = CAN.simulated.center_of_mass() - touching.translation;
    let mut deep = touching;
    deep.translation += inwards.normalize_or_zero() * 4e-3;
    // No iterations: only looked at.
    let idle = SkinFitSettings {
        draw_in: with_iterations(&settings.draw_in, 0),
        push_out: with_iterations(&settings.push_out, 0),
        ..settings.clone()
    };
    let before = HandFitter::new(&*HAND, &idle).unwrap().fine(sdf, &deep);
    assert_eq!(before.pose, deep);
    let after = fitter.fine(sdf, &deep);
    assert!(before.deepest > 3e-3, "{}", before.deepest);
    assert!(after.deepest < DEEPEST, "{}", after.deepest);
}

#[test]
fn the_projection_bounds_the_depth_and_keeps_the_contact() {
    let settings = quick();
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let sdf = CAN.simulated.sdf();
    let idle = SkinFitSettings {
        projection: with_iterations(&settings.projection, 0),
        depenetration_iterations: 0,
        ..settings.clone()
    };
    let idle = HandFitter::new(&*HAND, &idle).unwrap();
    // The most promising of several starts, as grasps are made.
    let coarse = (0..8).map(|index| fitter.coarse(sdf, &start(&*HAND, index)));
    let best = coarse.min_by(|a, b| fitter.rating(a, FIRM).total_cmp(&fitter.rating(b, FIRM)));
    let fitted = fitter.fine(sdf, &best.expect("eight").pose);
    // As deep as it is, seen by many points and by the mesh instead of a coarse grid.
    let before = idle.project(sdf, &CAN.distance, &fitted.pose);
    assert_eq!(before.pose, fitted.pose);
    assert!(!fitter.is_shallow(&before), "{}", before.deepest);
    let after = fitter.project(sdf, &CAN.distance, &fitted.pose);
    assert!(
        after.deepest < 0.5 * before.deepest,
        "{} {}",
        after.deepest,
        before.deepest
    );
    // On so coarse a grid single hands keep anything from 0.3 to 0.8 of their contact: what a fit knows of the surface
    // has to be nearly right for the projection to keep it.
    let source = NamedMesh::load("can", 1.0).unwrap();
    let can = GraspObject::prepare(source, 96, 1000.0, &|_| {}).unwrap();
    let sdf = can.simulated.sdf();
    // And so has the fit to be: from 3 mm deep no hand comes back with its contact.
    let settings = SkinFitSettings {
        fine_samples: 3000,
        fine_medial_spheres: 3000,
        ..settings
    };
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let idle = SkinFitSettings {
        projection: with_iterations(&settings.projection, 0),
        depenetration_iterations: 0,
        ..settings.clone()
    };
    let idle = HandFitter::new(&*HAND, &idle).unwrap();
    let (mut area_before, mut area_after) = (0.0, 0.0);
    for index in 0..4 {
        let fitted = fitter.fine(sdf, &fitter.coarse(sdf, &start(&*HAND, index)).pose);
        let before = idle.project(sdf, &can.distance, &fitted.pose);
        let after = fitter.project(sdf, &can.distance, &fitted.pose);
        area_before += before.contact_area;
        area_after += after.contact_area;
    }
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
        for stage in [
            &mut settings.approach,
            &mut settings.contact,
            &mut settings.draw_in,
            &mut settings.push_out,
            &mut settings.projection,
        ] {
            stage.medial_weight *= factor;
        }
        let fitter = HandFitter::new(&*HAND, &settings).unwrap();
        let sdf = bowl.simulated.sdf();
        let volumes = (0..2).map(|index| {
            let start = draw_start(&bowl, &*HAND, &SynthesisSettings::default(), 0, index).unwrap();
            let fitted = fitter.fine(sdf, &fitter.coarse(sdf, &start).pose);
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
    let fit = || fit_hand(&*HAND, CAN.simulated.sdf(), &beyond, &settings).unwrap();
    let (once, again) = (fit(), fit());
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
    let fitted = fit_hand(&*HAND, CAN.simulated.sdf(), &far, &settings).unwrap();
    assert_eq!(fitted.pose.translation, far.translation);
    assert_eq!((fitted.contact_area, fitted.deepest), (0.0, 0.0));
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    assert_eq!(
        (fitted.imbalance, fitter.rating(&fitted, FIRM)),
        (1.0, fitted.cost)
    );
}

#[test]
fn a_hand_that_closes_its_grasp_is_rated_above_one_that_leans() {
    let settings = quick();
    let fitter = HandFitter::new(&*HAND, &settings).unwrap();
    let sdf = CAN.simulated.sdf();
    let closure = |fitted| {
        // A few of them, as the pipeline takes.
        let contacts = fitter.contacts(sdf, fitted);
        let step = contacts.len().div_ceil(24).max(1);
        let contacts: Vec<_> = contacts
            .into_iter()
            .step_by(step)
            .map(|[point, normal]| Contact {
                point: point.into(),
                normal,
            })
            .collect();
        if contacts.is_empty() {
            return 0.0;
        }
        let center = CAN.simulated.center_of_mass().into();
        let scale = largest_radius(&CAN.source.mesh.vertices, center);
        let wrenches = FingerModel::hard(0.8, 6).wrenches(&contacts, center, scale);
        ferrari_canny(&wrenches, &EpsilonSettings::sum())
            .unwrap()
            .value
    };
    let fitted: Vec<_> = (0..8)
        .map(|index| fitter.coarse(sdf, &start(&*HAND, index)))
        .collect();
    let firmest = (fitted.iter()).max_by(|a, b| closure(a).total_cmp(&closure(b)));
    let firmest = firmest.expect("eight");
    assert!(closure(firmest) > 0.1, "{}", closure(firmest));
    // Pulled back, so that it touches nothing.
    let mut away = firmest.clone();
    away.pose.translation.x += 1.0;
    assert_eq!(closure(&away), 0.0);
    assert!(firmest.cost < 0.0);
    let loose = fitter.rating(firmest, 0.0);
    let rating = fitter.rating(firmest, closure(firmest));
    assert!(rating < loose && loose < 0.0, "{rating} {loose}");
    assert_eq!(
        loose,
        (1.0 - settings.closure_discount) * fitter.rating(firmest, FIRM)
    );
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
    let wrong = [
        (
            "candidates",
            SkinFitSettings {
                candidates: 0,
                ..default.clone()
            },
        ),
        (
            "coarse_samples",
            SkinFitSettings {
                coarse_samples: 0,
                ..default.clone()
            },
        ),
        (
            "fine_samples",
            SkinFitSettings {
                fine_samples: 1 << 30,
                ..default.clone()
            },
        ),
        (
            "approach.end_reach",
            SkinFitSettings {
                approach: FitStage {
                    end_reach: 0.0,
                    ..default.approach.clone()
                },
                ..default.clone()
            },
        ),
        (
            "skin_fit.target_depth",
            SkinFitSettings {
                target_depth: -1.0,
                ..default.clone()
            },
        ),
        (
            "soft.max_depth",
            SkinFitSettings {
                soft: DepthSettings {
                    max_depth: 0.0,
                    ..default.soft.clone()
                },
                ..default.clone()
            },
        ),
        (
            "rigid.max_depth",
            SkinFitSettings {
                rigid: DepthSettings {
                    max_depth: f64::NAN,
                    ..default.rigid.clone()
                },
                ..default.clone()
            },
        ),
        (
            "depth_scale",
            SkinFitSettings {
                depth_scale: 0.0,
                ..default.clone()
            },
        ),
        (
            "contact.depth_weight",
            SkinFitSettings {
                contact: FitStage {
                    depth_weight: -1.0,
                    ..default.contact.clone()
                },
                ..default.clone()
            },
        ),
        (
            "projection.medial_weight",
            SkinFitSettings {
                projection: FitStage {
                    medial_weight: f64::NAN,
                    ..default.projection.clone()
                },
                ..default.clone()
            },
        ),
        (
            "fine_medial_spheres",
            SkinFitSettings {
                fine_medial_spheres: 0,
                ..default.clone()
            },
        ),
        (
            "rigid.depth_limit",
            SkinFitSettings {
                rigid: DepthSettings {
                    depth_limit: 1e-4,
                    ..default.rigid.clone()
                },
                ..default.clone()
            },
        ),
        (
            "imbalance_discount",
            SkinFitSettings {
                imbalance_discount: 1.5,
                ..default.clone()
            },
        ),
        (
            "finalists",
            SkinFitSettings {
                finalists: 0,
                ..default.clone()
            },
        ),
        (
            "closure_discount",
            SkinFitSettings {
                closure_discount: 1.1,
                ..default.clone()
            },
        ),
        (
            "firm_closure",
            SkinFitSettings {
                firm_closure: 0.0,
                ..default.clone()
            },
        ),
        (
            "posture_weight",
            SkinFitSettings {
                posture_weight: -1.0,
                ..default.clone()
            },
        ),
        (
            "intersection_weight",
            SkinFitSettings {
                intersection_weight: f64::INFINITY,
                ..default
            },
        ),
    ];
    for (field, skin_fit) in wrong {
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
            projection: with_iterations(&quick().projection, projection_iterations),
            depenetration_iterations: projection_iterations,
            ..quick()
        }),
        ..SynthesisSettings::default().with_steps(50)
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
