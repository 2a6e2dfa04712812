//! The hands that need no file, and hands by name or path.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::human::{HumanPoseSpace, human_model};
use crate::{
    ArticulatedHand, Hand, HandError, HandOptions, MirroredHand, SkinnedHand, SkinnedHandOptions,
    UrdfOptions, allegro, barrett, human, leap, load_skinned_hand, load_urdf,
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
    /// What skinned hands are made with; hands of rigid links refuse it.
    pub skin: SkinOptions,
}

/// What a skinned hand is made with: the built-in human hand, or a file in MANO's layout.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SkinOptions {
    /// Shape parameters in standard deviations, in order; those not given are 0, the mean shape.
    pub shape: Vec<f64>,
    /// Pose the hand by so many of its principal components. Without, a file's are all used, and the built-in human
    /// hand is posed by the angles of its joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_components: Option<usize>,
    /// Count poses from the flat hand instead of from the mean pose.
    pub flat_mean: bool,
}

impl SkinOptions {
    fn of_model(&self) -> SkinnedHandOptions {
        let usual = SkinnedHandOptions::default();
        SkinnedHandOptions {
            shape: self.shape.clone(),
            components: self.pose_components.unwrap_or(usual.components),
            flat_mean: self.flat_mean,
            ..usual
        }
    }

    fn human(&self) -> Result<SkinnedHand, HandError> {
        match self.pose_components {
            None => human(&self.of_model()),
            Some(_) => SkinnedHand::new(human_model(HumanPoseSpace::Synergies), &self.of_model()),
        }
    }

    /// Hands of rigid links have none of this.
    fn refuse(&self) -> Result<(), HandError> {
        let given = [
            ("shape", !self.shape.is_empty()),
            ("components", self.pose_components.is_some()),
            ("flat_mean", self.flat_mean),
        ];
        match given.into_iter().find(|(_, is_given)| *is_given) {
            None => Ok(()),
            Some((option, _)) => Err(HandError::BadOption {
                option,
                value: "given".into(),
                remedy: "only skinned hands have it: `human`, and .pkl and .npz files in MANO's layout",
            }),
        }
    }
}

/// Returns the built-in hand named `name`, one of [`BUILTIN_HANDS`]; `None` if there is none.
pub fn builtin_hand(name: &str) -> Option<Box<dyn Hand>> {
    // Built-in hands with default options have no faults: a test makes each of them.
    builtin_hand_with(name, &LoadOptions::default()).ok()?
}

fn builtin_hand_with(
    name: &str,
    options: &LoadOptions,
) -> Result<Option<Box<dyn Hand>>, HandError> {
    Ok(match articulated_hand_with(name, &options.hand)? {
        Some(hand) => Some(Box::new(hand)),
        None if name == "human" => Some(Box::new(options.skin.human()?)),
        None => None,
    })
}

/// Makes a built-in hand of rigid links; `None` if there is none of that name.
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

/// Returns the built-in hand of that name, or the hand that a file describes, covered as finely as the paper does.
///
/// # Errors
/// As [`load_hand_from`].
pub fn load_hand(name_or_path: &str) -> Result<Box<dyn Hand>, HandError> {
    load_hand_from(name_or_path, &LoadOptions::default())
}

/// Returns the built-in hand of that name, or the hand that a file describes, or its mirror image.
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
        options.skin.refuse()?;
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

/// Loads the hand of a URDF file; `None` if that is not what the path names.
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

/// Makes a built-in hand, or that of a file of any other kind.
fn other_hand(name_or_path: &str, options: &LoadOptions) -> Result<Box<dyn Hand>, HandError> {
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
    if extension == "pkl" || extension == "npz" {
        return Ok(Box::new(load_skinned_hand(path, &options.skin.of_model())?));
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

    fn human_with(skin: SkinOptions) -> Result<Box<dyn Hand>, HandError> {
        let options = LoadOptions {
            skin,
            ..LoadOptions::default()
        };
        load_hand_from("human", &options)
    }

    #[test]
    fn a_skinned_hand_takes_shape_and_components() {
        let usual = builtin_hand("human").unwrap();
        let twelve = human_with(SkinOptions {
            pose_components: Some(12),
            ..SkinOptions::default()
        })
        .unwrap();
        assert_eq!(twelve.articulation_names().len(), 12);
        let large = human_with(SkinOptions {
            shape: vec![2.0],
            ..SkinOptions::default()
        })
        .unwrap();
        let extent = |hand: &dyn Hand| {
            let pose = crate::HandPose {
                translation: graspd_geom::Vec3::zero(),
                rotation: graspd_geom::Quaternion::identity(),
                articulation: hand.open_articulation().to_vec(),
            };
            let xs = hand.surface(&pose).vertices.into_iter().map(|p| p.x);
            let (low, high) = xs.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        };
        // The first parameter is the size of the whole hand: 6 % for each standard deviation.
        let ratio = extent(&*large) / extent(&*usual);
        assert!((1.02..1.3).contains(&ratio), "{ratio}");
    }

    #[test]
    fn what_a_hand_cannot_follow_is_refused() {
        let shape = |count: usize| SkinOptions {
            shape: vec![0.5; count],
            ..SkinOptions::default()
        };
        assert!(human_with(shape(10)).is_ok());
        for (hand, skin) in [
            ("human", shape(11)),
            (
                "human",
                SkinOptions {
                    pose_components: Some(0),
                    ..SkinOptions::default()
                },
            ),
            ("allegro", shape(1)),
        ] {
            let options = LoadOptions {
                skin,
                ..LoadOptions::default()
            };
            let error = load_hand_from(hand, &options).map(|_| ()).unwrap_err();
            assert!(
                matches!(error, HandError::BadOption { .. } | HandError::Option(_)),
                "{error}"
            );
        }
    }
}
