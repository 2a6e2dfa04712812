//! The depth of the origin once it is inside: of the growing polytope, only the facets nearer than a known bound.
//!
//! A facet with vertices w_1 ... w_D is the point u with `w_i . u = 1` of the polar polytope `{u :
//! w . u <= 1}`, and its distance from the origin is 1 / |u|. Facets farther than an upper bound on
//! the depth are the vertices inside a ball B about the origin, and never matter again: B is
//! convex, so an edge between two of them stays inside, and so do all vertices that cuts put there.
//! What is kept is therefore the vertices outside of B with their D edges, of which each leads to
//! another one, or into B. A new point p cuts off the vertices with `p . u > 1`; the new vertices
//! lie where its hyperplane meets
//!
//! * an edge from a vertex cut off to one that stays,
//! * an edge that leads into B, before it gets there. It may begin at either kind of vertex.
//!
//! Two new vertices are joined by an edge where they have all points but one in common; every other edge within the
//! hyperplane leads into B. Of a hundred thousand facets of the polytope one in ten is ever looked at.
//!
//! An edge that ought to lead into B but misses it, or more than two vertices on one edge, is the
//! work of rounding: then the caller starts over with the whole polytope, which can be checked as
//! such.

use std::collections::BinaryHeap;

use super::DepthBounds;
use super::body::Body;
use super::expansion::Queued;
use super::frame::Frame;
use super::hyperplane::{difference, dot};
use super::inverse::inverse;
use super::polytope::{NONE, Polytope, Stop};

/// The ball is smaller than the bound says by this part, so that a vertex just on it counts as outside.
const SLACK: f64 = 1e-9;
/// How far `w . u` may be off 1 for a facet's own vertices.
const RESIDUAL: f64 = 1e-12;
/// Edges are computed from those of the vertex before; this many times in a row at most.
const MAX_GENERATIONS: u8 = 6;
/// A component along an edge this much smaller than the largest is no sure pivot.
const MIN_PIVOT: f64 = 1e-9;
/// Vertices looked at together.
const BLOCK: usize = 8;

/// A vertex of the polar polytope outside of the ball.
#[derive(Clone, Copy)]
struct Vertex<const D: usize> {
    /// Edge k leaves constraint k: `w_i . edges[k]` is -1 for i = k and 0 for the others.
    edges: [[f64; D]; D],
    /// The points whose hyperplanes meet here.
    points: [u32; D],
    /// Where each edge leads; [`NONE`] for those into the ball.
    neighbours: [u32; D],
    birth: u32,
    /// How often edges were computed from others' since they were computed from the points.
    generation: u8,
}

/// A ridge of the new facets that contains the new point: the other points, and where it belongs.
type Ridge = (u128, u32, u32);

/// The vertices outside of the ball.
pub(super) struct Frontier<const D: usize> {
    /// Coordinates of the vertices, coordinate by coordinate; 0 for slots without one.
    columns: [Vec<f64>; D],
    /// The longest way along an edge of each vertex into the ball.
    reach: Vec<f64>,
    vertices: Vec<Vertex<D>>,
    free: Vec<u32>,
    queue: BinaryHeap<Queued>,
    /// `p . u` for each slot.
    products: Vec<f64>,
    /// Of the ball.
    radius_squared: f64,
    upper: f64,
    birth: u32,
    origin: [f64; D],
}

impl<const D: usize> Frontier<D> {
    /// The frontier of a polytope around the origin, given an upper bound on the depth, in the working frame.
    pub(super) fn new(frame: &Frame<D>, polytope: &Polytope<D>, upper: f64) -> Result<Self, Stop> {
        let mut frontier = Self {
            columns: std::array::from_fn(|_| Vec::new()),
            reach: Vec::new(),
            vertices: Vec::new(),
            free: Vec::new(),
            queue: BinaryHeap::new(),
            products: Vec::new(),
            radius_squared: 0.0,
            upper,
            birth: 0,
            origin: frame.in_frame(&[0.0; D]),
        };
        frontier.set_upper(upper);
        let mut slot_of = vec![NONE; polytope.slots()];
        for (old, facet) in polytope.facets() {
            let depth = frame.depth_of_origin(facet);
            if depth <= 0.0 {
                return Err(Stop::Contradiction);
            }
            let (place, edges) = frontier
                .meeting_point(frame, &facet.vertices)
                .ok_or(Stop::Contradiction)?;
            if dot(&place, &place) >= frontier.radius_squared {
                let vertex = Vertex {
                    edges,
                    points: facet.vertices,
                    neighbours: facet.neighbours,
                    birth: 0,
                    generation: 0,
                };
                slot_of[old as usize] = frontier.put(&place, vertex);
            }
        }
        for slot in 0..frontier.vertices.len() {
            let neighbours = &mut frontier.vertices[slot].neighbours;
            *neighbours = neighbours.map(|old| slot_of[old as usize]);
            frontier.measure_reach(slot as u32)?;
        }
        Ok(frontier)
    }

