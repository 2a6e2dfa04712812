//! The search itself.

use graspd_eval::{Contact, FRICTION_EDGES};
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{Hand, HandPose};
use graspd_settings::Validate;
use nalgebra::{Point3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::closing::close;
use super::eigengrasps::Eigengrasps;
use super::energy::ContactEnergy;
use super::probe::Probe;
use super::settings::AnnealingSettings;
use crate::GraspError;
use crate::force_closure::epsilon_of_some;
use crate::object::GraspObject;

/// GraspIt!'s schedule: a temperature of T_0 exp(-c k^(1/d)) at step k, which begins at K_FIRST.
const INITIAL_TEMPERATURE: f64 = 1e6;
const COOLING: f64 = 7.0;
const COOLING_DIMENSIONS: f64 = 8.0;
const FIRST_STEP: f64 = 30_000.0;
const USUAL_STEPS: f64 = 70_000.0;
/// An energy that is greater by so many \[m\] for each unit of temperature is accepted once in e times: 1e6 mm.
const ACCEPTED_RISE: f64 = 1e3;
/// Contacts that epsilon is computed of, at most.
const MAX_CONTACTS: usize = 40;

/// A state of the search.
#[derive(Clone, Debug)]
struct State {
    translation: Vec3<f64>,
    rotation: Quaternion<f64>,
    amplitudes: Vec<f64>,
}

/// One of the best states so far.
struct Kept {
    energy: f64,
    state: State,
    contacts: Vec<Vec3<f64>>,
}

/// Searches `steps` neighbours for a grasp, from `start` on, and closes the hand: very fast simulated annealing
/// over base pose and eigengrasp amplitudes on the contact energy. States in which the hand enters the object, or
/// itself more than when it is open, are rejected. The best few are closed until joints are stopped, and of these
/// grasps the one of the greatest epsilon is returned (of the least energy where none has force closure).
///
/// `observe` sees the number of each step.
///
/// # Errors
/// If a setting is out of range or the hand's surface is not closed.
///
/// # Source
/// M. Ciocarlie, P. Allen, "Hand posture subspaces for dexterous robotic grasping", IJRR 28(7), 2009; L. Ingber,
/// "Very fast simulated re-annealing", Mathematical and Computer Modelling 12(8), 1989; constants as in GraspIt!.
pub fn anneal(
    hand: &dyn Hand,
    object: &GraspObject,
    start: &HandPose,
    settings: &AnnealingSettings,
    steps: usize,
    rng: &mut ChaCha8Rng,
    observe: &mut dyn FnMut(usize),
) -> Result<HandPose, GraspError> {
    settings.validate()?;
    let mut probe = Probe::new(hand, object.simulated.sdf());
    let energy_of = ContactEnergy::new(hand, &mut probe, settings)?;
    let eigengrasps = Eigengrasps::of(hand, &mut probe, settings.amplitudes);
    let checked = probe.thinned(settings.checked_points);
    probe.place(start);
    let overlap_at_start = probe.overlap();
    let center = object.simulated.center_of_mass();
    let (low, high) = object.simulated.sdf().bounds();
    let radius = 0.5 * (high - low).norm() + settings.reach;
    let neighborhood = Neighborhood {
        center,
        radius,
        ranges: &eigengrasps.ranges,
    };

    let pose_of = |state: &State| HandPose {
        translation: state.translation,
        rotation: state.rotation,
        articulation: eigengrasps.articulation(hand, &state.amplitudes),
    };
    let mut state = State {
        translation: start.translation,
        rotation: start.rotation,
        amplitudes: (eigengrasps.ranges.iter())
            .map(|[low, high]| 0.0f64.clamp(*low, *high))
            .collect(),
    };
    probe.place(&pose_of(&state));
    let mut energy = energy_of.of(&probe);
    let mut best: Vec<Kept> = vec![Kept {
        energy,
        state: state.clone(),
        contacts: energy_of.positions(&probe),
    }];
    for step in 0..steps {
        observe(step);
        let k = FIRST_STEP + USUAL_STEPS * step as f64 / steps as f64;
        let temperature = INITIAL_TEMPERATURE * (-COOLING * k.powf(1.0 / COOLING_DIMENSIONS)).exp();
        let allowed = (0..settings.attempts).find_map(|_| {
            let next = neighborhood.neighbor(&state, temperature, rng);
            probe.place(&pose_of(&next));
            let is_allowed = !probe.enters(&checked)
                && probe.overlap() <= overlap_at_start + settings.contact_depth;
            is_allowed.then_some(next)
        });
        let Some(next) = allowed else { continue };
        let next_energy = energy_of.of(&probe);
        let rise = next_energy - energy;
        if rise > 0.0 && rng.random::<f64>() >= (-rise / (ACCEPTED_RISE * temperature)).exp() {
            continue;
        }
        (state, energy) = (next, next_energy);
        let worst = best.last().map_or(f64::INFINITY, |kept| kept.energy);
        if best.len() < settings.kept || energy < worst {
            keep(
                &mut best,
                settings,
                energy,
                &state,
                energy_of.positions(&probe),
            );
        }
    }

    let mut chosen: Option<(f64, HandPose)> = None;
    for kept in &best {
        let pose = close(
            hand,
            &mut probe,
            &eigengrasps,
            settings,
            &pose_of(&kept.state),
        );
        let epsilon = epsilon(&mut probe, object, settings, &pose)?;
        if chosen.as_ref().is_none_or(|(most, _)| epsilon > *most) {
            chosen = Some((epsilon, pose));
        }
    }
    Ok(chosen.map_or_else(|| start.clone(), |(_, pose)| pose))
}

/// Keeps a state among the best, in the place of those that are much like it.
fn keep(
    best: &mut Vec<Kept>,
    settings: &AnnealingSettings,
    energy: f64,
    state: &State,
    contacts: Vec<Vec3<f64>>,
) {
    let is_close = |kept: &Kept| {
        let distances = kept.contacts.iter().zip(&contacts);
        let sum: f64 = distances.map(|(a, b)| (*a - *b).norm()).sum();
        sum < settings.apart * contacts.len() as f64
    };
    if best
        .iter()
        .any(|kept| kept.energy <= energy && is_close(kept))
    {
        return;
    }
    best.retain(|kept| !is_close(kept));
    let place = best.partition_point(|kept| kept.energy <= energy);
    best.insert(
        place,
        Kept {
            energy,
            state: state.clone(),
            contacts,
        },
    );
    best.truncate(settings.kept);
}

/// What states are next to each other.
struct Neighborhood<'a> {
    center: Vec3<f64>,
    radius: f64,
    ranges: &'a [[f64; 2]],
}

