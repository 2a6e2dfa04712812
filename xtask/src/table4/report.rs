//! The table, as text, JSON and a page.

use anyhow::{Context, Result};
use serde_json::{Value, json};

/// CA \[cm^2\], IV \[cm^3\], CA/IV \[1/cm\] and SD \[cm\] of the paper's Table 4 (supplementary material, appendix D).
const PAPER_TRUTH: [f64; 4] = [42.6, 2.83, 15.1, 0.41];
const PAPER_RGBD: [f64; 4] = [25.46, 7.82, 3.26, 5.68];

/// Means over the two grasps of least displacement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Means {
    pub(super) area_cm2: f64,
    /// The number of voxels of the hand's surface inside the object, each as 1 mm^2.
    pub(super) counted_area_cm2: f64,
    pub(super) volume_cm3: f64,
    pub(super) displacement_cm: f64,
}

impl Means {
    /// From the `top_2` of a summary.
    pub(super) fn of(value: &Value) -> Result<Self> {
        let number = |key: &str| {
            value[key]
                .as_f64()
                .with_context(|| format!("the summary has no {key}"))
        };
        Ok(Self {
            area_cm2: number("contact_area_cm2")?,
            counted_area_cm2: number("contact_area_voxel_count_cm2")?,
            volume_cm3: number("interpenetration_volume_cm3")?,
            displacement_cm: number("sim_displacement_cm")?,
        })
    }

    fn to_json(self) -> Value {
        json!({
            "contact_area_cm2": self.area_cm2,
            "contact_area_voxel_count_cm2": self.counted_area_cm2,
            "interpenetration_volume_cm3": self.volume_cm3,
            "sim_displacement_cm": self.displacement_cm,
        })
    }

    /// Over objects.
    fn over(all: impl Iterator<Item = Self> + Clone) -> Self {
        let count = all.clone().count().max(1) as f64;
        let mean = |pick: fn(Self) -> f64| all.clone().map(pick).sum::<f64>() / count;
        Self {
            area_cm2: mean(|m| m.area_cm2),
            counted_area_cm2: mean(|m| m.counted_area_cm2),
            volume_cm3: mean(|m| m.volume_cm3),
            displacement_cm: mean(|m| m.displacement_cm),
        }
    }

    /// CA, IV, CA/IV, SD: the third is the ratio of means, as in the paper.
    fn columns(&self) -> [f64; 4] {
        self.columns_with(self.area_cm2)
    }

    /// The same with contact area as the paper counts it.
    fn counted_columns(&self) -> [f64; 4] {
        self.columns_with(self.counted_area_cm2)
    }

    fn columns_with(&self, area: f64) -> [f64; 4] {
        let ratio = area / self.volume_cm3;
        [area, self.volume_cm3, ratio, self.displacement_cm]
    }
}

/// One object's results.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ObjectRow {
    pub(super) name: String,
    pub(super) note: Option<String>,
    pub(super) is_rendered: bool,
    pub(super) views: usize,
    pub(super) truth: Means,
    pub(super) rgbd: Means,
    /// Wall time, from the capture to the judgement.
    pub(super) seconds: f64,
}

impl ObjectRow {
    pub(super) fn line(&self) -> String {
        format!(
            "   true mesh: {}\n   RGB-D:     {}\n   {:.0} s",
            words(&self.truth),
            words(&self.rgbd),
            self.seconds
        )
    }

    /// As it is kept between runs.
    pub(super) fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "note": self.note,
            "is_rendered": self.is_rendered,
            "views": self.views,
            "truth": self.truth.to_json(),
            "rgbd": self.rgbd.to_json(),
            "seconds": self.seconds,
        })
    }

    /// From what was kept.
    pub(super) fn from_json(value: &Value) -> Result<Self> {
        let lacks = |key: &str| format!("no {key} in the results kept");
        Ok(Self {
            name: (value["name"].as_str())
                .with_context(|| lacks("name"))?
                .to_owned(),
            note: value["note"].as_str().map(str::to_owned),
            is_rendered: (value["is_rendered"].as_bool()).with_context(|| lacks("is_rendered"))?,
            views: value["views"].as_u64().with_context(|| lacks("views"))? as usize,
            truth: Means::of(&value["truth"])?,
            rgbd: Means::of(&value["rgbd"])?,
            seconds: (value["seconds"].as_f64()).with_context(|| lacks("seconds"))?,
        })
    }

    fn capture(&self) -> String {
        let kind = if self.is_rendered { "rendered" } else { "real" };
        format!("{kind}, {} views", self.views)
    }
}

