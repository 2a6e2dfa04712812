//! MuJoCo scenes: the hand fixed at its grasp, the object free, both as convex pieces, since MuJoCo takes the hull
//! of any mesh.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use graspd::{GraspRecord, write_atomically};
use graspd_eval::{ConvexPiece, DisplacementSettings, ObjectUnderTest, convex_parts};
use graspd_geom::MassProperties;
use nalgebra::Vector3;

use super::super::cache::CacheChoice;
use super::source::GraspSource;

/// A file for each grasp; nothing else is needed to load it.
pub(super) fn write(source: &mut GraspSource<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let protocol = source.evaluation()?.displacement;
    let cache = CacheChoice::default().open();
    let mut written = Vec::new();
    for number in 0..source.len() {
        let run = source.run(number)?;
        let hand = source.hand(&run)?;
        let object = source.object(&run)?;
        let judged = ObjectUnderTest::new(&object.mesh).with_context(|| object.label())?;
        let judged = judged.with_cache(cache.clone());
        let body = Body {
            pieces: &judged.pieces().pieces,
            mass: MassProperties::new(&object.mesh, 1.0, &object.label())?,
        };
        for record in &run.records {
            let context = || source.context(&run, record);
            let pose = record
                .hand_pose(hand.articulation_names())
                .with_context(context)?;
            let hand_pieces = convex_parts(&hand.surface(&pose)).with_context(context)?;
            let path = folder.join(format!("{}.xml", run.file_stem(record)));
            let scene = scene(record, &body, &hand_pieces, &protocol);
            write_atomically(&path, scene.as_bytes())?;
            written.push(path);
        }
    }
    Ok(written)
}

/// The object.
struct Body<'a> {
    pieces: &'a [ConvexPiece],
    /// At some density.
    mass: MassProperties,
}

/// The scene in the object's frame, with the constants of the simulation displacement.
fn scene(
    record: &GraspRecord,
    object: &Body<'_>,
    hand: &[ConvexPiece],
    protocol: &DisplacementSettings,
) -> String {
    let down = Vector3::from(protocol.gravity_direction).normalize() * protocol.gravity;
    let center = object.mass.center_of_mass;
    let inertia = object.mass.inertia * (protocol.mass / object.mass.mass);
    let mut xml = String::from("<mujoco model=\"grasp\">\n");
    let _ = writeln!(
        xml,
        "  <!-- {} on {}, start {}: lengths in metres, the frame is the object's -->",
        in_comment(&record.hand),
        in_comment(&record.object),
        record.index
    );
    let _ = writeln!(
        xml,
        "  <option timestep=\"{}\" gravity=\"{}\" iterations=\"{}\" cone=\"elliptic\" impratio=\"10\"/>",
        protocol.time_step,
        numbers(down.as_slice()),
        protocol.solver_iterations
    );
    let _ = writeln!(
        xml,
        "  <default><geom type=\"mesh\" condim=\"3\" friction=\"{} 0 0\" mass=\"0\"/></default>",
        protocol.friction
    );
    xml += "  <asset>\n";
    assets(&mut xml, "object", object.pieces);
    assets(&mut xml, "hand", hand);
    xml += "  </asset>\n  <worldbody>\n    <light pos=\"0 0 1\"/>\n    <body name=\"hand\">\n";
    geoms(
        &mut xml,
        "hand",
        hand.len(),
        "contype=\"1\" conaffinity=\"0\" rgba=\"0.9 0.8 0.68 1\"",
    );
    xml += "    </body>\n    <body name=\"object\">\n      <freejoint/>\n";
    let _ = writeln!(
        xml,
        "      <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>",
        numbers(center.coords.as_slice()),
        protocol.mass,
        numbers(&[
            inertia[(0, 0)],
            inertia[(1, 1)],
            inertia[(2, 2)],
            inertia[(0, 1)],
            inertia[(0, 2)],
            inertia[(1, 2)],
        ])
    );
    geoms(
        &mut xml,
        "object",
        object.pieces.len(),
        "contype=\"0\" conaffinity=\"1\" rgba=\"0.45 0.53 0.6 1\"",
    );
    xml + "    </body>\n  </worldbody>\n</mujoco>\n"
}

fn assets(xml: &mut String, name: &str, pieces: &[ConvexPiece]) {
    for (index, piece) in pieces.iter().enumerate() {
        let faces: Vec<String> = piece.faces.iter().flatten().map(u32::to_string).collect();
        // Thin pieces have hardly any volume, which the compiler of the model takes for a fault.
        let _ = writeln!(
            xml,
            "    <mesh name=\"{name}_{index}\" inertia=\"convex\" vertex=\"{}\" face=\"{}\"/>",
            numbers(piece.vertices.as_flattened()),
            faces.join(" ")
        );
    }
}

/// Hand and object meet; the hand's pieces do not meet each other, nor do the object's.
fn geoms(xml: &mut String, name: &str, count: usize, attributes: &str) {
    for index in 0..count {
        let _ = writeln!(xml, "      <geom mesh=\"{name}_{index}\" {attributes}/>");
    }
}

/// To a tenth of a micrometre where they are metres.
fn numbers(values: &[f64]) -> String {
    let values: Vec<String> = values
        .iter()
        .map(|value| {
            if value.abs() < 1e-3 {
                format!("{value:.6e}")
            } else {
                format!("{value:.7}")
            }
        })
        .collect();
    values.join(" ")
}

/// What may stand in a comment of XML.
fn in_comment(name: &str) -> String {
    name.chars()
        .map(|c| {
            if c.is_control() || "-<>&".contains(c) {
                '_'
            } else {
                c
            }
        })
        .collect()
}
