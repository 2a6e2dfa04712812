//! Contacts and the marks that show them.

use nalgebra::{Point3, Vector3};

use crate::{Color, Dot};

/// Radius of the mark of the strongest contact \[m\].
const RADIUS: f64 = 1.4e-3;

/// A point at which a hand presses on an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// Where, in the object's frame \[m\].
    pub position: Point3<f64>,
    /// The force on the object \[N\].
    pub force: Vector3<f64>,
}

/// Makes dots at the contacts, in the colour ([`Color::heat`]) and size of their force as a share of the largest.
pub fn contact_dots(contacts: &[ContactForce]) -> Vec<Dot> {
    let largest = (contacts.iter())
        .map(|contact| contact.force.norm())
        .fold(0.0, f64::max);
    let dot = |contact: &ContactForce| {
        let level = if largest > 0.0 {
            contact.force.norm() / largest
        } else {
            0.0
        };
        Dot {
            position: contact.position,
            radius: RADIUS * (0.5 + 0.5 * level.sqrt()),
            color: Color::heat(level),
        }
    };
    contacts.iter().map(dot).collect()
}
