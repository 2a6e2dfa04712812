//! The cost of a pose, and its normal equations.

use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPoint, HandPose, JacobianRows, PointForces, PosedHand};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::cost::ContactCost;
use crate::distance_field::{Answer, DistanceField, LookUpScratch, Query, STEEPEST};
use crate::medial_spheres::MedialSpheres;
use crate::normal_equations::NormalEquations;
use crate::settings::SkinFitSettings;
use crate::skin::SkinSamples;

/// Self-intersections are counted in this unit \[m\].
const INTERSECTION_UNIT: f64 = 1e-3;
/// Joints with a smaller range than this count as if they had it \[rad\]: play is no reason to be stiff.
const MIN_RANGE: f64 = 0.05;

/// Where the skin and the collision spheres of a posed hand are with respect to the object.
#[derive(Debug, Default)]
pub(crate) struct Placement {
    hand: PosedHand,
    skin: Vec<SkinPoint>,
    balls: Vec<Ball>,
}

/// A point of the skin.
#[derive(Clone, Copy, Debug)]
struct SkinPoint {
    /// Where it was when its distance was looked up: it has not come within reach since.
    seen_at: Vector3<f64>,
    /// Signed distance there \[m\].
    distance: f64,
    /// The object's outward unit normal, or 0.
    normal: Vector3<f64>,
}

/// A medial sphere of the hand.
#[derive(Clone, Copy, Debug)]
struct Ball {
    /// Where its centre was when its distance was looked up.
    seen_at: Vector3<f64>,
    distance: f64,
    /// How much nearer the object is to its centre than its radius \[m\]; 0 if it is not.
    lack: f64,
    /// The object's outward unit normal at its centre, or 0.
    normal: Vector3<f64>,
}

impl Placement {
    /// Signed distance of each point of the skin \[m\]; of one out of reach, what it was when it was last looked up.
    pub(crate) fn distances(&self) -> impl Iterator<Item = f64> + Clone {
        self.skin.iter().map(|point| point.distance)
    }
}

/// A pair of spheres that overlap.
struct Overlap {
    pair: [u32; 2],
    depth: f64,
    /// From the second to the first.
    direction: Vector3<f64>,
}

/// The pairs of spheres that overlap.
fn overlaps<'p>(
    hand: &'p dyn Hand,
    placement: &'p Placement,
) -> impl Iterator<Item = Overlap> + 'p {
    let spheres = hand.collision_spheres();
    let centers = &placement.hand.spheres;
    let overlap = move |&pair: &[u32; 2]| {
        let [first, second] = pair.map(|sphere| sphere as usize);
        let between = centers[first] - centers[second];
        let reach = spheres.radius[first] + spheres.radius[second];
        if between.norm_squared() >= reach * reach {
            return None;
        }
        // No direction parts concentric spheres.
        let direction = between.try_normalize(0.0)?;
        let depth = reach - between.norm();
        (depth > 0.0).then_some(Overlap {
            pair,
            depth,
            direction,
        })
    };
    spheres.pairs.iter().filter_map(overlap)
}

/// The cost as a function of the pose: that of all points of the skin, of posture and of self-intersection.
pub(crate) struct PoseCost<'a> {
    hand: &'a dyn Hand,
    field: &'a dyn DistanceField,
    skin: &'a SkinSamples,
    spheres: &'a MedialSpheres,
    /// No cost looks at skin farther from the object than this \[m\].
    horizon: f64,
    /// The relaxed posture and the weight of each joint's distance from it.
    posture: Vec<(f64, f64)>,
    intersection_factor: f64,
    matrix: NormalEquations,
    pulls: Vec<PointForces>,
    /// Slope and weight of each pull.
    terms: Vec<(f64, f64)>,
    rows: JacobianRows,
    /// The points that are looked up, and what they are of the skin or the medial spheres.
    queries: Vec<Query>,
    asked: Vec<u32>,
    answers: Vec<Answer>,
    look_up: LookUpScratch,
}

