//! CPU times of contact metrics: `contact_time FOLDER...`, each a run of `graspd synth --meshes` (Linux).

use graspd_eval::{
    EvaluationSettings, Metrics, ObjectUnderTest, SelfPenetration, evaluate,
    interpenetration_volume_cm3,
};
use graspd_geom::SignedDistance;
use graspd_mesh::load_mesh;

const REPETITIONS: usize = 20;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for folder in std::env::args().skip(1) {
        let meshes = std::path::Path::new(&folder).join("meshes");
        let mesh = load_mesh(meshes.join("object.obj"))?;
        let object = ObjectUnderTest::new(&mesh)?;
        println!("{folder}: object of {} faces", mesh.faces.len());
        let mut hands: Vec<_> = std::fs::read_dir(&meshes)?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.to_string_lossy().ends_with("_hand.obj"))
            .collect();
        hands.sort();
        for path in hands {
            let hand = load_mesh(&path)?;
            let with = |metrics: &str| -> Result<_, Box<dyn std::error::Error>> {
                let settings = EvaluationSettings {
                    metrics: metrics.parse::<Metrics>()?,
                    ..EvaluationSettings::default()
                };
                let mut judged = evaluate(&object, &hand, &settings)?;
                let seconds = seconds_of(|| {
                    judged = evaluate(&object, &hand, &settings)?;
                    Ok(())
                })?;
                Ok((1e3 * seconds, judged))
            };
            let ((volume, _), (both, found)) = (with("iv")?, with("ca,iv")?);
            let tree = seconds_of(|| SignedDistance::new(&hand).map(drop).map_err(Into::into))?;
            let solid = SignedDistance::new(&hand)?;
            let count = seconds_of(|| {
                interpenetration_volume_cm3(&solid, object.signed_distance(), 1e-3);
                Ok(())
            })?;
            let itself = SelfPenetration::new(&hand)?;
            let own = seconds_of(|| itself.depth_mm(&hand).map(drop).map_err(Into::into))?;
            println!(
                "hand of {} faces: IV + CA {both:.1} ms ({:.2} cm3, {:.1} cm2, {:.1} cm2 by \
                 voxels), IV {volume:.1} ms (hand's tree {:.1}, voxels {:.1}), self-penetration {:.1} ms",
                hand.faces.len(),
                found.interpenetration_volume_cm3.unwrap_or(f64::NAN),
                found.contact_area_cm2.unwrap_or(f64::NAN),
                found.contact_area_voxel_count_cm2.unwrap_or(f64::NAN),
                1e3 * tree,
                1e3 * count,
                1e3 * own,
            );
        }
    }
    Ok(())
}

/// CPU seconds of one call, from many: the counter moves in steps of a few milliseconds.
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
