//! `graspd hands`: what is built in, and what a file holds.

use anyhow::Result;
use clap::{Args, Subcommand};
use graspd_hand::{BUILTIN_HANDS, Hand, load_hand};

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
    /// Describe a built-in hand or a URDF: joints, limits, contact points, palm
    Inspect {
        /// Built-in hand or a .urdf
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
        println!("{}", serde_json::to_string_pretty(&list)?);
    } else {
        for hand in BUILTIN_HANDS {
            println!("{:10} {}", hand.name, hand.description);
        }
        println!("any URDF: name its file; `graspd hands inspect FILE` tells what was found in it");
    }
    Ok(())
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
    let limits = hand.limits().unwrap_or_default();
    let joints = hand
        .articulation_names()
        .iter()
        .zip(limits)
        .zip(hand.open_articulation());
    if json {
        let value = serde_json::json!({
            "name": hand.name(),
            "joints": joints.map(|((name, limit), open)| serde_json::json!({
                "name": name, "lower": limit.lower, "upper": limit.upper, "open": open,
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
        println!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(());
    }
    println!("{}", hand.name());
    println!("joints ({}):", hand.articulation_names().len());
    for ((name, limit), open) in joints {
        println!(
            "  {name:20} {:8.3} .. {:7.3}  open {open:7.3}",
            limit.lower, limit.upper
        );
    }
    println!("contact points: {}", contacts.count);
    for (name, count) in hand.body_names().iter().zip(&per_body) {
        if *count > 0 {
            println!("  {name:20} {count:5}");
        }
    }
    println!(
        "self-collision: {} spheres, {} pairs",
        spheres.radius.len(),
        spheres.pairs.len()
    );
    let vector = |v: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", v[0], v[1], v[2]);
    println!("palm centre {} m", vector(palm.center.coords.into()));
    println!("palm normal {}", vector(palm.normal.into()));
    println!("fingers     {}", vector(palm.fingers.into()));
    Ok(())
}
