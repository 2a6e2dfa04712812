//! Starts that know the object: a preshaped hand around a place that is thin enough for it.

use graspd_geom::{SurfacePoint, SurfaceSampler, Vec3};
use graspd_hand::{Hand, HandPose};
use graspd_sim::{Scene, SimulationParams};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::GraspError;
use crate::aperture::{Aperture, Apertures, MIN_FACING, REACH};
use crate::object::GraspObject;
use crate::start::start_rng;

/// Every so many-th start is one of these.
const EVERY: usize = 2;
/// Seed of the places; any would do.
const SEED: u64 = 5;
/// Points of the object's surface whose thickness is measured.
const SURFACE_POINTS: usize = 1000;
/// Where the ray through the object starts, inside it \[m\].
const RAY_OFFSET: f64 = 1e-6;
/// Beyond both sides of a place there has to be room for a digit this thick \[m\], with its middle this far outside.
const DIGIT: f64 = 0.012;
const MIN_ROOM: f64 = 0.005;
/// Discount on places as far from the centre of mass as the surface goes, relative to those at it.
const REMOTE_DISCOUNT: f64 = 0.7;
/// What is thicker than this share of the hand's span is hardly held.
const SPAN_SHARE: f64 = 0.9;
/// An aperture is wider than what it is put around by at least this, and at most by this and a share of it \[m\].
const MIN_GAP: f64 = 2e-3;
const MAX_GAP: f64 = 1.5e-2;
const GAP_SHARE: f64 = 0.2;
/// Poses that are tried for a start, and how many that do not touch are enough.
const TRIALS: usize = 2000;
const FREE: usize = 12;
/// Skin keeps this distance from the object \[m\], and centres of collision spheres this share of their radius.
const CLEARANCE: f64 = 5e-4;
const SPHERE_SHARE: f64 = 0.8;

/// A place where the object's surface has a counterpart on the other side, and a hand has room at both.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AntipodalPair {
    /// Halfway between the two points \[m\].
    center: Vector3<f64>,
    /// Outward unit normal at the first of them.
    axis: Vector3<f64>,
    /// Distance through the solid \[m\].
    thickness: f64,
}

impl AntipodalPair {
    /// Measures the thickness along the normal at a point; `None` where the other side is not about parallel, or
    /// something is in the way of a digit.
    fn through(object: &GraspObject, point: &SurfacePoint) -> Option<Self> {
        let inward = -point.normal;
        let start = point.point + inward * RAY_OFFSET;
        let hit = object.distance.tree().first_hit(&start, &inward)?;
        let thickness = hit.length + RAY_OFFSET;
        let center = point.point.coords + inward * (thickness / 2.0);
        let has_room = [1.0, -1.0].iter().all(|side| {
            let digit = center + inward * (side * (thickness + DIGIT) / 2.0);
            object.simulated.sdf().distance(Vec3::from(digit)) > MIN_ROOM
        });
        (has_room && hit.normal.dot(&inward) > MIN_FACING).then_some(Self {
            center,
            axis: point.normal,
            thickness,
        })
    }
}

/// Draws starts of one hand at one object.
pub(crate) struct AntipodalStarts<'a> {
    object: &'a GraspObject,
    hand: &'a dyn Hand,
    apertures: Apertures,
    /// Those thin enough for the hand's span.
    pairs: Vec<AntipodalPair>,
    /// Summed weights of the pairs up to and including each.
    weights: Vec<f64>,
    /// Thickness of the thinnest pair, thin enough or not \[m\].
    thinnest: Option<f64>,
}

impl<'a> AntipodalStarts<'a> {
    /// Measures the hand, and the object's thickness at points uniform by area. Thin places near the centre of mass
    /// weigh most, those as thick as the hand's span nothing.
    ///
    /// # Errors
    /// If the hand has no surface.
    pub(crate) fn new(
        object: &'a GraspObject,
        hand: &'a dyn Hand,
        surface: &SurfaceSampler<'_>,
    ) -> Result<Self, GraspError> {
        let apertures = Apertures::new(hand)?;
        let span = apertures.span();
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let points = (0..SURFACE_POINTS).map(|_| surface.sample(&mut rng));
        let mut pairs: Vec<_> = points
            .filter_map(|point| AntipodalPair::through(object, &point))
            .collect();
        let thinnest = pairs.iter().map(|pair| pair.thickness).reduce(f64::min);
        pairs.retain(|pair| pair.thickness < SPAN_SHARE * span);
        let middle = Point3::from(object.simulated.center_of_mass());
        let radius = graspd_eval::largest_radius(&object.source.mesh.vertices, middle);
        let mut sum = 0.0;
        let weight = |pair: &AntipodalPair| {
            let thinness = 1.0 - pair.thickness / span;
            let remoteness = ((pair.center - middle.coords).norm() / radius).min(1.0);
            sum += thinness * thinness * (1.0 - REMOTE_DISCOUNT * remoteness);
            sum
        };
        Ok(Self {
            weights: pairs.iter().map(weight).collect(),
            object,
            hand,
            apertures,
            pairs,
            thinnest,
        })
    }

