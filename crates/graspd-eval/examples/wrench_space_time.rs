//! CPU times of wrench-space metrics: `wrench_space_time FOLDER...`, each a run of `graspd synth --meshes` (Linux).

use graspd_eval::{
    EpsilonSettings, EvaluationSettings, FingerModel, HullVolume, ObjectUnderTest, VolumeMethod,
    ferrari_canny, hull_volume,
};
use graspd_mesh::load_mesh;

const REPETITIONS: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let settings = EvaluationSettings::default();
    for folder in std::env::args().skip(1) {
        let meshes = std::path::Path::new(&folder).join("meshes");
        let object = ObjectUnderTest::new(&load_mesh(meshes.join("object.obj"))?)?;
        println!("{folder}");
        let mut hands: Vec<_> = std::fs::read_dir(&meshes)?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.to_string_lossy().ends_with("_hand.obj"))
            .collect();
        hands.sort();
        for path in hands {
            let hand = load_mesh(&path)?;
            let mut contacts = Vec::new();
            let finding = seconds_of(|| {
                contacts = object.contacts(&hand, &settings)?;
                Ok(())
            })?;
            let finger = FingerModel::hard(settings.friction, settings.friction_edges);
            let wrenches =
                finger.wrenches(&contacts, object.center_of_mass(), object.torque_scale());
            let sum = EpsilonSettings::sum();
            let mut epsilon = ferrari_canny(&wrenches, &sum)?;
            let nearest = seconds_of(|| {
                epsilon = ferrari_canny(&wrenches, &sum)?;
                Ok(())
            })?;
            let mut volume = hull_volume(&wrenches, &settings.volume)?;
            let whole = seconds_of(|| {
                volume = hull_volume(&wrenches, &settings.volume)?;
                Ok(())
            })?;
            println!(
                "{} contacts ({:.1} ms): epsilon {:.1} ms ({:.6}), volume {:.1} ms ({:.6}, {})",
                contacts.len(),
                1e3 * finding,
                1e3 * nearest,
                epsilon.value,
                1e3 * whole,
                volume.value,
                method(&volume),
            );
        }
    }
    Ok(())
}

fn method(volume: &HullVolume) -> String {
    match volume.method {
        VolumeMethod::Exact => "exact".into(),
        VolumeMethod::Sampled { directions } => format!(
            "+-{:.2} % from {directions} directions",
            100.0 * (volume.upper / volume.value - 1.0)
        ),
    }
}

/// CPU seconds of one call, from a few.
fn seconds_of(
    mut work: impl FnMut() -> Result<(), Box<dyn std::error::Error>>,
) -> Result<f64, Box<dyn std::error::Error>> {
    let started = cpu_seconds();
    for _ in 0..REPETITIONS {
        work()?;
    }
    Ok((cpu_seconds() - started) / REPETITIONS as f64)
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
