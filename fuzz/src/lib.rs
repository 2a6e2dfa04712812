//! What must hold of whatever comes out of a reader; shared by the fuzz targets.

use graspd_mesh::parse_mesh;
use graspd_hand::{HandError, SkinnedHand, SkinnedHandOptions, parse_skinned_model};

/// Longer messages do not fit the one line that a user is promised.
const LONGEST_MESSAGE: usize = 4000;

fn check_message(message: &str) {
    assert!(!message.contains('\n'), "more than one line: {message}");
    assert!(message.len() < LONGEST_MESSAGE, "{message}");
}

/// A mesh file is refused in one line, or gives finite positions and faces that name them.
pub fn check_mesh(bytes: &[u8], name: &str) {
    match parse_mesh(bytes, name) {
        Err(error) => check_message(&error.to_string()),
        Ok(mesh) => {
            let count = mesh.vertices.len() as u32;
            assert!(mesh.faces.iter().flatten().all(|&vertex| vertex < count));
            assert!(
                mesh.vertices
                    .iter()
                    .all(|p| p.iter().all(|x| x.is_finite()))
            );
        }
    }
}

/// A MANO file is refused in one line, or gives a model that is refused in one line or makes a hand.
pub fn check_model(bytes: &[u8]) {
    let hand = parse_skinned_model(bytes, "hand")
        .and_then(|model| SkinnedHand::new(model, &SkinnedHandOptions::default()));
    if let Err(error) = hand {
        check_hand_error(&error);
    }
}

/// An error about a hand is one line.
pub fn check_hand_error(error: &HandError) {
    check_message(&error.to_string());
}
