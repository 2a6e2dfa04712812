//! What a hand keeps between calls: working memory, and where its points are in one pose.

use std::any::Any;
use std::fmt;

use graspd_geom::{Rigid, Vec3};
use nalgebra::Point3;

use crate::points::PointBuffer;

/// Memory whose content is the hand's own business: any type, made and read by the hand alone.
#[derive(Default)]
pub struct HandState(Option<Box<dyn Any + Send + Sync>>);

impl HandState {
    /// Keeps `state`.
    pub fn new<S: Any + Send + Sync>(state: S) -> Self {
        Self(Some(Box::new(state)))
    }

    /// Returns what is kept.
    ///
    /// # Panics
    /// If it is no `S`: it was made by a hand of another kind.
    pub fn get<S: Any>(&self) -> &S {
        let state = self.0.as_deref().and_then(|state| state.downcast_ref());
        state.expect(OWN_STATE)
    }

    /// Returns what is kept, to be changed.
    ///
    /// # Panics
    /// As [`HandState::get`].
    pub fn get_mut<S: Any>(&mut self) -> &mut S {
        let state = self.0.as_deref_mut().and_then(|state| state.downcast_mut());
        state.expect(OWN_STATE)
    }

    /// Returns what is kept, to be changed; replaces it by the default if it is no `S`.
    pub fn get_or_default<S: Any + Send + Sync + Default>(&mut self) -> &mut S {
        if !self.0.as_deref().is_some_and(|state| state.is::<S>()) {
            *self = Self::new(S::default());
        }
        self.get_mut()
    }
}

const OWN_STATE: &str = "scratch and posed hands must come from the hand that they are given to";

impl fmt::Debug for HandState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if self.0.is_some() {
            "HandState(..)"
        } else {
            "HandState"
        })
    }
}

/// Working memory of one hand for one worker: what [`Kinematics::forward`](crate::Kinematics::forward) leaves for
/// [`Kinematics::pullback`](crate::Kinematics::pullback). Made by [`Hand::new_scratch`](crate::Hand::new_scratch).
#[derive(Debug, Default)]
pub struct HandScratch {
    /// What the last forward pass rounded off the coordinates of the contact points \[m\], `[n]`: with it they are
    /// exact to some 1e-10 m.
    pub contact_remainder: PointBuffer<f32>,
    /// What else the hand keeps.
    pub state: HandState,
}

/// A point that moves with a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandPoint {
    /// A vertex of the surface.
    Vertex(u32),
    /// The centre of a collision sphere.
    Sphere(u32),
}

/// Where a hand is in one pose, object frame; filled by [`Hand::pose`](crate::Hand::pose), its memory used again.
#[derive(Debug, Default)]
pub struct PosedHand {
    /// The vertices of the surface \[m\], `[v]`; [`Hand::faces`](crate::Hand::faces) joins them.
    pub vertices: Vec<Point3<f64>>,
    /// The centres of the collision spheres \[m\], `[s]`.
    pub spheres: Vec<Point3<f64>>,
    /// The frames of the bodies, in the order of [`Hand::body_names`](crate::Hand::body_names); empty where bodies
    /// have none.
    pub bodies: Vec<Rigid<f64>>,
    /// What the hand keeps for [`Hand::jacobian_rows`](crate::Hand::jacobian_rows).
    pub state: HandState,
}

impl PosedHand {
    /// Returns where a point is.
    ///
    /// # Panics
    /// If the hand has no such point.
    #[inline]
    pub fn position(&self, point: HandPoint) -> Vec3<f64> {
        match point {
            HandPoint::Vertex(vertex) => self.vertices[vertex as usize].into(),
            HandPoint::Sphere(sphere) => self.spheres[sphere as usize].into(),
        }
    }
}

/// Chooses that of two values, one for each precision, which is a `T`.
pub(crate) fn choose<T: Any>(pair: [&dyn Any; 2]) -> &T {
    let chosen = pair.into_iter().find_map(|value| value.downcast_ref());
    chosen.expect("there are two precisions")
}

/// Chooses as [`choose`], to change the value.
pub(crate) fn choose_mut<T: Any>(pair: [&mut dyn Any; 2]) -> &mut T {
    let chosen = pair.into_iter().find_map(|value| value.downcast_mut());
    chosen.expect("there are two precisions")
}
