//! All metrics of one grasp, in the form that records keep.

use std::sync::OnceLock;

use graspd_geom::{DiskCache, MassProperties, SignedDistance, TriangleMesh};
use graspd_settings::Validate;
use nalgebra::{Matrix3, Point3};
use serde::{Deserialize, Serialize};

use crate::EvaluationError;
use crate::contact_area::{contact_area_cm2, voxel_count_area_cm2};
use crate::contacts::contacts;
use crate::displacement::{
    DecompositionSettings, DynamicObject, FixedHand, ObjectPieces, SIX_DIRECTIONS, shake, simulate,
    simulate_six_directions,
};
use crate::ferrari_canny::{EpsilonSettings, ForceLimit, ferrari_canny};
use crate::hull::{VolumeMethod, hull_volume};
use crate::interpenetration::interpenetration_volume_cm3;
use crate::penetration::max_penetration_mm;
use crate::self_penetration::SelfPenetration;
use crate::settings::EvaluationSettings;
use crate::voxels::surface_voxels;
use crate::wrench_space::{Contact, FingerModel, largest_radius};

/// An object with everything about it that all of its grasps share.
pub struct ObjectUnderTest {
    mesh: TriangleMesh,
    distance: SignedDistance,
    mass_properties: MassProperties,
    torque_scale: f64,
    decomposition: DecompositionSettings,
    cache: Option<DiskCache>,
    /// Made when a displacement is first asked for: it takes seconds, and other metrics do not need it.
    pieces: OnceLock<ObjectPieces>,
    dynamic: OnceLock<DynamicObject>,
    hand: Option<SelfPenetration>,
}

impl ObjectUnderTest {
    /// From the object's true mesh \[m\]: closed, faces looking outward.
    ///
    /// # Errors
    /// [`EvaluationError::BadMesh`] if the mesh is empty, open or inside out.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, EvaluationError> {
        Self::with_decomposition(mesh, &DecompositionSettings::default())
    }

    /// As [`ObjectUnderTest::new`], with settings for the convex decomposition that the displacement needs.
    ///
    /// # Errors
    /// As [`ObjectUnderTest::new`].
    pub fn with_decomposition(
        mesh: &TriangleMesh,
        decomposition: &DecompositionSettings,
    ) -> Result<Self, EvaluationError> {
        let bad = |fault: String| EvaluationError::BadMesh {
            mesh: "object",
            fault,
        };
        let distance = SignedDistance::new(mesh).map_err(|error| bad(error.to_string()))?;
        let mass_properties =
            MassProperties::new(mesh, 1.0, "object").map_err(|error| bad(error.to_string()))?;
        Ok(Self {
            torque_scale: largest_radius(&mesh.vertices, mass_properties.center_of_mass),
            mesh: mesh.clone(),
            distance,
            mass_properties,
            decomposition: decomposition.clone(),
            cache: None,
            pieces: OnceLock::new(),
            dynamic: OnceLock::new(),
            hand: None,
        })
    }

    /// Takes the convex decomposition from a cache, or stores it there; no result depends on it.
    #[must_use]
    pub fn with_cache(self, cache: Option<DiskCache>) -> Self {
        Self { cache, ..self }
    }

    /// Tells what the hand of the grasps looks like at rest (open), which the self-penetration is
    /// measured against: links overlap at their joints by construction.
    ///
    /// # Errors
    /// [`EvaluationError::BadMesh`] for a hand that is not closed.
    pub fn grasped_by(self, hand_at_rest: &TriangleMesh) -> Result<Self, EvaluationError> {
        let hand = Some(SelfPenetration::new(hand_at_rest)?);
        Ok(Self { hand, ..self })
    }

    /// The exact signed distance to the object.
    pub fn signed_distance(&self) -> &SignedDistance {
        &self.distance
    }
    /// Centre of mass of the solid at uniform density \[m\].
    pub fn center_of_mass(&self) -> Point3<f64> {
        self.mass_properties.center_of_mass
    }
    /// The largest distance of the surface from the centre of mass \[m\]: the scale of torques.
    pub fn torque_scale(&self) -> f64 {
        self.torque_scale
    }
    /// Inertia about the centre of mass, along the object's axes, for a mass of 1 kg \[m^2\].
    pub(crate) fn unit_inertia(&self) -> Matrix3<f64> {
        self.mass_properties.inertia / self.mass_properties.mass
    }
    /// The object's convex pieces; made on the first call, in seconds.
    pub fn pieces(&self) -> &ObjectPieces {
        self.pieces.get_or_init(|| {
            let distance = |p: &Point3<f64>| self.distance.signed_distance(p);
            let (mesh, settings) = (&self.mesh, &self.decomposition);
            match &self.cache {
                Some(cache) => ObjectPieces::new_cached(mesh, &distance, settings, cache),
                None => ObjectPieces::new(mesh, &distance, settings),
            }
        })
    }
    /// The object as the embedded physics engine sees it; made on the first call, in seconds.
    pub fn dynamic(&self) -> &DynamicObject {
        self.dynamic.get_or_init(|| {
            DynamicObject::new(self.pieces(), self.center_of_mass(), self.unit_inertia())
        })
    }
    /// The object's contacts with a posed hand.
    ///
    /// # Errors
    /// As [`evaluate`].
    pub fn contacts(
        &self,
        hand: &TriangleMesh,
        settings: &EvaluationSettings,
    ) -> Result<Vec<Contact>, EvaluationError> {
        settings.validate()?;
        let solid = hand_solid(hand)?;
        let voxels = surface_voxels(
            hand,
            &solid,
            &self.distance,
            settings.voxel_size,
            settings.reach(),
        );
        let (half, tolerance) = (settings.half_diagonal(), settings.contact_tolerance);
        Ok(contacts(&voxels, half, &self.distance, tolerance))
    }
}

