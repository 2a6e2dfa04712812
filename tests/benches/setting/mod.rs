//! What benchmarks of the synthesis have in common: a hand that has reached an object.

use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_ad::Instructions;
use graspd_hand::{Hand, HandPose, Kinematics, SkinnedHand, SkinnedHandOptions, builtin_hand};
use graspd_sim::{Precision, Scene, SimulationParams};

#[path = "../../../crates/graspd-hand/tests/mano/synthetic.rs"]
#[allow(dead_code)] // The tests of the hands use more of it.
mod synthetic;

/// Samples of the mug's distance grid along each axis.
pub(crate) const GRID: usize = 128;
/// Steps after which the hand is at the object.
const APPROACH_STEPS: usize = 700;
/// Density of the objects \[kg/m^3\].
const DENSITY: f64 = 1000.0;

/// Which hand.
#[derive(Clone, Copy)]
#[allow(dead_code)] // Not every benchmark uses all.
pub(crate) enum Subject {
    /// A built-in hand.
    Builtin(&'static str),
    /// A made-up model with the sizes of MANO's arrays, all pose blendshapes present or none.
    Skinned { has_blendshapes: bool },
}

impl Subject {
    fn hand(self) -> Box<dyn Hand> {
        match self {
            Self::Builtin(name) => builtin_hand(name).expect("it is built in"),
            Self::Skinned { has_blendshapes } => {
                let mut model = synthetic::model(1);
                if !has_blendshapes {
                    model.pose_directions = None;
                }
                let hand = SkinnedHand::new(model, &SkinnedHandOptions::default());
                Box::new(hand.expect("the model is sound"))
            }
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Builtin(name) => name,
            Self::Skinned {
                has_blendshapes: true,
            } => "skin with blendshapes",
            Self::Skinned {
                has_blendshapes: false,
            } => "skin without blendshapes",
        }
    }
}

/// A hand at an object.
pub(crate) struct Setting {
    pub(crate) name: &'static str,
    pub(crate) hand: Box<dyn Hand>,
    pub(crate) object: GraspObject,
    pub(crate) settings: SynthesisSettings,
    pub(crate) simulation: SimulationParams,
    pub(crate) pose: HandPose,
}

impl Setting {
    /// The Allegro hand.
    #[allow(dead_code)]
    pub(crate) fn new() -> Self {
        Self::of(Subject::Builtin("allegro"))
    }

    pub(crate) fn of(subject: Subject) -> Self {
        let hand = subject.hand();
        let object = object("mug", GRID);
        let approach = SynthesisSettings::paper().with_steps(APPROACH_STEPS);
        let start = draw_start(&object, &*hand, &approach, 0, 0).expect("it has a surface");
        let reached = synthesize::<f32>(
            &*hand,
            &object.simulated,
            start,
            &approach,
            &mut |_, _, _| {},
        );
        // From here on as at the end of a run: constant rates, the object undilated.
        let settings = SynthesisSettings {
            smoothing_steps: 0,
            ..SynthesisSettings::paper()
        };
        Self {
            name: subject.name(),
            simulation: settings.simulation(),
            pose: reached.expect("the preset is valid").pose,
            hand,
            object,
            settings,
        }
    }

    /// Hand and counts, as names of benchmarks give them.
    pub(crate) fn size(&self) -> String {
        let contacts = self.hand.contact_points().count;
        let velocities = self.simulation.velocities.len();
        let name = self.name;
        format!("{name} {contacts} contacts x {velocities} velocities, mug {GRID}^3")
    }

    pub(crate) fn scene<E: Precision>(&self) -> Scene<'_, E>
    where
        for<'h> dyn Hand + 'h: Kinematics<E>,
    {
        let mut scene = Scene::new(&*self.hand, &self.object.simulated, &self.simulation);
        scene.place(&self.pose);
        scene
    }
}

pub(crate) fn object(name: &str, resolution: usize) -> GraspObject {
    let source = NamedMesh::load(name, 1.0).expect("it is built in");
    GraspObject::prepare(source, resolution, DENSITY, &|_| {}).expect("it has a volume")
}

/// The instructions that contacts are evaluated with in single precision.
pub(crate) fn fast_backend() -> String {
    format!("f32 {}", Instructions::in_use().name())
}
