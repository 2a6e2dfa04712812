//! Target wrenches, stored once for all contacts that never touched.

use graspd_ad::Element;
use graspd_geom::Vec3;
use graspd_hand::POINT_PADDING;

use crate::kernel::WRENCH_LEN;
use crate::params::Wrench;

/// Numbers in a row of blocks: one velocity of one block.
const STRIDE: usize = WRENCH_LEN * POINT_PADDING;

/// The target wrenches of all contacts for [`Scene::move_targets`](crate::Scene::move_targets), 0 at first.
///
/// A contact that does not touch has wrench 0, so the gradient by its targets depends on the targets alone: all
/// contacts that have never touched have the same targets with the same history. These are kept once, and a contact
/// gets targets of its own when it first touches (contacts side by side in vector registers together). That is exact:
/// [`TargetWrenches::expand`] gives the same bits as if every contact had had its own all along.
#[derive(Clone, Debug)]
pub struct TargetWrenches<E> {
    /// `[blocks + 2][J][6][8]`: the blocks of contacts, the shared targets, and these before the last move.
    pub(crate) values: Vec<E>,
    /// Whether a group of contacts that stand side by side has its own targets, `[n / lanes]`.
    pub(crate) own: Vec<bool>,
    /// The own targets summed over the blocks, `[J][6][8]`.
    pub(crate) own_sums: Vec<E>,
    /// The derivative of L_phys by the wrench of a contact that never touched, `[J][6][8]`.
    pub(crate) pull: Vec<E>,
    /// How many contacts stand side by side.
    pub(crate) lanes: usize,
    velocities: usize,
}

impl<E: Element> TargetWrenches<E> {
    /// `weight`: of each contact, `[n]`; padding has targets of its own, which stay 0.
    pub(crate) fn new(weight: &[E], velocities: usize, lanes: usize) -> Self {
        let blocks = weight.len() / POINT_PADDING;
        let is_padded = |group: &[E]| group.iter().any(|&weight| weight != E::one());
        Self {
            values: vec![E::zero(); (blocks + 2) * velocities * STRIDE],
            own: weight.chunks_exact(lanes).map(is_padded).collect(),
            own_sums: vec![E::zero(); velocities * STRIDE],
            pull: vec![E::zero(); velocities * STRIDE],
            lanes,
            velocities,
        }
    }

    /// How many numbers move: what an optimiser of them has to keep state for.
    pub fn state_len(&self) -> usize {
        self.values.len()
    }

    /// How many contacts have targets of their own, padding included.
    pub fn own_count(&self) -> usize {
        self.lanes * self.own.iter().filter(|&&own| own).count()
    }

    /// The targets of every contact, laid out as the wrenches of a [`Scene`](crate::Scene):
    /// `[blocks of 8 contacts][J][6][8]`.
    pub fn expand(&self) -> Vec<E> {
        let block_len = self.velocities * STRIDE;
        let (blocks, shared) = self.values.split_at(self.shared());
        let mut targets = blocks.to_vec();
        for (number, target) in targets.iter_mut().enumerate() {
            let contact = number / block_len * POINT_PADDING + number % POINT_PADDING;
            if !self.own[contact / self.lanes] {
                let row = number % block_len / POINT_PADDING;
                *target = shared[row * POINT_PADDING];
            }
        }
        targets
    }

    /// Where the shared targets begin.
    pub(crate) fn shared(&self) -> usize {
        self.values.len() - 2 * self.velocities * STRIDE
    }

    /// Where those from before the last move begin.
    pub(crate) fn shared_before(&self) -> usize {
        self.values.len() - self.velocities * STRIDE
    }

    /// The sum of the targets for velocity `j` over all contacts.
    pub(crate) fn total(&self, j: usize) -> Wrench<f64> {
        let shared_by = (self.own.len() * self.lanes - self.own_count()) as f64;
        let shared = &self.values[self.shared() + j * STRIDE..][..STRIDE];
        let own_sums = &self.own_sums[j * STRIDE..][..STRIDE];
        let mut sums = [0.0; WRENCH_LEN];
        for k in 0..WRENCH_LEN {
            let row = &own_sums[k * POINT_PADDING..][..POINT_PADDING];
            let own: f64 = row.iter().map(|value| value.lane(0)).sum();
            sums[k] = own + shared_by * shared[k * POINT_PADDING].lane(0);
        }
        let [tx, ty, tz, fx, fy, fz] = sums;
        Wrench {
            torque: Vec3::new(tx, ty, tz),
            force: Vec3::new(fx, fy, fz),
        }
    }
}