    /// Says so if the hand cannot close around any part of the object.
    pub(crate) fn warning(&self) -> Option<String> {
        let [held, thinnest] = [Some(SPAN_SHARE * self.apertures.span()), self.thinnest]
            .map(|length| length.map(|length| format!("{:.0} mm", 1e3 * length)));
        let thinnest = thinnest.map_or("has no two opposite sides within reach".into(), |it| {
            format!("is {it} thick where it is thinnest")
        });
        self.pairs.is_empty().then(|| {
            format!(
                "{} can hardly hold {}: it closes around what is up to {} thick, and the object {thinnest}",
                self.hand.name(),
                self.object.source.name,
                held.unwrap_or_default(),
            )
        })
    }

    /// Returns the start of this number, a pure function of (seed, object, hand, number); `None` if it is not one of
    /// these, or no pose was found.
    pub(crate) fn start(&self, seed: u64, number: usize) -> Option<HandPose> {
        if !number.is_multiple_of(EVERY) {
            return None;
        }
        let name = format!("{}, antipodal", self.hand.name());
        self.draw(&mut start_rng(
            seed,
            &self.object.source.name,
            &name,
            number,
        ))
    }

    /// Draws an aperture of the hand around an antipodal pair that is a little less thick, the axes aligned, turned
    /// about them at random; of some such poses that do not touch the object takes the one with most skin near it.
    fn draw(&self, rng: &mut impl Rng) -> Option<HandPose> {
        let total = *self.weights.last()?;
        let mut free: Vec<(f64, HandPose)> = Vec::new();
        for _ in 0..TRIALS {
            let drawn = rng.random_range(0.0..total);
            let pair = &self.pairs[self.weights.partition_point(|sum| *sum <= drawn)];
            let widest = pair.thickness * (1.0 + GAP_SHARE) + MAX_GAP;
            let apertures = (self.apertures).between(pair.thickness + MIN_GAP, widest);
            if apertures.is_empty() {
                continue;
            }
            let aperture = &apertures[rng.random_range(0..apertures.len())];
            let roll = rng.random_range(0.0..std::f64::consts::TAU);
            let axis = if rng.random() { pair.axis } else { -pair.axis };
            let base = placed(aperture, &pair.center, &axis, roll);
            if let Some(nearness) = self.nearness(aperture, &base) {
                free.push((nearness, self.pose(aperture, &base)));
            }
            if free.len() == FREE {
                break;
            }
        }
        free.sort_by(|a, b| b.0.total_cmp(&a.0));
        let simulation = SimulationParams::default();
        let mut scene = Scene::<f64>::new(self.hand, &self.object.simulated, &simulation);
        let mut poses = free.into_iter().map(|(_, pose)| pose);
        poses.find(|pose| {
            scene.place(pose);
            scene.closest_distance() > 0.0
        })
    }

    fn pose(&self, aperture: &Aperture, base: &Isometry3<f64>) -> HandPose {
        HandPose {
            translation: Vec3::from(base.translation.vector),
            rotation: base.rotation.into(),
            articulation: (self.apertures.preshapes[aperture.preshape].articulation).clone(),
        }
    }

    /// Counts the skin near the object that faces it, less what would only push it to one side; `None` if the hand
    /// touches.
    fn nearness(&self, aperture: &Aperture, base: &Isometry3<f64>) -> Option<f64> {
        let sdf = self.object.simulated.sdf();
        let preshape = &self.apertures.preshapes[aperture.preshape];
        let at = |point: &Vector3<f64>| Vec3::from(base.rotation * point + base.translation.vector);
        let mut spheres = preshape.spheres.iter();
        if spheres.any(|(center, radius)| sdf.distance(at(center)) < SPHERE_SHARE * radius) {
            return None;
        }
        let (mut sum, mut push) = (0.0, Vector3::zeros());
        for skin in &preshape.skin {
            let (distance, outward) = sdf.distance_and_gradient(at(&skin.point));
            if distance < CLEARANCE {
                return None;
            }
            let outward = Vector3::from(outward);
            let facing = -(base.rotation * skin.normal).dot(&outward);
            let gain = facing.max(0.0) / (1.0 + (distance / REACH).powi(2));
            sum += gain;
            push += outward * gain;
        }
        Some(sum - push.norm())
    }
}

