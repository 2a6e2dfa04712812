use toml::Table;

use graspd_fit::{DepthSettings, SkinFitSettings};

use super::keys::known_keys;
use super::tree::leaves;
use super::*;

fn layers(texts: &[&str]) -> ConfigurationLayers {
    let mut layers = ConfigurationLayers::default();
    for (number, text) in texts.iter().enumerate() {
        let table: Table = text.parse().unwrap();
        layers.push(Origin::Flag(format!("--layer{number}")), table);
    }
    layers
}

fn resolved(texts: &[&str]) -> ResolvedConfiguration {
    layers(texts).resolve().unwrap()
}

fn fault(texts: &[&str]) -> String {
    layers(texts).resolve().unwrap_err().to_string()
}

#[test]
fn nothing_said_is_the_default() {
    let plain = resolved(&[]);
    assert_eq!(plain.configuration, Configuration::default());
    assert_eq!(plain.origin("execution.squeeze"), Origin::Default);
    assert_eq!(
        plain.origin("settings.steps"),
        Origin::Preset("default".into())
    );
}

#[test]
fn every_key_has_a_source_and_every_source_a_key() {
    // All that there can be: no preset has both a fit and annealing.
    let mut all = resolved(&["[settings]\nannealing = true\n[evaluation]\ntorque_scale = 1.0"]);
    all.configuration.settings.skin_fit.get_or_insert_default();
    let mut keys: Vec<String> = leaves(&Table::try_from(&all.configuration).unwrap())
        .into_iter()
        .map(|(key, _)| key)
        .collect();
    let mut declared = Vec::new();
    for (key, range) in known_keys() {
        assert_ne!(range.source, "", "{key} has no source");
        declared.push(key);
    }
    keys.sort();
    declared.sort();
    assert_eq!(keys, declared);
    // What stretches is what the library stretches.
    let (short, long) = (
        resolved(&["[settings]\nsteps = 70"]),
        resolved(&["[settings]\nsteps = 140"]),
    );
    let (short, long) = (short.entries().unwrap(), long.entries().unwrap());
    for (a, b) in short.iter().zip(&long) {
        let is_steps = a.key == "settings.steps";
        let differs = a.value != b.value && !is_steps;
        let is_stretched = matches!(a.origin, Origin::StretchedPreset(_));
        assert!(!differs || is_stretched, "{}", a.key);
    }
}

#[test]
fn the_last_layer_wins_and_is_named() {
    let both = resolved(&[
        "sdf_resolution = 64\n[settings]\npreset = \"soft\"\nforce_rate = 0.5\nleak = 0.3",
        "[settings]\nforce_rate = 0.25",
    ]);
    let Configuration {
        settings,
        sdf_resolution,
        ..
    } = &both.configuration;
    assert_eq!((settings.preset.as_str(), *sdf_resolution), ("soft", 64));
    assert_eq!((settings.force_rate, settings.leak), (0.25, 0.3));
    assert_eq!(settings.steps, SynthesisSettings::soft().steps);
    assert_eq!(both.origin("settings.force_rate").to_string(), "--layer1");
    assert_eq!(both.origin("settings.leak").to_string(), "--layer0");
    assert_eq!(both.origin("settings.density").to_string(), "preset soft");
    // A preset in a later layer goes under everything, too.
    let other = resolved(&[
        "[settings]\nforce_rate = 0.5",
        "[settings]\npreset = \"paper\"",
    ]);
    let expected = SynthesisSettings {
        force_rate: 0.5,
        ..SynthesisSettings::paper()
    };
    assert_eq!(other.configuration.settings, expected);
}

#[test]
fn steps_stretch_what_is_below_and_not_what_is_beside_them() {
    let stretched = resolved(&["[settings]\npreset = \"soft\"\nstiffening_start = 3\nsteps = 700"]);
    let expected = SynthesisSettings {
        stiffening_start: 3,
        ..SynthesisSettings::soft().with_steps(700)
    };
    assert_eq!(stretched.configuration.settings, expected);
    assert_eq!(
        stretched.origin("settings.decay_start").to_string(),
        "preset soft, stretched"
    );
    assert_eq!(
        stretched.origin("settings.stiffening_start").to_string(),
        "--layer0"
    );
}

