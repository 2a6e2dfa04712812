//! The displacement and the shake test as a job for a physics engine outside this program, and what it answers.
//!
//! The protocol is the same: the hand fixed, the object of the same convex pieces and mass properties, the same
//! steps, solver iterations and friction. What an engine makes of them is its own.

use graspd_geom::{SignedDistance, TriangleMesh, connected_parts};
use graspd_settings::Validate;
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::convex_piece::ConvexPiece;
use super::decomposition::{DecompositionSettings, ObjectPieces};
use super::protocol::{DisplacementSettings, SIX_DIRECTIONS};
use crate::report::{GraspMetrics, ObjectUnderTest};
use crate::settings::EvaluationSettings;
use crate::{EvaluationError, ShakeOutcome};

/// Most convex pieces of each connected part of a hand.
const MAX_HAND_PIECES: usize = 128;

/// An object, hands and what is to be simulated with each of them; serialised, the input of an engine.
#[derive(Clone, Debug, Serialize)]
pub struct SimulationJob {
    object: SimulatedObject,
    hands: Vec<SimulatedHand>,
    falls: Vec<SimulatedFall>,
    #[serde(skip)]
    purposes: Vec<Purpose>,
    #[serde(skip)]
    free_fall_cm: f64,
}

#[derive(Clone, Debug, Serialize)]
struct SimulatedObject {
    pieces: Vec<ConvexPiece>,
    /// \[m\]
    center_of_mass: [f64; 3],
    /// About the centre of mass, for 1 kg \[m^2\].
    unit_inertia: [[f64; 3]; 3],
}

#[derive(Clone, Debug, Serialize)]
struct SimulatedHand {
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    /// The same solid as convex pieces; none unless asked for.
    pieces: Vec<ConvexPiece>,
}

/// One simulation.
#[derive(Clone, Debug, Serialize)]
struct SimulatedFall {
    mass: f64,
    gravity: [f64; 3],
    time_step: f64,
    steps: usize,
    solver_iterations: usize,
    friction: f64,
    hand_restitution: f64,
    object_restitution: f64,
    /// Where the object counts as lost and the simulation ends.
    limits: Option<FallLimits>,
}

#[derive(Clone, Debug, Serialize)]
struct FallLimits {
    /// \[m\]
    displacement: f64,
    /// \[rad\]
    rotation: f64,
}

/// Which metric a fall is for.
#[derive(Clone, Copy, Debug)]
enum Purpose {
    Displacement,
    MeanDisplacement,
    Shake(usize),
}

/// What an engine answers.
#[derive(Clone, Debug, Deserialize)]
pub struct SimulationAnswer {
    /// The engine's name and version.
    pub engine: String,
    /// For each hand and each fall, how the object moved.
    motions: Vec<Vec<SimulatedMotion>>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct SimulatedMotion {
    /// \[m\]
    displacement: [f64; 3],
    lost: bool,
    #[serde(default)]
    diverged: bool,
}

impl SimulationJob {
    /// A job without hands, for those of the wanted metrics that are simulated.
    ///
    /// # Errors
    /// A setting out of range.
    pub fn new(
        object: &ObjectUnderTest,
        settings: &EvaluationSettings,
    ) -> Result<Self, EvaluationError> {
        settings.validate()?;
        let inertia = object.unit_inertia();
        let row = |i: usize| [0, 1, 2].map(|j| inertia[(i, j)]);
        let mut job = Self {
            object: SimulatedObject {
                pieces: object.pieces().pieces.clone(),
                center_of_mass: object.center_of_mass().coords.into(),
                unit_inertia: [row(0), row(1), row(2)],
            },
            hands: Vec::new(),
            falls: Vec::new(),
            purposes: Vec::new(),
            free_fall_cm: settings.displacement.free_fall() * 100.0,
        };
        let wanted = &settings.metrics;
        if wanted.displacement {
            job.add_fall(Purpose::Displacement, &settings.displacement, None);
        }
        for (index, direction) in SIX_DIRECTIONS.into_iter().enumerate() {
            if wanted.displacement_mean6 {
                let protocol = DisplacementSettings {
                    gravity_direction: direction,
                    ..settings.displacement.clone()
                };
                job.add_fall(Purpose::MeanDisplacement, &protocol, None);
            }
            if wanted.shake {
                let limits = FallLimits {
                    displacement: settings.shake.max_displacement,
                    rotation: settings.shake.max_rotation,
                };
                let protocol = settings.shake.under(direction);
                job.add_fall(Purpose::Shake(index), &protocol, Some(limits));
            }
        }
        Ok(job)
    }

