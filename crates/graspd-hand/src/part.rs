//! The solid parts that a hand of rigid bodies is made of.

use graspd_geom::TriangleMesh;

/// One closed solid, fixed to a body.
#[derive(Clone, Debug)]
pub struct Part {
    /// The body that it belongs to, an index into [`Hand::body_names`](crate::Hand::body_names).
    pub body: usize,
    /// Its surface in the body's frame: closed, outward oriented \[m\].
    pub mesh: TriangleMesh,
}
