//! `graspd objects`: what is built in.

use anyhow::{Context, Result};
use clap::Args;
use graspd_geom::signed_volume;
use graspd_mesh::{BUILTIN_OBJECTS, builtin_object};

use crate::console::{print, print_json};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut rows = Vec::new();
    for object in BUILTIN_OBJECTS {
        let mesh = builtin_object(object.name).context(object.name)?;
        let (low, high) = mesh.bounds().context(object.name)?;
        let size = (high - low) * 1000.0;
        rows.push((object, size, signed_volume(&mesh) * 1e6, mesh.faces.len()));
    }
    if arguments.json {
        let list: Vec<_> = rows
            .iter()
            .map(|(object, size, volume, faces)| {
                serde_json::json!({
                    "name": object.name,
                    "description": object.description,
                    "size_mm": [size.x, size.y, size.z],
                    "volume_cm3": volume,
                    "faces": faces,
                })
            })
            .collect();
        return print_json(&list);
    }
    let mut text = String::new();
    for (object, size, volume, faces) in rows {
        text += &format!(
            "{:10} {:5.1} x {:5.1} x {:5.1} mm  {:7.1} cm3  {:6} faces  {}\n",
            object.name, size.x, size.y, size.z, volume, faces, object.description
        );
    }
    print(&text)
}
