//! A facet of a growing polytope.

/// A facet of the growing polytope. In six dimensions the hyperplane fills one cache line, the links another.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Facet<const D: usize> {
    pub(super) normal: [f64; D],
    pub(super) offset: f64,
    /// Heights within this of 0 are not certain; used by exact predicates alone.
    pub(super) uncertainty: f64,
    /// In an order whose determinant makes the normal point outward.
    pub(super) vertices: [u32; D],
    /// `neighbours[k]` shares all vertices but `vertices[k]`.
    pub(super) neighbours: [u32; D],
    /// Which insertion last looked at this facet, and with what result.
    pub(super) mark: u32,
    /// The insertion that made it; tells a reused slot from what was there before.
    pub(super) birth: u32,
    /// For the owner's use: the first of the points outside this facet.
    pub(super) outside: u32,
}
