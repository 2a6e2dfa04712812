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

/// What a finger can exert at a contact per unit of normal force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerModel {
    /// Coulomb friction coefficient mu.
    pub friction: f64,
    /// Edges of the friction pyramid; below 3 counts as 3.
    pub edges: usize,
    /// Largest torque about the normal per unit of normal force \[m\], 0 for a hard finger. A round patch of radius
    /// a under even pressure has 2/3 mu a.
    pub torsional_friction: f64,
}

impl FingerModel {
    /// A point contact with Coulomb friction.
    pub fn hard(friction: f64, edges: usize) -> Self {
        Self {
            friction,
            edges,
            torsional_friction: 0.0,
        }
    }

    /// How many wrenches stand for each contact.
    pub fn wrenches_per_contact(&self) -> usize {
        self.generators().len()
    }

    /// The wrenches `(f; ((p - c) x f + m n) / s)` of unit normal force at each contact that span what the finger
    /// can exert.
    ///
    /// The edges of a hard finger's pyramid are `f = n + mu t_k` with `edges` unit tangents t_k at
    /// equal angles, so the normal component of every f is exactly 1. Without friction (`friction
    /// <= 0`) there is the one wrench of f = n. A soft finger's friction force f_t and torque m
    /// about the normal share one limit, `(|f_t| / mu)^2 + (m / gamma)^2 <= 1` with gamma the
    /// torsional friction; beside the hard finger's edges at m = 0 it has as many at each of `m =
    /// +-gamma / sqrt(2)`, with `|f_t| = mu / sqrt(2)`, and f = n with m = +-gamma.
    ///
    /// c is the object's centre of mass \[m\]; the torque scale s \[m\], usually [`largest_radius`], makes torques
    /// commensurate with forces. Wrenches are `[fx, fy, fz, tx, ty, tz]`, contact by contact.
    ///
    /// Normals are brought to unit length first; that of a contact with normal 0 stays 0. What is not finite in
    /// the input is not finite in the wrenches either.
    ///
    /// # Source
    /// C. Ferrari, J. Canny, "Planning optimal grasps", ICRA 1992; the ellipsoid of soft fingers: R. D. Howe,
    /// M. R. Cutkosky, "Practical force-motion models for sliding manipulation", IJRR 15(6), 1996.
    pub fn wrenches(
        &self,
        contacts: &[Contact],
        center_of_mass: Point3<f64>,
        torque_scale: f64,
    ) -> Vec<[f64; 6]> {
        let generators = self.generators();
        let mut wrenches = Vec::with_capacity(contacts.len() * generators.len());
        for contact in contacts {
            let length = contact.normal.norm();
            let normal = contact.normal / if length == 0.0 { 1.0 } else { length };
            let arm = (contact.point - center_of_mass) / torque_scale;
            let (first, second) = tangents(normal);
            wrenches.extend(generators.iter().map(|[along_first, along_second, twist]| {
                let force = normal + first * *along_first + second * *along_second;
                let torque = arm.cross(&force) + normal * (twist / torque_scale);
                [force.x, force.y, force.z, torque.x, torque.y, torque.z]
            }));
        }
        wrenches
    }

    /// Two tangential forces and the torque about the normal \[m\] of each wrench, per unit of normal force.
    fn generators(&self) -> Vec<[f64; 3]> {
        let has_friction = self.friction.is_nan() || self.friction > 0.0;
        let twist = self.torsional_friction;
        let ring = |share: f64, twist: f64| {
            let count = if has_friction { self.edges.max(3) } else { 0 };
            (0..count).map(move |k| {
                let (sine, cosine) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
                let tangential = self.friction * share;
                [cosine * tangential, sine * tangential, twist]
            })
        };
        let mut generators: Vec<_> = ring(1.0, 0.0).collect();
        if twist.is_nan() || twist > 0.0 {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            generators.extend(ring(half, half * twist));
            generators.extend(ring(half, -half * twist));
            generators.extend([[0.0, 0.0, twist], [0.0, 0.0, -twist]]);
        } else if !has_friction {
            generators.push([0.0; 3]);
        }
        generators
    }
}

/// The wrenches of hard fingers: [`FingerModel::wrenches`] of [`FingerModel::hard`].
pub fn grasp_wrenches(
    contacts: &[Contact],
    friction: f64,
    edges: usize,
    center_of_mass: Point3<f64>,
    torque_scale: f64,
) -> Vec<[f64; 6]> {
    FingerModel::hard(friction, edges).wrenches(contacts, center_of_mass, torque_scale)
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
