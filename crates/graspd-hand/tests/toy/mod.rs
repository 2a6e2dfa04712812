//! Small robots as URDF text.

use graspd_hand::{ArticulatedHand, HandError, HandOptions, UrdfOptions, load_urdf};

pub(crate) const BOX: &str =
    r#"<collision><geometry><box size="0.02 0.02 0.02"/></geometry></collision>"#;

pub(crate) fn small_options() -> UrdfOptions {
    UrdfOptions {
        search_paths: Vec::new(),
        hand: HandOptions {
            contact_points: 64,
            collision_spheres: 8,
            ..HandOptions::default()
        },
    }
}

pub(crate) fn load_text(text: &str) -> Result<ArticulatedHand, HandError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.urdf");
    std::fs::write(&path, text).unwrap();
    load_urdf(path, &small_options())
}

/// A robot of links `a`, `b`, ... with a box each, and the given joints.
pub(crate) fn robot(links: &str, joints: &str) -> String {
    let links: String = links
        .chars()
        .map(|name| format!(r#"<link name="{name}">{BOX}</link>"#))
        .collect();
    format!(r#"<?xml version="1.0"?><robot name="toy">{links}{joints}</robot>"#)
}

pub(crate) fn joint(name: &str, kind: &str, links: [&str; 2], rest: &str) -> String {
    let [parent, child] = links;
    format!(
        r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{rest}</joint>"#
    )
}

pub(crate) const LIMIT: &str = r#"<limit lower="-1" upper="2"/>"#;
