//! The contact energy: how far virtual contacts are from touching.

use graspd_geom::{Quaternion, SignedDistance, Vec3};
use graspd_hand::{Hand, HandPose};
use nalgebra::{Matrix3, Point3, Vector3};

use super::probe::Probe;
use super::settings::AnnealingSettings;
use crate::GraspError;

/// A virtual contact faces away from the palm's back by at least this cosine: its normal along the palm's, or
/// towards the middle of what the hand closes around.
const FACING: f64 = 0.5;

/// A point of the hand that should touch. Its normal is kept in the frame of three points of the same body, so that it
/// follows the hand whatever that is made of.
#[derive(Clone, Debug)]
struct VirtualContact {
    point: usize,
    corners: [usize; 2],
    normal: Vector3<f64>,
}

/// The energy of a posed hand.
#[derive(Clone, Debug)]
pub(super) struct ContactEnergy {
    contacts: Vec<VirtualContact>,
    alignment: f64,
}

impl ContactEnergy {
    /// Chooses the virtual contacts: spread evenly over the palm's side of the open hand.
    ///
    /// # Errors
    /// If the hand's surface is not closed.
    pub(super) fn new(
        hand: &dyn Hand,
        probe: &mut Probe<'_>,
        settings: &AnnealingSettings,
    ) -> Result<Self, GraspError> {
        let open = HandPose {
            translation: Vec3::zero(),
            rotation: Quaternion::identity(),
            articulation: hand.open_articulation().to_vec(),
        };
        let surface = SignedDistance::new(&hand.surface(&open))?;
        probe.place(&open);
        let position = |number: usize| Point3::from(probe.point(number));
        let palm = hand.palm();
        // What the hand closes around is about a finger's length before the palm.
        let focus = palm.center + palm.normal * 0.05;
        let mut facing = Vec::new();
        for &number in &probe.numbers {
            let p = position(number);
            let normal = surface.closest(&p).normal;
            let towards = (focus - p).normalize();
            if normal.dot(&palm.normal).max(normal.dot(&towards)) > FACING {
                facing.push((number, p, normal));
            }
        }
        let body = &hand.contact_points().body;
        let chosen = spread(&facing, settings.virtual_contacts);
        let contacts = (chosen.into_iter())
            .filter_map(|(number, p, normal)| {
                let others = probe.numbers.iter().copied();
                let others: Vec<usize> = others.filter(|&n| body[n] == body[number]).collect();
                let corners = corners(p, &others, position)?;
                let frame = frame([p, position(corners[0]), position(corners[1])]);
                Some(VirtualContact {
                    point: number,
                    corners,
                    normal: frame.transpose() * normal,
                })
            })
            .collect();
        Ok(Self {
            contacts,
            alignment: settings.alignment,
        })
    }

    /// The energy \[m\] of the hand as it is placed: the mean over the virtual contacts of |d| + alignment (1 -
    /// n.g), with the distance d to the object, the contact's outward normal n and the direction g to the nearest
    /// point of the object.
    ///
    /// # Source
    /// M. Ciocarlie, P. Allen, "Hand posture subspaces for dexterous robotic grasping", IJRR 28(7), 2009, section 4.1;
    /// the weight is that of GraspIt!'s contact energy, 100 / 2 for distances in mm.
    pub(super) fn of(&self, probe: &Probe<'_>) -> f64 {
        let mut sum = 0.0;
        for contact in &self.contacts {
            let p = probe.point(contact.point);
            let (distance, gradient) = probe.sdf.distance_and_gradient(p);
            let [a, b] = contact
                .corners
                .map(|number| Point3::from(probe.point(number)));
            let normal = frame([p.into(), a, b]) * contact.normal;
            let cosine = -normal.dot(&Vector3::from(gradient.normalize_or_zero()));
            sum += distance.abs() + self.alignment * (1.0 - cosine);
        }
        sum / self.contacts.len().max(1) as f64
    }

    /// Where the virtual contacts of the placed hand are.
    pub(super) fn positions(&self, probe: &Probe<'_>) -> Vec<Vec3<f64>> {
        (self.contacts.iter())
            .map(|contact| probe.point(contact.point))
            .collect()
    }
}

type Facing = (usize, Point3<f64>, Vector3<f64>);

/// `count` of the points, each as far as possible from those before it.
fn spread(points: &[Facing], count: usize) -> Vec<Facing> {
    let mut nearest = vec![f64::INFINITY; points.len()];
    let mut chosen = Vec::new();
    while chosen.len() < count.min(points.len()) {
        let farthest = (0..points.len()).fold(
            0,
            |best, k| {
                if nearest[k] > nearest[best] { k } else { best }
            },
        );
        let point = points[farthest];
        for (slot, (_, p, _)) in nearest.iter_mut().zip(points) {
            *slot = slot.min((p - point.1).norm());
        }
        nearest[farthest] = f64::NEG_INFINITY;
        chosen.push(point);
    }
    chosen
}

/// Two other points that make the largest triangle with `p`; `None` if all lie on a line.
fn corners(
    p: Point3<f64>,
    others: &[usize],
    position: impl Fn(usize) -> Point3<f64>,
) -> Option<[usize; 2]> {
    let farthest = |score: &dyn Fn(&Point3<f64>) -> f64| {
        let scored = others.iter().map(|&n| (score(&position(n)), n));
        scored.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (_, first) = farthest(&|q| (q - p).norm())?;
    let along = position(first) - p;
    let (area, second) = farthest(&|q| along.cross(&(q - p)).norm())?;
    (area > 1e-9).then_some([first, second])
}

/// The orthonormal frame of a triangle, axes as columns.
fn frame([a, b, c]: [Point3<f64>; 3]) -> Matrix3<f64> {
    let first = (b - a).normalize();
    let third = first.cross(&(c - a)).normalize();
    Matrix3::from_columns(&[first, third.cross(&first), third])
}