impl Neighborhood<'_> {
    /// A neighbour: every variable moves by a share of its range that is spread evenly over the orders of magnitude
    /// from the temperature to 1.
    fn neighbor(&self, state: &State, temperature: f64, rng: &mut ChaCha8Rng) -> State {
        let mut share = || {
            let u: f64 = rng.random_range(-1.0..1.0);
            u.signum() * temperature * ((1.0 + 1.0 / temperature).powf(u.abs()) - 1.0)
        };
        let mut vector = |range: f64| Vec3::new(share(), share(), share()) * range;
        let translation = self.within(state.translation, vector(2.0 * self.radius));
        let turn = Quaternion::exp(vector(std::f64::consts::PI));
        let rotation = turn.compose(state.rotation).normalize();
        let amplitudes = (state.amplitudes.iter().zip(self.ranges))
            .map(|(amplitude, [low, high])| {
                let next = amplitude + share() * (high - low);
                if (*low..=*high).contains(&next) {
                    next
                } else {
                    *amplitude
                }
            })
            .collect();
        State {
            translation,
            rotation,
            amplitudes,
        }
    }

    /// The place after a move, or the one before if that leads too far away.
    fn within(&self, before: Vec3<f64>, change: Vec3<f64>) -> Vec3<f64> {
        let after = before + change;
        let distance = (after - self.center).norm();
        // A start may be farther away than the search goes.
        let is_allowed = distance <= self.radius || distance <= (before - self.center).norm();
        if is_allowed { after } else { before }
    }
}

/// Ferrari and Canny's epsilon of the points that touch.
fn epsilon(
    probe: &mut Probe<'_>,
    object: &GraspObject,
    settings: &AnnealingSettings,
    pose: &HandPose,
) -> Result<f64, GraspError> {
    probe.place(pose);
    let sdf = probe.sdf;
    let touching: Vec<Contact> = (probe.numbers.iter())
        .filter_map(|&number| {
            let p = probe.point(number);
            let (distance, gradient) = sdf.distance_and_gradient(p);
            (distance < 0.0).then(|| Contact {
                point: Point3::from(p),
                normal: -Vector3::from(gradient),
            })
        })
        .collect();
    epsilon_of_some(
        touching,
        MAX_CONTACTS,
        settings.friction,
        FRICTION_EDGES,
        object,
    )
}
