//! `reproduce-table4`: the paper's RGB-D experiment, grasps from captures judged on the true mesh.

mod kept;
mod report;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::command::{graspd, parsed, target_folder};
use crate::objects::{Subject, TABLE4, subjects};
use crate::steps::{output, run};
use kept::Kept;
use report::{Means, ObjectRow, document, json, table};

/// What is asked for.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Options {
    /// A folder of real captures, one folder an object.
    ycb: Option<PathBuf>,
    /// Which objects; by default the paper's eight.
    objects: Vec<String>,
    /// Two objects and two starts.
    quick: bool,
    /// Nothing of an interrupted or earlier run is taken over.
    fresh: bool,
}

impl Options {
    /// From the words after the command; `None` for words that make no sense.
    pub(crate) fn parse(words: &[&str]) -> Option<Self> {
        let mut options = Self::default();
        let mut rest = words.iter();
        while let Some(word) = rest.next() {
            match *word {
                "--quick" => options.quick = true,
                "--fresh" => options.fresh = true,
                "--ycb" => options.ycb = Some(PathBuf::from(rest.next()?)),
                "--objects" => {
                    options.objects = rest.next()?.split(',').map(str::to_owned).collect();
                }
                _ => return None,
            }
        }
        Some(options)
    }
}

/// Objects and starts of a quick run.
const QUICK_OBJECTS: usize = 2;
const QUICK_STARTS: usize = 2;
/// As in the paper.
const STARTS: usize = 10;

/// Runs the experiment with the release build of the command, prints the table, and writes `table4.json`, `table4.md` and
/// pictures: into `docs`, or a quick run's into `target/table4-quick`.
///
/// An object's results are kept as soon as it is done (`target/table4/OBJECT/row.json`): a run that was interrupted goes on with
/// the next object, as long as the command, the mesh and what was asked for are the same.
pub(crate) fn reproduce(root: &Path, options: &Options) -> Result<()> {
    let started = Instant::now();
    let graspd = graspd(root)?;
    let target = target_folder(root)?;
    let mut subjects = subjects(root, &options.objects, &TABLE4)?;
    let mut starts = STARTS;
    if options.quick {
        subjects.truncate(QUICK_OBJECTS);
        starts = QUICK_STARTS;
    }
    let work = target.join(if options.quick {
        "table4-quick"
    } else {
        "table4"
    });
    let docs = if options.quick {
        work.clone()
    } else {
        root.join("docs")
    };
    let experiment = Experiment {
        graspd,
        pictures: docs.join("pictures"),
        work,
        ycb: options.ycb.clone(),
        starts,
    };
    fs::create_dir_all(&experiment.pictures)
        .with_context(|| format!("cannot make {}", experiment.pictures.display()))?;
    let mut rows = Vec::new();
    for subject in &subjects {
        println!("== {}", subject.name);
        let row = experiment
            .row(subject, options.fresh)
            .with_context(|| format!("{} failed", subject.name))?;
        println!("{}", row.line());
        rows.push(row);
    }
    let rendered = rows.iter().filter(|row| row.is_rendered).count();
    println!(
        "\n{rendered} of {} captures rendered, {} real; {starts} grasps for each mesh",
        rows.len(),
        rows.len() - rendered
    );
    let text = table(&rows);
    println!("{text}");
    let seconds = started.elapsed().as_secs_f64();
    write(
        &docs.join("table4.json"),
        &format!("{:#}\n", json(&rows, starts)),
    )?;
    write(
        &docs.join("table4.md"),
        &document(&rows, starts, options.quick),
    )?;
    println!(
        "{} and table4.md written after {seconds:.0} s",
        docs.join("table4.json").display()
    );
    Ok(())
}

struct Experiment {
    graspd: PathBuf,
    work: PathBuf,
    pictures: PathBuf,
    ycb: Option<PathBuf>,
    starts: usize,
}

