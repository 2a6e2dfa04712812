//! The settings of a synthesis and their named sets.

use graspd::Validate;
use graspd::{
    GraspError, PAPER_PADDING, PAPER_RESOLUTION, PAPER_STANDOFF, PRESETS, SynthesisSettings,
};
use graspd_fit::SkinFitSettings;
use graspd_sim::Twist;

fn table(settings: &SynthesisSettings) -> toml::Table {
    toml::Table::try_from(settings).expect("settings are plain numbers")
}

/// The settings with one field replaced.
fn with(field: &str, value: impl Into<toml::Value>) -> SynthesisSettings {
    let mut table = table(&SynthesisSettings::default());
    table.insert(field.into(), value.into());
    table.try_into().expect("the field's type is the same")
}

fn fault(settings: &SynthesisSettings) -> String {
    settings
        .validate()
        .expect_err("a field is out of range")
        .to_string()
}

#[test]
fn the_paper_preset_has_the_papers_numbers() {
    let paper = SynthesisSettings::paper();
    assert_eq!(paper.preset, "paper");
    // The discretised shape and its coarse-to-fine dilation.
    assert_eq!((PAPER_RESOLUTION, PAPER_PADDING), (256, 0.01));
    assert_eq!(paper.smoothing_margin, 0.01);
    assert_eq!(paper.smoothing_steps, 5000);
    assert_eq!(paper.density, 1000.0);
    // Contact forces: constant stiffness, leaky gradient.
    assert_eq!(paper.normal_stiffness, 1e6);
    assert_eq!(paper.friction_stiffness, 1e8);
    assert_eq!(paper.friction_coefficient, 0.8);
    assert_eq!(paper.leak, 0.1);
    assert_eq!(paper.soft_stiffness, paper.normal_stiffness);
    // One simulated step from each of three velocities.
    assert_eq!(paper.time_step, 1e-5);
    assert_eq!(
        paper.object_velocities,
        [[0.0; 3], [0.01, 0.01, 0.01], [-0.01, -0.01, -0.01]]
    );
    // The relaxed problem.
    assert_eq!(paper.task_limit, 1e-4);
    assert_eq!(paper.joint_limit, 1e-4);
    assert_eq!(paper.relaxation_weight, 1e-2);
    // The optimisers: constant rates, Adamax, damped constraints, limits kept by the constraint alone.
    assert_eq!(paper.steps, 7000);
    assert_eq!(paper.damping, 1.0);
    assert_eq!(paper.force_rate, 1e-2);
    let pose_rates = [
        paper.translation_rate,
        paper.rotation_rate,
        paper.articulation_rate,
    ];
    assert_eq!(pose_rates, [3e-3; 3]);
    assert!(!paper.pose_uses_adam);
    assert!(!paper.clamp_joints);
    assert_eq!((paper.decay_factor, paper.force_decay_factor), (1.0, 1.0));
    assert_eq!(paper.warmup_steps, 0);
    // Starts.
    assert_eq!(paper.standoff, 0.1);
    assert_eq!(PAPER_STANDOFF, paper.standoff);
}

#[test]
fn the_simulation_gets_the_settings_numbers() {
    let settings = SynthesisSettings {
        normal_stiffness: 2.0,
        friction_stiffness: 3.0,
        friction_coefficient: 0.5,
        leak: 0.25,
        time_step: 7.0,
        object_velocities: vec![[1.0, 2.0, 3.0]],
        ..SynthesisSettings::default()
    };
    let simulation = settings.simulation();
    let contact = &simulation.contact;
    assert_eq!(
        [
            contact.normal_stiffness,
            contact.friction_stiffness,
            contact.friction_coefficient,
            contact.leak,
            simulation.time_step
        ],
        [2.0, 3.0, 0.5, 0.25, 7.0]
    );
    let twist = Twist {
        linear: [1.0, 2.0, 3.0].into(),
        angular: [0.0; 3].into(),
    };
    assert_eq!(simulation.velocities, [twist]);
}

