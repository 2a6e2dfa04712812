//! Steps of a synthesis allocate nothing, once the buffers are there.
//!
//! Alone in its program: the counter sees all threads.

use std::alloc::System;

use graspd::{GraspObject, Losses, NamedMesh, SynthesisSettings, draw_start, synthesize};
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
    let settings = SynthesisSettings::default().with_steps(STEPS);
    let start = draw_start(object, hand, &settings, 0, 0).expect("it has a surface");
    let mut allocated = Vec::with_capacity(STEPS);
    let mut observe = |_: usize, _: &HandPose, _: &Losses| allocated.push(ALLOCATOR.stats());
    synthesize::<E>(hand, &object.simulated, start, &settings, &mut observe)
        .expect("the settings are valid");
    allocated
}

#[test]
fn steps_allocate_nothing() {
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
    }
}
