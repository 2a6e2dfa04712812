//! The hands that need no file, and hands by name or path.

use std::path::Path;

use crate::{Hand, HandError, HandOptions, allegro};

/// A hand that is built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltinHand {
    /// What to call it.
    pub name: &'static str,
    /// What it is, in one line.
    pub description: &'static str,
}

/// All hands that [`builtin_hand`] knows.
pub const BUILTIN_HANDS: &[BuiltinHand] = &[BuiltinHand {
    name: "allegro",
    description: "Allegro hand, right: three fingers and a thumb, 16 joints",
}];

/// The built-in hand named `name`, one of [`BUILTIN_HANDS`]; `None` if there is none.
///
/// # Errors
/// [`HandError::BadOption`].
pub fn builtin_hand(name: &str, options: &HandOptions) -> Result<Option<Box<dyn Hand>>, HandError> {
    Ok(match name {
        "allegro" => Some(Box::new(allegro(options)?)),
        _ => None,
    })
}

/// The built-in hand of that name, or the hand that a file describes.
///
/// # Errors
/// Whatever is wrong with the file; [`HandError::UnknownHand`] where there is neither.
pub fn load_hand(name_or_path: &str, options: &HandOptions) -> Result<Box<dyn Hand>, HandError> {
    if let Some(hand) = builtin_hand(name_or_path, options)? {
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
    Err(HandError::UnknownFormat {
        file: path.to_path_buf(),
    })
}
