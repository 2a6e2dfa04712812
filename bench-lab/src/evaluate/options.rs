//! What an evaluation is asked to do.

use std::path::{Path, PathBuf};

use clap::Args;

/// The options of `cargo xtask evaluate`.
#[derive(Args, Clone, Debug)]
pub(crate) struct Options {
    /// `ycb`, `table4`, or names of objects
    #[arg(long, value_name = "ycb|table4|NAME,...", default_value = "ycb")]
    pub(super) objects: String,
    /// As of `graspd synth`
    #[arg(long, default_value = "human")]
    pub(super) hand: String,
    /// As of `graspd synth`
    #[arg(long, default_value = "default")]
    preset: String,
    /// Grasps of each object
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u32).range(1..))]
    starts: u32,
    /// As of `graspd synth`
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// As of `graspd synth`
    #[arg(long, default_value = "0")]
    pub(super) seed: u64,
    /// As of `graspd synth`
    #[arg(long, value_name = "N")]
    resolution: Option<usize>,
    /// A part of the method to leave out; may be repeated
    #[arg(long, value_name = "PART")]
    without: Vec<String>,
    /// Settings that differ from the preset's
    #[arg(long, value_name = "FILE.toml")]
    pub(super) config: Option<PathBuf>,
    /// One of these settings, as of `graspd synth`; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Say which differences to an earlier run, its `evaluation.json` or its folder, are significant
    #[arg(long, value_name = "FILE|DIR")]
    pub(super) against: Option<PathBuf>,
    /// Where the results go [default: a folder in target/evaluate]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// As of `graspd synth`
    #[arg(long, value_name = "T")]
    pub(super) threads: Option<usize>,
    /// A build of the graspd command to use instead of this checkout's
    #[arg(long, value_name = "PROGRAM")]
    pub(super) graspd: Option<PathBuf>,
}

impl Options {
    /// Returns the arguments of `graspd synth` that decide the grasps, but for the object.
    pub(super) fn arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        let mut add = |flag: &str, value: String| arguments.extend([flag.to_owned(), value]);
        add("--hand", self.hand.clone());
        add("--preset", self.preset.clone());
        add("-n", self.starts.to_string());
        add("--seed", self.seed.to_string());
        if let Some(steps) = self.steps {
            add("--steps", steps.to_string());
        }
        if let Some(resolution) = self.resolution {
            add("--resolution", resolution.to_string());
        }
        for part in &self.without {
            add("--without", part.clone());
        }
        if let Some(config) = &self.config {
            add("--config", config.to_string_lossy().into_owned());
        }
        for setting in &self.settings {
            add("--set", setting.clone());
        }
        arguments
    }

    /// Returns a short name of the run, fit for a folder.
    pub(super) fn title(&self) -> String {
        let stem = |path: &Path| {
            path.file_stem()
                .unwrap_or(path.as_os_str())
                .to_string_lossy()
                .into_owned()
        };
        let mut title = format!("{}-{}", stem(Path::new(&self.hand)), self.preset);
        for part in &self.without {
            title += &format!("-without-{part}");
        }
        if let Some(config) = &self.config {
            title += &format!("-{}", stem(config));
        }
        for setting in &self.settings {
            title += &format!("-{}", setting.trim_start_matches("settings."));
        }
        title
    }

    /// Returns the command that repeats the run.
    pub(super) fn command(&self) -> String {
        let mut words = vec![
            "cargo xtask evaluate --objects".to_owned(),
            self.objects.clone(),
        ];
        let arguments = self.arguments().into_iter();
        words.extend(arguments.map(|word| {
            if word == "-n" {
                "--starts".into()
            } else {
                word
            }
        }));
        words.join(" ")
    }
}

#[cfg(test)]
pub(super) mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        options: Options,
    }

    pub(in crate::evaluate) fn parse(words: &str) -> Result<Options, clap::Error> {
        let words = std::iter::once("evaluate").chain(words.split_whitespace());
        Program::try_parse_from(words).map(|program| program.options)
    }

    #[test]
    fn options_are_those_of_the_usage() {
        let options = parse(
            "--hand allegro --objects table4 --preset soft --starts 5 --steps 700 --seed 3 --resolution 128 \
             --without mdmm --config a/stiff.toml --set settings.leak=0.2 --against b -o c --threads 2 --graspd d",
        )
        .unwrap();
        assert_eq!(options.objects, "table4");
        assert_eq!(options.title(), "allegro-soft-without-mdmm-stiff-leak=0.2");
        assert_eq!(
            options.command(),
            "cargo xtask evaluate --objects table4 --hand allegro --preset soft --starts 5 --seed 3 --steps 700 \
             --resolution 128 --without mdmm --config a/stiff.toml --set settings.leak=0.2"
        );
        let repeated = options.command();
        let again = parse(repeated.trim_start_matches("cargo xtask evaluate")).unwrap();
        assert_eq!(again.arguments(), options.arguments());

        let usual = parse("").unwrap();
        assert_eq!(
            (usual.objects.as_str(), usual.title().as_str()),
            ("ycb", "human-default")
        );
        for wrong in ["--fast", "--hand", "--starts 0", "--seed x"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