#[test]
fn a_configuration_written_and_read_is_the_same() {
    for preset in crate::PRESETS {
        let text = format!(
            "[settings]\npreset = \"{preset}\"\nsteps = 123\n[evaluation]\ntorque_scale = 0.07"
        );
        let first = resolved(&[&text]);
        let again = resolved(&[&first.to_toml().unwrap()]);
        assert_eq!(first.configuration, again.configuration);
    }
}

#[test]
fn the_fit_can_be_switched_on_and_off() {
    for key in ["skin_fit", "conformity"] {
        let skin_fit = |text: &str| resolved(&[text]).configuration.settings.skin_fit;
        assert_eq!(skin_fit(&format!("[settings]\n{key} = false")), None);
        assert_eq!(
            skin_fit(&format!("[settings]\npreset = \"soft\"\n{key} = true")),
            Some(SkinFitSettings::default())
        );
        let own = format!("[settings]\npreset = \"soft\"\n[settings.{key}]\ncandidates = 2");
        assert_eq!(skin_fit(&own).unwrap().candidates, 2);
    }
    let soft = resolved(&["[settings]\npreset = \"soft\""])
        .entries()
        .unwrap();
    assert!(!soft.iter().any(|entry| entry.key.contains("skin_fit")));
}

/// The fit's settings as version 0.1's first runs wrote them, each with another value than today's.
const EARLIER_FIT: &str = "
[settings.conformity]
candidates = 7
core_samples = [801, 6001]
dense_samples = [40001, 100001]
densest_samples = [40002, 400002]
coarse_iterations = [31, 21]
fine_iterations = [41, 22]
projection_iterations = 11
retreat_iterations = 23
reach = [0.051, 0.0051, 0.0016, 0.0021, 0.00081]
depth = 0.00016
most_depth = 0.00176
rigid_most_depth = 0.00041
deep_weights = [0.03, 1.1, 1.2, 4.1]
deepest = 0.00256
rigid_deepest = 0.00066
core_weights = [0.02, 2.1, 0.34, 2.2]
";

/// And as they were written after that, before the second-order solver.
const LATER_FIT: &str = "
[settings.skin_fit]
candidates = 7
finalists = 3
imbalance_discount = 0.1
closure_discount = 0.4
firm_closure = 0.3
coarse_medial_spheres = 801
depenetration_iterations = 23
target_depth = 0.00016
depth_scale = 0.0005
limit_weight = 31.0
[settings.skin_fit.approach]
iterations = 31
start_reach = 0.051
[settings.skin_fit.projection]
iterations = 11
medial_weight = 2.2
[settings.skin_fit.soft]
max_depth = 0.00176
depth_limit = 0.00256
projection_samples = 40001
check_samples = 40002
[settings.skin_fit.rigid]
depth_limit = 0.00066
check_samples = 400002
";

#[test]
fn settings_of_earlier_fits_are_read() {
    let usual = SkinFitSettings::default();
    let expected = |soft_samples, rigid_samples| SkinFitSettings {
        candidates: 7,
        projection_iterations: 11,
        soft: DepthSettings {
            depth_limit: 0.00256,
            dense_samples: soft_samples,
            ..usual.soft
        },
        rigid: DepthSettings {
            depth_limit: 0.00066,
            dense_samples: rigid_samples,
            ..usual.rigid
        },
        ..usual.clone()
    };
    for (text, retired, expected) in [
        (
            EARLIER_FIT,
            [
                "conformity.reach",
                "conformity.depth`",
                "conformity.rigid_most_depth",
            ],
            expected(usual.soft.dense_samples, usual.rigid.dense_samples),
        ),
        (
            LATER_FIT,
            [
                "skin_fit.finalists",
                "skin_fit.approach.iterations",
                "skin_fit.soft.max_depth",
            ],
            expected(40002, 400_002),
        ),
    ] {
        let read = resolved(&[text]);
        let warning = read.warning().expect("some have no meaning any more");
        assert!(retired.iter().all(|key| warning.contains(key)), "{warning}");
        assert!(
            !warning.contains("candidates") && !warning.contains("depth_limit"),
            "{warning}"
        );
        assert_eq!(read.configuration.settings.skin_fit, Some(expected));
    }
    assert_eq!(
        resolved(&["[settings.skin_fit]\ntail = 3.0"]).warning(),
        None
    );
}