/// The metrics of a grasp, under the names that grasp records use; `None` (null) for those not asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct GraspMetrics {
    /// Area of the hand's surface in contact \[cm^2\].
    pub contact_area_cm2: Option<f64>,
    /// The same voxels, each counted as the area of its side whichever way the surface in it is tilted \[cm^2\]: about
    /// 1.5 times as much, and what published contact areas are to be compared with (docs/metrics.md).
    pub contact_area_voxel_count_cm2: Option<f64>,
    /// Volume of the hand inside the object \[cm^3\].
    pub interpenetration_volume_cm3: Option<f64>,
    /// Their ratio \[1/cm\]; `None` also where the hand does not penetrate at all.
    pub ca_over_iv: Option<f64>,
    /// Ferrari and Canny's epsilon over all contacts: the lower of two bounds, which agree to 1e-9 (L1).
    pub epsilon: Option<f64>,
    /// The upper bound on epsilon.
    pub epsilon_upper: Option<f64>,
    /// Why epsilon is 0; `None` where it is not.
    pub epsilon_reason: Option<String>,
    /// Volume of the grasp wrench space: exact, or an estimate where it has too many facets.
    pub gws_volume: Option<f64>,
    /// The 95 % confidence interval of an estimated volume; `None` for an exact one.
    pub gws_volume_interval: Option<[f64; 2]>,
    /// How far the object moves under gravity while the hand is fixed \[cm\].
    pub sim_displacement_cm: Option<f64>,
    /// The mean of that over gravity along each of the six axis directions \[cm\].
    pub sim_displacement_mean6_cm: Option<f64>,
    /// How many of the shake test's six forces the hand withstands.
    pub shake_withstood: Option<usize>,
    /// Whether it withstands all of them.
    pub shake_success: Option<bool>,
    /// The physics engine of the displacements and the shake test, with its version; `rapier`
    /// without one, in older records, is an earlier version of the built-in solver.
    pub sim_engine: Option<String>,
    /// Largest depth of the hand's surface inside the object \[mm\].
    pub max_penetration_mm: Option<f64>,
    /// Largest depth of the hand inside itself \[mm\]; `None` also where its shape at rest is not known.
    pub self_penetration_mm: Option<f64>,
    /// How many contacts (surface voxels within the contact tolerance) there are.
    pub contacts: Option<usize>,
}

/// Judges one grasp: `hand` is the posed hand's surface in the object's frame, made of closed, outward-oriented
/// parts that may overlap.
///
/// A simulation that diverges counts as an object that falls freely.
///
/// # Errors
/// A setting out of range, or a hand that is not closed.
pub fn evaluate(
    object: &ObjectUnderTest,
    hand: &TriangleMesh,
    settings: &EvaluationSettings,
) -> Result<GraspMetrics, EvaluationError> {
    settings.validate()?;
    let wanted = &settings.metrics;
    let mut metrics = GraspMetrics::default();
    let solid = hand_solid(hand)?;
    if wanted.interpenetration_volume {
        metrics.interpenetration_volume_cm3 = Some(interpenetration_volume_cm3(
            &solid,
            &object.distance,
            settings.voxel_size,
        ));
    }
    if wanted.needs_surface() {
        let (size, half) = (settings.voxel_size, settings.half_diagonal());
        let voxels = surface_voxels(hand, &solid, &object.distance, size, settings.reach());
        if wanted.contact_area {
            let threshold = settings.contact_threshold;
            metrics.contact_area_cm2 = Some(contact_area_cm2(&voxels, threshold));
            metrics.contact_area_voxel_count_cm2 =
                Some(voxel_count_area_cm2(&voxels, threshold, size));
        }
        if wanted.max_penetration {
            let deepest = max_penetration_mm(hand, &voxels, half, &object.distance);
            metrics.max_penetration_mm = Some(deepest);
        }
        if wanted.wrench_space {
            let all = contacts(&voxels, half, &object.distance, settings.contact_tolerance);
            wrench_space_metrics(&mut metrics, object, &all, settings)?;
        }
    }
    if let Some(at_rest) = &object.hand
        && wanted.self_penetration
    {
        metrics.self_penetration_mm = Some(at_rest.depth_mm(hand)?);
    }
    if let (Some(area), Some(volume)) = (
        metrics.contact_area_cm2,
        metrics.interpenetration_volume_cm3,
    ) {
        metrics.ca_over_iv = (volume > 0.0).then(|| area / volume);
    }
    if wanted.needs_physics() {
        physics_metrics(&mut metrics, object, hand, settings)?;
    }
    Ok(metrics)
}

