//! The page as one file: what it holds, how large it is, what it refuses, and where its script comes from.

use std::fs;
use std::path::Path;

use graspd_geom::{Quaternion, TriangleMesh, Vec3};
use graspd_hand::{Hand, HandPose, builtin_hand};
use graspd_mesh::builtin_object;
use graspd_view::{
    ContactForce, GraspPage, Keyframe, LossName, MetricColumn, Optimization, PageGrasp, ViewError,
    page_html,
};
use nalgebra::{Point3, Vector3};
use sha2::{Digest, Sha256};

const LOSSES: usize = 5;

/// A hand that closes and turns on its way.
fn pose(hand: &dyn Hand, grasp: usize, share: f64) -> HandPose {
    let angle = grasp as f64;
    HandPose {
        translation: Vec3::new(0.12 * angle.cos(), 0.12 * angle.sin(), 0.05 * share),
        rotation: Quaternion::exp(Vec3::new(0.3 * share, 0.2, angle)),
        articulation: (hand.open_articulation().iter().enumerate())
            .map(|(joint, open)| open + 0.4 * share * (1.0 + joint as f64 + angle).sin())
            .collect(),
    }
}

fn grasp(hand: &dyn Hand, index: usize, steps: usize) -> PageGrasp {
    let time = |at: usize| at as f64 / 8.0;
    let share = |step: usize| (step as f64 / steps.max(1) as f64).sqrt();
    PageGrasp {
        rank: Some(index + 1),
        index,
        metrics: vec![Some(0.01 * index as f64)],
        details: vec![("steps".into(), steps.to_string())],
        motion: (0..=16)
            .map(|at| Keyframe {
                time: time(at),
                pose: pose(hand, index, time(at)),
            })
            .collect(),
        contacts: (0..60)
            .map(|i| ContactForce {
                position: Point3::new(0.03, 0.001 * f64::from(i), 0.05),
                force: Vector3::new(-0.1, 0.0, 0.01 * f64::from(i)),
            })
            .collect(),
        optimization: (steps > 0).then(|| Optimization {
            steps: (0..steps as u64).map(|step| 20 * step).collect(),
            poses: (0..steps)
                .map(|step| pose(hand, index, share(step)))
                .collect(),
            losses: (0..steps)
                .map(|step| vec![1.0 / (1.0 + step as f64 + index as f64); LOSSES])
                .collect(),
        }),
    }
}

fn page<'a>(
    object: &'a TriangleMesh,
    hand: &'a dyn Hand,
    count: usize,
    steps: usize,
) -> GraspPage<'a> {
    GraspPage {
        object_name: "mug".into(),
        object,
        hand,
        facts: vec![("seed".into(), "0".into())],
        columns: vec![MetricColumn {
            label: "SD".into(),
            unit: "cm".into(),
            about: "simulation displacement".into(),
            digits: 2,
        }],
        loss_names: (0..LOSSES)
            .map(|loss| LossName {
                label: format!("loss {loss}"),
                unit: String::new(),
            })
            .collect(),
        grasps: (0..count).map(|index| grasp(hand, index, steps)).collect(),
    }
}

#[test]
fn fifty_grasps_with_their_optimisations_stay_below_ten_megabytes() {
    let object = builtin_object("mug").unwrap();
    for name in ["allegro", "human"] {
        let hand = builtin_hand(name).unwrap();
        // 7000 steps, kept every 20.
        let html = page_html(&page(&object, &*hand, 50, 350)).unwrap();
        println!(
            "50 grasps of {name} with 350 poses each: {:.2} MB",
            html.len() as f64 / 1e6
        );
        assert!(html.len() < 10_000_000, "{name}: {}", html.len());
        assert!(html.starts_with("<!doctype html>") && html.ends_with("</html>\n"));
    }
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let object = builtin_object("box").unwrap();
    let hand = builtin_hand("barrett").unwrap();
    let fault = |page: &GraspPage<'_>| page_html(page).unwrap_err();
    let empty = page(&object, &*hand, 0, 0);
    assert!(fault(&empty).to_string().contains("no grasps"));
    let mut without = page(&object, &*hand, 2, 0);
    without.grasps[1]
        .motion
        .retain(|keyframe| keyframe.time != 1.0);
    let message = fault(&without).to_string();
    assert!(
        message.contains("grasp 1 has no pose at time 1"),
        "{message}"
    );
    let mut open = object.clone();
    open.faces.pop();
    let open = page(&open, &*hand, 1, 0);
    assert!(matches!(fault(&open), ViewError::Object(_)));
    // Numbers that are none are nothing.
    let mut odd = page(&object, &*hand, 1, 3);
    odd.grasps[0].metrics = vec![Some(f64::NAN)];
    odd.grasps[0].optimization.as_mut().unwrap().losses[1] = vec![f64::INFINITY; LOSSES];
    let html = page_html(&odd).unwrap();
    assert!(html.contains("\"metrics\":[null]") && html.contains("[1.0,null,"));
}

/// The bundle says of which sources it was made.
#[test]
fn the_bundle_is_of_these_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("viewer");
    let mut names = vec!["build.mjs".to_owned(), "package-lock.json".to_owned()];
    let mut sources: Vec<String> = fs::read_dir(folder.join("src"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    sources.sort();
    names.extend(sources.iter().map(|name| format!("src/{name}")));
    let mut digest = Sha256::new();
    for name in &names {
        let text = fs::read(folder.join(name)).unwrap();
        digest.update(format!("{name} {}\n", text.len()));
        digest.update(text);
    }
    let digest: String = (digest.finalize().iter())
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let bundle = fs::read_to_string(folder.join("viewer.js")).unwrap();
    let (_, told) = bundle.split_once("sources sha256:").unwrap();
    assert_eq!(&told[..64], digest, "run cargo xtask viewer");
    // Licences come along, and nothing in it ends the element that it stands in.
    for notice in [
        "three.js authors",
        "Arjun Barrett",
        "Permission is hereby granted",
    ] {
        assert!(bundle.contains(notice), "{notice}");
    }
    assert!(!bundle.to_lowercase().contains("</script"));
    assert!(!bundle.contains("<!--"));
}