impl Experiment {
    /// An object's results: those kept, or else made now and kept.
    fn row(&self, subject: &Subject, is_fresh: bool) -> Result<ObjectRow> {
        let folder = self.work.join(&subject.name);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let real = self.ycb.as_ref().map(|ycb| ycb.join(&subject.name));
        let asked = format!("{subject:?} {} {real:?}", self.starts);
        let kept = Kept::new(
            &folder,
            &asked,
            &[self.graspd.as_path(), Path::new(&subject.argument)],
        )?;
        let pictures = ["truth", "rgbd"].map(|name| self.picture(subject, name));
        if !is_fresh
            && pictures.iter().all(|path| path.exists())
            && let Some(row) = kept.row()
        {
            println!("   kept from an earlier run (--fresh makes it anew)");
            return Ok(row);
        }
        let row = self.object(subject)?;
        kept.keep(&row)?;
        Ok(row)
    }

    fn picture(&self, subject: &Subject, name: &str) -> PathBuf {
        let file = format!("table4-{}-{name}.png", subject.name);
        self.pictures.join(file)
    }

    /// Captures, reconstructs, grasps and judges one object.
    fn object(&self, subject: &Subject) -> Result<ObjectRow> {
        let started = Instant::now();
        let folder = self.work.join(&subject.name);
        let truth = subject.argument.as_str();
        let real = self.ycb.as_ref().map(|ycb| ycb.join(&subject.name));
        let real = real.filter(|folder| folder.join("calibration.h5").exists());
        let mesh = folder.join("reconstruction.obj");
        let mut reconstruct = self.command("reconstruct");
        if let Some(capture) = &real {
            println!("   capture: {}", capture.display());
            // A real capture is in the frame of its table.
            reconstruct.arg(capture).args(["--align-to", truth]);
        } else {
            println!("   capture: rendered, 15 views with the noise of the depth camera");
            let capture = folder.join("capture");
            run(self.command("scan").arg(truth).arg("-o").arg(&capture))?;
            reconstruct.arg(capture);
        }
        let reconstruction = parsed(reconstruct.arg("-o").arg(&mesh).arg("--json"))?;

        let synthesize = |object: &Path, name: &str| -> Result<PathBuf> {
            let run_folder = folder.join(name);
            let picture = self.picture(subject, name);
            let mut command = self.command("synth");
            command.arg(object).args(["--hand", "human", "-n"]);
            command.arg(self.starts.to_string());
            command
                .arg("-o")
                .arg(&run_folder)
                .arg("--png")
                .arg(&picture);
            // The table is not wanted here.
            output(&mut command)?;
            Ok(run_folder)
        };
        let judged = |run_folder: &Path| -> Result<Means> {
            let mut command = self.command("eval");
            command.arg(run_folder).args(["--object", truth, "--json"]);
            Means::of(&parsed(&mut command)?["summary"]["top_2"])
        };
        Ok(ObjectRow {
            name: subject.name.clone(),
            note: subject.note.clone(),
            is_rendered: real.is_none(),
            views: reconstruction["views"].as_array().map_or(0, Vec::len),
            truth: judged(&synthesize(Path::new(truth), "truth")?)?,
            rgbd: judged(&synthesize(&mesh, "rgbd")?)?,
            seconds: started.elapsed().as_secs_f64(),
        })
    }

    fn command(&self, name: &str) -> Command {
        let mut command = Command::new(&self.graspd);
        command.arg(name).arg("--quiet");
        command
    }
}

/// Writes a file under another name and renames it: whole or not at all.
fn write(path: &Path, text: &str) -> Result<()> {
    let temporary = path.with_extension("new");
    fs::write(&temporary, text)
        .and_then(|()| fs::rename(&temporary, path))
        .with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_those_of_the_usage() {
        let parsed =
            Options::parse(&["--ycb", "a/b", "--objects", "x,y", "--quick", "--fresh"]).unwrap();
        let expected = Options {
            ycb: Some(PathBuf::from("a/b")),
            objects: vec!["x".into(), "y".into()],
            quick: true,
            fresh: true,
        };
        assert_eq!(parsed, expected);
        assert_eq!(Options::parse(&[]), Some(Options::default()));
        for wrong in [&["--fast"][..], &["--ycb"], &["--objects"]] {
            assert_eq!(Options::parse(wrong), None);
        }
    }
}
