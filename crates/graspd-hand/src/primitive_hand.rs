//! Hands of boxes, cylinders and capsules, written as tables of links.

use graspd_geom::{Quaternion, Rigid, TriangleMesh, box_mesh, capsule_mesh, cylinder_mesh};
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::articulated::HandDescription;
use crate::{HandError, Joint, JointKind, KinematicTree, Limit, Mimic, PalmFrame, Part};

/// Edge length of round shapes \[m\].
const EDGE: f64 = 3e-3;

/// A solid of a link, in the link's frame \[m\].
#[derive(Clone, Copy)]
pub(crate) enum Shape {
    /// Center and side lengths.
    Box([f64; 3], [f64; 3]),
    /// Ends of the axis and radius of a capsule.
    Capsule([f64; 3], [f64; 3], f64),
    /// Ends of the axis and radius of a cylinder.
    Cylinder([f64; 3], [f64; 3], f64),
}

impl Shape {
    fn mesh(self) -> TriangleMesh {
        match self {
            Self::Box(center, sides) => {
                let sides = Vector3::from(sides);
                box_mesh(sides, sides.max()).transformed(&Translation3::from(center).into())
            }
            Self::Capsule(from, to, radius) => {
                let (placement, length) = along(from, to);
                capsule_mesh(radius, length, EDGE).transformed(&placement)
            }
            Self::Cylinder(from, to, radius) => {
                let (placement, length) = along(from, to);
                cylinder_mesh(radius, length, EDGE).transformed(&placement)
            }
        }
    }
}

/// Takes the z axis to the line between two points, its origin to their middle; and their distance.
fn along(from: [f64; 3], to: [f64; 3]) -> (Isometry3<f64>, f64) {
    let [from, to] = [from, to].map(Point3::from);
    let axis = to - from;
    let turn = Rotation3::rotation_between(&Vector3::z(), &axis)
        .unwrap_or_else(|| Rotation3::new(Vector3::x() * std::f64::consts::PI));
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let middle = Translation3::from(nalgebra::center(&from, &to));
    (Isometry3::from_parts(middle, turn), axis.norm())
}

/// How a link hangs on its parent.
#[derive(Clone, Copy)]
pub(crate) enum Hinge {
    /// Rigidly.
    Fixed,
    /// By a joint of its own: name, axis, limits.
    Free(&'static str, [f64; 3], [f64; 2]),
    /// By a joint that follows another: axis, the other's name, multiplier.
    Follows([f64; 3], &'static str, f64),
}

/// A link, and how it hangs on its parent, which must come earlier (the first link has none).
pub(crate) struct LinkRow {
    pub(crate) name: String,
    pub(crate) parent: String,
    /// From the link's frame at joint value 0 to the parent's: xyz \[m\] and rpy \[rad\].
    pub(crate) origin: [[f64; 3]; 2],
    pub(crate) hinge: Hinge,
    pub(crate) shapes: Vec<Shape>,
}

/// Returns a hand of such links, open with all joints at 0 or as near as they can get.
pub(crate) fn described(
    name: &str,
    rows: &[LinkRow],
    palm: PalmFrame,
) -> Result<HandDescription, HandError> {
    let links: Vec<String> = rows.iter().map(|row| row.name.clone()).collect();
    let joints: Vec<Joint> = rows.iter().skip(1).map(joint).collect();
    let tree = KinematicTree::new(&links, &joints)?;
    let mut parts = Vec::new();
    for (row, link) in tree
        .links()
        .iter()
        .filter_map(|link| Some((rows.iter().find(|row| row.name == link.name)?, link)))
    {
        let placement = Isometry3::from(link.placement);
        parts.extend(row.shapes.iter().map(|shape| Part {
            body: link.body,
            mesh: shape.mesh().transformed(&placement),
        }));
    }
    Ok(HandDescription {
        name: name.to_owned(),
        open: tree.limits().iter().map(|limit| limit.clamp(0.0)).collect(),
        tree,
        parts,
        palm,
        notes: Vec::new(),
    })
}

fn joint(row: &LinkRow) -> Joint {
    let [xyz, [roll, pitch, yaw]] = row.origin;
    let (kind, name, axis, limit, mimic) = match row.hinge {
        Hinge::Fixed => (JointKind::Fixed, None, [0.0; 3], Limit::UNLIMITED, None),
        Hinge::Free(name, axis, [lower, upper]) => (
            JointKind::Revolute,
            Some(name),
            axis,
            Limit { lower, upper },
            None,
        ),
        Hinge::Follows(axis, followed, multiplier) => {
            let mimic = Mimic {
                joint: followed.to_owned(),
                multiplier,
                offset: 0.0,
            };
            (
                JointKind::Revolute,
                None,
                axis,
                Limit::UNLIMITED,
                Some(mimic),
            )
        }
    };
    Joint {
        name: name.map_or_else(|| format!("{}_joint", row.name), str::to_owned),
        kind,
        parent: row.parent.clone(),
        child: row.name.clone(),
        origin: Rigid {
            rotation: Quaternion::from(UnitQuaternion::from_euler_angles(roll, pitch, yaw))
                .to_matrix(),
            translation: xyz.into(),
        },
        axis: axis.into(),
        limit,
        mimic,
    }
}
