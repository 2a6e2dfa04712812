//! The tree that searches walk: each node has up to eight children, whose boxes are tested at once.

use nalgebra::Point3;
use rayon::prelude::*;

use super::eight_boxes::{BOXES, EightBoxes};
use super::oriented_box::OrientedBox;
use super::tree::Node;

/// Room for what a search has yet to look at: at each of at most 11 levels, as every level divides by eight, up to
/// 7 children stay behind, and those of the last node take 8 places, written before it is known whether they count.
pub(super) const STACK: usize = 7 * 11 + 2 * BOXES;

/// What a box of a node holds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Child {
    /// The node of that number.
    Node(u32),
    /// The triangle of that number, in leaf order.
    Triangle(u32),
}

/// A node with up to eight children.
#[derive(Clone, Debug)]
pub(super) struct WideNode {
    pub(super) boxes: EightBoxes,
    pub(super) children: [Child; BOXES],
    /// How many children there are.
    pub(super) count: usize,
}

/// Takes three levels of a binary tree at a time for one of a wide tree; the first node is the root.
///
/// `corners`: of the triangles, in leaf order; `middle`: the origin of the boxes.
pub(super) fn widened(
    nodes: &[Node],
    corners: &[[Point3<f64>; 3]],
    middle: &Point3<f64>,
) -> Vec<WideNode> {
    // The binary nodes below each wide node; wide nodes are numbered in the order in which they are found.
    let mut below: Vec<Vec<usize>> = Vec::new();
    let mut children: Vec<[Child; BOXES]> = Vec::new();
    let mut found = vec![0];
    while let Some(&root) = found.get(below.len()) {
        let members = descendants(nodes, root);
        let mut links = [Child::Triangle(0); BOXES];
        for (link, &member) in links.iter_mut().zip(&members) {
            *link = if nodes[member].is_leaf() {
                Child::Triangle(nodes[member].first)
            } else {
                found.push(member);
                Child::Node(found.len() as u32 - 1)
            };
        }
        below.push(members);
        children.push(links);
    }
    below
        .par_iter()
        .zip(children)
        .map(|(members, children)| {
            let boxes: Vec<OrientedBox> = members
                .iter()
                .map(|&member| OrientedBox::around(&corners[nodes[member].triangles()], middle))
                .collect();
            WideNode {
                boxes: EightBoxes::new(&boxes),
                children,
                count: members.len(),
            }
        })
        .collect()
}

/// Up to eight nodes that together hold what `root` holds, got by splitting the largest again and again.
///
/// None is split further than to a power of eight triangles, so that nodes lower down, of which there are more,
/// are full.
fn descendants(nodes: &[Node], root: usize) -> Vec<usize> {
    let mut enough = 1;
    while enough * BOXES < nodes[root].count as usize {
        enough *= BOXES;
    }
    let mut members = vec![root];
    while members.len() < BOXES {
        let counts = members.iter().map(|&member| nodes[member].count);
        let Some((place, count)) = counts.enumerate().max_by_key(|(_, count)| *count) else {
            break;
        };
        if count as usize <= enough {
            break;
        }
        let (left, right) = (members[place] + 1, nodes[members[place] + 1].end as usize);
        members[place] = left;
        members.insert(place + 1, right);
    }
    members
}