impl<'a> PoseCost<'a> {
    /// `farthest`: no cost that is going to be asked for looks at skin farther from the object \[m\].
    pub(crate) fn new(
        hand: &'a dyn Hand,
        field: &'a dyn DistanceField,
        skin: &'a SkinSamples,
        spheres: &'a MedialSpheres,
        settings: &SkinFitSettings,
        farthest: f64,
    ) -> Self {
        let joints = hand.open_articulation().len();
        let posture_weight = settings.posture_weight;
        // Coefficients of hands in MANO's layout are counted from the relaxed hand.
        let relaxed_at_zero = hand.is_soft();
        let posture = (0..joints).map(|joint| match hand.limits() {
            Some(limits) => {
                let limit = limits[joint];
                let range = limit.range().max(MIN_RANGE);
                let middle = if relaxed_at_zero { 0.0 } else { limit.middle() };
                // An unlimited joint has no preference.
                (middle, posture_weight / (range * range))
            }
            None => (0.0, posture_weight),
        });
        Self {
            hand,
            field,
            skin,
            spheres,
            horizon: farthest,
            posture: posture.collect(),
            intersection_factor: settings.intersection_weight / INTERSECTION_UNIT.powi(2),
            matrix: NormalEquations::new(hand.jacobian_basis(), joints),
            pulls: Vec::new(),
            terms: Vec::new(),
            rows: JacobianRows::default(),
            queries: Vec::new(),
            asked: Vec::new(),
            answers: Vec::new(),
            look_up: LookUpScratch::default(),
        }
    }

    /// Puts the hand somewhere: `placement` is overwritten. Of points that cannot have come within
    /// reach since `before`, the distance is not looked up again.
    pub(crate) fn place(
        &mut self,
        pose: &HandPose,
        before: Option<&Placement>,
        placement: &mut Placement,
    ) {
        self.hand.pose(pose, &mut placement.hand);
        self.place_skin(before, placement);
        self.place_medial_spheres(before, placement);
    }

    fn place_skin(&mut self, before: Option<&Placement>, placement: &mut Placement) {
        let vertices = &placement.hand.vertices[..];
        self.begin_look_up();
        placement.skin.clear();
        for number in 0..self.skin.len() {
            let position = self.skin.position(vertices, number);
            let last = before.map(|before| &before.skin[number]);
            placement.skin.push(match last {
                Some(last) if is_beyond(last.distance - self.horizon, &last.seen_at, &position) => {
                    *last
                }
                _ => {
                    self.ask(
                        number,
                        position,
                        last.map(|last| (last.seen_at, last.distance)),
                    );
                    SkinPoint {
                        seen_at: position,
                        distance: 0.0,
                        normal: Vector3::zeros(),
                    }
                }
            });
        }
        self.look_up();
        for (&number, answer) in self.asked.iter().zip(&self.answers) {
            let point = &mut placement.skin[number as usize];
            (point.distance, point.normal) = (answer.distance, answer.normal);
        }
    }

    fn place_medial_spheres(&mut self, before: Option<&Placement>, placement: &mut Placement) {
        let vertices = &placement.hand.vertices[..];
        self.begin_look_up();
        placement.balls.clear();
        for number in 0..self.spheres.len() {
            let center = self.spheres.center(vertices, number);
            let radius = self.spheres.radius(number);
            let last = before.map(|before| &before.balls[number]);
            placement.balls.push(match last {
                Some(last) if is_beyond(last.distance - radius, &last.seen_at, &center) => *last,
                _ => {
                    self.ask(
                        number,
                        center,
                        last.map(|last| (last.seen_at, last.distance)),
                    );
                    Ball {
                        seen_at: center,
                        distance: 0.0,
                        lack: 0.0,
                        normal: Vector3::zeros(),
                    }
                }
            });
        }
        self.look_up();
        for (&number, answer) in self.asked.iter().zip(&self.answers) {
            let ball = &mut placement.balls[number as usize];
            (ball.distance, ball.normal) = (answer.distance, answer.normal);
            ball.lack = (self.spheres.radius(number as usize) - answer.distance).max(0.0);
        }
    }

    fn begin_look_up(&mut self) {
        self.queries.clear();
        self.asked.clear();
    }

    fn ask(&mut self, number: usize, at: Vector3<f64>, seen: Option<(Vector3<f64>, f64)>) {
        self.queries.push(Query { at, seen });
        self.asked.push(number as u32);
    }

    fn look_up(&mut self) {
        (self.field).look_up(&self.queries, &mut self.look_up, &mut self.answers);
    }

