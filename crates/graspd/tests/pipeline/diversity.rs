//! How different grasps are.

use graspd::{Diversity, diverse, pose_distances};
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{Hand, HandPose};

use crate::fixtures::{HAND, displaced_record};

fn at(x: f64) -> HandPose {
    HandPose {
        translation: Vec3::new(x, 0.0, 0.0),
        rotation: Quaternion::identity(),
        articulation: HAND.open_articulation().to_vec(),
    }
}

#[test]
fn distances_are_those_of_the_hands_points() {
    let mut bent = at(0.0);
    bent.articulation[2] += 0.5;
    let poses = [at(0.0), at(0.003), at(0.015), bent];
    let distances = pose_distances(&*HAND, &poses.each_ref());
    assert!((distances[0][1] - 0.003).abs() < 1e-12);
    assert!((distances[2][1] - 0.012).abs() < 1e-12);
    // One finger of the hand moves, by less than its length.
    assert!(distances[0][3] > 1e-3 && distances[0][3] < 0.05);
    for a in 0..4 {
        assert_eq!(distances[a][a], 0.0);
        for b in 0..4 {
            assert_eq!(distances[a][b], distances[b][a]);
        }
    }
    let three: Vec<Vec<f64>> = distances[..3].iter().map(|row| row[..3].to_vec()).collect();
    let diversity = Diversity::of(&three).expect("three poses");
    assert!((diversity.mean_distance_mm - 10.0).abs() < 1e-9);
    assert!((diversity.mean_nearest_mm - 6.0).abs() < 1e-9);
    assert!((diversity.least_distance_mm - 3.0).abs() < 1e-9);
    assert_eq!(Diversity::of(&three[..1]), None);
}

#[test]
fn a_spread_begins_with_the_best_and_leaves_out_what_does_not_hold() {
    let displacements = [0.01, 0.02, 0.1, 0.4, 3.0];
    let records: Vec<_> = (displacements.iter().enumerate())
        .map(|(index, cm)| displaced_record(index, Some(*cm)))
        .collect();
    let poses = [0.0, 0.001, 0.02, 0.012, 0.5].map(at);
    let distances = pose_distances(&*HAND, &poses.each_ref());
    assert_eq!(diverse(&records, &distances, 1), [0]);
    assert_eq!(diverse(&records, &distances, 2), [0, 2]);
    assert_eq!(diverse(&records, &distances, 3), [0, 2, 3]);
    // The last one is the farthest, but it falls.
    assert_eq!(diverse(&records, &distances, 4), [0, 1, 2, 3]);
    assert_eq!(diverse(&records, &distances, 9), [0, 1, 2, 3, 4]);
}