    /// Cuts until the farthest vertex is one of the whole body's, or as [`super::expansion::expand`] ends.
    pub(super) fn search(
        mut self,
        frame: &mut Frame<D>,
        body: &impl Body<D>,
        relative_gap: f64,
        most_vertices: usize,
    ) -> Result<DepthBounds, Stop> {
        let lower = loop {
            let Some(nearest) = self.pop_current() else {
                break self.upper;
            };
            let slot = nearest.slot as usize;
            let place = self.place(slot);
            let length = dot(&place, &place).sqrt();
            let point = body.farthest(frame, &place.map(|x| x / length));
            let step = self.relative(frame, point);
            let product = dot(&step, &place);
            if product / length < self.upper {
                self.set_upper(product / length);
                self.purge()?;
            }
            let least = 1.0 + frame.tolerance * length;
            let depth = nearest.depth;
            let is_close = self.upper - depth <= relative_gap * self.upper;
            if product <= least || is_close || self.len() > most_vertices {
                break depth.min(self.upper);
            }
            if self.vertices[slot].points.contains(&point) {
                return Err(Stop::Contradiction);
            }
            self.cut(frame, point, &step, least)?;
        };
        Ok(DepthBounds {
            lower: lower * frame.scale,
            upper: self.upper * frame.scale,
        })
    }

    fn len(&self) -> usize {
        self.vertices.len() - self.free.len()
    }

    fn place(&self, slot: usize) -> [f64; D] {
        std::array::from_fn(|k| self.columns[k][slot])
    }

    fn relative(&self, frame: &Frame<D>, point: u32) -> [f64; D] {
        difference(&frame.points[point as usize], &self.origin)
    }

    fn set_upper(&mut self, upper: f64) {
        self.upper = upper;
        self.radius_squared = (1.0 - SLACK) / (upper * upper);
    }

    /// The first of the queue that has not been cut off or swallowed by the ball.
    fn pop_current(&mut self) -> Option<Queued> {
        while let Some(queued) = self.queue.pop() {
            let vertex = &self.vertices[queued.slot as usize];
            if vertex.birth == queued.birth && self.reach[queued.slot as usize] >= 0.0 {
                return Some(queued);
            }
        }
        None
    }

    /// Stores a vertex, and notes it in the queue.
    fn put(&mut self, place: &[f64; D], vertex: Vertex<D>) -> u32 {
        let slot = match self.free.pop() {
            Some(slot) => {
                self.vertices[slot as usize] = vertex;
                slot
            }
            None => {
                self.vertices.push(vertex);
                self.reach.push(0.0);
                self.products.push(0.0);
                for column in &mut self.columns {
                    column.push(0.0);
                }
                self.vertices.len() as u32 - 1
            }
        };
        for k in 0..D {
            self.columns[k][slot as usize] = place[k];
        }
        self.reach[slot as usize] = 0.0;
        let depth = dot(place, place).sqrt().recip();
        let birth = vertex.birth;
        self.queue.push(Queued { depth, slot, birth });
        slot
    }

    fn remove(&mut self, slot: u32) {
        for column in &mut self.columns {
            column[slot as usize] = 0.0;
        }
        self.reach[slot as usize] = f64::NEG_INFINITY;
        self.free.push(slot);
    }

    /// Place and edges of the vertex where the points' hyperplanes meet, by elimination.
    fn meeting_point(
        &self,
        frame: &Frame<D>,
        points: &[u32; D],
    ) -> Option<([f64; D], [[f64; D]; D])> {
        let rows = points.map(|point| self.relative(frame, point));
        let inverse = inverse(rows)?;
        // Column k of the inverse has the product 1 with row k, and 0 with the others.
        let edges: [[f64; D]; D] =
            std::array::from_fn(|k| std::array::from_fn(|row| -inverse[row][k]));
        let place: [f64; D] = std::array::from_fn(|row| inverse[row].iter().sum());
        (self.is_on_all(frame, points, &place)).then_some((place, edges))
    }

    /// Whether a place is on the points' hyperplanes.
    fn is_on_all(&self, frame: &Frame<D>, points: &[u32; D], place: &[f64; D]) -> bool {
        let most = RESIDUAL * (1.0 + dot(place, place));
        points.iter().all(|&point| {
            let step = self.relative(frame, point);
            (dot(&step, place) - 1.0).abs() <= most
        })
    }

