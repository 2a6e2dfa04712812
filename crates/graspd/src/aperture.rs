//! Around what a hand can close: places of its skin that face each other and move towards each other.

use graspd_geom::{GeometryError, TriangleTree};
use graspd_hand::{
    Hand, HandPose, Kinematics, Limit, PointBuffer, PosedHand, closed_articulation,
    closing_directions,
};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Seed of the ways to close the hand; any would do.
const SEED: u64 = 11;
/// Ways to close the hand, and at which shares of each, until the hand meets itself, there is a preshape.
const CLOSINGS: usize = 96;
const STAGES: [f64; 6] = [1.0, 0.95, 0.88, 0.76, 0.6, 0.35];
/// Least share of its range by which a joint takes part in closing.
const MIN_SHARE: f64 = 0.3;
/// How far a joint that does not close is moved from the open hand, of the way to a value drawn from its range.
const SIDEWAYS: f64 = 0.5;
/// Bisections for where the hand meets itself: where collision spheres overlap by more than this \[m\].
const BISECTIONS: usize = 6;
const MAX_OVERLAP: f64 = 2e-3;
/// The part of the way by which the hand closes on to see where its skin goes.
const CLOSING_STEP: f64 = 0.02;
/// Skin points that stand for the hand.
const SKIN_POINTS: usize = 800;
/// Cosine of the largest angle between a normal and the line to the opposite side: about the friction cone's.
pub(crate) const MIN_FACING: f64 = 0.8;
/// Two places come nearer to each other by at least this share of what they move.
const MIN_APPROACH: f64 = 0.5;
/// Least width of an aperture \[m\], and the ratio of widths from one bin to the next.
const MIN_WIDTH: f64 = 3e-3;
const BIN_RATIO: f64 = 1.25;
/// Apertures that are kept in each bin of widths, those that most skin faces.
const KEPT: usize = 48;
/// Skin farther than about this from a thing in the aperture does not count for it \[m\].
pub(crate) const REACH: f64 = 8e-3;
/// What the span can hold is faced by at least this share of the most skin that faces anything.
const SPAN_SUPPORT: f64 = 0.4;

/// A point of the skin, frame of the hand's base.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SkinPoint {
    /// Where it is \[m\].
    pub(crate) point: Vector3<f64>,
    /// Outward unit normal.
    pub(crate) normal: Vector3<f64>,
    /// Where it goes when the hand closes by [`CLOSING_STEP`] more \[m\].
    movement: Vector3<f64>,
}

/// A posture before grasping, with the base at the origin.
#[derive(Clone, Debug)]
pub(crate) struct Preshape {
    pub(crate) articulation: Vec<f64>,
    pub(crate) skin: Vec<SkinPoint>,
    /// Centre \[m\] and radius \[m\] of each collision sphere.
    pub(crate) spheres: Vec<(Vector3<f64>, f64)>,
}

/// Two places of the skin that face each other and come nearer when the hand closes, frame of its base.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aperture {
    /// Index of its preshape.
    pub(crate) preshape: usize,
    /// Halfway between the two \[m\].
    pub(crate) center: Vector3<f64>,
    /// Unit vector from one to the other.
    pub(crate) axis: Vector3<f64>,
    /// Distance between the two \[m\].
    pub(crate) width: f64,
    /// How much of the skin faces its centre from about half its width, in points.
    support: f64,
}

/// The apertures of a hand, narrow ones first.
#[derive(Clone, Debug)]
pub(crate) struct Apertures {
    pub(crate) preshapes: Vec<Preshape>,
    apertures: Vec<Aperture>,
}

impl Apertures {
    /// Finds the apertures of a hand that closes in random ways. A pure function of the hand.
    ///
    /// # Errors
    /// If the hand's surface has no triangles.
    pub(crate) fn new(hand: &dyn Hand) -> Result<Self, GeometryError> {
        let skin = Skin::new(hand)?;
        let found: Vec<(Preshape, Vec<Aperture>)> = (skin.closings().par_iter())
            .flat_map_iter(|closing| skin.preshapes(closing))
            .map(|preshape| {
                let apertures = apertures(&preshape.skin);
                (preshape, apertures)
            })
            .collect();
        let (preshapes, found): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let mut all: Vec<Aperture> = Vec::new();
        for (preshape, own) in found.into_iter().enumerate() {
            all.extend(own.into_iter().map(|it| Aperture { preshape, ..it }));
        }
        let most = all.iter().map(|it| it.support).fold(0.0, f64::max);
        let wide = all.iter().filter(|it| it.support > SPAN_SUPPORT * most);
        let span = wide.map(|it| it.width).fold(0.0, f64::max);
        all.retain(|it| it.width <= span);
        all.sort_by(|a, b| {
            let bins = bin(a.width).cmp(&bin(b.width));
            bins.then(b.support.total_cmp(&a.support))
        });
        let bins = all.chunk_by(|a, b| bin(a.width) == bin(b.width));
        let mut apertures: Vec<Aperture> = bins
            .flat_map(|same| same.iter().take(KEPT).copied())
            .collect();
        apertures.sort_by(|a, b| a.width.total_cmp(&b.width));
        Ok(Self {
            preshapes,
            apertures,
        })
    }