fn words(means: &Means) -> String {
    let [area, volume, ratio, displacement] = cells(&means.columns());
    format!("CA {area} cm2, IV {volume} cm3, CA/IV {ratio} /cm, SD {displacement} cm")
}

fn cells(columns: &[f64; 4]) -> [String; 4] {
    columns.map(|x| {
        if x.is_finite() {
            format!("{x:.2}")
        } else {
            "-".into()
        }
    })
}

/// The rows of the paper's table, ours beside theirs.
fn compared(rows: &[ObjectRow]) -> [(&'static str, [f64; 4]); 6] {
    let truth = Means::over(rows.iter().map(|row| row.truth));
    let rgbd = Means::over(rows.iter().map(|row| row.rgbd));
    [
        ("true mesh, here", truth.columns()),
        ("the same, CA by voxel count", truth.counted_columns()),
        ("true mesh, paper", PAPER_TRUTH),
        ("RGB-D, here", rgbd.columns()),
        ("the same, CA by voxel count", rgbd.counted_columns()),
        ("RGB-D, paper", PAPER_RGBD),
    ]
}

/// The table for a terminal.
pub(super) fn table(rows: &[ObjectRow]) -> String {
    let mut text = format!(
        "{:28} {:>8} {:>8} {:>8} {:>8}\n",
        "", "CA cm2", "IV cm3", "CA/IV", "SD cm"
    );
    for (name, columns) in compared(rows) {
        let [area, volume, ratio, displacement] = cells(&columns);
        text += &format!("{name:28} {area:>8} {volume:>8} {ratio:>8} {displacement:>8}\n");
    }
    text
}

/// Everything, for programs.
pub(super) fn json(rows: &[ObjectRow], starts: usize) -> Value {
    let columns = |columns: [f64; 4]| {
        let [area, volume, ratio, displacement] = columns;
        json!({"CA": area, "IV": volume, "CA/IV": ratio, "SD": displacement})
    };
    let objects: Vec<Value> = (rows.iter())
        .map(|row| {
            json!({
                "object": row.name,
                "note": row.note,
                "capture": if row.is_rendered { "rendered" } else { "real" },
                "views": row.views,
                "seconds": row.seconds,
                "GT-Mesh": columns(row.truth.columns()),
                "RGB-D": columns(row.rgbd.columns()),
            })
        })
        .collect();
    let [
        truth,
        counted_truth,
        paper_truth,
        rgbd,
        counted_rgbd,
        paper_rgbd,
    ] = compared(rows).map(|(_, row)| columns(row));
    json!({
        "schema": "graspd.table4/1",
        "units": {"CA": "cm^2", "IV": "cm^3", "CA/IV": "1/cm", "SD": "cm"},
        "starts": starts,
        "ours": {"GT-Mesh": truth, "RGB-D": rgbd},
        "ours_by_voxel_count": {"GT-Mesh": counted_truth, "RGB-D": counted_rgbd},
        "paper": {"GT-Mesh": paper_truth, "RGB-D": paper_rgbd},
        "objects": objects,
    })
}

/// The page, with a picture of the best grasp for each object and row.
pub(super) fn document(rows: &[ObjectRow], starts: usize, is_quick: bool) -> String {
    let rendered = rows.iter().filter(|row| row.is_rendered).count();
    let command = if is_quick { " --quick" } else { "" };
    let mut text = format!(
        "# Grasps from depth images (the paper's Table 4)\n\n\
         Written by `cargo xtask reproduce-table4{command}`: {starts} grasps each of {} objects with the human hand, optimised on \
         the true mesh and on a\nmesh reconstructed from a capture ({rendered} rendered, {} real), both judged on the true mesh; \
         means over the two of least simulation\ndisplacement (SD). CA: contact area, IV: interpenetration volume; \
         CA/IV is the ratio of the means. The paper's contact area\nis, as \
         we read its appendix A.6, the number of 1 mm voxels of the hand's surface inside the object, each counted as 1 mm²; this is given beside the true area. How captures are made and read: [rgbd.md](rgbd.md).\n\n\
         The paper grasps with MANO, whose licence does not allow to ship it; the hand here is the built-in one. Its judge is another program: \
         figures of the\ntwo can be compared in kind and not to the digit.\n\n\
         | | CA [cm²] | IV [cm³] | CA/IV [1/cm] | SD [cm] |\n|---|---|---|---|---|\n",
        rows.len(),
        rows.len() - rendered,
    );
    for (name, columns) in compared(rows) {
        text += &format!("| {name} | {} |\n", cells(&columns).join(" | "));
    }
    text += "\n| object | capture | CA, true mesh | IV | SD | CA, RGB-D | IV | SD |\n|---|---|---|---|---|---|---|---|\n";
    for row in rows {
        let [area, volume, _, displacement] = cells(&row.truth.columns());
        let [area_2, volume_2, _, displacement_2] = cells(&row.rgbd.columns());
        let note = row
            .note
            .as_ref()
            .map_or_else(String::new, |n| format!(" ({n})"));
        text += &format!(
            "| {}{note} | {} | {area} | {volume} | {displacement} | {area_2} | {volume_2} | {displacement_2} |\n",
            row.name,
            row.capture(),
        );
    }
    text += "\nThe best grasp of each row, as optimised: on the true mesh, and on the reconstruction.\n";
    for row in rows {
        text += &format!(
            "\n{0}\n\n![on the true mesh](pictures/table4-{0}-truth.png)\n![on the reconstruction](pictures/table4-{0}-rgbd.png)\n",
            row.name
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, area: f64) -> ObjectRow {
        let means = Means {
            area_cm2: area,
            counted_area_cm2: 1.5 * area,
            volume_cm3: 2.0,
            displacement_cm: 0.5,
        };
        ObjectRow {
            name: name.into(),
            note: None,
            is_rendered: true,
            views: 15,
            truth: means,
            rgbd: Means {
                displacement_cm: 1.5,
                ..means
            },
            seconds: 60.0,
        }
    }

    #[test]
    fn means_are_over_objects_and_the_ratio_is_that_of_means() {
        let rows = [row("a", 10.0), row("b", 30.0)];
        let value = json(&rows, 10);
        assert_eq!(value["ours"]["GT-Mesh"]["CA"], 20.0);
        assert_eq!(value["ours"]["GT-Mesh"]["CA/IV"], 10.0);
        assert_eq!(value["ours"]["RGB-D"]["SD"], 1.5);
        assert_eq!(value["paper"]["RGB-D"]["SD"], 5.68);
        assert_eq!(value["objects"][1]["object"], "b");
        let text = table(&rows);
        assert_eq!(text.lines().count(), 7);
        assert_eq!(value["ours_by_voxel_count"]["RGB-D"]["CA"], 30.0);
        assert!(
            text.contains("RGB-D, here                     20.00     2.00    10.00     1.50"),
            "{text}"
        );
        let page = document(&rows, 10, false);
        assert!(
            page.contains("| RGB-D, paper | 25.46 | 7.82 | 3.26 | 5.68 |"),
            "{page}"
        );
        assert!(page.contains("pictures/table4-b-rgbd.png"));
    }

    #[test]
    fn a_summary_without_metrics_is_an_error() {
        let whole = json!({"contact_area_cm2": 1.0, "contact_area_voxel_count_cm2": 1.4, "interpenetration_volume_cm3": 2.0, "sim_displacement_cm": 3.0});
        assert_eq!(Means::of(&whole).unwrap().displacement_cm, 3.0);
        assert!(Means::of(&json!({"contact_area_cm2": null})).is_err());
    }
}