    /// The longest way into the ball along the edges that lead there; an error if one of them does not.
    fn measure_reach(&mut self, slot: u32) -> Result<(), Stop> {
        let mut reach = 0.0_f64;
        for k in 0..D {
            let vertex = &self.vertices[slot as usize];
            if vertex.neighbours[k] == NONE {
                let length = dot(&vertex.edges[k], &vertex.edges[k]).sqrt();
                reach = reach.max(self.way_into_ball(slot as usize, k)? * length);
            }
        }
        self.reach[slot as usize] = reach;
        Ok(())
    }

    /// After how many times edge k it gets into the ball; an error if it does not.
    fn way_into_ball(&self, slot: usize, k: usize) -> Result<f64, Stop> {
        let (place, edge) = (self.place(slot), &self.vertices[slot].edges[k]);
        let outside = (dot(&place, &place) - self.radius_squared).max(0.0);
        let (along, squared) = (-dot(&place, edge), dot(edge, edge));
        let discriminant = along * along - squared * outside;
        if along <= 0.0 || discriminant < 0.0 {
            return Err(Stop::Contradiction);
        }
        Ok(outside / (along + discriminant.sqrt()))
    }

    /// Drops the vertices that the ball has swallowed as it grew.
    fn purge(&mut self) -> Result<(), Stop> {
        let mut swallowed = Vec::new();
        for slot in 0..self.vertices.len() {
            let place = self.place(slot);
            if self.reach[slot] >= 0.0 && dot(&place, &place) < self.radius_squared {
                swallowed.push(slot as u32);
            }
        }
        let mut touched = Vec::new();
        for &slot in &swallowed {
            for neighbour in self.vertices[slot as usize].neighbours {
                if neighbour != NONE {
                    self.unlink(neighbour, slot)?;
                    touched.push(neighbour);
                }
            }
            self.remove(slot);
        }
        for slot in touched {
            if self.reach[slot as usize] >= 0.0 {
                self.measure_reach(slot)?;
            }
        }
        Ok(())
    }

    /// Edge of `slot` that led to `gone`: into the ball from now on.
    fn unlink(&mut self, slot: u32, gone: u32) -> Result<(), Stop> {
        let neighbours = &mut self.vertices[slot as usize].neighbours;
        let back = neighbours.iter().position(|&other| other == gone);
        neighbours[back.ok_or(Stop::Contradiction)?] = NONE;
        Ok(())
    }

    /// `p . u` for all slots; `p . u = 0` for those without a vertex.
    fn multiply(&mut self, step: &[f64; D]) {
        let count = self.vertices.len();
        let whole = count - count % BLOCK;
        for start in (0..whole).step_by(BLOCK) {
            let mut sums = [0.0; BLOCK];
            for k in 0..D {
                let column = &self.columns[k][start..start + BLOCK];
                for i in 0..BLOCK {
                    sums[i] += column[i] * step[k];
                }
            }
            self.products[start..start + BLOCK].copy_from_slice(&sums);
        }
        for slot in whole..count {
            self.products[slot] = dot(&self.place(slot), step);
        }
    }

    /// Cuts off the vertices beyond the hyperplane of a point.
    fn cut(
        &mut self,
        frame: &Frame<D>,
        point: u32,
        step: &[f64; D],
        least: f64,
    ) -> Result<(), Stop> {
        self.birth += 1;
        self.multiply(step);
        let length = dot(step, step).sqrt();
        let mut visible = Vec::new();
        let mut fresh: Vec<u32> = Vec::new();
        let mut touched: Vec<u32> = Vec::new();
        for slot in 0..self.vertices.len() {
            let product = self.products[slot];
            if product > least {
                visible.push(slot as u32);
            } else if product > least - length * self.reach[slot] && self.reach[slot] > 0.0 {
                // A vertex that stays, with an edge into the ball that may be cut on its way.
                for k in 0..D {
                    if self.vertices[slot].neighbours[k] == NONE {
                        let new = self.on_edge(frame, slot, k, point, step, least)?;
                        if let Some(new) = new {
                            self.vertices[new as usize].neighbours[k] = slot as u32;
                            self.vertices[slot].neighbours[k] = new;
                            fresh.push(new);
                            touched.push(slot as u32);
                        }
                    }
                }
            }
        }
        for &slot in &visible {
            for k in 0..D {
                let beyond = self.vertices[slot as usize].neighbours[k];
                if beyond == NONE {
                    fresh.extend(self.on_edge(frame, slot as usize, k, point, step, least)?);
                } else if self.products[beyond as usize] <= least {
                    let new = self.on_edge(frame, slot as usize, k, point, step, least)?;
                    let neighbours = &mut self.vertices[beyond as usize].neighbours;
                    let back = neighbours.iter().position(|&other| other == slot);
                    neighbours[back.ok_or(Stop::Contradiction)?] = new.unwrap_or(NONE);
                    match new {
                        Some(new) => {
                            self.vertices[new as usize].neighbours[k] = beyond;
                            fresh.push(new);
                        }
                        None => touched.push(beyond),
                    }
                }
            }
        }
        for &slot in &visible {
            self.remove(slot);
        }
        self.link(&fresh, point)?;
        for &slot in fresh.iter().chain(&touched) {
            self.measure_reach(slot)?;
        }
        Ok(())
    }

