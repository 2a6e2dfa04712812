//! `bench`: ways of computing a step side by side, as one table.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::steps::{cargo, run};

/// Runs the benchmarks `backends` and `solver` and prints a line for each of their cases; `save` keeps the results
/// under a name, for criterion to compare with later.
pub(crate) fn bench(root: &Path, save: Option<&str>) -> Result<()> {
    let results = root.join("target").join("criterion");
    let start = SystemTime::now();
    let mut command = cargo(
        root,
        "bench --locked -p graspd-tests --bench backends --bench solver --",
    );
    command.env("CRITERION_HOME", &results);
    if let Some(name) = save {
        command.args(["--save-baseline", name]);
    }
    run(&mut command)?;

    let mut lines = Vec::new();
    for file in samples(&results)? {
        // Results of earlier runs, perhaps of cases that no longer exist, lie beside those of this one.
        if fs::metadata(&file)?.modified()? >= start {
            lines.push(line(&file)?);
        }
    }
    lines.sort_by(|a, b| a.0.cmp(&b.0));
    println!("\n{:>12} {:>12}  processor time", "minimum", "median");
    for (name, minimum, median) in lines {
        println!("{:>12} {:>12}  {name}", in_units(minimum), in_units(median));
    }
    Ok(())
}

/// All `new/sample.json` under `folder`.
fn samples(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries =
        fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.ends_with("new") {
            found.push(path.join("sample.json"));
        } else if path.is_dir() {
            found.extend(samples(&path)?);
        }
    }
    Ok(found)
}

/// Name, minimum and median \[ns\] of the case whose samples these are.
fn line(file: &Path) -> Result<(String, f64, f64)> {
    let read = |file: &Path| -> Result<Value> {
        let text =
            fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
        Ok(serde_json::from_str(&text)?)
    };
    let case = read(&file.with_file_name("benchmark.json"))?;
    let name = case["full_id"].as_str().context("a case without a name")?;
    let (minimum, median) = minimum_and_median(&read(file)?)
        .with_context(|| format!("{} has no samples", file.display()))?;
    Ok((name.to_owned(), minimum, median))
}

/// Of the time of one iteration \[ns\].
fn minimum_and_median(sample: &Value) -> Option<(f64, f64)> {
    let numbers = |key: &str| -> Option<Vec<f64>> {
        sample[key].as_array()?.iter().map(Value::as_f64).collect()
    };
    let (times, counts) = (numbers("times")?, numbers("iters")?);
    let mut each: Vec<f64> = times.iter().zip(&counts).map(|(t, n)| t / n).collect();
    each.sort_by(f64::total_cmp);
    Some((*each.first()?, *each.get(each.len() / 2)?))
}

fn in_units(nanoseconds: f64) -> String {
    if nanoseconds < 1e7 {
        format!("{:.1} us", nanoseconds * 1e-3)
    } else {
        format!("{:.3} s", nanoseconds * 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn times_are_those_of_one_iteration() {
        let sample = json!({"iters": [1.0, 2.0, 4.0], "times": [5000.0, 6000.0, 40_000.0]});
        assert_eq!(minimum_and_median(&sample), Some((3000.0, 5000.0)));
        assert_eq!(minimum_and_median(&json!({})), None);
        assert_eq!(in_units(3000.0), "3.0 us");
        assert_eq!(in_units(1.25e9), "1.250 s");
    }
}
