//! Measures of the hand, and its skeleton in the rest pose.
//!
//! Frame: right hand, origin at the wrist joint, fingers towards -x, back of the hand towards +y, thumb towards +z.
//! Lengths in this module are in millimetres, as the published tables have them.
//!
//! # Source
//! * Lengths of metacarpals and phalanges and of the soft tissue at the tips: means of 66 adults by radiograph,
//!   Buryanov and Kotiuk, "Proportions of Hand Segments", International Journal of Morphology 28(3), 2010.
//! * Breadths and depths: between the means of men and women of the surveys by Greiner, "Hand Anthropometry of U.S.
//!   Army Personnel", Natick TR-92/011, 1991, and DIN 33402-2, rounded to about half a millimetre.
//! * Where the metacarpals' heads are across the palm: made to fit the hand breadth of those surveys (about 85 mm) and
//!   the metacarpal lengths, with the transverse arch of the knuckles by eye.

use nalgebra::{Point3, Vector3};

/// Metres in a millimetre.
pub(crate) const MM: f64 = 1e-3;

/// A finger or the thumb: three bones that move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) name: &'static str,
    /// Its first joint in MANO's order.
    pub(crate) first_joint: usize,
    /// Where its first joint is: the metacarpophalangeal joint, or the thumb's carpometacarpal joint.
    pub(crate) base: [f64; 3],
    /// Direction of each of its bones in the rest pose, of any length.
    pub(crate) directions: [[f64; 3]; 3],
    /// Lengths of its bones; of the last without the soft tissue at the tip.
    pub(crate) lengths: [f64; 3],
    /// Thickness of the soft tissue beyond the last bone.
    pub(crate) tip_tissue: f64,
    /// Half breadth of the skin at its three joints and of the ball that ends its tip.
    pub(crate) half_breadths: [f64; 4],
    /// Which way its pads face in the rest pose.
    pub(crate) pad: [f64; 3],
    /// Where its metacarpal begins; the thumb's is the first bone of its own.
    pub(crate) metacarpal_base: Option<[f64; 3]>,
}

/// Index, middle, little and ring finger and the thumb, in MANO's order.
pub(crate) const RAYS: [Ray; 5] = [
    Ray {
        name: "index",
        first_joint: 1,
        base: [-92.0, 2.0, 23.5],
        directions: [
            [-0.993, 0.0, 0.118],
            [-0.993, 0.0, 0.118],
            [-0.995, 0.0, 0.1],
        ],
        lengths: [39.78, 22.38, 15.82],
        tip_tissue: 3.84,
        half_breadths: [11.0, 9.9, 8.6, 7.1],
        pad: [0.0, -1.0, 0.0],
        metacarpal_base: Some([-26.0, 1.0, 12.0]),
    },
    Ray {
        name: "middle",
        first_joint: 4,
        base: [-96.0, 4.0, 2.0],
        directions: [[-1.0, 0.0, 0.01], [-1.0, 0.0, 0.01], [-1.0, 0.0, 0.0]],
        lengths: [44.63, 26.33, 17.40],
        tip_tissue: 3.95,
        half_breadths: [11.2, 10.0, 8.8, 7.2],
        pad: [0.0, -1.0, 0.0],
        metacarpal_base: Some([-31.0, 3.0, 2.0]),
    },
    Ray {
        name: "pinky",
        first_joint: 7,
        base: [-79.0, -3.0, -36.0],
        directions: [
            [-0.962, 0.0, -0.275],
            [-0.968, 0.0, -0.25],
            [-0.974, 0.0, -0.225],
        ],
        lengths: [32.74, 18.11, 15.96],
        tip_tissue: 3.73,
        half_breadths: [9.4, 8.4, 7.4, 6.1],
        pad: [0.0, -1.0, 0.0],
        metacarpal_base: Some([-29.0, -1.0, -17.0]),
    },
    Ray {
        name: "ring",
        first_joint: 10,
        base: [-89.0, 2.0, -18.0],
        directions: [
            [-0.993, 0.0, -0.118],
            [-0.993, 0.0, -0.118],
            [-0.995, 0.0, -0.1],
        ],
        lengths: [41.37, 25.65, 17.30],
        tip_tissue: 3.95,
        half_breadths: [10.5, 9.4, 8.2, 6.8],
        pad: [0.0, -1.0, 0.0],
        metacarpal_base: Some([-32.0, 2.0, -8.0]),
    },
    Ray {
        name: "thumb",
        first_joint: 13,
        base: [-22.0, -9.0, 23.0],
        directions: [
            [-0.74, -0.24, 0.63],
            [-0.81, -0.17, 0.56],
            [-0.87, -0.12, 0.48],
        ],
        lengths: [46.22, 31.57, 21.67],
        tip_tissue: 5.67,
        half_breadths: [14.0, 11.6, 10.8, 8.6],
        pad: [-0.2, -0.72, -0.66],
        metacarpal_base: None,
    },
];

