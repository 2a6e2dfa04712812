//! A recorded optimisation: a hand that reaches a mug and grasps it.

use std::sync::LazyLock;

use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_ad::{Element, Real};
use graspd_hand::{ArticulatedHand, HandOptions, HandPose, POINT_PADDING, allegro};
use graspd_opt::AdamaxIteration;
use graspd_sim::TargetRule;

/// Samples of the mug's distance grid along each axis.
const RESOLUTION: usize = 64;
/// Density of the mug \[kg/m^3\].
const DENSITY: f64 = 1000.0;
/// Steps of a short optimisation, and of one as `graspd synth` makes it.
const SHORT: usize = 400;
const WHOLE: usize = 7000;

pub(crate) static HAND: LazyLock<ArticulatedHand> = LazyLock::new(|| {
    allegro(&HandOptions {
        contact_points: 1000,
        collision_spheres: 0,
        ..HandOptions::default()
    })
    .expect("these options are in range")
});

pub(crate) static MUG: LazyLock<GraspObject> = LazyLock::new(|| {
    let source = NamedMesh::load("mug", 1.0).expect("a built-in object");
    GraspObject::prepare(source, RESOLUTION, DENSITY, &|_| {}).expect("it has a volume")
});

pub(crate) struct Trajectory {
    pub(crate) settings: SynthesisSettings,
    pub(crate) poses: Vec<HandPose>,
}

pub(crate) static TRAJECTORY: LazyLock<Trajectory> = LazyLock::new(|| recorded(SHORT));
pub(crate) static WHOLE_TRAJECTORY: LazyLock<Trajectory> = LazyLock::new(|| recorded(WHOLE));

fn recorded(steps: usize) -> Trajectory {
    // Without dilation and at the final stiffness throughout: a scene as it is made.
    let settings = SynthesisSettings {
        smoothing_steps: 0,
        soft_stiffness: SynthesisSettings::soft().normal_stiffness,
        ..SynthesisSettings::soft().with_steps(steps)
    };
    let start = draw_start(&MUG, &*HAND, &settings, 0, 0).expect("it has a surface");
    let mut poses = Vec::new();
    let mut observe = |_: usize, pose: &HandPose, _: &_| poses.push(pose.clone());
    synthesize::<f32>(&*HAND, &MUG.simulated, start, &settings, &mut observe)
        .expect("the settings are valid");
    Trajectory { settings, poses }
}

/// Adamax as the rule by which targets move.
pub(crate) struct AdamaxRule<'a, E>(pub(crate) AdamaxIteration<'a, E>);

impl<E: Element> TargetRule<E> for AdamaxRule<'_, E> {
    #[inline(always)]
    fn update<T: Real<Element = E>>(&mut self, first: usize, gradient: [T; 6]) -> [T; 6] {
        self.0.update(first, POINT_PADDING, gradient)
    }
    #[inline(always)]
    fn inherit<T: Real<Element = E>>(&mut self, from: usize, to: usize) {
        self.0.inherit::<T, 6>(from, to, POINT_PADDING);
    }
}
