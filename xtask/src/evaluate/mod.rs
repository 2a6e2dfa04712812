//! `evaluate`: grasps of many objects, judged and summed up; two runs compared.

mod bootstrap;
mod metrics;
mod options;
mod plots;
mod report;
mod summary;

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::command::{graspd, target_folder};
use crate::objects::{Subject, subjects};
use crate::steps::output;
use metrics::{Grasp, ObjectResult};
pub(crate) use options::Options;
pub(crate) use plots::plot;
use report::{Comparison, Evaluation};

/// Makes the grasps that are not there yet, one object after the other and the starts of each in parallel; prints the
/// tables and writes them: `evaluation.json` and `.md`, and with `--against` `comparison.json` and `.md`.
///
/// The grasps of an object are kept in a folder named by the object and by a digest of everything that they depend on. It
/// gets this name when it is complete, so that a run that was interrupted goes on where it stopped.
pub(crate) fn evaluate(root: &Path, options: &Options) -> Result<()> {
    let started = Instant::now();
    // A wrong file is to be found before the work and not after.
    let other = options
        .against
        .as_deref()
        .map(read_evaluation)
        .transpose()?;
    let chosen = subjects(root, &options.objects, options.usual)?;
    let harness = Harness {
        graspd: match &options.graspd {
            Some(path) => path.clone(),
            None => graspd(root)?,
        },
        folder: match &options.output {
            Some(folder) => folder.clone(),
            None => target_folder(root)?.join("evaluate").join(options.title()),
        },
        options,
    };
    let mut objects = Vec::new();
    for (number, subject) in chosen.iter().enumerate() {
        let result = (harness.object(subject)).with_context(|| {
            format!(
                "{} failed; the same command goes on from here",
                subject.name
            )
        })?;
        let seconds = started.elapsed().as_secs_f64();
        println!(
            "{} ({} of {}): {} grasps after {seconds:.0} s",
            subject.name,
            number + 1,
            chosen.len(),
            result.grasps.len(),
        );
        objects.push(result);
    }
    let evaluation = Evaluation {
        title: options.title(),
        command: options.command(),
        objects,
    };
    harness.write("evaluation", &evaluation.json(), &evaluation.page())?;
    println!("\n{}", evaluation.page());
    if let Some(other) = other {
        let comparison = Comparison::new(&evaluation, &other)?;
        harness.write("comparison", &comparison.json(), &comparison.page())?;
        println!("{}", comparison.page());
    }
    println!("written to {}", harness.folder.display());
    Ok(())
}

struct Harness<'a> {
    graspd: PathBuf,
    folder: PathBuf,
    options: &'a Options,
}

impl Harness<'_> {
    /// The grasps of one object, made now or kept from before.
    fn object(&self, subject: &Subject) -> Result<ObjectResult> {
        let digest = self.digest(subject)?;
        let folder = self.folder.join("grasps");
        let kept = folder.join(format!("{}-{digest:016x}", subject.name));
        if !kept.is_dir() {
            let partial = folder.join(format!("{}.partial", subject.name));
            // What an interrupted run left.
            if let Err(error) = fs::remove_dir_all(&partial)
                && error.kind() != ErrorKind::NotFound
            {
                bail!("{}: cannot be removed: {error}", partial.display());
            }
            fs::create_dir_all(&folder)
                .with_context(|| format!("cannot make {}", folder.display()))?;
            let mut command = Command::new(&self.graspd);
            command.args(["synth", &subject.argument, "--quiet"]);
            command.args(self.options.arguments());
            if let Some(threads) = self.options.threads {
                command.arg("--threads").arg(threads.to_string());
            }
            // Its table is not wanted here.
            output(command.arg("-o").arg(&partial))?;
            fs::rename(&partial, &kept).with_context(|| {
                format!("cannot rename {} to {}", partial.display(), kept.display())
            })?;
        }
        let file = kept.join("grasps.jsonl");
        let grasps = read(&file)?
            .lines()
            .map(|line| Grasp::of(&serde_json::from_str(line)?))
            .collect::<Result<_>>()
            .with_context(|| format!("{} cannot be used", file.display()))?;
        ObjectResult::new(&subject.name, subject.note.as_deref(), grasps)
    }

    /// A number that changes with anything that the grasps depend on: the command, its arguments, and the files named.
    fn digest(&self, subject: &Subject) -> Result<u64> {
        let mut digest = Digest::new();
        for argument in self.options.arguments() {
            digest.update(argument.as_bytes());
        }
        digest.update(subject.argument.as_bytes());
        let files = [&subject.argument, &self.options.hand].map(Path::new);
        let config = self.options.config.as_deref();
        for file in (files.into_iter().filter(|path| path.is_file()))
            .chain([self.graspd.as_path()])
            .chain(config)
        {
            let bytes =
                fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
            digest.update(&bytes);
        }
        Ok(digest.0)
    }

    fn write(&self, name: &str, value: &Value, page: &str) -> Result<()> {
        let write = |ending: &str, text: &str| -> Result<()> {
            let path = self.folder.join(format!("{name}.{ending}"));
            let partial = self.folder.join(format!("{name}.{ending}.partial"));
            fs::write(&partial, text)
                .and_then(|()| fs::rename(&partial, &path))
                .with_context(|| format!("cannot write {}", path.display()))
        };
        write("json", &format!("{value:#}\n"))?;
        write("md", page)
    }
}

