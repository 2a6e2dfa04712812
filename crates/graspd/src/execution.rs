//! What a robot needs besides the grasp: where to come from, and how to hold on.

use graspd_hand::{Hand, HandPose, clamp_to_limits};
use graspd_settings::{Ranges, Validate, between, ranges};
use serde::{Deserialize, Serialize};

use crate::approach::{ClosingOrder, PathProbe, PlannedPreGrasp};
use crate::object::GraspObject;
use crate::pressing::Pressing;

/// Lever arm below which joints can hardly move the contacts: bounds the squeeze where forces pass through axes \[m\].
const MIN_LEVER: f64 = 0.01;

/// How pre-grasps and squeezes are made from grasps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecutionSettings {
    /// How far the opened hand stands back along the approach \[m\].
    pub retreat: f64,
    /// How far joints move the contact points on into the object, on average, where nothing would stop them \[m\].
    pub squeeze: f64,
    /// Sum of the normal forces that the squeeze's joint torques balance \[N\].
    pub squeeze_force: f64,
}

impl Default for ExecutionSettings {
    /// 5 cm back, 5 mm on, 10 N.
    fn default() -> Self {
        Self {
            retreat: 0.05,
            squeeze: 0.005,
            squeeze_force: 10.0,
        }
    }
}

impl Validate for ExecutionSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            retreat: between(0.0, 1.0).unit("m"),
            squeeze: between(0.0, 0.05).unit("m"),
            squeeze_force: between(0.0, 1000.0).unit("N"),
        }
        .source("docs/hands.md")
    }
}

/// How far the hand opens for a pre-grasp, of the way to fully open; the widest that is free is taken.
const OPENINGS: [f64; 5] = [1.0, 0.6, 0.3, 0.1, 0.0];
/// How far it stands back, of the distance asked for.
const RETREATS: [f64; 2] = [1.0, 2.0];
/// Sideways parts of the ways back, in terms of the palm's axes (fingers, side), beside 1 against the normal.
const TILTS: [[f64; 2]; 7] = [
    [0.0, 0.0],
    [-0.6, 0.0],
    [0.6, 0.0],
    [0.0, 0.6],
    [0.0, -0.6],
    [-1.7, 0.0],
    [1.7, 0.0],
];

/// The pre-grasp of a grasp: the hand opened and drawn back against the palm's normal, by at least
/// `settings.retreat`.
///
/// Contact points and the vertices of the hand's surface are looked up in the object's distance grid at way points
/// along the path. Where the straight way collides, less opened hands, longer ways and ways tilted by 31 and 60
/// degrees towards each side of the palm are tried; the first that is free is taken. Where none is, the one that
/// gets least deep is given with `is_free` false.
pub fn plan_pre_grasp(
    hand: &dyn Hand,
    object: &GraspObject,
    grasp: &HandPose,
    settings: &ExecutionSettings,
) -> PlannedPreGrasp {
    let mut probe = PathProbe::new(hand, object, grasp);
    let rotation = grasp.rotation.to_matrix();
    let palm = hand.palm();
    let [normal, fingers, side] = [palm.normal, palm.fingers, palm.normal.cross(&palm.fingers)]
        .map(|axis| rotation.apply(axis.into()));
    let mut best: Option<PlannedPreGrasp> = None;
    for tilt in TILTS {
        let back = fingers * tilt[0] + side * tilt[1] - normal;
        let back = back.normalize_or_zero();
        for opening in OPENINGS {
            for retreat in RETREATS {
                let pose = HandPose {
                    translation: grasp.translation + back * (settings.retreat * retreat),
                    rotation: grasp.rotation,
                    articulation: opened(hand, &grasp.articulation, opening),
                };
                for order in [ClosingOrder::ApproachThenClose, ClosingOrder::Together] {
                    let plan = probe.follow(&pose, grasp, order);
                    if plan.is_free {
                        return plan;
                    }
                    let depth =
                        |plan: &PlannedPreGrasp| plan.clearance.min(plan.clearance_on_the_way);
                    if best.as_ref().is_none_or(|best| depth(&plan) > depth(best)) {
                        best = Some(plan);
                    }
                }
            }
        }
    }
    // There is at least one candidate.
    best.unwrap_or_else(|| probe.follow(grasp, grasp, ClosingOrder::Together))
}

/// The joints moved by a share of their way to fully open.
fn opened(hand: &dyn Hand, grasp: &[f64], share: f64) -> Vec<f64> {
    let open = hand.open_articulation();
    let mut joints: Vec<f64> = (grasp.iter().zip(open))
        .map(|(grasp, open)| grasp + share * (open - grasp))
        .collect();
    if let Some(limits) = hand.limits() {
        clamp_to_limits(&mut joints, limits);
    }
    joints
}

/// How the joints press on.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedSqueeze {
    /// Where to command the joints of a position-controlled hand, within their limits, `[n]`.
    pub articulation: Vec<f64>,
    /// Joint torques \[N m\] (forces \[N\] of sliding joints) for a torque-controlled hand, `[n]`.
    pub torques: Vec<f64>,
}

/// The squeeze of a grasp.
///
/// Forces: every contact point nearer to the surface than 0.5 mm beyond the nearest one presses against the surface's
/// normal, in proportion to its depth below that band; their sizes sum to `settings.squeeze_force` F. Torques:
/// tau = J^T f. Displacement: along the torques, d theta = tau s F / (|tau|^2 + (l F)^2), which moves the contact
/// points along their forces by s = `settings.squeeze` on average, weighted by force, where the lever arm |tau| / F is
/// well above l = 1 cm, and by less where forces pass near the axes. Limits cut it off.
pub fn plan_squeeze(
    hand: &dyn Hand,
    object: &GraspObject,
    grasp: &HandPose,
    settings: &ExecutionSettings,
) -> PlannedSqueeze {
    let sdf = object.simulated.sdf();
    let mut pressing = Pressing::new(hand, grasp, |p| sdf.distance_and_gradient(p));
    let gradient = pressing.pull_back(hand, grasp);
    let total = pressing.total;
    // Now in units of the total force: lever arms [m].
    let levers: Vec<f64> = (gradient.articulation.iter())
        .map(|torque| if total > 0.0 { torque / total } else { 0.0 })
        .collect();
    let squared: f64 = levers.iter().map(|lever| lever * lever).sum();
    let step = settings.squeeze / (squared + MIN_LEVER * MIN_LEVER);
    let mut articulation: Vec<f64> = (grasp.articulation.iter().zip(&levers))
        .map(|(joint, lever)| joint + step * lever)
        .collect();
    if let Some(limits) = hand.limits() {
        clamp_to_limits(&mut articulation, limits);
    }
    PlannedSqueeze {
        articulation,
        torques: levers
            .iter()
            .map(|lever| lever * settings.squeeze_force)
            .collect(),
    }
}
