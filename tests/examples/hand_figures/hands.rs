//! The hands of the figures: those that are built in, and the public files that the tests know.

use std::error::Error;

use graspd_geom::shared_file;
use graspd_hand::{Hand, LoadOptions, load_hand_from};

/// What a row of the table is about.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// What its picture is called after.
    pub(crate) name: &'static str,
    /// What the table calls it.
    pub(crate) title: &'static str,
    /// A built-in name, or a file in the folder of shared data.
    hand: &'static str,
    mirrored: bool,
}

const fn row(name: &'static str, title: &'static str, hand: &'static str) -> Row {
    Row {
        name,
        title,
        hand,
        mirrored: false,
    }
}

const fn mirrored(name: &'static str, title: &'static str, hand: &'static str) -> Row {
    Row {
        name,
        title,
        hand,
        mirrored: true,
    }
}

/// All of them, in the order of the table.
pub(crate) const ROWS: [Row; 12] = [
    row("human", "`human`", "human"),
    mirrored("human-mirrored", "`human --mirror`", "human"),
    row(
        "mano-layout",
        "MakeHuman's hand (`.npz` in MANO's layout, 1608 vertices)",
        "data/human_hand/mpfb_right_hand/mpfb_right_hand.npz",
    ),
    row("allegro", "`allegro`", "allegro"),
    mirrored("allegro-mirrored", "`allegro --mirror`", "allegro"),
    row(
        "allegro-urdf",
        "Allegro URDF (right)",
        "data/hands/allegro_hand/allegro_hand_right.urdf",
    ),
    row(
        "allegro-right-urdf",
        "Allegro URDF of the maker (right)",
        "data/hands/simlab_allegro_hand_ros/allegro_hand_description/allegro_hand_description_right.urdf",
    ),
    row(
        "allegro-left-urdf",
        "Allegro URDF of the maker (left)",
        "data/hands/simlab_allegro_hand_ros/allegro_hand_description/allegro_hand_description_left.urdf",
    ),
    row("leap", "`leap`", "leap"),
    row(
        "leap-urdf",
        "LEAP URDF",
        "data/hands/leap_hand/leap_hand_right.urdf",
    ),
    row("barrett", "`barrett`", "barrett"),
    row(
        "barrett-urdf",
        "Barrett URDF",
        "data/hands/barrett_hand/bhand_model.urdf",
    ),
];

impl Row {
    /// Loads the hand of this row, as `graspd synth` takes it; `None` if its file is not there.
    pub(crate) fn load(&self) -> Result<Option<Box<dyn Hand>>, Box<dyn Error>> {
        let options = LoadOptions {
            mirrored: self.mirrored,
            ..LoadOptions::default()
        };
        if !self.hand.contains('/') {
            return Ok(Some(load_hand_from(self.hand, &options)?));
        }
        let file = shared_file(self.hand);
        let load = |file: std::path::PathBuf| load_hand_from(&file.to_string_lossy(), &options);
        Ok(file.map(load).transpose()?)
    }
}