/// The results of another run, from its file or its folder.
fn read_evaluation(path: &Path) -> Result<Evaluation> {
    let file = if path.is_dir() {
        path.join("evaluation.json")
    } else {
        path.to_owned()
    };
    serde_json::from_str(&read(&file)?)
        .map_err(anyhow::Error::from)
        .and_then(|value| Evaluation::of(&value))
        .with_context(|| format!("{} cannot be used", file.display()))
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// FNV-1a over parts, each followed by its length: it tells files apart that differ by accident, not by malice.
///
/// # Source
/// G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake, "The FNV Non-Cryptographic Hash Algorithm", IETF draft.
struct Digest(u64);

impl Digest {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn update(&mut self, part: &[u8]) {
        let length = (part.len() as u64).to_le_bytes();
        for byte in part.iter().chain(&length) {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_see_every_byte_and_where_parts_end() {
        let of = |parts: &[&str]| {
            let mut digest = Digest::new();
            parts.iter().for_each(|part| digest.update(part.as_bytes()));
            digest.0
        };
        assert_eq!(of(&["ab", "c"]), of(&["ab", "c"]));
        for other in [
            &["a", "bc"][..],
            &["abc"],
            &["ab", "d"],
            &["ab"],
            &["ab", "c", ""],
        ] {
            assert_ne!(of(&["ab", "c"]), of(other), "{other:?}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn an_interrupted_run_goes_on_and_changed_settings_start_anew() {
        use std::os::unix::fs::PermissionsExt;

        let folder = std::env::temp_dir().join(format!("graspd-evaluate-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        // Stands for the command: notes that it was called, and writes what a run writes.
        let script = folder.join("graspd");
        let record = metrics::tests::grasp(0, 12.0, 0.1).json();
        let text = format!(
            "#!/bin/sh\necho called >> '{}'\nfor word; do folder=$word; done\nmkdir -p \"$folder\"\n\
             echo '{record}' > \"$folder/grasps.jsonl\"\n",
            folder.join("calls").display()
        );
        fs::write(&script, text).unwrap();
        fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
        let calls = || read(&folder.join("calls")).unwrap().lines().count();
        let subject = Subject {
            name: "can".into(),
            argument: "can".into(),
            note: None,
        };
        let mut options = Options::default();
        for (seed, expected) in [(0, 1), (0, 1), (1, 2), (0, 2)] {
            options.seed = seed;
            let harness = Harness {
                graspd: script.clone(),
                folder: folder.join("run"),
                options: &options,
            };
            // What an interruption leaves.
            fs::create_dir_all(folder.join("run/grasps/can.partial/meshes")).unwrap();
            assert_eq!(harness.object(&subject).unwrap().grasps.len(), 1);
            assert_eq!(calls(), expected);
        }
        fs::remove_dir_all(folder).unwrap();
    }
}
