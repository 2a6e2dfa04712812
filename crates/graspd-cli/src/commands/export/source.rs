//! The grasps to be exported, run by run, with what is needed to pose them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context, Result, bail};
use graspd::{GraspRecord, NamedMesh, RunDescription, grasp_files, read_records};
use graspd_eval::EvaluationSettings;
use graspd_hand::Hand;

use super::super::subject::{hand_of, objects_of};
use super::{Arguments, Format};

/// Where grasps come from.
pub(super) struct GraspSource<'a> {
    arguments: &'a Arguments,
    folder: PathBuf,
    files: Vec<PathBuf>,
    /// Loading a hand may take longer than writing all of its grasps.
    hands: HashMap<(String, Option<String>), Rc<dyn Hand>>,
}

/// The grasps of one run.
pub(super) struct ExportedRun {
    /// The run's name in its batch; none for a run by itself.
    pub(super) name: Option<String>,
    file: PathBuf,
    /// The best first.
    pub(super) records: Vec<GraspRecord>,
}

impl ExportedRun {
    /// A name for a file of one grasp, unique within the source.
    pub(super) fn file_stem(&self, record: &GraspRecord) -> String {
        match &self.name {
            Some(name) => format!("{name}_{:03}", record.index),
            None => format!("{}_{:03}", sanitised(&record.object), record.index),
        }
    }
}

impl<'a> GraspSource<'a> {
    pub(super) fn open(arguments: &'a Arguments) -> Result<Self> {
        if arguments.top_k == Some(0) {
            bail!("--top-k is 0; it must be at least 1");
        }
        let path = &arguments.grasps;
        let files = if path.is_file() {
            vec![path.clone()]
        } else {
            grasp_files(path)?
        };
        let folder = match path.parent() {
            Some(parent) if path.is_file() => parent.to_owned(),
            _ => path.clone(),
        };
        Ok(Self {
            arguments,
            folder,
            files,
            hands: HashMap::new(),
        })
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// How many runs there are.
    pub(super) fn len(&self) -> usize {
        self.files.len()
    }

    /// How grasps are judged: friction, gravity and mass of a scene are those of the simulation.
    pub(super) fn evaluation(&self) -> Result<EvaluationSettings> {
        let resolved = self.arguments.configuration.resolve(self.arguments.quiet)?;
        Ok(resolved.configuration.evaluation)
    }

    /// Run number `number`.
    pub(super) fn run(&self, number: usize) -> Result<ExportedRun> {
        let file = self.files[number].clone();
        let mut records = read_records(&file)?;
        let is_scene = matches!(self.arguments.format, Format::Mjcf | Format::Gltf);
        let kept = self.arguments.top_k.or(is_scene.then_some(1));
        // Grasps of others come without ranks, in their own order.
        records.sort_by_key(|record| record.rank.unwrap_or(usize::MAX));
        records.truncate(kept.unwrap_or(usize::MAX));
        let is_batch = self.files.len() > 1 || file.parent() != Some(&self.folder);
        let name = file.parent().and_then(Path::file_name).filter(|_| is_batch);
        Ok(ExportedRun {
            name: name.map(|name| name.to_string_lossy().into_owned()),
            file,
            records,
        })
    }

    /// The hand of a run.
    pub(super) fn hand(&mut self, run: &ExportedRun) -> Result<Rc<dyn Hand>> {
        let first = run.records.first().context("there are no grasps")?;
        // Two files may give hands of one name.
        let recorded = RunDescription::beside(&run.file)
            .map(|run| format!("{:?}", (run.hand, run.hand_mirrored, run.hand_skin)));
        let key = (first.hand.clone(), recorded);
        if let Some(hand) = self.hands.get(&key) {
            return Ok(Rc::clone(hand));
        }
        let asked = self.arguments.hand.as_deref();
        let options = self.arguments.loading.options()?;
        let hand = hand_of(
            &run.records,
            &run.file,
            asked,
            &options,
            self.arguments.quiet,
        )?;
        let hand: Rc<dyn Hand> = Rc::from(hand);
        self.hands.insert(key, Rc::clone(&hand));
        Ok(hand)
    }

    /// The object of a run.
    pub(super) fn object(&self, run: &ExportedRun) -> Result<NamedMesh> {
        let asked = self.arguments.object.as_deref();
        let repair = &self.arguments.repair;
        let objects = objects_of(
            &run.records,
            &run.file,
            asked,
            None,
            repair,
            self.arguments.quiet,
        )?;
        let scales = objects.len();
        let mut objects = objects.into_iter();
        match (objects.next(), objects.next()) {
            (Some(object), None) => Ok(object),
            _ => bail!(
                "{}: the grasps are for {scales} scales of the object, and a scene has one; export them in parts, \
                one scale each",
                run.file.display()
            ),
        }
    }

    /// The hand's pose of a record, with the file in the error.
    pub(super) fn context(&self, run: &ExportedRun, record: &GraspRecord) -> String {
        format!("{}: grasp {}", run.file.display(), record.index)
    }
}

/// Letters that every file system takes.
pub(super) fn sanitised(name: &str) -> String {
    let safe = |c: char| {
        if c.is_ascii_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    let name: String = name.chars().map(safe).collect();
    // Not the folder itself, nor the one above.
    name.trim_start_matches('.').to_owned()
}
