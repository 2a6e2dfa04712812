//! Joints between links, and what keeps links and joints from being a tree.

use std::collections::HashMap;

use graspd_geom::{Rigid, Vec3};

use crate::{HandError, Limit};

/// How a joint lets its child move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Not at all.
    Fixed,
    /// About its axis, between limits \[rad\].
    Revolute,
    /// About its axis, without limits \[rad\].
    Continuous,
    /// Along its axis, between limits \[m\].
    Prismatic,
}

/// A joint that follows another: value = multiplier * followed value + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// Name of the joint that is followed.
    pub joint: String,
    /// Factor.
    pub multiplier: f64,
    /// Summand \[rad or m\].
    pub offset: f64,
}

/// A joint between two links, as descriptions of robots give it.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Name of the link that it hangs on.
    pub parent: String,
    /// Name of the link that it moves.
    pub child: String,
    /// From the joint's frame, which is the child's frame at value 0, to the parent's.
    pub origin: Rigid<f64>,
    /// Axis in the joint's frame, of any length but 0; not looked at for fixed joints.
    pub axis: Vec3<f64>,
    /// Range of its value; not looked at for fixed and continuous joints.
    pub limit: Limit,
    /// The joint that it follows, if it does not move by itself.
    pub mimic: Option<Mimic>,
}

/// Returns the range of a joint: a continuous one has none, whatever it says.
pub(crate) fn limit_of(joint: &Joint) -> Limit {
    match joint.kind {
        JointKind::Continuous => Limit::UNLIMITED,
        _ => joint.limit,
    }
}

/// The root link and the joints sorted parents first.
pub(crate) struct Order {
    pub(crate) root: usize,
    pub(crate) joints: Vec<usize>,
}

/// Checks that links and joints are one tree, and sorts it.
pub(crate) fn order_from_root(links: &[String], joints: &[Joint]) -> Result<Order, HandError> {
    if links.is_empty() {
        return Err(HandError::NoLinks);
    }
    let mut link_index = HashMap::new();
    for (index, link) in links.iter().enumerate() {
        if link_index.insert(link.as_str(), index).is_some() {
            return Err(HandError::DuplicateName {
                kind: "link",
                name: link.clone(),
            });
        }
    }
    let mut names = std::collections::HashSet::new();
    let mut parent_joint: Vec<Option<usize>> = vec![None; links.len()];
    let mut child_joints: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
    for (index, joint) in joints.iter().enumerate() {
        if !names.insert(joint.name.as_str()) {
            return Err(HandError::DuplicateName {
                kind: "joint",
                name: joint.name.clone(),
            });
        }
        let find = |link: &String| {
            let found = link_index.get(link.as_str()).copied();
            found.ok_or_else(|| HandError::MissingLink {
                joint: joint.name.clone(),
                link: link.clone(),
            })
        };
        let (parent, child) = (find(&joint.parent)?, find(&joint.child)?);
        child_joints[parent].push(index);
        if let Some(first) = parent_joint[child].replace(index) {
            return Err(HandError::TwoParents {
                link: joint.child.clone(),
                first: joints[first].name.clone(),
                second: joint.name.clone(),
            });
        }
    }
    let roots: Vec<usize> = (0..links.len())
        .filter(|&link| parent_joint[link].is_none())
        .collect();
    if roots.len() > 1 {
        return Err(HandError::SeveralRoots {
            roots: roots.iter().map(|&link| links[link].clone()).collect(),
        });
    }
    // With at most one parent each, links that the root does not reach hang on each other in a ring.
    let mut reached = vec![false; links.len()];
    let mut sorted = Vec::with_capacity(joints.len());
    let mut pending: Vec<usize> = roots.clone();
    while let Some(link) = pending.pop() {
        reached[link] = true;
        for &joint in &child_joints[link] {
            sorted.push(joint);
        }
        pending.extend(
            child_joints[link]
                .iter()
                .rev()
                .map(|&j| link_index[joints[j].child.as_str()]),
        );
    }
    match reached.iter().position(|&is_reached| !is_reached) {
        Some(link) => Err(HandError::Cycle {
            link: links[link].clone(),
        }),
        None => Ok(Order {
            root: roots[0],
            joints: sorted,
        }),
    }
}

/// Checks that a joint's numbers are finite and make sense.
pub(crate) fn check_numbers(joint: &Joint) -> Result<(), HandError> {
    let name = &joint.name;
    let is_finite = |v: &Vec3<f64>| v.x.is_finite() && v.y.is_finite() && v.z.is_finite();
    let finite = |what: &str, ok: bool| {
        if ok {
            return Ok(());
        }
        Err(HandError::NotFinite {
            what: format!("the {what} of joint `{name}`"),
        })
    };
    let origin = &joint.origin;
    finite(
        "origin",
        origin.rotation.rows.iter().all(is_finite) && is_finite(&origin.translation),
    )?;
    if let Some(mimic) = &joint.mimic {
        finite(
            "mimic element",
            mimic.multiplier.is_finite() && mimic.offset.is_finite(),
        )?;
    }
    if joint.kind == JointKind::Fixed {
        return Ok(());
    }
    finite("axis", is_finite(&joint.axis))?;
    let length = joint.axis.norm();
    finite("length of the axis", length.is_finite())?;
    if length <= 0.0 {
        return Err(HandError::ZeroAxis {
            joint: name.clone(),
        });
    }
    let Limit { lower, upper } = limit_of(joint);
    finite("limit", !lower.is_nan() && !upper.is_nan())?;
    if lower > upper {
        return Err(HandError::ReversedLimits {
            joint: name.clone(),
            lower,
            upper,
        });
    }
    Ok(())
}

/// Returns the joint that joint `index` follows in the end, and the factor and summand that relate the two values.
pub(crate) fn followed(
    joints: &[Joint],
    index_of: &HashMap<&str, usize>,
    index: usize,
) -> Result<(usize, f64, f64), HandError> {
    let (mut current, mut multiplier, mut offset) = (index, 1.0, 0.0);
    for _ in 0..=joints.len() {
        let joint = &joints[current];
        let Some(mimic) = &joint.mimic else {
            return Ok((current, multiplier, offset));
        };
        let bad = |fault| HandError::BadMimic {
            joint: joint.name.clone(),
            followed: mimic.joint.clone(),
            fault,
        };
        offset += multiplier * mimic.offset;
        multiplier *= mimic.multiplier;
        current = *index_of
            .get(mimic.joint.as_str())
            .ok_or_else(|| bad("does not exist"))?;
        if joints[current].kind == JointKind::Fixed {
            return Err(bad("is fixed"));
        }
    }
    let first = joints[index].mimic.as_ref();
    Err(HandError::BadMimic {
        joint: joints[index].name.clone(),
        followed: first.map_or_else(String::new, |mimic| mimic.joint.clone()),
        fault: "is one of joints that follow each other in a circle",
    })
}