    /// The vertex where a point's hyperplane meets edge k, if it does before the edge gets into the ball.
    ///
    /// It does where one end of the edge is cut off and the other stays, and ends are judged as
    /// vertices are: what is beyond the hyperplane by no more than rounding stays. An edge into the
    /// ball ends where it gets there.
    fn on_edge(
        &mut self,
        frame: &Frame<D>,
        slot: usize,
        k: usize,
        point: u32,
        step: &[f64; D],
        least: f64,
    ) -> Result<Option<u32>, Stop> {
        let from = &self.vertices[slot];
        let edge = from.edges[k];
        let share = -dot(step, &edge);
        let (start, product) = (self.place(slot), self.products[slot]);
        let whole = if from.neighbours[k] == NONE {
            let whole = self.way_into_ball(slot, k)?;
            if (product > least) == (product - whole * share > least) {
                return Ok(None);
            }
            whole
        } else {
            let end = self.place(from.neighbours[k] as usize);
            dot(&difference(&end, &start), &edge) / dot(&edge, &edge)
        };
        let mut way = (product - 1.0) / share;
        if way.is_nan() || way < 0.0 {
            way = 0.0;
        }
        way = way.min(whole.max(0.0));
        let mut place: [f64; D] = std::array::from_fn(|i| start[i] + way * edge[i]);
        // An edge between two vertices may lead through the ball.
        if from.neighbours[k] != NONE && dot(&place, &place) < self.radius_squared {
            return Ok(None);
        }
        let mut vertex = *from;
        vertex.points[k] = point;
        vertex.neighbours = [NONE; D];
        vertex.birth = self.birth;
        vertex.generation += 1;
        let shares: [f64; D] = std::array::from_fn(|i| -dot(step, &vertex.edges[i]));
        let largest = shares.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if vertex.generation > MAX_GENERATIONS
            || share.abs() < MIN_PIVOT * largest
            || !self.is_on_all(frame, &vertex.points, &place)
        {
            (place, vertex.edges) = self
                .meeting_point(frame, &vertex.points)
                .ok_or(Stop::Contradiction)?;
            vertex.generation = 0;
        } else {
            for i in 0..D {
                if i == k {
                    vertex.edges[k] = edge.map(|x| x / share);
                } else {
                    let amount = shares[i] / share;
                    for j in 0..D {
                        vertex.edges[i][j] -= amount * edge[j];
                    }
                }
            }
        }
        Ok(Some(self.put(&place, vertex)))
    }

    /// Joins new vertices that have all points but one in common.
    fn link(&mut self, fresh: &[u32], point: u32) -> Result<(), Stop> {
        let mut ridges: Vec<Ridge> = Vec::with_capacity(fresh.len() * D);
        for &slot in fresh {
            let points = self.vertices[slot as usize].points;
            for k in 0..D {
                if points[k] == point {
                    continue;
                }
                // The points in ascending order, but for the new one and the k-th.
                let mut others = [0u32; D];
                let mut count = 0;
                for (i, &other) in points.iter().enumerate() {
                    if i != k && other != point {
                        let mut at = count;
                        while at > 0 && others[at - 1] > other {
                            others[at] = others[at - 1];
                            at -= 1;
                        }
                        others[at] = other;
                        count += 1;
                    }
                }
                let key = others[..count]
                    .iter()
                    .fold(0u128, |key, &other| key << 32 | u128::from(other));
                ridges.push((key, slot, k as u32));
            }
        }
        ridges.sort_unstable();
        for run in ridges.chunk_by(|a, b| a.0 == b.0) {
            match run {
                [_] => {}
                &[(_, a, k), (_, b, l)] => {
                    self.vertices[a as usize].neighbours[k as usize] = b;
                    self.vertices[b as usize].neighbours[l as usize] = a;
                }
                _ => return Err(Stop::Contradiction),
            }
        }
        Ok(())
    }
}
