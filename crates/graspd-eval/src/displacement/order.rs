//! In which order contacts are solved.
//!
//! Where a hand presses hard, 15 passes over the contacts do not converge, and where the object ends depends on their order by a few
//! hundredths of a centimetre. The order is therefore that of the engine whose equations these are: pieces as its tree of boxes meets
//! them, each with one of 128 colours as long as it has contacts; then by colour the first patch of each piece, and then all others.
//!
//! # Source
//! rapier 0.36: its broad phase, the colouring of its contact graph, and its grouping of what is left over.

use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::partitioning::{Bvh, BvhWorkspace};

use super::search::Touch;

/// So many pieces at once have a colour, and so many of the other patches come last.
const COLORS: usize = 128;
/// By this the boxes in the tree are wider than they need be \[m\].
const SKIN: f64 = 4e-3;

/// What a piece with contacts has.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// No contacts.
    None,
    Color(u8),
    /// No colour was left.
    Late,
}

/// The order of pieces, and the colours of those with contacts.
#[derive(Clone)]
pub(super) struct SolvingOrder {
    pieces: Vec<u32>,
    /// Of each piece.
    places: Vec<Place>,
    taken: u128,
}

impl SolvingOrder {
    /// Of pieces with these boxes about a hand with that one, nothing touching; `ahead` is how far ahead contacts are sought \[m\].
    pub(super) fn new(hand: Aabb, pieces: impl Iterator<Item = Aabb>, ahead: f64) -> Self {
        let mut tree = Bvh::new();
        let mut workspace = BvhWorkspace::default();
        let mut count = 0;
        for bounds in std::iter::once(hand).chain(pieces) {
            tree.insert_or_update_partially(bounds.loosened(0.5 * ahead), count, SKIN);
            count += 1;
        }
        tree.refit(&mut workspace);
        let pieces = count - 1;
        let mut order = Vec::with_capacity(pieces as usize);
        tree.traverse_bvtt_single_tree::<true>(&mut workspace, &mut |a: u32, b: u32| {
            if a.min(b) == 0 {
                order.push(a.max(b) - 1);
            }
        });
        let mut is_known = vec![false; pieces as usize];
        for piece in &order {
            is_known[*piece as usize] = true;
        }
        order.extend((0..pieces).filter(|piece| !is_known[*piece as usize]));
        Self {
            pieces: order,
            places: vec![Place::None; pieces as usize],
            taken: 0,
        }
    }

    /// Takes over which pieces have contacts by now.
    pub(super) fn update(&mut self, has_contacts: impl Fn(usize) -> bool) {
        for (piece, place) in self.places.iter_mut().enumerate() {
            if *place != Place::None && !has_contacts(piece) {
                if let Place::Color(color) = place {
                    self.taken &= !(1 << *color);
                }
                *place = Place::None;
            }
        }
        for piece in &self.pieces {
            let place = &mut self.places[*piece as usize];
            if *place == Place::None && has_contacts(*piece as usize) {
                // From the highest down.
                *place = match (!self.taken).checked_ilog2() {
                    Some(color) => Place::Color(color as u8),
                    None => Place::Late,
                };
                if let Place::Color(color) = place {
                    self.taken |= 1 << *color;
                }
            }
        }
    }

    /// Writes out piece and patch of all patches in the order in which they are solved.
    pub(super) fn write(&self, touches: &[Touch], into: &mut Vec<[usize; 2]>) {
        into.clear();
        let solved = |piece: usize| {
            let patches = touches[piece].patches.iter().enumerate();
            let solved = patches.filter(|(_, patch)| patch.is_solved());
            solved.map(move |(patch, _)| [piece, patch])
        };
        let mut colored = [None; COLORS];
        for (piece, place) in self.places.iter().enumerate() {
            if let Place::Color(color) = place {
                colored[*color as usize] = Some(piece);
            }
        }
        into.extend(
            colored
                .iter()
                .flatten()
                .filter_map(|piece| solved(*piece).next()),
        );
        let start = into.len();
        for piece in self.pieces.iter().map(|piece| *piece as usize) {
            let first = usize::from(self.places[piece] != Place::Late);
            into.extend(solved(piece).skip(first));
        }
        let late = &mut into[start..];
        late.rotate_left(COLORS.min(late.len()));
    }
}
