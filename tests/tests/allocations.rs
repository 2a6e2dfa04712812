//! Steps of a synthesis and iterations of a fit allocate nothing, once the buffers are there.
//!
//! Alone in its program: the counter sees all threads.

use std::alloc::System;

use graspd::{GraspObject, Losses, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_fit::{DepthSettings, HandFitter, SkinFitSettings};
use graspd_hand::{Hand, HandOptions, HandPose, Kinematics, MirroredHand, allegro, builtin_hand};
use graspd_sim::Precision;
use stats_alloc::{INSTRUMENTED_SYSTEM, Stats, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const STEPS: usize = 30;

/// What had been allocated when each step was about to move the pose.
fn allocated_by_step<E: Precision>(hand: &dyn Hand, object: &GraspObject) -> Vec<Stats>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    let settings = SynthesisSettings::soft().with_steps(STEPS);
    let start = draw_start(object, hand, &settings, 0, 0).expect("it has a surface");
    let mut allocated = Vec::with_capacity(STEPS);
    let mut observe = |_: usize, _: &HandPose, _: &Losses| allocated.push(ALLOCATOR.stats());
    synthesize::<E>(hand, &object.simulated, start, &settings, &mut observe)
        .expect("the settings are valid");
    allocated
}

/// The same of the second-order solver's iterations.
fn allocated_by_iteration(hand: &dyn Hand, object: &GraspObject) -> Vec<Stats> {
    let settings = SkinFitSettings {
        coarse_samples: 200,
        fine_samples: 400,
        // The hand's own vertices, which come on top, are enough.
        soft: DepthSettings {
            dense_samples: 1,
            ..SkinFitSettings::default().soft
        },
        rigid: DepthSettings {
            dense_samples: 1,
            ..SkinFitSettings::default().rigid
        },
        ..SkinFitSettings::default()
    };
    let fitter = HandFitter::new(hand, &settings).expect("the hand is closed");
    let start = draw_start(object, hand, &SynthesisSettings::default(), 0, 0).expect("a surface");
    let mut allocated = Vec::with_capacity(settings.iterations);
    let mut observe = |_: usize, _: &HandPose| allocated.push(ALLOCATOR.stats());
    fitter.fit(object.simulated.sdf(), &start, &mut observe);
    allocated
}

// One test: another one's allocations would be counted, too.
#[test]
fn steps_and_iterations_allocate_nothing() {
    let options = HandOptions {
        contact_points: 300,
        collision_spheres: 30,
        ..HandOptions::default()
    };
    let rigid = allegro(&options).expect("these options are in range");
    let soft = builtin_hand("human").expect("it is built in");
    let mirrored = MirroredHand::new(builtin_hand("human").expect("it is built in"));
    let source = NamedMesh::load("can", 1.0).expect("a built-in object");
    let object = GraspObject::prepare(source, 32, 1000.0, &|_| {}).expect("it has a volume");
    let hands: [&dyn Hand; 3] = [&rigid, &*soft, &mirrored];
    for hand in hands {
        for allocated in [
            allocated_by_step::<f32>(hand, &object),
            allocated_by_step::<f64>(hand, &object),
        ] {
            assert!(allocated[10].allocations > 0, "the counter counts");
            for step in 10..20 {
                let (before, after) = (allocated[step], allocated[step + 1]);
                assert_eq!(before, after, "{} in step {step}", hand.name());
            }
        }
        let allocated = allocated_by_iteration(hand, &object);
        // The last five have the fine samples; by then all memory is there.
        for last in allocated[allocated.len() - 5..].windows(2) {
            assert_eq!(last[0], last[1], "{} in an iteration", hand.name());
        }
    }
}
