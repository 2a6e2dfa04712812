//! Whole runs: the same for any number of threads, ranked, observed.

use std::collections::BTreeMap;
use std::sync::Mutex;

use graspd::{
    ExecutionSettings, Grasp, GraspError, GraspRecord, RecordedPose, RunObserver, RunSettings,
    SCHEMA, SynthesisSettings, draw_start, synthesize_grasps,
};
use graspd_eval::{EvaluationSettings, Metrics};
use graspd_hand::Hand;

use crate::fixtures::{CAN, HAND};

const STEPS: usize = 12;
const COUNT: usize = 3;

fn settings() -> SynthesisSettings {
    SynthesisSettings::paper().with_steps(STEPS)
}

fn run_settings(metrics: &str) -> RunSettings {
    RunSettings {
        seed: 5,
        count: COUNT,
        trajectory_every: Some(5),
        execution: ExecutionSettings::default(),
        evaluation: EvaluationSettings {
            metrics: metrics.parse().expect("these metrics exist"),
            // Coarse, for speed.
            voxel_size: 4e-3,
            ..EvaluationSettings::default()
        },
    }
}

fn run_on(threads: usize, run: &RunSettings, observer: &dyn RunObserver) -> Vec<Grasp> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a thread or two")
        .install(|| synthesize_grasps(&CAN, &*HAND, &settings(), run, observer))
        .expect("a can and a hand")
}

fn failure(settings: &SynthesisSettings, run: &RunSettings) -> GraspError {
    synthesize_grasps(&CAN, &*HAND, settings, run, &Untouched).expect_err("it cannot run")
}

/// Fails the test when anything has been done at all.
struct Untouched;

impl RunObserver for Untouched {
    fn step(&self, index: usize, step: usize) {
        panic!("start {index} took step {step}");
    }
    fn finished(&self, record: &GraspRecord) {
        panic!("grasp {} was made", record.index);
    }
}

/// Counts what it sees.
#[derive(Default)]
struct Counts {
    /// The steps of each start, in order.
    steps: Mutex<BTreeMap<usize, Vec<usize>>>,
    finished: Mutex<Vec<GraspRecord>>,
}

impl RunObserver for Counts {
    fn step(&self, index: usize, step: usize) {
        let mut steps = self.steps.lock().expect("no thread panics");
        steps.entry(index).or_default().push(step);
    }
    fn finished(&self, record: &GraspRecord) {
        let mut finished = self.finished.lock().expect("no thread panics");
        finished.push(record.clone());
    }
}

/// The records as written, without the timings.
fn timeless(grasps: &[Grasp]) -> Vec<String> {
    grasps
        .iter()
        .map(|grasp| {
            let record = GraspRecord {
                seconds: None,
                ..grasp.record.clone()
            };
            serde_json::to_string(&record).expect("plain numbers")
        })
        .collect()
}

#[test]
fn threads_change_nothing_and_grasps_come_by_rank() {
    let run = run_settings("ca,iv,pd,sd");
    let (alone, observer) = (run_on(1, &run, &()), Counts::default());
    let together = run_on(2, &run, &observer);
    assert_eq!(timeless(&alone), timeless(&together));
    for (a, b) in alone.iter().zip(&together) {
        assert_eq!((&a.pose, &a.trajectory), (&b.pose, &b.trajectory));
    }

    let displacements: Vec<_> = alone
        .iter()
        .map(|grasp| {
            let metrics = grasp.record.metrics.as_ref();
            metrics
                .and_then(|m| m.sim_displacement_cm)
                .expect("it was asked for")
        })
        .collect();
    assert!(displacements.is_sorted(), "{displacements:?}");
    let ranks: Vec<_> = alone.iter().map(|grasp| grasp.record.rank).collect();
    assert_eq!(ranks, [Some(1), Some(2), Some(3)]);

    // The observer saw every step of every start, and every grasp once, before it was ranked.
    let steps = observer.steps.into_inner().expect("no thread panicked");
    let every_step: Vec<usize> = (0..STEPS).collect();
    let expected: BTreeMap<_, _> = (0..COUNT).map(|i| (i, every_step.clone())).collect();
    assert_eq!(steps, expected);
    let mut finished = observer.finished.into_inner().expect("no thread panicked");
    finished.sort_by_key(|record| record.index);
    let mut unranked: Vec<_> = together.iter().map(|grasp| grasp.record.clone()).collect();
    unranked.sort_by_key(|record| record.index);
    for record in &mut unranked {
        record.rank = None;
    }
    assert_eq!(finished, unranked);
}

