//! The hands that need no file, and hands by name or path.

use std::path::Path;

use crate::{
    Hand, HandError, HandOptions, SkinnedHandOptions, UrdfOptions, allegro, human,
    load_skinned_hand, load_urdf,
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
];

/// The built-in hand named `name`, one of [`BUILTIN_HANDS`]; `None` if there is none.
pub fn builtin_hand(name: &str) -> Option<Box<dyn Hand>> {
    // Built-in hands with default options have no faults: a test makes each of them.
    builtin_hand_with(name, &HandOptions::default()).ok()?
}

fn builtin_hand_with(
    name: &str,
    options: &HandOptions,
) -> Result<Option<Box<dyn Hand>>, HandError> {
    Ok(match name {
        "allegro" => Some(Box::new(allegro(options)?)),
        "human" => Some(Box::new(human(&SkinnedHandOptions::default())?)),
        _ => None,
    })
}

/// The built-in hand of that name, or the hand that a file describes, covered as finely as the paper does.
///
/// # Errors
/// As [`load_hand_with`].
pub fn load_hand(name_or_path: &str) -> Result<Box<dyn Hand>, HandError> {
    load_hand_with(name_or_path, &HandOptions::default())
}

/// The built-in hand of that name, or the hand that a file describes.
///
/// # Errors
/// Whatever is wrong with the file or the options; [`HandError::UnknownHand`] where there is no such file either.
pub fn load_hand_with(
    name_or_path: &str,
    options: &HandOptions,
) -> Result<Box<dyn Hand>, HandError> {
    if let Some(hand) = builtin_hand_with(name_or_path, options)? {
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
    if extension == "urdf" || extension == "xacro" {
        let options = UrdfOptions {
            hand: options.clone(),
            ..UrdfOptions::default()
        };
        return Ok(Box::new(load_urdf(path, &options)?));
    }
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