    /// Returns the width of the widest aperture \[m\]; 0 where the hand closes around nothing.
    pub(crate) fn span(&self) -> f64 {
        self.apertures.last().map_or(0.0, |widest| widest.width)
    }

    /// Returns the apertures at least `lowest` and less than `highest` wide \[m\].
    pub(crate) fn between(&self, lowest: f64, highest: f64) -> &[Aperture] {
        let below = |width: f64| self.apertures.partition_point(|it| it.width < width);
        &self.apertures[below(lowest)..below(highest).max(below(lowest))]
    }
}

/// Returns the number of the bin of an aperture's width.
fn bin(width: f64) -> usize {
    ((width / MIN_WIDTH).ln() / BIN_RATIO.ln()).max(0.0) as usize
}

/// Finds the apertures of a preshape: of each bin of widths the one whose sides face each other best.
fn apertures(skin: &[SkinPoint]) -> Vec<Aperture> {
    let mut best: Vec<Option<(f64, Aperture)>> = Vec::new();
    let inner: Vec<&SkinPoint> = (skin.iter())
        .filter(|it| it.movement.dot(&it.normal) >= 0.0)
        .collect();
    for (index, from) in inner.iter().enumerate() {
        for to in &inner[index + 1..] {
            let between = to.point - from.point;
            let along = (from.normal.dot(&between)).min(-to.normal.dot(&between));
            if along <= 0.0 {
                continue;
            }
            let width = between.norm();
            let nearing = (from.movement - to.movement).dot(&between);
            let moved = from.movement.norm() + to.movement.norm();
            let is_closing = nearing > MIN_APPROACH * moved * width;
            if width < MIN_WIDTH || along < MIN_FACING * width || !is_closing {
                continue;
            }
            let (bin, facing) = (bin(width), along / width);
            best.resize(best.len().max(bin + 1), None);
            if best[bin].is_none_or(|(most, _)| facing > most) {
                let aperture = Aperture {
                    preshape: 0,
                    center: (from.point + to.point) / 2.0,
                    axis: between / width,
                    width,
                    support: 0.0,
                };
                best[bin] = Some((facing, aperture));
            }
        }
    }
    let supported = best.into_iter().flatten().map(|(_, it)| Aperture {
        support: support(skin, it.center, it.width),
        ..it
    });
    supported.collect()
}

/// Counts the skin that faces a centre from half the width away.
fn support(skin: &[SkinPoint], center: Vector3<f64>, width: f64) -> f64 {
    let gain = |it: &SkinPoint| {
        let inward = center - it.point;
        let distance = inward.norm();
        let off = (distance - width / 2.0) / REACH;
        (it.normal.dot(&inward) / distance.max(MIN_WIDTH)).max(0.0) / (1.0 + off * off)
    };
    skin.iter().map(gain).sum()
}

/// The contact points that stand for the hand.
struct Skin<'a> {
    hand: &'a dyn Hand,
    /// Index of each into [`Hand::contact_points`].
    points: Vec<usize>,
    /// The face that each lies on.
    faces: Vec<[u32; 3]>,
}

impl<'a> Skin<'a> {
    fn new(hand: &'a dyn Hand) -> Result<Self, GeometryError> {
        let tree = TriangleTree::new(&hand.surface_at_rest())?;
        let contacts = hand.contact_points();
        let stride = contacts.count.div_ceil(SKIN_POINTS).max(1);
        let real = (0..contacts.weight.len()).filter(|&point| contacts.weight[point] > 0.0);
        let points: Vec<usize> = real.step_by(stride).collect();
        let (open, _) = forward(hand, &HandPose::at_origin(hand.open_articulation()));
        let face = |&point: &usize| hand.faces()[tree.closest(&open.get(point).into()).face];
        Ok(Self {
            hand,
            faces: points.iter().map(face).collect(),
            points,
        })
    }

