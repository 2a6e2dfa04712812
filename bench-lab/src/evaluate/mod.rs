//! `evaluate`: grasps of many objects, judged and summed up; two runs compared.

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
use graspd::read_records;

use crate::command::{Laboratory, digest, output, read_json, write_json, write_text};
use crate::objects::{Subject, subjects};
use metrics::{Grasp, ObjectResult};
pub(crate) use options::Options;
pub(crate) use plots::plot;
use report::{Comparison, Evaluation, SCHEMA};

/// Makes the grasps that are not there yet, one object after the other and the starts of each in parallel; prints the
/// tables and writes them: `evaluation.json` and `.md`, and with `--against` `comparison.json` and `.md`.
///
/// The grasps of an object are kept in a folder named by the object and by a digest of everything that they depend on.
/// It gets this name when it is complete, so that an interrupted run goes on where it stopped.
pub(crate) fn evaluate(laboratory: &Laboratory, options: &Options) -> Result<()> {
    let started = Instant::now();
    // A wrong file is to be found before the work and not after.
    let other = (options.against.as_deref())
        .map(read_evaluation)
        .transpose()?;
    let chosen = subjects(&laboratory.root, &options.objects)?;
    let usual = || laboratory.target.join("evaluate").join(options.title());
    let experiment = Experiment {
        graspd: options.graspd.as_ref().unwrap_or(&laboratory.graspd),
        folder: options.output.clone().unwrap_or_else(usual),
        options,
    };
    let mut objects = Vec::new();
    for (number, subject) in chosen.iter().enumerate() {
        let result = (experiment.object(subject)).with_context(|| {
            format!(
                "{} failed; the same command goes on from here",
                subject.name
            )
        })?;
        println!(
            "{} ({} of {}): {} grasps after {:.0} s",
            subject.name,
            number + 1,
            chosen.len(),
            result.grasps.len(),
            started.elapsed().as_secs_f64(),
        );
        objects.push(result);
    }
    let evaluation = Evaluation {
        schema: SCHEMA.into(),
        title: options.title(),
        command: options.command(),
        objects,
    };
    let file = |name: &str| experiment.folder.join(name);
    let page = evaluation.page();
    write_json(&file("evaluation.json"), &evaluation.json())?;
    write_text(&file("evaluation.md"), &page)?;
    println!("\n{page}");
    if let Some(other) = other {
        let comparison = Comparison::new(&evaluation, &other)?;
        let page = comparison.page();
        write_json(&file("comparison.json"), &comparison.json())?;
        write_text(&file("comparison.md"), &page)?;
        println!("{page}");
    }
    println!("written to {}", experiment.folder.display());
    Ok(())
}

struct Experiment<'a> {
    graspd: &'a Path,
    folder: PathBuf,
    options: &'a Options,
}

impl Experiment<'_> {
    /// Returns the grasps of one object, made now or kept from before.
    fn object(&self, subject: &Subject) -> Result<ObjectResult> {
        let arguments = self.options.arguments();
        let hand = Path::new(&self.options.hand);
        let mut files = vec![Path::new(&subject.argument), hand, self.graspd];
        files.extend(self.options.config.as_deref());
        let digest = digest(&(&arguments, &subject.argument), &files)?;
        let folder = self.folder.join("grasps");
        let kept = folder.join(format!("{}-{digest}", subject.name));
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
            let mut command = Command::new(self.graspd);
            command
                .args(["synth", &subject.argument, "--quiet"])
                .args(arguments);
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
        let grasps = (read_records(&file)?
            .iter()
            .map(Grasp::of)
            .collect::<Result<_>>())
        .with_context(|| format!("{} cannot be used", file.display()))?;
        ObjectResult::new(&subject.name, subject.note.as_deref(), grasps)
    }
}

/// Reads the results of another run from its file or its folder.
fn read_evaluation(path: &Path) -> Result<Evaluation> {
    let file = if path.is_dir() {
        path.join("evaluation.json")
    } else {
        path.to_owned()
    };
    let evaluation: Evaluation = read_json(&file)?;
    if evaluation.schema != SCHEMA
        || evaluation
            .objects
            .iter()
            .any(|object| object.grasps.is_empty())
    {
        bail!(
            "{}: no {SCHEMA} with grasps; give the evaluation.json of another run",
            file.display()
        );
    }
    Ok(evaluation)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn an_interrupted_run_goes_on_and_changed_settings_start_anew() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        // Stands for the command: notes that it was called, and writes what a run writes.
        let script = folder.join("graspd");
        let record = serde_json::to_string(&metrics::tests::record(0, 12.0, 0.1)).unwrap();
        let text = format!(
            "#!/bin/sh\necho called >> '{}'\nfor word; do folder=$word; done\nmkdir -p \"$folder\"\n\
             echo '{record}' > \"$folder/grasps.jsonl\"\n",
            folder.join("calls").display()
        );
        fs::write(&script, text).unwrap();
        fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
        let calls = || {
            fs::read_to_string(folder.join("calls"))
                .unwrap()
                .lines()
                .count()
        };
        let subject = Subject {
            name: "can".into(),
            argument: "can".into(),
            note: None,
        };
        let mut options = options::tests::parse("").unwrap();
        for (seed, expected) in [(0, 1), (0, 1), (1, 2), (0, 2)] {
            options.seed = seed;
            let experiment = Experiment {
                graspd: &script,
                folder: folder.join("run"),
                options: &options,
            };
            // What an interruption leaves.
            fs::create_dir_all(folder.join("run/grasps/can.partial/meshes")).unwrap();
            assert_eq!(experiment.object(&subject).unwrap().grasps.len(), 1);
            assert_eq!(calls(), expected);
        }
    }
}
