//! The pose of a hand of rigid links, and rows of its Jacobian: a point is moved by the joints between its body and
//! the base.

use graspd_geom::{Rigid, Vec3};
use nalgebra::Point3;

use crate::body_points::BodyPoints;
use crate::{ArticulatedHand, HandPoint, HandPose, JacobianRows, PointForces, PosedHand};

impl ArticulatedHand {
    pub(crate) fn place(&self, pose: &HandPose, posed: &mut PosedHand) {
        let BodyPoints {
            spheres,
            sphere_centers,
            ..
        } = &self.points;
        (posed.bodies).resize(self.tree().body_count(), Rigid::identity());
        self.tree()
            .forward(&pose.base(), &pose.articulation, &mut posed.bodies);
        posed.vertices.clear();
        for part in self.parts() {
            let body = &posed.bodies[part.body];
            let placed = |&local: &Point3<f64>| Point3::from(body.apply(local.into()));
            posed.vertices.extend(part.mesh.vertices.iter().map(placed));
        }
        posed.spheres.clear();
        let placed = |(&center, &body): (&Vec3<f64>, &u32)| {
            Point3::from(posed.bodies[body as usize].apply(center))
        };
        (posed.spheres).extend(sphere_centers.iter().zip(&spheres.body).map(placed));
    }

    pub(crate) fn rows_of(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        forces: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        rows.clear();
        let mut screws = std::mem::take(&mut rows.screws);
        screws.extend(self.tree().screws(&posed.bodies));
        for forces in forces {
            // The forces on points of one body add up.
            let loads = forces.points.map(|(point, force)| {
                let body = match point {
                    HandPoint::Vertex(vertex) => self.points.vertex_bodies[vertex as usize],
                    HandPoint::Sphere(sphere) => self.points.spheres.body[sphere as usize],
                };
                Load {
                    body: body as usize,
                    force,
                    torque: posed.position(point).cross(force),
                }
            });
            for load in merged(loads) {
                let mut body = load.body;
                while let Some(screw) = body.checked_sub(1).map(|joint| &screws[joint]) {
                    let value = screw.turn.dot(load.torque) + screw.shift.dot(load.force);
                    rows.add(screw.parameter, value);
                    body = screw.parent;
                }
            }
            rows.end(forces, posed, pose.translation);
        }
        screws.clear();
        rows.screws = screws;
    }
}

/// A force on a body, and its torque about the object frame's origin.
#[derive(Clone, Copy)]
struct Load {
    body: usize,
    force: Vec3<f64>,
    torque: Vec3<f64>,
}

/// Returns the loads with those of one body added up; the rest are of the base, which no joint moves.
fn merged([a, b, c]: [Load; 3]) -> [Load; 3] {
    const NONE: Load = Load {
        body: 0,
        force: Vec3 {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        },
        torque: Vec3 {
            x: 0.0,
            y: 0.0,
            z: 0.0,
        },
    };
    let sum = |a: Load, b: Load| Load {
        body: a.body,
        force: a.force + b.force,
        torque: a.torque + b.torque,
    };
    if a.body == b.body {
        let ab = sum(a, b);
        return if a.body == c.body {
            [sum(ab, c), NONE, NONE]
        } else {
            [ab, c, NONE]
        };
    }
    [a, b, c]
}