    /// Draws ways to close the hand: an articulation, and its change until some joint is closed.
    fn closings(&self) -> Vec<[Vec<f64>; 2]> {
        let hand = self.hand;
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let (open, closed) = (hand.open_articulation(), closed_articulation(hand, 1.0));
        let closing = closing_directions(hand);
        let unlimited = vec![Limit::UNLIMITED; open.len()];
        let limits = hand.limits().unwrap_or(&unlimited);
        let mut joint = |joint: usize| {
            let share = rng.random_range(MIN_SHARE..1.0);
            let drawn = limits[joint].sample(&mut rng);
            if closing[joint] == 0.0 {
                (open[joint] + SIDEWAYS * (drawn - open[joint]), 0.0)
            } else {
                (open[joint], share * (closed[joint] - open[joint]))
            }
        };
        let closings = (0..CLOSINGS).map(|_| (0..open.len()).map(&mut joint).unzip());
        closings.map(|(start, change)| [start, change]).collect()
    }

    /// Closes the hand until it meets itself, and poses the skin at some shares of that way.
    fn preshapes(&self, [start, change]: &[Vec<f64>; 2]) -> Vec<Preshape> {
        let at = |way: f64| {
            let joints = start.iter().zip(change);
            let joints = joints.map(|(start, change)| start + way * change);
            HandPose::at_origin(joints.collect::<Vec<_>>())
        };
        let is_free = |way: f64| !meets_itself(self.hand, &at(way));
        let (mut low, mut high) = (0.0, 1.0);
        if is_free(high) {
            low = high;
        } else if !is_free(low) {
            return Vec::new();
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            let bound = if is_free(middle) { &mut low } else { &mut high };
            *bound = middle;
        }
        let preshape = |share| self.preshape(&at(share * low), &at(share * low + CLOSING_STEP));
        STAGES.into_iter().map(preshape).collect()
    }

    fn preshape(&self, pose: &HandPose, next: &HandPose) -> Preshape {
        let mut posed = PosedHand::default();
        self.hand.pose(pose, &mut posed);
        let (contacts, centers) = forward(self.hand, pose);
        let (moved, _) = forward(self.hand, next);
        let skin = self.points.iter().zip(&self.faces).map(|(&point, face)| {
            let [a, b, c] = face.map(|vertex| posed.vertices[vertex as usize]);
            SkinPoint {
                point: contacts.get(point).into(),
                normal: ((b - a).cross(&(c - a)))
                    .try_normalize(0.0)
                    .unwrap_or_default(),
                movement: (moved.get(point) - contacts.get(point)).into(),
            }
        });
        let spheres = self.hand.collision_spheres().radius.iter().enumerate();
        Preshape {
            skin: skin.collect(),
            spheres: spheres
                .map(|(sphere, radius)| (centers.get(sphere).into(), *radius))
                .collect(),
            articulation: pose.articulation.clone(),
        }
    }
}

fn meets_itself(hand: &dyn Hand, pose: &HandPose) -> bool {
    let (_, centers) = forward(hand, pose);
    let spheres = hand.collision_spheres();
    spheres.pairs.iter().any(|pair| {
        let [a, b] = pair.map(|sphere| sphere as usize);
        let distance = (centers.get(a) - centers.get(b)).norm();
        spheres.radius[a] + spheres.radius[b] - distance > MAX_OVERLAP
    })
}

/// Computes where contact points and collision spheres are.
fn forward(hand: &dyn Hand, pose: &HandPose) -> (PointBuffer<f64>, PointBuffer<f64>) {
    let mut contacts = PointBuffer::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    let mut scratch = hand.new_scratch();
    Kinematics::<f64>::forward(hand, pose, &mut scratch, &mut contacts, &mut spheres);
    (contacts, spheres)
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_hand::builtin_hand;

    #[test]
    fn hands_close_around_what_is_thinner_than_their_span() {
        let spans = [
            ("allegro", 0.12, 0.22),
            ("human", 0.08, 0.15),
            ("barrett", 0.15, 0.35),
        ];
        for (name, least, most) in spans {
            let hand = builtin_hand(name).expect("it is built in");
            let apertures = Apertures::new(&*hand).expect("it has a surface");
            assert!(
                (least..most).contains(&apertures.span()),
                "{name}: {}",
                apertures.span()
            );
            for [low, high] in [[0.0, 0.03], [0.03, 0.05], [0.06, 0.1]] {
                let count = apertures.between(low, high).len();
                assert!(count > 4, "{name}: {count} from {low} to {high} m");
            }
        }
    }

    #[test]
    fn preshapes_do_not_intersect_themselves_and_keep_their_limits() {
        let hand = builtin_hand("allegro").expect("it is built in");
        let apertures = Apertures::new(&*hand).expect("it has a surface");
        let limits = hand.limits().expect("its joints have limits");
        for preshape in &apertures.preshapes {
            assert!(!meets_itself(
                &*hand,
                &HandPose::at_origin(&preshape.articulation[..])
            ));
            for (joint, limit) in preshape.articulation.iter().zip(limits) {
                assert!(limit.contains(*joint));
            }
        }
    }
}
