//! The way from pre-grasp to grasp, and how near the object it leads.

use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPose, HandScratch, PointBuffer};

use crate::object::GraspObject;

/// Poses looked at on each straight stretch of the way.
const WAY_POINTS: usize = 8;
/// The way may be this much deeper in the object than the grasp itself \[m\]: the distance grid's own error.
const DEPTH_TOLERANCE: f64 = 5e-4;
/// Least distance between the pre-grasp and the object \[m\].
const MIN_CLEARANCE: f64 = 2e-3;

/// The order in which the hand gets from pre-grasp to grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClosingOrder {
    /// First the base moves in a straight line with the joints of the pre-grasp, then the joints close in a straight
    /// line with the base in place.
    ApproachThenClose,
    /// Base and joints move together, each in a straight line.
    Together,
}

impl ClosingOrder {
    /// Its name in records.
    pub fn name(self) -> &'static str {
        match self {
            Self::ApproachThenClose => "approach_then_close",
            Self::Together => "together",
        }
    }
}

/// Where the hand should be before it grasps.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPreGrasp {
    /// The opened hand, standing back.
    pub pose: HandPose,
    /// How to get from there to the grasp.
    pub order: ClosingOrder,
    /// Least signed distance of the hand to the object in the pre-grasp \[m\].
    pub clearance: f64,
    /// Least signed distance at the way points before the grasp \[m\]: about that of the grasp itself where the way
    /// is free, as the hand touches at its end.
    pub clearance_on_the_way: f64,
    /// Whether the pre-grasp is clear of the object and no way point is deeper in it than the grasp.
    pub is_free: bool,
}

/// Poses on the way from `start` to `grasp`, without the grasp itself.
pub(crate) fn way_points(start: &HandPose, grasp: &HandPose, order: ClosingOrder) -> Vec<HandPose> {
    let between = |base: f64, joints: f64| HandPose {
        translation: start.translation + (grasp.translation - start.translation) * base,
        rotation: grasp.rotation,
        articulation: (start.articulation.iter().zip(&grasp.articulation))
            .map(|(start, end)| start + joints * (end - start))
            .collect(),
    };
    let shares = (0..WAY_POINTS).map(|i| i as f64 / WAY_POINTS as f64);
    match order {
        ClosingOrder::ApproachThenClose => {
            let approach = shares.clone().map(|share| between(share, 0.0));
            approach
                .chain(shares.map(|share| between(1.0, share)))
                .collect()
        }
        ClosingOrder::Together => shares.map(|share| between(share, share)).collect(),
    }
}

/// Measures poses of one hand against one object.
pub(crate) struct PathProbe<'a> {
    hand: &'a dyn Hand,
    object: &'a GraspObject,
    scratch: HandScratch,
    contacts: PointBuffer<f32>,
    spheres: PointBuffer<f32>,
    /// No way point may be deeper \[m\].
    deepest_allowed: f64,
}

impl<'a> PathProbe<'a> {
    pub(crate) fn new(hand: &'a dyn Hand, object: &'a GraspObject, grasp: &HandPose) -> Self {
        let mut probe = Self {
            hand,
            object,
            scratch: hand.new_scratch(),
            contacts: PointBuffer::zeros(hand.contact_points().weight.len()),
            spheres: PointBuffer::zeros(hand.collision_spheres().radius.len()),
            deepest_allowed: 0.0,
        };
        let at_grasp = probe
            .contact_distance(grasp)
            .min(probe.surface_distance(grasp));
        probe.deepest_allowed = at_grasp.min(0.0) - DEPTH_TOLERANCE;
        probe
    }

    /// Looks along a way; what is said of a way that collides is about its part up to the first collision found.
    pub(crate) fn follow(
        &mut self,
        start: &HandPose,
        grasp: &HandPose,
        order: ClosingOrder,
    ) -> PlannedPreGrasp {
        let points = way_points(start, grasp, order);
        let mut plan = PlannedPreGrasp {
            pose: start.clone(),
            order,
            clearance: f64::INFINITY,
            clearance_on_the_way: f64::INFINITY,
            is_free: false,
        };
        // Contact points first, as they are quick; the whole surface, which also has its hidden sides, only where
        // they pass. Collisions are most likely near the grasp.
        for measure in [Self::contact_distance, Self::surface_distance] {
            plan.clearance = plan.clearance.min(measure(self, start));
            for pose in points.iter().rev() {
                let distance = measure(self, pose);
                plan.clearance_on_the_way = plan.clearance_on_the_way.min(distance);
                if distance < self.deepest_allowed {
                    return plan;
                }
            }
            if plan.clearance < MIN_CLEARANCE {
                return plan;
            }
        }
        plan.is_free = true;
        plan
    }

    /// Least signed distance of the contact points.
    fn contact_distance(&mut self, pose: &HandPose) -> f64 {
        self.hand.forward(
            pose,
            &mut self.scratch,
            &mut self.contacts,
            &mut self.spheres,
        );
        let sdf = self.object.simulated.sdf();
        (0..self.contacts.len())
            .map(|i| sdf.distance(self.contacts.get(i)))
            .fold(f64::INFINITY, f64::min)
    }

    /// Least signed distance of the vertices of the hand's surface.
    fn surface_distance(&mut self, pose: &HandPose) -> f64 {
        let sdf = self.object.simulated.sdf();
        let surface = self.hand.surface(pose);
        (surface.vertices.iter())
            .map(|vertex| sdf.distance(Vec3::from(*vertex)))
            .fold(f64::INFINITY, f64::min)
    }
}
