//! A run's results as JSON and as a page.

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::metrics::{COLUMNS, Column, ObjectResult};
use super::summary::{Estimate, SELECTIONS, Selection, Verdict, common, difference, estimate};

pub(super) const SCHEMA: &str = "graspd.evaluation/1";

/// A run: what was asked for, and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Evaluation {
    pub(super) schema: String,
    /// A name for tables.
    pub(super) title: String,
    /// The command that repeats it.
    pub(super) command: String,
    pub(super) objects: Vec<ObjectResult>,
}

impl Evaluation {
    /// Returns everything, for programs; read back as an [`Evaluation`], which leaves the means out.
    pub(super) fn json(&self) -> Value {
        let means =
            |objects: &[ObjectResult]| columns(|s, column| json!(estimate(objects, s, column)));
        let mut value = json!(self);
        value["over_objects"] = means(&self.objects);
        for (entry, object) in value["objects"]
            .as_array_mut()
            .into_iter()
            .flatten()
            .zip(&self.objects)
        {
            let Value::Object(selections) = means(std::slice::from_ref(object)) else {
                continue;
            };
            for (selection, columns) in selections {
                entry[selection] = columns;
            }
        }
        value
    }

    /// The page.
    pub(super) fn page(&self) -> String {
        let starts = self.objects.iter().map(|object| object.grasps.len()).max();
        let mut page = format!(
            "# {}\n\n```sh\n{}\n```\n\n\
             {} starts on each of {} objects, judged on the true meshes. Top k: the grasps of least displacement of \
             each object.\nBelow means are 95 % bootstrap intervals: over objects, where all grasps count over \
             objects and \
             starts, and in the\ntables of single objects over starts. CA/IV is the ratio of the means. SD6: mean \
             displacement over six directions of\ngravity; shake: share that withstands the shake test; holds: share \
             with SD < 0.5 cm; seconds: wall-clock of a synthesis\non one thread.\n",
            self.title,
            self.command,
            starts.unwrap_or(0),
            self.objects.len(),
        );
        page += &heading("over all objects", "grasps");
        for selection in SELECTIONS {
            page += &row(&words(selection), &estimates(&self.objects, selection));
        }
        for selection in SELECTIONS {
            page += &heading(&words(selection), "object");
            for object in &self.objects {
                let name = match &object.note {
                    Some(note) => format!("{} ({note})", object.name),
                    None => object.name.clone(),
                };
                let of_one = std::slice::from_ref(object);
                page += &row(&name, &estimates(of_one, selection));
            }
        }
        page
    }
}

/// The difference of each column between two runs.
pub(super) struct Comparison {
    ours: Evaluation,
    theirs: Evaluation,
}

impl Comparison {
    pub(super) fn new(ours: &Evaluation, theirs: &Evaluation) -> Result<Self> {
        let (a, b) = common(&ours.objects, &theirs.objects)?;
        let with = |run: &Evaluation, objects| Evaluation {
            objects,
            ..run.clone()
        };
        Ok(Self {
            ours: with(ours, a),
            theirs: with(theirs, b),
        })
    }

    /// The page.
    pub(super) fn page(&self) -> String {
        let (ours, theirs) = (&self.ours, &self.theirs);
        let grasps: usize = ours.objects.iter().map(|object| object.grasps.len()).sum();
        let mut page = format!(
            "# {} against {}\n\n```sh\n{}\n```\n\nagainst\n\n```sh\n{}\n```\n\n\
             {grasps} starts on {} objects that both have. A difference is significant if its 95 % bootstrap \
             interval, paired by\nobject (and by start where all grasps count), does not contain 0. There is no \
             correction for \
             multiple comparisons: of\ntwenty differences that do not exist, about one is called significant.\n",
            ours.title,
            theirs.title,
            ours.command,
            theirs.command,
            ours.objects.len(),
        );
        for selection in SELECTIONS {
            page += &format!(
                "\n## {}\n\n| | {} | {} | difference | 95 % interval | |\n|---|---|---|---|---|---|\n",
                words(selection),
                ours.title,
                theirs.title
            );
            for column in &COLUMNS {
                let of = |run: &Evaluation| number(estimate(&run.objects, selection, column).value);
                let gained = difference(&ours.objects, &theirs.objects, selection, column);
                page += &format!(
                    "| {} | {} | {} | {} | {} | {} |\n",
                    column.title,
                    of(ours),
                    of(theirs),
                    number(gained.value),
                    span(&gained),
                    Verdict::of(column, &gained).words(),
                );
            }
        }
        page
    }