    fn add_fall(
        &mut self,
        purpose: Purpose,
        protocol: &DisplacementSettings,
        limits: Option<FallLimits>,
    ) {
        let down = Vector3::from(protocol.gravity_direction).normalize() * protocol.gravity;
        self.purposes.push(purpose);
        self.falls.push(SimulatedFall {
            mass: protocol.mass,
            gravity: down.into(),
            time_step: protocol.time_step,
            steps: protocol.steps,
            solver_iterations: protocol.solver_iterations,
            friction: protocol.friction,
            hand_restitution: protocol.hand_restitution,
            object_restitution: protocol.object_restitution,
            limits,
        });
    }

    /// Whether none of the wanted metrics is simulated.
    pub fn is_empty(&self) -> bool {
        self.falls.is_empty()
    }

    /// Adds a posed hand, in the object's frame.
    ///
    /// `as_pieces`: also as convex pieces, for engines that know no concave meshes: each of the connected parts is
    /// decomposed as an object is.
    ///
    /// # Errors
    /// [`EvaluationError::BadMesh`] if `as_pieces` and a part of the hand is not closed.
    pub fn add_hand(
        &mut self,
        hand: &TriangleMesh,
        as_pieces: bool,
    ) -> Result<(), EvaluationError> {
        let pieces = if as_pieces {
            convex_parts(hand)?
        } else {
            Vec::new()
        };
        self.hands.push(SimulatedHand {
            vertices: hand.vertices.iter().map(|p| p.coords.into()).collect(),
            faces: hand.faces.clone(),
            pieces,
        });
        Ok(())
    }

    /// Writes what the engine found for hand `index` into its metrics.
    ///
    /// # Errors
    /// [`EvaluationError::BadAnswer`] if the answer does not belong to this job.
    pub fn fill(
        &self,
        answer: &SimulationAnswer,
        index: usize,
        metrics: &mut GraspMetrics,
    ) -> Result<(), EvaluationError> {
        let motions = answer.motions.get(index);
        let motions = motions.filter(|motions| motions.len() == self.purposes.len());
        let motions = motions.ok_or(EvaluationError::BadAnswer { hand: index })?;
        let mut six = Vec::new();
        let mut withstood = None::<ShakeOutcome>;
        for (motion, purpose) in motions.iter().zip(&self.purposes) {
            let moved = if motion.diverged {
                self.free_fall_cm
            } else {
                Vector3::from(motion.displacement).norm() * 100.0
            };
            match purpose {
                Purpose::Displacement => metrics.sim_displacement_cm = Some(moved),
                Purpose::MeanDisplacement => six.push(moved),
                Purpose::Shake(direction) => {
                    let outcome = withstood.get_or_insert(ShakeOutcome {
                        withstood: [false; 6],
                    });
                    outcome.withstood[*direction] = !motion.lost;
                }
            }
        }
        if !six.is_empty() {
            metrics.sim_displacement_mean6_cm = Some(six.iter().sum::<f64>() / six.len() as f64);
        }
        metrics.shake_withstood = withstood.map(|outcome| outcome.count());
        metrics.shake_success = withstood.map(|outcome| outcome.is_success());
        metrics.sim_engine = Some(answer.engine.clone());
        Ok(())
    }
}

/// A hand's surface as convex pieces, for engines that know no concave meshes: each of its connected parts is
/// decomposed as an object is.
///
/// # Errors
/// [`EvaluationError::BadMesh`] if a part is not closed.
pub fn convex_parts(hand: &TriangleMesh) -> Result<Vec<ConvexPiece>, EvaluationError> {
    let settings = DecompositionSettings {
        max_pieces: MAX_HAND_PIECES,
        ..DecompositionSettings::default()
    };
    let mut pieces = Vec::new();
    for part in connected_parts(hand) {
        let distance = SignedDistance::new(&part).map_err(|error| EvaluationError::BadMesh {
            mesh: "hand",
            fault: error.to_string(),
        })?;
        let distance = |p: &Point3<f64>| distance.signed_distance(p);
        pieces.extend(ObjectPieces::new(&part, &distance, &settings).pieces);
    }
    Ok(pieces)
}