#[test]
fn metrics_may_be_a_list() {
    let metrics = resolved(&["[evaluation]\nmetrics = \"ca,sd\""])
        .configuration
        .evaluation
        .metrics;
    assert_eq!(metrics, "ca,sd".parse().unwrap());
    assert!(fault(&["[evaluation]\nmetrics = \"ca,speed\""]).contains("speed"));
}

#[test]
fn mistakes_are_named_with_their_layer() {
    for (text, parts) in [
        (
            "[settings]\nstepz = 3",
            ["settings.stepz", "settings.steps"],
        ),
        ("steps = 3", ["`steps`", "settings.steps"]),
        (
            "[evaluatoin]\nfriction = 1.0",
            ["evaluatoin.friction", "evaluation.friction"],
        ),
        (
            "[evaluation]\nvoxelsize = 1e-3",
            ["voxelsize", "evaluation.voxel_size"],
        ),
        (
            "[settings.steps]\nmore = 3",
            ["settings.steps.more", "settings.steps"],
        ),
        ("[nonsense]", ["`nonsense`", "--layer0"]),
        ("[settings]\nsteps = 3.5", ["settings.steps", "--layer0"]),
        ("[settings]\nsteps = -3", ["settings.steps", "--layer0"]),
        (
            "[settings]\nforce_rate = \"fast\"",
            ["settings.force_rate", "invalid type"],
        ),
        (
            "[settings]\npreset = \"best\"",
            ["best", "default, fast, soft, paper"],
        ),
        ("[settings]\npreset = 3", ["settings.preset", "a name"]),
        (
            "[settings.conformity]\nreaches = [1.0]",
            ["settings.skin_fit.reaches", "--layer0"],
        ),
        ("grasps = 0", ["grasps", "at least 1"]),
        ("sdf_resolution = 5000", ["sdf_resolution", "2 to 1024"]),
        ("sdf_padding_m = -1", ["sdf_padding_m", "0 to 1"]),
        ("[settings]\nleak = 2", ["settings.leak", "0 to 1"]),
    ] {
        let message = fault(&[text]);
        for part in parts {
            assert!(message.contains(part), "no {part} in: {message}");
        }
    }
}

#[test]
fn values_of_flags_are_toml_or_text() {
    let mut layers = ConfigurationLayers::default();
    let flag = || Origin::Flag("--set".into());
    layers.set_text(flag(), "settings.force_rate", "1e-3");
    layers.set_text(flag(), "settings.clamp_joints", "true");
    layers.set_text(flag(), "evaluation.force_limit", "each");
    layers.set_text(
        flag(),
        "evaluation.displacement.gravity_direction",
        "[0, 0, -1]",
    );
    let Configuration {
        settings,
        evaluation,
        ..
    } = layers.resolve().unwrap().configuration;
    assert_eq!((settings.force_rate, settings.clamp_joints), (1e-3, true));
    assert_eq!(evaluation.force_limit, graspd_eval::ForceLimit::Each);
    assert_eq!(evaluation.displacement.gravity_direction, [0.0, 0.0, -1.0]);
}

#[test]
fn keys_of_earlier_versions_are_read() {
    let shake = resolved(&["[evaluation.shake]\nmost_displacement = 0.01\nmass = 0.2"]);
    let shake = shake.configuration.evaluation.shake;
    assert_eq!((shake.max_displacement, shake.mass), (0.01, 0.2));
}

#[test]
fn files_that_are_no_toml_are_named_with_the_line() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), "seed = 1\n[settings\n").unwrap();
    let error = ConfigurationLayers::default()
        .push_file(file.path())
        .unwrap_err()
        .to_string();
    assert!(error.contains(", line 2: "), "{error}");
    let missing = file.path().with_extension("none");
    let error = ConfigurationLayers::default()
        .push_file(&missing)
        .unwrap_err()
        .to_string();
    assert!(error.contains("cannot be read"), "{error}");
}
