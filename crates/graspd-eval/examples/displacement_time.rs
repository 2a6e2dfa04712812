//! CPU times of simulating grasps: `displacement_time FOLDER...`, each a run of `graspd synth --meshes` (Linux).

use graspd_eval::{DisplacementSettings, FixedHand, ObjectUnderTest, PhysicsEngine, ShakeSettings};
use graspd_eval::{shake, simulate, simulate_six_directions};
use graspd_geom::DiskCache;
use graspd_mesh::load_mesh;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let engine = PhysicsEngine::default();
    let cache = std::env::temp_dir().join("graspd-displacement-time");
    for folder in std::env::args().skip(1) {
        let meshes = std::path::Path::new(&folder).join("meshes");
        let object = ObjectUnderTest::new(&load_mesh(meshes.join("object.obj"))?)?;
        let object = object.with_cache(Some(DiskCache::new(&cache, DiskCache::USUAL_CAPACITY)));
        let started = cpu_seconds();
        let vertices = object
            .pieces()
            .pieces
            .iter()
            .map(|piece| piece.vertices.len());
        let (count, vertices) = (object.pieces().pieces.len(), vertices.sum::<usize>());
        let seconds = cpu_seconds() - started;
        println!("{folder}: {count} pieces, {vertices} vertices, {seconds:.2} s");
        let mut hands: Vec<_> = std::fs::read_dir(&meshes)?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.to_string_lossy().ends_with("_hand.obj"))
            .collect();
        hands.sort();
        for path in hands {
            let mesh = load_mesh(&path)?;
            let started = cpu_seconds();
            let hand = FixedHand::new(&mesh)?;
            let making = cpu_seconds() - started;
            let started = cpu_seconds();
            let settings = DisplacementSettings::default();
            simulate(object.dynamic(), &hand, &settings, engine)?;
            let alone = cpu_seconds() - started;
            let started = cpu_seconds();
            let six = simulate_six_directions(object.dynamic(), &hand, &settings, engine)?;
            let one = (cpu_seconds() - started) / 6.0;
            let started = cpu_seconds();
            let outcome = shake(object.dynamic(), &hand, &ShakeSettings::default(), engine)?;
            println!(
                "{} faces: mesh {:.1} ms, displacement {:.1} ms, {:.1} ms a direction of six \
                 ({} cm), shake {:.0} ms ({} of 6)",
                mesh.faces.len(),
                1e3 * making,
                1e3 * alone,
                1e3 * one,
                six.per_direction_cm.map(|x| format!("{x:.3}")).join(" "),
                1e3 * (cpu_seconds() - started),
                outcome.count()
            );
        }
    }
    Ok(())
}

/// CPU seconds of all threads of this process.
fn cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let nanoseconds = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-9
}
