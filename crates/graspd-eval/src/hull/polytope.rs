//! A simplicial polytope that grows by one point at a time.

use super::facet::Facet;
use super::hyperplane::Hyperplane;
use super::predicates::Predicates;

/// No facet, or no point.
pub(super) const NONE: u32 = u32::MAX;

/// Why the construction cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// Rounded predicates contradicted each other.
    Contradiction,
    TooManyFacets,
}

/// The mark of a slot that holds no facet.
const FREE: u32 = u32::MAX;

/// Facets in slots that are reused, linked across their ridges.
pub(super) struct Polytope<const D: usize> {
    facets: Vec<Facet<D>>,
    free: Vec<u32>,
    max_facets: usize,
    insertion: u32,
    /// Facets that the last point was above. They keep their outside sets until the next insertion.
    pub(super) visible: Vec<u32>,
    /// Facets that the last insertion made.
    pub(super) fresh: Vec<u32>,
    horizon: Vec<(u32, u32)>,
}

impl<const D: usize> Polytope<D> {
    /// The simplex of D + 1 points.
    pub(super) fn simplex(
        predicates: &impl Predicates<D>,
        corners: &[u32],
        max_facets: usize,
    ) -> Result<Self, Stop> {
        let mut polytope = Self {
            facets: Vec::with_capacity(1024),
            free: Vec::new(),
            max_facets: max_facets.max(D + 1),
            insertion: 0,
            visible: Vec::new(),
            fresh: Vec::new(),
            horizon: Vec::new(),
        };
        for omitted in 0..=D {
            // Facet k lacks corner k; its neighbour across the ridge that lacks corner j too is facet j.
            let others = |k: usize| (if k < omitted { k } else { k + 1 }) as u32;
            let mut neighbours: [u32; D] = std::array::from_fn(others);
            let mut vertices = neighbours.map(|corner| corners[corner as usize]);
            let mut facet = polytope.raise(predicates, vertices, 0)?;
            if predicates.height(&facet, corners[omitted]) > 0.0 {
                vertices.swap(0, 1);
                neighbours.swap(0, 1);
                facet = polytope.raise(predicates, vertices, 0)?;
            }
            facet.neighbours = neighbours;
            polytope.facets.push(facet);
            polytope.fresh.push(omitted as u32);
        }
        Ok(polytope)
    }

    /// The number of slots: every facet's index is below.
    pub(super) fn slots(&self) -> usize {
        self.facets.len()
    }

    /// How many facets there are.
    pub(super) fn count(&self) -> usize {
        self.facets.len() - self.free.len()
    }

    /// The facets with their slots.
    pub(super) fn facets(&self) -> impl Iterator<Item = (u32, &Facet<D>)> {
        let is_there = |(_, facet): &(usize, &Facet<D>)| facet.mark != FREE;
        let with_slot = |(slot, facet)| (slot as u32, facet);
        self.facets
            .iter()
            .enumerate()
            .filter(is_there)
            .map(with_slot)
    }

    /// The facet in a slot; for one of [`Self::visible`], the facet that was there.
    pub(super) fn facet(&self, slot: u32) -> &Facet<D> {
        &self.facets[slot as usize]
    }

    pub(super) fn facet_mut(&mut self, slot: u32) -> &mut Facet<D> {
        &mut self.facets[slot as usize]
    }

    /// Whether the slot still holds the facet of that birth.
    pub(super) fn holds(&self, slot: u32, birth: u32) -> bool {
        let facet = &self.facets[slot as usize];
        facet.mark != FREE && facet.birth == birth
    }

    /// Takes in a point that is above the facet `seed`: the facets that it sees give way to a cone from the
    /// point over their horizon.
    pub(super) fn insert(
        &mut self,
        predicates: &impl Predicates<D>,
        point: u32,
        seed: u32,
    ) -> Result<(), Stop> {
        self.insertion += 1;
        self.find_visible(predicates, point, seed);
        self.raise_cone(predicates, point)?;
        self.link_cone(point)?;
        for &slot in &self.visible {
            self.facets[slot as usize].mark = FREE;
        }
        self.free.extend_from_slice(&self.visible);
        Ok(())
    }

    fn seen_mark(&self) -> u32 {
        2 * self.insertion
    }

    fn hidden_mark(&self) -> u32 {
        2 * self.insertion + 1
    }

    /// Walks over the facets that the point is above, from the seed, and collects their outer ridges.
    fn find_visible(&mut self, predicates: &impl Predicates<D>, point: u32, seed: u32) {
        let (seen, hidden) = (self.seen_mark(), self.hidden_mark());
        self.visible.clear();
        self.horizon.clear();
        self.visible.push(seed);
        self.facets[seed as usize].mark = seen;
        let mut next = 0;
        while let Some(&slot) = self.visible.get(next) {
            next += 1;
            for k in 0..D {
                let beyond = self.facets[slot as usize].neighbours[k];
                let facet = &mut self.facets[beyond as usize];
                if facet.mark != seen && facet.mark != hidden {
                    let is_seen = predicates.height(facet, point) > 0.0;
                    facet.mark = if is_seen { seen } else { hidden };
                    if is_seen {
                        self.visible.push(beyond);
                    }
                }
                if self.facets[beyond as usize].mark == hidden {
                    self.horizon.push((slot, k as u32));
                }
            }
        }
    }

