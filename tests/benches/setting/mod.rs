//! What benchmarks of the synthesis have in common: a hand that has reached an object.

use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start, synthesize};
use graspd_hand::{Hand, HandPose, Kinematics, builtin_hand};
use graspd_sim::{Precision, Scene, SimulationParams};

/// Samples of the mug's distance grid along each axis.
pub(crate) const GRID: usize = 128;
/// Steps after which the hand is at the object.
const APPROACH_STEPS: usize = 700;
/// Density of the objects \[kg/m^3\].
const DENSITY: f64 = 1000.0;

/// A hand at an object.
pub(crate) struct Setting {
    pub(crate) hand: Box<dyn Hand>,
    pub(crate) object: GraspObject,
    pub(crate) settings: SynthesisSettings,
    pub(crate) simulation: SimulationParams,
    pub(crate) pose: HandPose,
}

impl Setting {
    pub(crate) fn new() -> Self {
        let hand = builtin_hand("allegro").expect("it is built in");
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
        format!("allegro {contacts} contacts x {velocities} velocities, mug {GRID}^3")
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
pub(crate) fn fast_backend() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::is_x86_feature_detected!("avx2") {
            "f32 avx2"
        } else {
            "f32 sse2"
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    "f32 arrays of 8"
}