#[test]
fn every_preset_is_found_by_name_and_valid() {
    for name in PRESETS {
        let settings = SynthesisSettings::preset(name).expect("it is listed");
        assert_eq!(settings.preset, name);
        settings.validate().expect("presets are valid");
    }
    let default = SynthesisSettings::preset("default").expect("it is listed");
    assert_eq!(default, SynthesisSettings::default());
}

#[test]
fn an_unknown_preset_names_those_that_exist() {
    for name in ["papier", "", "Paper"] {
        let error = SynthesisSettings::preset(name).expect_err("there is none");
        assert!(matches!(&error, GraspError::UnknownPreset { name: asked, .. } if asked == name));
        let text = error.to_string();
        assert!(PRESETS.iter().all(|known| text.contains(known)), "{text}");
    }
}

#[test]
fn schedules_stretch_with_the_steps() {
    let default = SynthesisSettings {
        warmup_steps: 200,
        ..SynthesisSettings::default()
    };
    for steps in [700, 3500, 7000, 70_000] {
        let scaled = default.clone().with_steps(steps);
        assert_eq!(scaled.steps, steps);
        // Every whole number is a number of steps.
        let (before, after) = (table(&default), table(&scaled));
        for (field, value) in &before {
            if let Some(value) = value.as_integer() {
                let exact = value as f64 * steps as f64 / default.steps as f64;
                assert_eq!(
                    after[field].as_integer(),
                    Some(exact.round() as i64),
                    "{field}"
                );
            }
        }
        scaled.validate().expect("as valid as before");
    }
    let paper = SynthesisSettings::paper();
    assert_eq!(paper.clone().with_steps(7000), paper);
}

#[test]
fn what_is_not_counted_in_steps_stays() {
    let before = SynthesisSettings::soft();
    let (after, before) = (table(&before.clone().with_steps(1234)), table(&before));
    for (field, value) in &before {
        if !value.is_integer() {
            assert_eq!(after[field], *value, "{field}");
        }
    }
    let default = SynthesisSettings::default();
    let fit = default.clone().with_steps(70).skin_fit.expect("it has one");
    let expected = SkinFitSettings {
        iterations: 70,
        ..default.skin_fit.expect("it has one")
    };
    assert_eq!(fit, expected);
}

#[test]
fn validation_names_the_field() {
    for (field, value) in &table(&SynthesisSettings::default()) {
        if value.is_float() {
            for bad in [f64::NAN, f64::INFINITY, -1.0] {
                let text = fault(&with(field, bad));
                assert!(text.contains(&format!("`{field}`")), "{field}: {text}");
            }
        }
    }
    assert!(fault(&with("steps", 0)).contains("`steps`"));
    assert!(fault(&with("leak", 1.5)).contains("`leak`"));
    for rate in ["force_rate", "translation_rate", "soft_stiffness"] {
        assert!(fault(&with(rate, 0.0)).contains(rate));
    }
    for factor in ["decay_factor", "force_decay_factor"] {
        assert!(fault(&with(factor, 1.5)).contains(factor));
    }
    assert!(fault(&with("soft_stiffness", 1e9)).contains("`soft_stiffness`"));
    assert!(fault(&with("stiffening_end", 0)).contains("`stiffening_end`"));
    for velocities in [vec![], vec![[0.0, f64::NAN, 0.0]]] {
        let settings = SynthesisSettings {
            object_velocities: velocities,
            ..SynthesisSettings::default()
        };
        assert!(fault(&settings).contains("velocities"));
    }
}

#[test]
fn zero_switches_off_what_may_be_off() {
    for field in ["smoothing_margin", "range_weight", "intersection_weight"] {
        with(field, 0.0).validate().expect(field);
    }
    with("smoothing_steps", 0).validate().expect("undilated");
}

#[test]
fn settings_survive_their_file_and_strange_fields_are_refused() {
    for name in PRESETS {
        let settings = SynthesisSettings::preset(name).expect("it is listed");
        let text = toml::to_string(&settings).expect("settings are plain numbers");
        let read: SynthesisSettings = toml::from_str(&text).expect("what was just written");
        assert_eq!(read, settings);

        let misspelt = text.replace("damping", "dampening");
        let error = toml::from_str::<SynthesisSettings>(&misspelt).expect_err("no such field");
        assert!(error.to_string().contains("dampening"), "{error}");
    }
}
