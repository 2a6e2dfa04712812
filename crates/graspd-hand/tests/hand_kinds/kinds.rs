//! Every kind of hand, with its points over any scalar type besides.

use graspd_ad::Real;
use graspd_geom::{Mat3, Rigid, Vec3, shared_file};
use graspd_hand::{
    ArticulatedHand, Hand, HandOptions, MirroredHand, SkinnedHand, SkinnedHandOptions, UrdfOptions,
    human, load_skinned_hand, parse_urdf,
};

use crate::coarse;

/// A free hand in MANO's layout, without blendshapes of pose and without a pose space of its own.
const MAKE_HUMAN: &str = "data/human_hand/mpfb_right_hand/mpfb_right_hand.npz";

/// A hand, and the parts of which its points are known in plain formulas.
pub(crate) enum Kind {
    Rigid(ArticulatedHand),
    Skinned(SkinnedHand),
    /// An image made of any hand's points, and the skinned hand that it is the image of.
    Mirrored(MirroredHand, SkinnedHand),
}

impl Kind {
    pub(crate) fn hand(&self) -> &dyn Hand {
        match self {
            Self::Rigid(hand) => hand,
            Self::Skinned(hand) => hand,
            Self::Mirrored(image, _) => image,
        }
    }

    pub(crate) fn mirrored(original: SkinnedHand) -> Self {
        Self::Mirrored(MirroredHand::new(Box::new(original.clone())), original)
    }

    /// Contact points, padding included, of the hand with its base at the origin.
    pub(crate) fn contacts_over<T: Real>(&self, articulation: &[T]) -> Vec<Vec3<T>> {
        match self {
            Self::Rigid(hand) => rigid_contacts(hand, articulation),
            Self::Skinned(hand) => skinned_contacts(hand, articulation),
            Self::Mirrored(_, original) => {
                let palm = original.palm();
                let side: Vec3<f64> = palm.normal.cross(&palm.fingers).normalize().into();
                let side = Vec3::constant(side);
                let reflected = |p: Vec3<T>| p - side * (side.dot(p) * T::constant(2.0));
                let points = skinned_contacts(original, articulation).into_iter();
                points.map(reflected).collect()
            }
        }
    }
}

fn rigid_contacts<T: Real>(hand: &ArticulatedHand, articulation: &[T]) -> Vec<Vec3<T>> {
    let mut poses = vec![Rigid::identity(); hand.tree().body_count()];
    hand.tree()
        .forward(&Rigid::identity(), articulation, &mut poses);
    let local = hand.local_contact_points();
    let bodies = hand.contact_points().body.iter().enumerate();
    bodies
        .map(|(i, &body)| poses[body as usize].apply(Vec3::constant(local.get(i))))
        .collect()
}

fn skinned_contacts<T: Real>(hand: &SkinnedHand, articulation: &[T]) -> Vec<Vec3<T>> {
    let rest = hand.rest_vertices().iter();
    let rest: Vec<Vec3<T>> = rest.map(|&vertex| Vec3::constant(vertex)).collect();
    let posed = hand.model().posed_vertices(
        &rest,
        &hand.rest_joints().map(Vec3::constant),
        &hand.pose_of(articulation),
        &Mat3::identity(),
        Vec3::zero(),
    );
    let slots = hand.contact_vertices().iter();
    slots.map(|&vertex| posed[vertex as usize]).collect()
}

pub(crate) fn rigid(
    make: fn(&HandOptions) -> Result<ArticulatedHand, graspd_hand::HandError>,
) -> ArticulatedHand {
    make(&coarse()).expect("default dimensions")
}

pub(crate) fn human_hand() -> SkinnedHand {
    human(&SkinnedHandOptions::default()).expect("default options")
}

pub(crate) fn make_human_hand() -> Option<SkinnedHand> {
    let path = shared_file(MAKE_HUMAN)?;
    Some(load_skinned_hand(&path, &SkinnedHandOptions::default()).expect("the file is sound"))
}

/// Jaws that slide, the second against the first, on a wrist that turns without end.
pub(crate) fn turning_gripper() -> ArticulatedHand {
    let solid = r#"<collision><geometry><box size="0.02 0.02 0.05"/></geometry></collision>"#;
    let text = format!(
        r#"<robot name="gripper">
        <link name="arm">{solid}</link><link name="palm">{solid}</link><link name="a">{solid}</link>
            <link name="b">{solid}</link>
        <joint name="turn" type="continuous"><parent link="arm"/><child link="palm"/>
            <origin xyz="0 0 0.05" rpy="0.1 0.2 0.3"/><axis xyz="0 0.6 0.8"/></joint>
        <joint name="slide" type="prismatic"><parent link="palm"/><child link="a"/>
            <origin xyz="0.04 0 0.05" rpy="0 0.2 0"/><axis xyz="1 0 0"/><limit lower="-0.03" upper="0.01"/></joint>
        <joint name="other" type="prismatic"><parent link="palm"/><child link="b"/>
            <origin xyz="-0.04 0 0.05"/><axis xyz="1 0 0"/><limit lower="-0.03" upper="0.03"/>
            <mimic joint="slide" multiplier="-1.5" offset="0.002"/></joint>
        </robot>"#
    );
    let options = UrdfOptions {
        hand: coarse(),
        ..UrdfOptions::default()
    };
    parse_urdf(&text, "gripper.urdf", &options).expect("the text is sound")
}