    /// Returns the same, for programs.
    pub(super) fn json(&self) -> Value {
        let (ours, theirs) = (&self.ours.objects, &self.theirs.objects);
        json!({
            "schema": "graspd.comparison/1",
            "ours": self.ours.command,
            "theirs": self.theirs.command,
            "difference": columns(|selection, column| {
                let gained = difference(ours, theirs, selection, column);
                json!({
                    "ours": estimate(ours, selection, column).value,
                    "theirs": estimate(theirs, selection, column).value,
                    "difference": gained.value,
                    "interval_95": gained.interval,
                    "verdict": Verdict::of(column, &gained).words(),
                })
            }),
        })
    }
}

/// Returns something of every column, for every selection of grasps.
fn columns(of: impl Fn(Selection, &Column) -> Value) -> Value {
    let all = |selection| {
        COLUMNS
            .iter()
            .map(|column| (column.key.to_owned(), of(selection, column)))
            .collect()
    };
    SELECTIONS
        .into_iter()
        .map(|selection| (selection.key.to_owned(), Value::Object(all(selection))))
        .collect()
}

fn estimates(objects: &[ObjectResult], selection: Selection) -> Vec<Estimate> {
    (COLUMNS.iter())
        .map(|column| estimate(objects, selection, column))
        .collect()
}

fn words(selection: Selection) -> String {
    selection.key.replace('_', " ")
}

fn heading(title: &str, first: &str) -> String {
    let titles: Vec<&str> = COLUMNS.iter().map(|column| column.title).collect();
    format!(
        "\n## {title}\n\n| {first} | {} |\n|{}\n",
        titles.join(" | "),
        "---|".repeat(1 + COLUMNS.len())
    )
}

fn row(name: &str, estimates: &[Estimate]) -> String {
    let cells: Vec<String> = (estimates.iter())
        .map(|estimate| match estimate.interval {
            Some(_) => format!("{}<br>{}", number(estimate.value), span(estimate)),
            None => number(estimate.value),
        })
        .collect();
    format!("| {name} | {} |\n", cells.join(" | "))
}

fn span(estimate: &Estimate) -> String {
    match estimate.interval {
        Some([low, high]) => format!("{} to {}", number(low), number(high)),
        None => "-".into(),
    }
}

/// Three digits of what is large, two or three places of what is small.
fn number(value: f64) -> String {
    match value.abs() {
        _ if !value.is_finite() => "-".into(),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        size if size >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::summary::tests::object;
    use super::*;

    fn run(title: &str, areas: [f64; 3]) -> Evaluation {
        Evaluation {
            schema: SCHEMA.into(),
            title: title.into(),
            command: format!("cargo xtask evaluate --preset {title}"),
            objects: vec![object("a", &areas), object("b", &areas)],
        }
    }

    #[test]
    fn runs_are_read_as_they_are_written() {
        let run = run("soft", [10.0, 20.0, 30.0]);
        let value = run.json();
        assert_eq!(
            value["over_objects"]["all"]["contact_area_cm2"]["mean"],
            20.0
        );
        assert_eq!(value["objects"][1]["top_2"]["ca_over_iv"]["mean"], 7.5);
        // Through the text, as from a file.
        let read: Evaluation = serde_json::from_str(&value.to_string()).unwrap();
        assert_eq!(read, run);
    }

    #[test]
    fn pages_show_means_with_intervals() {
        let page = run("soft", [10.0, 20.0, 30.0]).page();
        assert!(
            page.contains("| top 2 | 15.0<br>15.0 to 15.0 | 2.00"),
            "{page}"
        );
        assert_eq!(page.matches("\n| a |").count(), 3);
    }

    #[test]
    fn comparisons_say_what_is_significant() {
        let (more, less) = (
            run("new", [11.0, 21.0, 31.0]),
            run("old", [10.0, 20.0, 30.0]),
        );
        let comparison = Comparison::new(&more, &less).unwrap();
        let page = comparison.page();
        let line = "| CA cm² | 16.0 | 15.0 | 1.00 | 1.00 to 1.00 | better |";
        assert!(page.contains(line), "{page}");
        let value = comparison.json();
        let all = &value["difference"]["all"];
        assert_eq!(all["contact_area_cm2"]["verdict"], "better");
        assert_eq!(all["epsilon"]["verdict"], "no significant difference");
    }
}
