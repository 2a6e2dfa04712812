//! What an evaluation is asked to do.

use std::path::PathBuf;

use super::super::objects::{TABLE4, YCB};

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Options {
    pub(super) hand: String,
    /// Names of objects; by default those of `usual`.
    pub(super) objects: Vec<String>,
    /// The named list that was asked for.
    pub(super) usual: &'static [&'static str],
    /// As given, for the title of the run.
    list: String,
    pub(super) preset: String,
    pub(super) starts: usize,
    pub(super) steps: Option<usize>,
    pub(super) seed: u64,
    pub(super) resolution: Option<usize>,
    /// Parts of the method to leave out.
    pub(super) without: Vec<String>,
    /// Settings that differ from the preset's.
    pub(super) config: Option<PathBuf>,
    /// The `evaluation.json` of another run, or its folder.
    pub(super) against: Option<PathBuf>,
    pub(super) output: Option<PathBuf>,
    pub(super) threads: Option<usize>,
    /// A build of the command to use instead of making one.
    pub(super) graspd: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            hand: "human".into(),
            objects: Vec::new(),
            usual: &YCB,
            list: "ycb".into(),
            preset: "default".into(),
            starts: 10,
            steps: None,
            seed: 0,
            resolution: None,
            without: Vec::new(),
            config: None,
            against: None,
            output: None,
            threads: None,
            graspd: None,
        }
    }
}

impl Options {
    /// From the words after the command; `None` for words that make no sense.
    pub(crate) fn parse(words: &[&str]) -> Option<Self> {
        let mut options = Self::default();
        let mut rest = words.iter();
        while let Some(word) = rest.next() {
            let value = *rest.next()?;
            match *word {
                "--hand" => options.hand = value.to_owned(),
                "--objects" => options.set_objects(value),
                "--preset" => options.preset = value.to_owned(),
                "--starts" => options.starts = value.parse().ok().filter(|count| *count > 0)?,
                "--steps" => options.steps = Some(value.parse().ok()?),
                "--seed" => options.seed = value.parse().ok()?,
                "--resolution" => options.resolution = Some(value.parse().ok()?),
                "--without" => options.without.push(value.to_owned()),
                "--config" => options.config = Some(value.into()),
                "--against" => options.against = Some(value.into()),
                "-o" => options.output = Some(value.into()),
                "--threads" => options.threads = Some(value.parse().ok()?),
                "--graspd" => options.graspd = Some(value.into()),
                _ => return None,
            }
        }
        Some(options)
    }

    fn set_objects(&mut self, list: &str) {
        self.list = list.to_owned();
        match list {
            "ycb" => self.usual = &YCB,
            "table4" => self.usual = &TABLE4,
            _ => self.objects = list.split(',').map(str::to_owned).collect(),
        }
    }

    /// The arguments of `graspd synth` that decide the grasps, but for the object.
    pub(super) fn arguments(&self) -> Vec<String> {
        let mut arguments: Vec<String> = Vec::new();
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
        arguments
    }

    /// A short name, fit for a folder too.
    pub(super) fn title(&self) -> String {
        let stem = |text: &str| {
            let path = std::path::Path::new(text);
            path.file_stem().map_or_else(
                || text.to_owned(),
                |stem| stem.to_string_lossy().into_owned(),
            )
        };
        let mut title = format!("{}-{}", stem(&self.hand), self.preset);
        for part in &self.without {
            title += &format!("-without-{part}");
        }
        if let Some(config) = &self.config {
            title += &format!("-{}", stem(&config.to_string_lossy()));
        }
        title
    }

    /// The command that repeats the run.
    pub(super) fn command(&self) -> String {
        let mut words = vec![
            "cargo xtask evaluate --objects".to_owned(),
            self.list.clone(),
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
mod tests {
    use super::*;

    #[test]
    fn options_are_those_of_the_usage() {
        let words = "--hand allegro --objects table4 --preset soft --starts 5 --steps 700 --seed 3 --resolution 128 \
                     --without mdmm --config a/stiff.toml --against b -o c --threads 2 --graspd d";
        let words: Vec<&str> = words.split_whitespace().collect();
        let options = Options::parse(&words).unwrap();
        assert_eq!(options.usual, TABLE4);
        assert_eq!(options.objects, Vec::<String>::new());
        assert_eq!(options.title(), "allegro-soft-without-mdmm-stiff");
        assert_eq!(
            options.command(),
            "cargo xtask evaluate --objects table4 --hand allegro --preset soft --starts 5 --seed 3 --steps 700 --resolution 128 \
             --without mdmm --config a/stiff.toml"
        );
        let words: Vec<String> = options
            .command()
            .split(' ')
            .skip(3)
            .map(String::from)
            .collect();
        let again = Options::parse(&words.iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
        assert_eq!(again.arguments(), options.arguments());

        let few = Options::parse(&["--objects", "mug,can"]).unwrap();
        assert_eq!(few.objects, ["mug", "can"]);
        assert_eq!(Options::parse(&[]), Some(Options::default()));
        for wrong in [
            &["--fast"][..],
            &["--hand"],
            &["--starts", "0"],
            &["--seed", "x"],
        ] {
            assert_eq!(Options::parse(wrong), None, "{wrong:?}");
        }
    }
}
