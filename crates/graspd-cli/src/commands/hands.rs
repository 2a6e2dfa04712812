//! `graspd hands`: what is built in, and what a file holds.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::{Args, Subcommand};
use graspd_hand::{BUILTIN_HANDS, Hand, closed_articulation, closing_directions, load_hand_from};
use graspd_view::render_hand;

use super::input::HandLoading;
use super::output::prepare_file;
use crate::console::{print, print_json};

/// Width and height of each panel of `--png` \[pixels\].
const PICTURE_PANEL: (usize, usize) = (560, 560);
/// How far the second panel's hand is closed.
const CLOSED_SHARE: f64 = 0.5;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<HandsCommand>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum HandsCommand {
    /// Describe a built-in hand, a URDF or a MANO model: joints, limits, contact points, palm, and what had to be
    /// guessed
    Inspect(InspectArguments),
}

#[derive(Args)]
struct InspectArguments {
    /// Built-in hand, a .urdf, or a MANO model (.pkl or .npz)
    hand: String,
    #[command(flatten)]
    loading: HandLoading,
    /// Render the hand, open and half closed, with palm frame and contact points, to this PNG file
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let Some(HandsCommand::Inspect(inspection)) = &arguments.command else {
        return list(arguments.json);
    };
    if let Some(file) = &inspection.png {
        prepare_file(file, "--png")?;
    }
    let hand = load_hand_from(&inspection.hand, &inspection.loading.options()?)?;
    if let Some(file) = &inspection.png {
        let closed = closed_articulation(hand.as_ref(), CLOSED_SHARE);
        render_hand(hand.as_ref(), &closed, PICTURE_PANEL)?.write_png(file)?;
    }
    let picture = inspection.png.as_deref();
    inspect(hand.as_ref(), picture, inspection.json || arguments.json)
}

fn list(json: bool) -> Result<()> {
    if json {
        let list: Vec<_> = BUILTIN_HANDS
            .iter()
            .map(|hand| serde_json::json!({"name": hand.name, "description": hand.description}))
            .collect();
        return print_json(&list);
    }
    let mut text = String::new();
    for hand in BUILTIN_HANDS {
        text += &format!("{:10} {}\n", hand.name, hand.description);
    }
    text += "any URDF, and any hand in MANO's layout (.pkl, .npz): name its file; `graspd hands inspect FILE` tells \
        what was found\n";
    text += "--mirror takes the mirror image of any of them\n";
    print(&text)
}

fn inspect(hand: &dyn Hand, picture: Option<&Path>, json: bool) -> Result<()> {
    let contacts = hand.contact_points();
    let spheres = hand.collision_spheres();
    let palm = hand.palm();
    let per_body: Vec<usize> = (0..hand.body_names().len())
        .map(|body| {
            let of_body = contacts.body.iter().zip(&contacts.weight);
            of_body
                .filter(|&(&b, &w)| b as usize == body && w > 0.0)
                .count()
        })
        .collect();
    let colliding = colliding_bodies(hand);
    let names = hand.articulation_names();
    let closing = closing_directions(hand);
    // Some hands have no limits at all.
    let limit = |joint: usize| hand.limits().and_then(|limits| limits.get(joint));
    let joints = names.iter().zip(hand.open_articulation()).enumerate();
    if json {
        let value = serde_json::json!({
            "name": hand.name(),
            "joints": joints.map(|(joint, (name, open))| serde_json::json!({
                "name": name, "open": open, "closes": closing[joint],
                "lower": limit(joint).map(|limit| limit.lower),
                "upper": limit(joint).map(|limit| limit.upper),
                "middle": limit(joint).map(|limit| limit.middle()),
            })).collect::<Vec<_>>(),
            "followers": hand.coupled_joints(),
            "contact_points": contacts.count,
            "bodies": hand.body_names().iter().zip(&per_body).map(|(name, count)| {
                serde_json::json!({"name": name, "contact_points": count})
            }).collect::<Vec<_>>(),
            "collision_spheres": spheres.radius.len(),
            "collision_pairs": spheres.pairs.len(),
            "colliding_bodies": colliding,
            "palm": {
                "center_m": [palm.center.x, palm.center.y, palm.center.z],
                "normal": [palm.normal.x, palm.normal.y, palm.normal.z],
                "fingers": [palm.fingers.x, palm.fingers.y, palm.fingers.z],
            },
            "notes": hand.notes(),
        });
        return print_json(&value);
    }
    let mut text = format!("{}\njoints ({}):\n", hand.name(), names.len());
    for (joint, (name, open)) in joints {
        let range = limit(joint).map_or_else(
            || "no limits".into(),
            |limit| format!("{:8.3} .. {:7.3}", limit.lower, limit.upper),
        );
        let closes = match closing[joint] {
            c if c > 0.0 => "closes up",
            c if c < 0.0 => "closes down",
            _ => "",
        };
        let line = format!("  {name:20} {range:>19}  open {open:7.3}  {closes}");
        text += line.trim_end();
        text.push('\n');
    }
    text += &indented("followers:", hand.coupled_joints());
    let counted = hand.body_names().iter().zip(&per_body);
    let counted = counted.filter(|(_, count)| **count > 0);
    text += &format!("contact points: {}\n", contacts.count);
    text += &indented(
        "",
        counted.map(|(name, count)| format!("{name:20} {count:5}")),
    );
    text += &format!(
        "self-collision: {} spheres, {} pairs of them between {} pairs of bodies\n",
        spheres.radius.len(),
        spheres.pairs.len(),
        colliding.len()
    );
    text += &indented("", colliding.iter().map(|[a, b]| format!("{a} - {b}")));
    let vector = |v: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", v[0], v[1], v[2]);
    text += &format!("palm centre {} m\n", vector(palm.center.coords.into()));
    text += &format!("palm normal {}\n", vector(palm.normal.into()));
    text += &format!("fingers     {}\n", vector(palm.fingers.into()));
    text += &indented("notes:", hand.notes());
    if let Some(picture) = picture {
        text += &format!("picture: {}\n", picture.display());
    }
    print(&text)
}

/// Returns the lines, indented, below a heading; nothing at all without a line.
fn indented<T: std::fmt::Display>(heading: &str, lines: impl IntoIterator<Item = T>) -> String {
    let mut text = String::new();
    for line in lines {
        if text.is_empty() && !heading.is_empty() {
            text = format!("{heading}\n");
        }
        text += &format!("  {line}\n");
    }
    text
}

/// Returns the pairs of bodies whose spheres must not overlap, by name, in the order of the bodies.
fn colliding_bodies(hand: &dyn Hand) -> Vec<[&str; 2]> {
    let spheres = hand.collision_spheres();
    let bodies = |&[a, b]: &[u32; 2]| {
        let [a, b] = [a, b].map(|sphere| spheres.body[sphere as usize] as usize);
        [a.min(b), a.max(b)]
    };
    let mut pairs: Vec<[usize; 2]> = spheres.pairs.iter().map(bodies).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let names = hand.body_names();
    pairs
        .into_iter()
        .map(|pair| pair.map(|body| names[body].as_str()))
        .collect()
}
