//! `reproduce-table4`: the paper's RGB-D experiment, grasps from captures judged on the true mesh.

mod report;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::command::{Laboratory, digest, json_output, output, read_json, write_json, write_text};
use crate::objects::{Subject, subjects};
use report::{Means, ObjectRow, document, json, table};

/// The options of `cargo xtask reproduce-table4`.
#[derive(Args)]
pub(crate) struct Options {
    /// A folder of real captures, one folder an object; those of other objects are rendered
    #[arg(long, value_name = "DIR")]
    ycb: Option<PathBuf>,
    /// Names of objects
    #[arg(
        long,
        value_name = "NAME,...",
        default_value = "table4",
        hide_default_value = true
    )]
    objects: String,
    /// Two objects and two starts, into target/table4-quick
    #[arg(long)]
    quick: bool,
    /// Begin anew, without the results of an interrupted or earlier run
    #[arg(long)]
    fresh: bool,
}

/// Objects and starts of a quick run.
const QUICK_OBJECTS: usize = 2;
const QUICK_STARTS: usize = 2;
/// As in the paper.
const STARTS: usize = 10;

/// Runs the experiment, prints the table, and writes `table4.json`, `table4.md` and pictures: into `lab`, or a quick
/// run's into `target/table4-quick`.
///
/// An object's results are kept as soon as it is done (`target/table4/OBJECT/row.json`): an interrupted run goes on
/// with the next object, as long as the command, the mesh and what was asked for are the same.
pub(crate) fn reproduce(laboratory: &Laboratory, options: &Options) -> Result<()> {
    let started = Instant::now();
    let mut subjects = subjects(&laboratory.root, &options.objects)?;
    let mut starts = STARTS;
    let mut work = laboratory.target.join("table4");
    let mut notes = laboratory.root.join("lab");
    if options.quick {
        subjects.truncate(QUICK_OBJECTS);
        starts = QUICK_STARTS;
        work = laboratory.target.join("table4-quick");
        notes.clone_from(&work);
    }
    let experiment = Experiment {
        graspd: &laboratory.graspd,
        pictures: notes.join("pictures"),
        work,
        ycb: options.ycb.as_deref(),
        starts,
    };
    fs::create_dir_all(&experiment.pictures)
        .with_context(|| format!("cannot make {}", experiment.pictures.display()))?;
    let mut rows = Vec::new();
    for subject in &subjects {
        println!("== {}", subject.name);
        let row = (experiment.row(subject, options.fresh))
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
    println!("{}", table(&rows));
    write_json(&notes.join("table4.json"), &json(&rows, starts))?;
    write_text(
        &notes.join("table4.md"),
        &document(&rows, starts, options.quick),
    )?;
    println!(
        "{} and table4.md written after {:.0} s",
        notes.join("table4.json").display(),
        started.elapsed().as_secs_f64()
    );
    Ok(())
}

struct Experiment<'a> {
    graspd: &'a Path,
    work: PathBuf,
    pictures: PathBuf,
    ycb: Option<&'a Path>,
    starts: usize,
}

/// An object's results as they are kept, and the digest of what they depend on.
#[derive(Serialize, Deserialize)]
struct Kept {
    key: String,
    row: ObjectRow,
}

/// What is read of the output of `graspd reconstruct --json`.
#[derive(Deserialize)]
struct Reconstruction {
    #[serde(default)]
    views: Vec<serde::de::IgnoredAny>,
}

/// What is read of the output of `graspd eval --json`.
#[derive(Deserialize)]
struct Evaluated {
    summary: Best,
}

#[derive(Deserialize)]
struct Best {
    top_2: Means,
}

impl Experiment<'_> {
    /// Returns an object's results: those kept, or else made now and kept.
    fn row(&self, subject: &Subject, is_fresh: bool) -> Result<ObjectRow> {
        let folder = self.work.join(&subject.name);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let real = self.ycb.map(|ycb| ycb.join(&subject.name));
        let files = [self.graspd, Path::new(&subject.argument)];
        let key = digest(&(subject, self.starts, real), &files)?;
        let file = folder.join("row.json");
        let pictures = ["truth", "rgbd"].map(|name| self.picture(subject, name));
        if !is_fresh
            && pictures.iter().all(|path| path.exists())
            && let Ok(kept) = read_json::<Kept>(&file)
            && kept.key == key
        {
            println!("   kept from an earlier run (--fresh makes it anew)");
            return Ok(kept.row);
        }
        let kept = Kept {
            key,
            row: self.object(subject)?,
        };
        write_json(&file, &kept)?;
        Ok(kept.row)
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
        let real = self.ycb.map(|ycb| ycb.join(&subject.name));
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
            output(self.command("scan").arg(truth).arg("-o").arg(&capture))?;
            reconstruct.arg(capture);
        }
        let reconstruction: Reconstruction =
            json_output(reconstruct.arg("-o").arg(&mesh).arg("--json"))?;

        let synthesize = |object: &Path, name: &str| -> Result<PathBuf> {
            let run_folder = folder.join(name);
            let picture = self.picture(subject, name);
            let mut command = self.command("synth");
            command
                .arg(object)
                .args(["--hand", "human", "-n", &self.starts.to_string()]);
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
            Ok(json_output::<Evaluated>(&mut command)?.summary.top_2)
        };
        Ok(ObjectRow {
            name: subject.name.clone(),
            note: subject.note.clone(),
            is_rendered: real.is_none(),
            views: reconstruction.views.len(),
            truth: judged(&synthesize(Path::new(truth), "truth")?)?,
            rgbd: judged(&synthesize(&mesh, "rgbd")?)?,
            seconds: started.elapsed().as_secs_f64(),
        })
    }

    fn command(&self, name: &str) -> Command {
        let mut command = Command::new(self.graspd);
        command.arg(name).arg("--quiet");
        command
    }
}
