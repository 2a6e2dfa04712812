//! From contacts to the primitive wrenches that span the grasp wrench space.

use nalgebra::{Point3, Vector3};

/// Edges of the pyramid that stands for each friction cone, unless said otherwise.
pub const FRICTION_EDGES: usize = 8;

/// A point where the hand pushes on the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Position in the object's frame \[m\].
    pub point: Point3<f64>,
    /// Unit normal of the object's surface, pointing *into* the object: the direction in which a finger pushes.
    pub normal: Vector3<f64>,
}

/// The wrenches `(f; (p - c) x f / s)` of unit normal force at each contact, along the edges of its friction
/// pyramid: hard fingers with Coulomb friction.
///
/// The edges of a pyramid are `f = n + mu t_k` with `edges` unit tangents t_k at equal angles, so the normal
/// component of every f is exactly 1; `edges` below 3 counts as 3. Without friction (`friction <= 0`) each
/// contact has the one wrench of f = n. c is the object's centre of mass \[m\]; the torque scale s \[m\],
/// usually [`largest_radius`], makes torques commensurate with forces. Wrenches are `[fx, fy, fz, tx, ty, tz]`,
/// contact by contact.
///
/// Normals are brought to unit length first; that of a contact with normal 0 stays 0. What is not finite in
/// the input is not finite in the wrenches either.
///
/// # Source
/// C. Ferrari, J. Canny, "Planning optimal grasps", ICRA 1992.
pub fn grasp_wrenches(
    contacts: &[Contact],
    friction: f64,
    edges: usize,
    center_of_mass: Point3<f64>,
    torque_scale: f64,
) -> Vec<[f64; 6]> {
    let is_frictionless = friction <= 0.0;
    let edges = if is_frictionless { 1 } else { edges.max(3) };
    let mut wrenches = Vec::with_capacity(contacts.len() * edges);
    for contact in contacts {
        let length = contact.normal.norm();
        let normal = contact.normal / if length == 0.0 { 1.0 } else { length };
        let arm = (contact.point - center_of_mass) / torque_scale;
        let mut push = |force: Vector3<f64>| {
            let torque = arm.cross(&force);
            wrenches.push([force.x, force.y, force.z, torque.x, torque.y, torque.z]);
        };
        if is_frictionless {
            push(normal);
            continue;
        }
        let (first, second) = tangents(normal);
        for k in 0..edges {
            let (sine, cosine) = (std::f64::consts::TAU * k as f64 / edges as f64).sin_cos();
            push(normal + (first * cosine + second * sine) * friction);
        }
    }
    wrenches
}

/// The largest distance of any of the points from the centre \[m\]: the usual scale of torques, with the
/// vertices of the object's mesh and its centre of mass. 0 without points.
pub fn largest_radius(points: &[Point3<f64>], center: Point3<f64>) -> f64 {
    let squared = points.iter().map(|point| (point - center).norm_squared());
    squared.fold(0.0, f64::max).sqrt()
}

/// Two unit vectors that form a right-handed orthonormal frame with the unit normal. The first is orthogonal
/// to the coordinate axis farthest from the normal.
fn tangents(normal: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    let first = axis.cross(&normal);
    let length = first.norm();
    let first = first / if length == 0.0 { 1.0 } else { length };
    (first, normal.cross(&first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rounding of a handful of operations on values of order 1.
    const ROUNDING: f64 = 1e-14;

    fn contact() -> impl Strategy<Value = Contact> {
        let vector = || prop::array::uniform3(-1.0f64..1.0).prop_map(Vector3::from);
        (vector(), vector())
            .prop_filter("a normal needs a direction", |(_, n)| n.norm() > 0.1)
            .prop_map(|(point, normal)| Contact {
                point: point.into(),
                normal: normal.normalize(),
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn pyramid_edges_have_unit_normal_force_and_lie_on_the_cone(
            contact in contact(), friction in 0.01f64..2.0, edges in 3usize..13,
        ) {
            let center = Point3::new(0.1, -0.2, 0.3);
            let wrenches = grasp_wrenches(&[contact], friction, edges, center, 0.5);
            prop_assert_eq!(wrenches.len(), edges);
            let mut mean = Vector3::zeros();
            for wrench in &wrenches {
                let force = Vector3::new(wrench[0], wrench[1], wrench[2]);
                let torque = Vector3::new(wrench[3], wrench[4], wrench[5]);
                let along = force.dot(&contact.normal);
                prop_assert!((along - 1.0).abs() < ROUNDING);
                let tangential = force - contact.normal * along;
                prop_assert!((tangential.norm() - friction).abs() < ROUNDING);
                let moment = (contact.point - center).cross(&force);
                prop_assert!((torque * 0.5 - moment).norm() < ROUNDING);
                mean += force / edges as f64;
            }
            prop_assert!((mean - contact.normal).norm() < ROUNDING);
        }
    }

    #[test]
    fn frictionless_contacts_have_one_wrench_each() {
        let contact = Contact {
            point: Point3::new(0.0, 0.0, 2.0),
            normal: Vector3::new(-1.0, 0.0, 0.0),
        };
        let wrenches = grasp_wrenches(&[contact; 3], 0.0, 8, Point3::origin(), 4.0);
        assert_eq!(wrenches, vec![[-1.0, 0.0, 0.0, 0.0, -0.5, 0.0]; 3]);
    }

    #[test]
    fn faults_of_the_input_are_not_hidden() {
        let bad = Contact {
            point: Point3::new(f64::NAN, 0.0, 0.0),
            normal: Vector3::z(),
        };
        let good = Contact {
            point: Point3::new(1.0, 0.0, 0.0),
            normal: Vector3::z(),
        };
        let is_finite = |wrenches: Vec<[f64; 6]>| wrenches.iter().flatten().all(|x| x.is_finite());
        assert!(!is_finite(grasp_wrenches(
            &[bad],
            0.5,
            8,
            Point3::origin(),
            1.0
        )));
        assert!(!is_finite(grasp_wrenches(
            &[good],
            0.5,
            8,
            Point3::origin(),
            0.0
        )));
        assert!(!is_finite(grasp_wrenches(
            &[good],
            f64::NAN,
            8,
            Point3::origin(),
            1.0
        )));
    }

    #[test]
    fn the_largest_radius_is_to_the_farthest_point() {
        let points = [Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, -3.0, 4.0)];
        assert_eq!(largest_radius(&points, Point3::origin()), 5.0);
        assert_eq!(largest_radius(&[], Point3::origin()), 0.0);
    }
}