#[test]
fn a_record_tells_all_about_its_grasp() {
    let run = run_settings("iv");
    let settings = settings();
    for grasp in run_on(2, &run, &()) {
        let record = &grasp.record;
        assert_eq!(record.schema, SCHEMA);
        assert_eq!(
            (record.object.as_str(), &record.object_path),
            ("can", &None)
        );
        assert_eq!((record.hand.as_str(), record.seed), ("allegro", Some(5)));
        assert_eq!(
            record.hand_pose(HAND.articulation_names()).ok(),
            Some(grasp.pose.clone())
        );

        let start = draw_start(&CAN, &*HAND, &settings, 5, record.index).expect("it has a surface");
        let steps: Vec<_> = grasp.trajectory.iter().map(|point| point.step).collect();
        assert_eq!(steps, [0, 5, 10]);
        assert_eq!(grasp.trajectory[0].pose, start);
        assert_ne!(grasp.pose, start);

        let optimizer = record.optimizer.as_ref().expect("it was optimised here");
        assert_eq!(
            (optimizer.preset.as_str(), optimizer.steps),
            ("paper", STEPS)
        );
        let metrics = record.metrics.as_ref().expect("it was judged");
        assert!(metrics.interpenetration_volume_cm3.is_some());
        assert_eq!(
            (metrics.contact_area_cm2, metrics.sim_displacement_cm),
            (None, None)
        );
        let seconds = record.seconds.expect("it was timed");
        assert!(seconds.synthesis > 0.0 && seconds.evaluation > 0.0);
    }
}

#[test]
fn before_a_grasp_the_open_hand_stands_back_along_its_palm() {
    let run = RunSettings {
        count: 1,
        trajectory_every: None,
        ..run_settings("iv")
    };
    let grasp = &run_on(1, &run, &())[0];
    assert!(grasp.trajectory.is_empty());
    let before = grasp.record.pre_grasp.as_ref().expect("made here");
    assert_eq!(
        before.pose.rotation_wxyz,
        RecordedPose::from(&grasp.pose).rotation_wxyz
    );
    let open: Vec<f64> = HAND
        .articulation_names()
        .iter()
        .map(|name| before.joints_rad[name])
        .collect();
    assert_eq!(open, HAND.open_articulation());
    let palm = graspd::transform_object_hand(&grasp.pose) * HAND.palm().normal;
    let [x, y, z] = before.pose.translation_m;
    let t = grasp.pose.translation;
    let retreat = palm * -0.05;
    for (moved, expected) in [x - t.x, y - t.y, z - t.z].iter().zip(retreat.iter()) {
        assert!((moved - expected).abs() < 1e-12, "{moved} {expected}");
    }
}

#[test]
fn whatever_is_wrong_is_said_before_any_work() {
    let good = run_settings("iv");
    let none = RunSettings {
        count: 0,
        ..good.clone()
    };
    assert!(failure(&settings(), &none).to_string().contains("`count`"));

    let misjudged = RunSettings {
        evaluation: EvaluationSettings {
            metrics: Metrics::NONE,
            voxel_size: -1.0,
            ..EvaluationSettings::default()
        },
        ..good.clone()
    };
    assert!(
        failure(&settings(), &misjudged)
            .to_string()
            .contains("voxel_size")
    );

    let unsound = SynthesisSettings {
        translation_rate: f64::NAN,
        ..settings()
    };
    assert!(
        failure(&unsound, &good)
            .to_string()
            .contains("translation_rate")
    );
}

#[test]
fn an_optimisation_that_diverges_says_so() {
    let reckless = SynthesisSettings {
        translation_rate: 1e300,
        ..settings()
    };
    let run = run_settings("iv");
    let error = synthesize_grasps(&CAN, &*HAND, &reckless, &run, &()).expect_err("it diverges");
    assert!(matches!(error, GraspError::Diverged { .. }), "{error}");
}
