//! `graspd hands`: what is built in, and what a file holds.

use anyhow::Result;
use clap::{Args, Subcommand};
use graspd_hand::{BUILTIN_HANDS, Hand, load_hand};

use crate::console::{print, print_json};

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
    /// Describe a built-in hand, a URDF or a MANO model: joints, limits, contact points, palm
    Inspect {
        /// Built-in hand, a .urdf, or a MANO model (.pkl or .npz)
        hand: String,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.command {
        Some(HandsCommand::Inspect { hand, json }) => {
            inspect(load_hand(hand)?.as_ref(), *json || arguments.json)
        }
        None => list(arguments.json),
    }
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
    text += "any URDF: name its file; `graspd hands inspect FILE` tells what was found in it\n";
    print(&text)
}

fn inspect(hand: &dyn Hand, json: bool) -> Result<()> {
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
    let names = hand.articulation_names();
    // Some hands have no limits at all.
    let limit = |joint: usize| hand.limits().and_then(|limits| limits.get(joint));
    let joints = names.iter().zip(hand.open_articulation()).enumerate();
    if json {
        let value = serde_json::json!({
            "name": hand.name(),
            "joints": joints.map(|(joint, (name, open))| serde_json::json!({
                "name": name, "open": open,
                "lower": limit(joint).map(|limit| limit.lower),
                "upper": limit(joint).map(|limit| limit.upper),
            })).collect::<Vec<_>>(),
            "contact_points": contacts.count,
            "bodies": hand.body_names().iter().zip(&per_body).map(|(name, count)| {
                serde_json::json!({"name": name, "contact_points": count})
            }).collect::<Vec<_>>(),
            "collision_spheres": spheres.radius.len(),
            "collision_pairs": spheres.pairs.len(),
            "palm": {
                "center_m": [palm.center.x, palm.center.y, palm.center.z],
                "normal": [palm.normal.x, palm.normal.y, palm.normal.z],
                "fingers": [palm.fingers.x, palm.fingers.y, palm.fingers.z],
            },
        });
        return print_json(&value);
    }
    let mut text = format!("{}\njoints ({}):\n", hand.name(), names.len());
    for (joint, (name, open)) in joints {
        let range = limit(joint).map_or_else(
            || "no limits".into(),
            |limit| format!("{:8.3} .. {:7.3}", limit.lower, limit.upper),
        );
        text += &format!("  {name:20} {range:>19}  open {open:7.3}\n");
    }
    text += &format!("contact points: {}\n", contacts.count);
    for (name, count) in hand.body_names().iter().zip(&per_body) {
        if *count > 0 {
            text += &format!("  {name:20} {count:5}\n");
        }
    }
    text += &format!(
        "self-collision: {} spheres, {} pairs\n",
        spheres.radius.len(),
        spheres.pairs.len()
    );
    let vector = |v: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", v[0], v[1], v[2]);
    text += &format!("palm centre {} m\n", vector(palm.center.coords.into()));
    text += &format!("palm normal {}\n", vector(palm.normal.into()));
    text += &format!("fingers     {}\n", vector(palm.fingers.into()));
    print(&text)
}