    /// The cost of a pose, placed.
    pub(crate) fn value(&self, pose: &HandPose, placement: &Placement, cost: &ContactCost) -> f64 {
        let farthest = cost.farthest().max(0.0);
        let skin = placement
            .skin
            .iter()
            .filter(|point| point.distance < farthest);
        let skin: f64 = skin.map(|point| cost.value(point.distance)).sum();
        let joints = pose.articulation.iter().zip(&self.posture);
        let posture: f64 = joints
            .map(|(value, (relaxed, weight))| weight * (value - relaxed).powi(2))
            .sum();
        let overlap: f64 = overlaps(self.hand, placement)
            .map(|o| o.depth * o.depth)
            .sum();
        let cut = placement.balls.iter().filter(|ball| ball.lack > 0.0);
        let spheres: f64 = cut.map(|ball| cost.medial_value(ball.lack)).sum();
        skin + spheres + posture + self.intersection_factor * overlap
    }

    /// Computes the Gauss-Newton matrix and the gradient of the cost by (translation, rotation vector in the object
    /// frame, joints).
    pub(crate) fn normal_equations(
        &mut self,
        pose: &HandPose,
        placement: &Placement,
        cost: &ContactCost,
    ) -> (&DMatrix<f64>, &DVector<f64>) {
        self.linearize(pose, placement, cost, None)
    }

    /// The same with, in place of the gradient, its change where the distance changes by `change` \[m\] at each point.
    pub(crate) fn change_of_gradient(
        &mut self,
        pose: &HandPose,
        placement: &Placement,
        cost: &ContactCost,
        change: &dyn Fn(Vector3<f64>) -> f64,
    ) -> (&DMatrix<f64>, &DVector<f64>) {
        self.linearize(pose, placement, cost, Some(change))
    }

    fn linearize(
        &mut self,
        pose: &HandPose,
        placement: &Placement,
        cost: &ContactCost,
        change: Option<&dyn Fn(Vector3<f64>) -> f64>,
    ) -> (&DMatrix<f64>, &DVector<f64>) {
        let vertices = &placement.hand.vertices[..];
        let slope_of = |slope: f64, weight: f64, at: Vector3<f64>| match change {
            None => slope,
            Some(change) => weight * change(at),
        };
        self.pulls.clear();
        self.terms.clear();
        for (number, point) in placement.skin.iter().enumerate() {
            let (slope, weight) = cost.slope_and_weight(point.distance);
            if weight > 0.0 {
                let slope = slope_of(slope, weight, point.seen_at);
                self.pulls.push(self.skin.pull(number, &point.normal));
                self.terms.push((slope, weight));
            }
        }
        for (number, ball) in placement.balls.iter().enumerate() {
            let (slope, weight) = cost.medial_slope_and_weight(ball.lack);
            if weight > 0.0 {
                let slope = slope_of(slope, weight, ball.seen_at);
                self.pulls
                    .push(self.spheres.pull(vertices, number, &ball.normal));
                self.terms.push((slope, weight));
            }
        }
        let factor = 2.0 * self.intersection_factor;
        let own = if change.is_some() { 0.0 } else { 1.0 };
        for overlap in overlaps(self.hand, placement) {
            let [first, second] = overlap.pair.map(HandPoint::Sphere);
            let apart = Vec3::from(overlap.direction);
            self.pulls.push(PointForces {
                points: [(first, apart), (second, -apart), (first, Vec3::zero())],
            });
            // The depth falls as they part.
            self.terms.push((-own * factor * overlap.depth, factor));
        }
        self.hand
            .jacobian_rows(pose, &placement.hand, &self.pulls, &mut self.rows);
        self.matrix.clear();
        for (row, &(slope, weight)) in self.rows.iter().zip(&self.terms) {
            self.matrix.add(&row, slope, weight);
        }
        let (matrix, gradient) = self.matrix.finish();
        for (joint, (value, (relaxed, weight))) in
            pose.articulation.iter().zip(&self.posture).enumerate()
        {
            matrix[(6 + joint, 6 + joint)] += 2.0 * weight;
            gradient[6 + joint] += own * 2.0 * weight * (value - relaxed);
        }
        (matrix, gradient)
    }
}

/// Whether a point that was by `margin` beyond some distance still is, after moving from one place to another.
#[inline]
fn is_beyond(margin: f64, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
    margin > 0.0 && (to - from).norm_squared() * (STEEPEST * STEEPEST) < margin * margin
}