    /// Makes the facet over each ridge of the horizon and links it with the hidden facet beyond.
    ///
    /// The point takes the place of the vertex opposite the ridge. The new facet borders the hidden one as the
    /// visible one did, so this keeps the orientation.
    fn raise_cone(&mut self, predicates: &impl Predicates<D>, point: u32) -> Result<(), Stop> {
        if self.count() + self.horizon.len() > self.max_facets {
            return Err(Stop::TooManyFacets);
        }
        self.fresh.clear();
        for index in 0..self.horizon.len() {
            let (slot, k) = self.horizon[index];
            let old = &self.facets[slot as usize];
            let beyond = old.neighbours[k as usize];
            let mut vertices = old.vertices;
            vertices[k as usize] = point;
            let plane = predicates
                .cone_hyperplane(&vertices, point, old, &self.facets[beyond as usize])
                .ok_or(Stop::Contradiction)?;
            let mut facet = self.unlinked(plane, vertices, self.hidden_mark());
            facet.neighbours[k as usize] = beyond;
            let fresh = match self.free.pop() {
                Some(free) => {
                    self.facets[free as usize] = facet;
                    free
                }
                None => {
                    self.facets.push(facet);
                    (self.facets.len() - 1) as u32
                }
            };
            self.fresh.push(fresh);
            // From the hidden facet the way leads to the new one now, and so it does from the visible one.
            let back = position(&self.facets[beyond as usize].neighbours, slot)
                .ok_or(Stop::Contradiction)?;
            self.facets[beyond as usize].neighbours[back] = fresh;
            self.facets[slot as usize].neighbours[k as usize] = fresh;
        }
        Ok(())
    }

    /// Links the new facets with one another.
    ///
    /// Two of them meet where their ridges of the horizon do. From one, turn about that common part through
    /// the visible facets, leaving each by its other ridge around it, until the way leads to a new facet.
    fn link_cone(&mut self, point: u32) -> Result<(), Stop> {
        let seen = self.seen_mark();
        for index in 0..self.fresh.len() {
            let fresh = self.fresh[index];
            let (first, k) = self.horizon[index];
            for i in 0..D {
                if i == k as usize || self.facets[fresh as usize].neighbours[i] != NONE {
                    continue;
                }
                let mut from = first;
                let mut pivot = self.facets[first as usize].vertices[k as usize];
                let mut slot = self.facets[first as usize].neighbours[i];
                let mut steps = 0;
                let opposite = loop {
                    let here = &self.facets[slot as usize];
                    if here.mark != seen {
                        break position(&here.vertices, pivot);
                    }
                    let (Some(exit), Some(entry)) = (
                        position(&here.vertices, pivot),
                        position(&here.neighbours, from),
                    ) else {
                        return Err(Stop::Contradiction);
                    };
                    pivot = here.vertices[entry];
                    from = slot;
                    slot = here.neighbours[exit];
                    steps += 1;
                    if steps > self.visible.len() {
                        return Err(Stop::Contradiction);
                    }
                };
                let opposite = opposite.ok_or(Stop::Contradiction)?;
                let partner = &mut self.facets[slot as usize];
                if partner.neighbours[opposite] != NONE || partner.vertices[opposite] == point {
                    return Err(Stop::Contradiction);
                }
                partner.neighbours[opposite] = fresh;
                self.facets[fresh as usize].neighbours[i] = slot;
            }
        }
        Ok(())
    }

    /// A facet without neighbours.
    #[inline]
    fn raise(
        &self,
        predicates: &impl Predicates<D>,
        vertices: [u32; D],
        mark: u32,
    ) -> Result<Facet<D>, Stop> {
        let plane = predicates
            .hyperplane(&vertices)
            .ok_or(Stop::Contradiction)?;
        Ok(self.unlinked(plane, vertices, mark))
    }

    #[inline(always)]
    fn unlinked(&self, plane: Hyperplane<D>, vertices: [u32; D], mark: u32) -> Facet<D> {
        Facet {
            normal: plane.normal,
            offset: plane.offset,
            uncertainty: plane.uncertainty,
            vertices,
            neighbours: [NONE; D],
            mark,
            birth: self.insertion,
            outside: NONE,
        }
    }
}

/// Where in the row the value stands. Without an early exit, which the processor would mispredict.
#[inline(always)]
pub(super) fn position<const D: usize>(row: &[u32; D], value: u32) -> Option<usize> {
    let mut found = D;
    for k in (0..D).rev() {
        found = if row[k] == value { k } else { found };
    }
    (found < D).then_some(found)
}
