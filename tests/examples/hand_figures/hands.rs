//! The hands of the figures: those that are built in, and the public files that the tests know.

use std::error::Error;

use graspd_geom::shared_file;
use graspd_hand::{
    ArticulatedHand, Hand, HandOptions, MirroredHand, SkinnedHand, SkinnedHandOptions, UrdfOptions,
    allegro, barrett, human, leap, load_skinned_hand, load_urdf,
};

/// A hand by what it is made of, and whether it is to be mirrored.
pub(crate) struct Subject {
    pub(crate) made_of: MadeOf,
    pub(crate) is_mirrored: bool,
}

pub(crate) enum MadeOf {
    Links(Box<ArticulatedHand>),
    Skin(Box<SkinnedHand>),
}

impl Subject {
    /// The hand itself, as `graspd synth` takes it.
    pub(crate) fn hand(&self) -> Box<dyn Hand> {
        match (&self.made_of, self.is_mirrored) {
            (MadeOf::Links(hand), false) => hand.clone(),
            (MadeOf::Links(hand), true) => Box::new(hand.mirrored()),
            (MadeOf::Skin(hand), false) => hand.clone(),
            (MadeOf::Skin(hand), true) => Box::new(MirroredHand::new(hand.clone())),
        }
    }
}

/// What a row of the table is about.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// What its picture is called after.
    pub(crate) name: &'static str,
    /// What the table calls it.
    pub(crate) title: &'static str,
    source: Source,
    is_mirrored: bool,
}

#[derive(Clone, Copy)]
enum Source {
    Links(fn(&HandOptions) -> Result<ArticulatedHand, graspd_hand::HandError>),
    Human,
    Urdf(&'static str),
    Npz(&'static str),
}

const fn row(name: &'static str, title: &'static str, source: Source) -> Row {
    Row {
        name,
        title,
        source,
        is_mirrored: false,
    }
}

const fn mirrored(row: Row, name: &'static str, title: &'static str) -> Row {
    Row {
        name,
        title,
        is_mirrored: true,
        ..row
    }
}

const ALLEGRO: Row = row("allegro", "`allegro`", Source::Links(allegro));
const HUMAN: Row = row("human", "`human`", Source::Human);

/// All of them, in the order of the table.
pub(crate) const ROWS: [Row; 12] = [
    HUMAN,
    mirrored(HUMAN, "human-mirrored", "`human --mirror`"),
    row(
        "mano-layout",
        "MakeHuman's hand (`.npz` in MANO's layout, 1608 vertices)",
        Source::Npz("data/human_hand/mpfb_right_hand/mpfb_right_hand.npz"),
    ),
    ALLEGRO,
    mirrored(ALLEGRO, "allegro-mirrored", "`allegro --mirror`"),
    row(
        "allegro-urdf",
        "Allegro URDF (right)",
        Source::Urdf("data/hands/allegro_hand/allegro_hand_right.urdf"),
    ),
    row(
        "allegro-right-urdf",
        "Allegro URDF of the maker (right)",
        Source::Urdf(
            "data/hands/simlab_allegro_hand_ros/allegro_hand_description/allegro_hand_description_right.urdf",
        ),
    ),
    row(
        "allegro-left-urdf",
        "Allegro URDF of the maker (left)",
        Source::Urdf(
            "data/hands/simlab_allegro_hand_ros/allegro_hand_description/allegro_hand_description_left.urdf",
        ),
    ),
    row("leap", "`leap`", Source::Links(leap)),
    row(
        "leap-urdf",
        "LEAP URDF",
        Source::Urdf("data/hands/leap_hand/leap_hand_right.urdf"),
    ),
    row("barrett", "`barrett`", Source::Links(barrett)),
    row(
        "barrett-urdf",
        "Barrett URDF",
        Source::Urdf("data/hands/barrett_hand/bhand_model.urdf"),
    ),
];

impl Row {
    /// The hand of this row; `None` if its file is not there.
    pub(crate) fn subject(&self) -> Result<Option<Subject>, Box<dyn Error>> {
        let made_of = match self.source {
            Source::Links(make) => MadeOf::Links(Box::new(make(&HandOptions::default())?)),
            Source::Human => MadeOf::Skin(Box::new(human(&SkinnedHandOptions::default())?)),
            Source::Urdf(path) => match shared_file(path) {
                Some(file) => MadeOf::Links(Box::new(load_urdf(file, &UrdfOptions::default())?)),
                None => return Ok(None),
            },
            Source::Npz(path) => match shared_file(path) {
                Some(file) => MadeOf::Skin(Box::new(load_skinned_hand(
                    &file,
                    &SkinnedHandOptions::default(),
                )?)),
                None => return Ok(None),
            },
        };
        Ok(Some(Subject {
            made_of,
            is_mirrored: self.is_mirrored,
        }))
    }
}