/// Returns where the hand's base has to be for an aperture to lie around `center`, along `axis`.
fn placed(
    aperture: &Aperture,
    center: &Vector3<f64>,
    axis: &Vector3<f64>,
    roll: f64,
) -> Isometry3<f64> {
    let half_turn = || {
        let other = Vector3::ith(aperture.axis.iamin(), 1.0).cross(&aperture.axis);
        UnitQuaternion::from_scaled_axis(other.normalize() * std::f64::consts::PI)
    };
    let aligned = UnitQuaternion::rotation_between(&aperture.axis, axis).unwrap_or_else(half_turn);
    let rotation = UnitQuaternion::from_scaled_axis(axis * roll) * aligned;
    Isometry3::from_parts(
        Translation3::from(center - rotation * aperture.center),
        rotation,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NamedMesh;
    use graspd_geom::{TriangleMesh, box_mesh, cylinder_mesh, sphere_mesh};
    use graspd_hand::builtin_hand;

    fn object(name: &str, mesh: TriangleMesh) -> GraspObject {
        let source = NamedMesh {
            name: name.into(),
            path: None,
            scale: 1.0,
            mesh,
            repair: None,
        };
        GraspObject::prepare(source, 64, 1000.0, &|_| {}).expect("it is closed")
    }

    fn surface(object: &GraspObject) -> SurfaceSampler<'_> {
        SurfaceSampler::new(&object.source.mesh).expect("it has an area")
    }

    #[test]
    fn the_thickness_is_that_of_boxes_and_cylinders() {
        let hand = builtin_hand("allegro").expect("it is built in");
        let sides = [0.02, 0.05, 0.11];
        let brick = object("brick", box_mesh(sides.into(), 0.02));
        let starts = AntipodalStarts::new(&brick, &*hand, &surface(&brick)).expect("as usual");
        for pair in &starts.pairs {
            let side = sides[pair.axis.iamax()];
            assert!((pair.thickness - side).abs() < 1e-9, "{pair:?}");
            assert!(pair.center[pair.axis.iamax()].abs() < 1e-9, "{pair:?}");
        }
        assert_eq!(starts.pairs.len(), SURFACE_POINTS);
        let rod = object("rod", cylinder_mesh(0.005, 0.1, 0.002));
        let starts = AntipodalStarts::new(&rod, &*hand, &surface(&rod)).expect("as usual");
        let across = starts.pairs.iter().filter(|pair| pair.axis.z.abs() < 0.5);
        let across: Vec<f64> = across.map(|pair| pair.thickness).collect();
        assert!(across.len() > SURFACE_POINTS / 2);
        assert!(
            across.iter().all(|it| (0.009..0.0101).contains(it)),
            "{across:?}"
        );
    }

    #[test]
    fn a_start_is_a_pure_function_and_around_the_object_but_never_inside() {
        for name in ["allegro", "human"] {
            let hand = builtin_hand(name).expect("it is built in");
            let brick = object("brick", box_mesh([0.03, 0.05, 0.1].into(), 0.02));
            let starts = AntipodalStarts::new(&brick, &*hand, &surface(&brick)).expect("as usual");
            assert_eq!(starts.warning(), None);
            for number in (0..16).step_by(EVERY) {
                let pose = starts.start(0, number).expect("it is thin enough");
                assert_eq!(starts.start(0, number), Some(pose.clone()));
                assert_ne!(starts.start(1, number), Some(pose.clone()));
                assert_eq!(starts.start(0, number + 1), None);
                let vertices = hand.surface(&pose).vertices;
                let distances = vertices.iter().map(|v| brick.distance.signed_distance(v));
                let closest = distances.fold(f64::INFINITY, f64::min);
                assert!((0.0..0.02).contains(&closest), "{name} {number}: {closest}");
            }
        }
    }

    #[test]
    fn what_is_too_thick_is_said_so_and_has_no_such_start() {
        for name in ["human", "allegro"] {
            let hand = builtin_hand(name).expect("it is built in");
            let ball = object("ball", sphere_mesh(0.1, 0.01));
            let starts = AntipodalStarts::new(&ball, &*hand, &surface(&ball)).expect("as usual");
            assert_eq!(starts.start(0, 0), None);
            let warning = starts.warning().expect("200 mm are too many");
            let is_plain = warning.contains("mm thick, and the object is 1");
            assert!(
                is_plain || warning.contains("mm thick, and the object is 200"),
                "{warning}"
            );
        }
    }
}