/// Index into [`RAYS`] of the thumb.
pub(crate) const THUMB: usize = 4;

/// A ray laid out in the rest pose, in millimetres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chain {
    /// Its joints from the base, then the end of its last bone.
    pub(crate) joints: [Point3<f64>; 4],
    /// Unit directions of its bones.
    pub(crate) along: [Vector3<f64>; 3],
    /// For each bone the unit direction its pad faces, at right angles to the bone.
    pub(crate) pads: [Vector3<f64>; 3],
    /// For each bone the axis about which flexion turns it, to the right-hand rule.
    pub(crate) flexion_axes: [Vector3<f64>; 3],
}

impl Chain {
    pub(crate) fn new(ray: &Ray) -> Self {
        let along = ray.directions.map(|d| Vector3::from(d).normalize());
        let pads = along.map(|d| {
            let pad = Vector3::from(ray.pad);
            (pad - d * d.dot(&pad)).normalize()
        });
        let mut joints = [Point3::from(ray.base); 4];
        for bone in 0..3 {
            joints[bone + 1] = joints[bone] + along[bone] * ray.lengths[bone];
        }
        Self {
            joints,
            along,
            pads,
            flexion_axes: std::array::from_fn(|bone| along[bone].cross(&pads[bone])),
        }
    }
    /// Returns the tip of the skin.
    pub(crate) fn tip(&self, ray: &Ray) -> Point3<f64> {
        self.joints[3] + self.along[2] * ray.tip_tissue
    }
}

/// Lays all rays out, in the order of [`RAYS`].
pub(crate) fn chains() -> [Chain; 5] {
    RAYS.each_ref().map(Chain::new)
}

/// Returns the joints of the rest pose in MANO's order \[m\].
pub(crate) fn joints() -> [Point3<f64>; 16] {
    let mut joints = [Point3::origin(); 16];
    for (ray, chain) in RAYS.iter().zip(chains()) {
        for bone in 0..3 {
            joints[ray.first_joint + bone] = chain.joints[bone] * MM;
        }
    }
    joints
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metacarpals_have_their_published_lengths() {
        // Index, middle, little, ring; the joints are placed to about a millimetre.
        for (ray, published) in RAYS.iter().zip([68.12, 64.60, 53.69, 58.00]) {
            let base = Point3::from(ray.metacarpal_base.unwrap());
            let length = (Point3::from(ray.base) - base).norm();
            assert!((length - published).abs() < 1.5, "{}: {length}", ray.name);
        }
    }

    #[test]
    fn the_hand_is_as_long_as_hands_are() {
        // Greiner 1991: hand length 194 mm (men) and 181 mm (women), from the wrist crease.
        let chain = Chain::new(&RAYS[1]);
        let length = -chain.tip(&RAYS[1]).x;
        assert!((181.0..196.0).contains(&length), "{length}");
    }

    #[test]
    fn flexion_turns_fingers_towards_the_palm() {
        for chain in chains() {
            for bone in 0..3 {
                let turned = chain.flexion_axes[bone].cross(&chain.along[bone]);
                assert!((turned - chain.pads[bone]).norm() < 1e-12);
                assert!(chain.pads[bone].y < 0.0);
            }
        }
    }
}
