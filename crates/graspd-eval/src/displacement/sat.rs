//! Separating axes: whether a triangle and a convex polyhedron touch, and how deep they penetrate each other.
//!
//! *Theorem.* Two convex polyhedra are disjoint exactly if some axis separates their projections, and it is enough
//! to test (1) the normals of the faces of either and (2) the cross products of an edge of one with an edge of the
//! other. If they overlap, the axis of least overlap among these is the direction, and that overlap the length, of
//! the shortest translation that separates them: the penetration depth, since these axes are the face normals of
//! the Minkowski difference.
//!
//! *Pruning.* (2) is needed only for pairs of edges that span a face of the Minkowski difference: the arc between
//! the normals of the faces beside one edge crosses that of the other on the Gauss map (Gregorius). Faces are kept
//! in clusters of similar normals, whose bounding boxes bound the overlap along all of them; edges in clusters with
//! bounding boxes in space, since the deepest points of both lie within the penetration depth of each other.
//!
//! | module | |
//! |---|---|
//! | `lanes` | blocks of four numbers that compilers vectorise |
//! | `faces` | faces and edges of a polyhedron in clusters |
//! | `penetration` | least overlap along face normals and across pairs of edges |
//! | `triangle` | the test of a triangle with a polyhedron |
//!
//! # Source
//! D. Gregorius, "The separating axis test between convex polyhedra", Game Developers Conference 2013.

mod faces;
mod lanes;
mod penetration;
mod triangle;

pub(super) use faces::FaceClusters;
pub(super) use lanes::{LANES, in_blocks, lesser};
pub(super) use triangle::{Penetration, Separation, separate, triangles_without_back};
