//! Which contact points press on the object, and how hard.

use graspd_geom::{SignedDistance, Vec3};
use graspd_hand::{Hand, HandPose, HandScratch, PointBuffer, PoseGradient};

/// Contact points this near to the surface count as pressing on it \[m\].
const CONTACT_BAND: f64 = 5e-4;

/// A contact point that presses on the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressingContact {
    /// Where it is, object frame \[m\].
    pub position: Vec3<f64>,
    /// Its signed distance to the object, negative inside \[m\].
    pub distance: f64,
    /// Its force on the object, object frame \[N\].
    pub force: Vec3<f64>,
}

/// The contact points of a grasp that press on the object, by the law of [`plan_squeeze`](crate::plan_squeeze) with
/// the exact distance in place of the grid's: every point nearer to the surface than 0.5 mm beyond the nearest one
/// presses against the surface's normal, in proportion to its depth below that band; the sizes of all forces sum to
/// `squeeze_force` \[N\].
///
/// It tells where a grasp touches; it is no solution of the contact problem. Points without a share of the force
/// are left out.
pub fn pressing_contacts(
    hand: &dyn Hand,
    object: &SignedDistance,
    grasp: &HandPose,
    squeeze_force: f64,
) -> Vec<PressingContact> {
    let pressing = Pressing::new(hand, grasp, |p| {
        let (distance, gradient) = object.distance_and_gradient(&p.into());
        (distance, gradient.into())
    });
    if pressing.total <= 0.0 {
        return Vec::new();
    }
    let scale = squeeze_force / pressing.total;
    (0..pressing.contacts.len())
        .map(|index| PressingContact {
            position: pressing.contacts.get(index),
            distance: pressing.distances[index],
            force: pressing.forces.get(index) * scale,
        })
        .filter(|contact| contact.force.norm_squared() > 0.0)
        .collect()
}

/// The contact points of a grasp and how they press, in units of length.
pub(crate) struct Pressing {
    scratch: HandScratch,
    contacts: PointBuffer<f64>,
    centers: PointBuffer<f64>,
    distances: Vec<f64>,
    forces: PointBuffer<f64>,
    /// Sum of the sizes of all forces.
    pub(crate) total: f64,
}

impl Pressing {
    /// `touch` gives the signed distance to the object and its gradient.
    pub(crate) fn new(
        hand: &dyn Hand,
        grasp: &HandPose,
        touch: impl Fn(Vec3<f64>) -> (f64, Vec3<f64>),
    ) -> Self {
        let weights = &hand.contact_points().weight;
        let mut scratch = hand.new_scratch();
        let mut contacts = PointBuffer::<f64>::zeros(weights.len());
        let mut centers = PointBuffer::zeros(hand.collision_spheres().radius.len());
        hand.forward(grasp, &mut scratch, &mut contacts, &mut centers);

        let touch: Vec<(f64, Vec3<f64>)> = (0..contacts.len())
            .map(|i| touch(contacts.get(i)))
            .collect();
        let nearest = touch.iter().map(|t| t.0).fold(f64::INFINITY, f64::min);
        let reach = nearest.max(0.0) + CONTACT_BAND;
        let mut forces = PointBuffer::zeros(weights.len());
        let mut total = 0.0;
        for (i, (distance, gradient)) in touch.iter().enumerate() {
            let size = (reach - distance).max(0.0) * f64::from(weights[i]);
            forces.set(i, gradient.normalize_or_zero() * -size);
            total += size;
        }
        Self {
            scratch,
            contacts,
            centers,
            distances: touch.iter().map(|t| t.0).collect(),
            forces,
            total,
        }
    }

    /// J^T f: what the forces are to the pose.
    pub(crate) fn pull_back(&mut self, hand: &dyn Hand, grasp: &HandPose) -> PoseGradient {
        let unpushed = PointBuffer::zeros(self.centers.len());
        let mut gradient = PoseGradient::zero(grasp.articulation.len());
        hand.pullback(
            grasp,
            &mut self.scratch,
            &self.contacts,
            &self.forces,
            &self.centers,
            &unpushed,
            &mut gradient,
        );
        gradient
    }
}