/// Displacements and the shake test.
fn physics_metrics(
    metrics: &mut GraspMetrics,
    object: &ObjectUnderTest,
    hand: &TriangleMesh,
    settings: &EvaluationSettings,
) -> Result<(), EvaluationError> {
    let wanted = &settings.metrics;
    let engine = settings.engine;
    metrics.sim_engine = Some(engine.label()?.into());
    let fixed = FixedHand::new(hand)?;
    let (object, protocol) = (object.dynamic(), &settings.displacement);
    let fallen = protocol.free_fall() * 100.0;
    let or_fallen = |result| match result {
        Err(EvaluationError::Diverged { .. }) => Ok(fallen),
        other => other,
    };
    if wanted.displacement_mean6 {
        match simulate_six_directions(object, &fixed, protocol, engine) {
            Ok(six) => {
                metrics.sim_displacement_mean6_cm = Some(six.mean_cm);
                // The protocol's own direction is one of the six by default: no need to run it twice.
                let is_own = |d: &[f64; 3]| *d == protocol.gravity_direction;
                let own = SIX_DIRECTIONS.iter().position(is_own);
                metrics.sim_displacement_cm = own.map(|i| six.per_direction_cm[i]);
            }
            Err(error) => {
                metrics.sim_displacement_mean6_cm = Some(or_fallen(Err(error))?);
            }
        }
    }
    if !wanted.displacement {
        metrics.sim_displacement_cm = None;
    } else if metrics.sim_displacement_cm.is_none() {
        let motion = simulate(object, &fixed, protocol, engine);
        let displacement = or_fallen(motion.map(|motion| motion.displacement_cm()))?;
        metrics.sim_displacement_cm = Some(displacement);
    }
    if wanted.shake {
        let outcome = shake(object, &fixed, &settings.shake, engine)?;
        metrics.shake_withstood = Some(outcome.count());
        metrics.shake_success = Some(outcome.is_success());
    }
    Ok(())
}

/// Epsilon and volume over all contacts.
fn wrench_space_metrics(
    metrics: &mut GraspMetrics,
    object: &ObjectUnderTest,
    contacts: &[Contact],
    settings: &EvaluationSettings,
) -> Result<(), EvaluationError> {
    let finger = FingerModel {
        friction: settings.friction,
        edges: settings.friction_edges,
        torsional_friction: settings.torsional_friction,
    };
    let torque_scale = settings.torque_scale.unwrap_or(object.torque_scale);
    let wrenches = finger.wrenches(contacts, object.center_of_mass(), torque_scale);
    let epsilon_settings = match settings.force_limit {
        ForceLimit::Sum => EpsilonSettings::sum(),
        ForceLimit::Each => EpsilonSettings::each(finger.wrenches_per_contact()),
    };
    let epsilon = ferrari_canny(&wrenches, &epsilon_settings)?;
    let volume = hull_volume(&wrenches, &settings.volume)?;
    metrics.contacts = Some(contacts.len());
    metrics.epsilon = Some(epsilon.value);
    metrics.epsilon_upper = Some(epsilon.upper);
    metrics.epsilon_reason = epsilon.reason.map(|reason| reason.to_string());
    metrics.gws_volume = Some(volume.value);
    metrics.gws_volume_interval = match volume.method {
        VolumeMethod::Exact => None,
        VolumeMethod::Sampled { .. } => Some([volume.lower, volume.upper]),
    };
    Ok(())
}

/// Largest hand \[m\]: one whose coordinates are not in metres would ask for more voxels than there is time for.
const LARGEST_HAND: f64 = 5.0;

fn hand_solid(hand: &TriangleMesh) -> Result<SignedDistance, EvaluationError> {
    let bad = |fault: String| EvaluationError::BadMesh {
        mesh: "hand",
        fault,
    };
    if let Some((low, high)) = hand.bounds() {
        let extent = (high - low).max();
        if extent > LARGEST_HAND {
            return Err(bad(format!(
                "it is {extent} m across; coordinates must be in metres"
            )));
        }
    }
    SignedDistance::new(hand).map_err(|error| bad(error.to_string()))
}
