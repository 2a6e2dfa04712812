//! A few contacts that stand for many.

use nalgebra::{Point3, Vector3};

use crate::wrench_space::Contact;

/// At most `most` of the contacts, spread as widely as possible over positions and normals.
///
/// Farthest-point selection: the first is the contact farthest from the mean position, and each of the rest is
/// the one farthest from all before it, by the distance `|p - q|^2 / L^2 + |n - m|^2`, where L is the largest
/// distance of a contact from the mean. The first of equals is taken, so the result is a function of the input
/// alone, and the selection of k contacts begins with that of k - 1.
///
/// The hull of some of the wrenches lies within the hull of all: epsilon and volume of the reduced set never
/// exceed those of the full one. They are lower bounds, close when contacts are dense.
///
/// A contact that is not finite counts as infinitely far from the others, so that it is kept and shows.
pub fn reduce_contacts(contacts: &[Contact], most: usize) -> Vec<Contact> {
    if contacts.len() <= most {
        return contacts.to_vec();
    }
    let sum: Vector3<f64> = contacts.iter().map(|contact| contact.point.coords).sum();
    let mean = Point3::from(sum / contacts.len() as f64);
    let from_mean = |contact: &Contact| finite_or_far((contact.point - mean).norm_squared());
    let spread = contacts.iter().map(from_mean).fold(0.0, f64::max);
    let per_length = if spread > 0.0 { spread.recip() } else { 0.0 };

    let mut chosen = Vec::with_capacity(most);
    let mut distances = vec![f64::INFINITY; contacts.len()];
    let mut next = first_greatest(contacts.iter().map(from_mean));
    while chosen.len() < most {
        let latest = contacts[next];
        chosen.push(latest);
        // Never again, not even among repeated contacts or infinite distances.
        distances[next] = f64::NEG_INFINITY;
        for (distance, contact) in distances.iter_mut().zip(contacts) {
            let apart = (contact.point - latest.point).norm_squared() * per_length
                + (contact.normal - latest.normal).norm_squared();
            *distance = distance.min(finite_or_far(apart));
        }
        next = first_greatest(distances.iter().copied());
    }
    chosen
}

/// Index of the greatest value, the first among equals.
fn first_greatest(values: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, value) in values.enumerate() {
        if value > best.1 {
            best = (index, value);
        }
    }
    best.0
}

fn finite_or_far(distance: f64) -> f64 {
    if distance.is_finite() {
        distance
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FRICTION_EDGES, grasp_quality, grasp_wrenches};
    use proptest::prelude::*;

    fn on_sphere(raw: [f64; 3]) -> Contact {
        let normal = Vector3::from(raw).normalize();
        Contact {
            point: Point3::from(-normal),
            normal,
        }
    }

    fn spread_contacts(count: usize) -> Vec<Contact> {
        // A spiral of constant pitch: dense everywhere, symmetric nowhere.
        let at = |k: usize| {
            let height = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
            let (sine, cosine) = (2.4 * k as f64).sin_cos();
            let radius = (1.0 - height * height).sqrt();
            on_sphere([radius * cosine, radius * sine, height])
        };
        (0..count).map(at).collect()
    }

    fn epsilon(contacts: &[Contact]) -> f64 {
        let wrenches = grasp_wrenches(contacts, 0.5, FRICTION_EDGES, Point3::origin(), 1.0);
        grasp_quality(&wrenches).epsilon
    }

    #[test]
    fn few_contacts_stay_as_they_are() {
        let contacts = spread_contacts(5);
        assert_eq!(reduce_contacts(&contacts, 5), contacts);
        assert_eq!(reduce_contacts(&contacts, 0), vec![]);
        assert_eq!(reduce_contacts(&[], 3), vec![]);
    }

    #[test]
    fn selections_are_nested_and_their_epsilon_grows_to_that_of_all() {
        let contacts = spread_contacts(40);
        let full = epsilon(&contacts);
        let mut previous = 0.0;
        for most in [4, 8, 16, 32] {
            let reduced = reduce_contacts(&contacts, most);
            assert_eq!(reduced, reduce_contacts(&contacts, 33)[..most]);
            let value = epsilon(&reduced);
            // Rounding in the hull of values of order 1.
            assert!(previous <= value + 1e-12 && value <= full + 1e-12);
            previous = value;
        }
        assert!(previous > 0.9 * full, "{previous} of {full}");
    }

    #[test]
    fn repeated_contacts_come_last() {
        let mut contacts = vec![on_sphere([0.0, 0.0, 1.0]); 30];
        contacts.push(on_sphere([1.0, 0.0, 0.0]));
        contacts.push(on_sphere([0.0, -1.0, 0.0]));
        let reduced = reduce_contacts(&contacts, 3);
        for contact in &contacts[29..] {
            assert!(reduced.contains(contact));
        }
    }

    #[test]
    fn a_contact_that_is_not_finite_is_kept() {
        let mut contacts = spread_contacts(50);
        contacts[20].normal.x = f64::NAN;
        let reduced = reduce_contacts(&contacts, 4);
        assert!(reduced.iter().any(|contact| contact.normal.x.is_nan()));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn epsilon_never_grows_by_leaving_contacts_out(
            raw in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 5..10), most in 3usize..8,
        ) {
            let contacts: Vec<_> = raw
                .into_iter()
                .filter(|v| Vector3::from(*v).norm() > 0.1)
                .map(on_sphere)
                .collect();
            let reduced = reduce_contacts(&contacts, most);
            prop_assert!(epsilon(&reduced) <= epsilon(&contacts) + 1e-12);
        }
    }
}
