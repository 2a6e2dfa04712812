//! The hands that need no file, and hands by name or path.

use std::path::{Path, PathBuf};

use crate::{
    ArticulatedHand, Hand, HandError, HandOptions, MirroredHand, SkinnedHandOptions, UrdfOptions,
    allegro, barrett, human, leap, load_skinned_hand, load_urdf,
};

/// A hand that is built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltinHand {
    /// What to call it.
    pub name: &'static str,
    /// What it is, in one line.
    pub description: &'static str,
}

/// All hands that [`builtin_hand`] knows.
pub const BUILTIN_HANDS: &[BuiltinHand] = &[
    BuiltinHand {
        name: "allegro",
        description: "Allegro hand, right: three fingers and a thumb, 16 joints",
    },
    BuiltinHand {
        name: "human",
        description: "human hand, right: 778 contact points, 15 joints of 3 angles each",
    },
    BuiltinHand {
        name: "leap",
        description: "LEAP hand, right: three fingers and a thumb, 16 joints",
    },
    BuiltinHand {
        name: "barrett",
        description: "BarrettHand BH8-282: three fingers, two of which spread, 8 coupled joints of 4 motors",
    },
];

/// How a hand is made from a name or a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// How finely it is covered.
    pub hand: HandOptions,
    /// Folders in which a URDF's meshes are looked for, see [`UrdfOptions::search_paths`].
    pub package_paths: Vec<PathBuf>,
    /// Whether to take its mirror image: left for right.
    pub mirrored: bool,
}

/// The built-in hand named `name`, one of [`BUILTIN_HANDS`]; `None` if there is none.
pub fn builtin_hand(name: &str) -> Option<Box<dyn Hand>> {
    // Built-in hands with default options have no faults: a test makes each of them.
    builtin_hand_with(name, &HandOptions::default()).ok()?
}

fn builtin_hand_with(
    name: &str,
    options: &HandOptions,
) -> Result<Option<Box<dyn Hand>>, HandError> {
    Ok(match articulated_hand_with(name, options)? {
        Some(hand) => Some(Box::new(hand)),
        None if name == "human" => Some(Box::new(human(&SkinnedHandOptions::default())?)),
        None => None,
    })
}

/// The built-in hands of rigid links.
fn articulated_hand_with(
    name: &str,
    options: &HandOptions,
) -> Result<Option<ArticulatedHand>, HandError> {
    Ok(match name {
        "allegro" => Some(allegro(options)?),
        "leap" => Some(leap(options)?),
        "barrett" => Some(barrett(options)?),
        _ => None,
    })
}

/// The built-in hand of that name, or the hand that a file describes, covered as finely as the paper does.
///
/// # Errors
/// As [`load_hand_from`].
pub fn load_hand(name_or_path: &str) -> Result<Box<dyn Hand>, HandError> {
    load_hand_from(name_or_path, &LoadOptions::default())
}

/// The built-in hand of that name, or the hand that a file describes.
///
/// # Errors
/// As [`load_hand_from`].
pub fn load_hand_with(
    name_or_path: &str,
    options: &HandOptions,
) -> Result<Box<dyn Hand>, HandError> {
    let options = LoadOptions {
        hand: options.clone(),
        ..LoadOptions::default()
    };
    load_hand_from(name_or_path, &options)
}

/// The built-in hand of that name, or the hand that a file describes, or its mirror image.
///
/// # Errors
/// Whatever is wrong with the file or the options; [`HandError::UnknownHand`] where there is no such file either.
pub fn load_hand_from(
    name_or_path: &str,
    options: &LoadOptions,
) -> Result<Box<dyn Hand>, HandError> {
    let rigid = match articulated_hand_with(name_or_path, &options.hand)? {
        Some(hand) => Some(hand),
        None => urdf_hand(name_or_path, options)?,
    };
    // Hands of rigid links have a mirror image of their own, which costs nothing to pose.
    if let Some(hand) = rigid {
        return Ok(Box::new(if options.mirrored {
            hand.mirrored()
        } else {
            hand
        }));
    }
    let hand = other_hand(name_or_path, options)?;
    Ok(if options.mirrored {
        Box::new(MirroredHand::new(hand))
    } else {
        hand
    })
}

/// The hand of a URDF file; `None` if that is not what the path names.
fn urdf_hand(
    name_or_path: &str,
    options: &LoadOptions,
) -> Result<Option<ArticulatedHand>, HandError> {
    let path = Path::new(name_or_path);
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if !path.exists() || !(extension == "urdf" || extension == "xacro") {
        return Ok(None);
    }
    let options = UrdfOptions {
        hand: options.hand.clone(),
        search_paths: options.package_paths.clone(),
    };
    load_urdf(path, &options).map(Some)
}

/// A built-in hand or a file of any other kind.
fn other_hand(name_or_path: &str, options: &LoadOptions) -> Result<Box<dyn Hand>, HandError> {
    if let Some(hand) = builtin_hand_with(name_or_path, &options.hand)? {
        return Ok(hand);
    }
    let path = Path::new(name_or_path);
    if !path.exists() {
        let names: Vec<&str> = BUILTIN_HANDS.iter().map(|hand| hand.name).collect();
        return Err(HandError::UnknownHand {
            name: name_or_path.to_owned(),
            built_in: names.join(", "),
        });
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension == "pkl" || extension == "npz" {
        let options = SkinnedHandOptions::default();
        return Ok(Box::new(load_skinned_hand(path, &options)?));
    }
    Err(HandError::UnknownFormat {
        file: path.to_path_buf(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_hand_can_be_made() {
        for hand in BUILTIN_HANDS {
            let made = builtin_hand(hand.name).unwrap_or_else(|| panic!("{} fails", hand.name));
            assert_eq!(made.name(), hand.name);
        }
        assert!(builtin_hand("no such hand").is_none());
    }
}
