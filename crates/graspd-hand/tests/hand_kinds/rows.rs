//! Points that follow hands of rigid links, skinned hands without blendshapes, and mirror images of both.

use graspd_hand::{Hand, MirroredHand, allegro, barrett};
use proptest::prelude::*;

use crate::jacobian_rows::assert_jacobian_rows;
use crate::kinds::{human_hand, rigid, turning_gripper};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn points_of_every_kind_of_hand_follow_as_differences_say(seed: u64) {
        let mirrored = MirroredHand::new(Box::new(human_hand()));
        let twice = MirroredHand::new(Box::new(turning_gripper()));
        let hands: [&dyn Hand; 7] = [
            &rigid(allegro),
            &rigid(barrett),
            &rigid(allegro).mirrored(),
            &turning_gripper(),
            &human_hand(),
            &mirrored,
            &twice,
        ];
        for hand in hands {
            assert_jacobian_rows(hand, seed)?;
        }
    }
}
