//! The table, as text, JSON and a page.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// CA \[cm^2\], IV \[cm^3\], CA/IV \[1/cm\] and SD \[cm\] of the paper's Table 4 (supplementary material, appendix D).
const PAPER_TRUTH: [f64; 4] = [42.6, 2.83, 15.1, 0.41];
const PAPER_RGBD: [f64; 4] = [25.46, 7.82, 3.26, 5.68];

/// Means over the two grasps of least displacement, as `top_2` of a summary has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Means {
    #[serde(rename = "contact_area_cm2")]
    area_cm2: f64,
    /// The number of 1 mm voxels of the hand's surface inside the object, each as 1 mm^2.
    #[serde(rename = "contact_area_voxel_count_cm2")]
    counted_area_cm2: f64,
    #[serde(rename = "interpenetration_volume_cm3")]
    volume_cm3: f64,
    #[serde(rename = "sim_displacement_cm")]
    displacement_cm: f64,
}

impl Means {
    /// Averages over objects.
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

    /// Returns CA, IV, CA/IV and SD; the third is the ratio of the means, as in the paper.
    fn columns(&self) -> [f64; 4] {
        self.columns_with(self.area_cm2)
    }

    /// Returns the same with contact area as the paper counts it.
    fn counted_columns(&self) -> [f64; 4] {
        self.columns_with(self.counted_area_cm2)
    }

    fn columns_with(&self, area: f64) -> [f64; 4] {
        let ratio = area / self.volume_cm3;
        [area, self.volume_cm3, ratio, self.displacement_cm]
    }
}

/// One object's results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

    fn kind(&self) -> &'static str {
        if self.is_rendered { "rendered" } else { "real" }
    }

    fn capture(&self) -> String {
        format!("{}, {} views", self.kind(), self.views)
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

/// Returns the table for programs, `table4.json`.
pub(super) fn json(rows: &[ObjectRow], starts: usize) -> Value {
    let columns = |columns: [f64; 4]| {
        let [area, volume, ratio, displacement] = columns;
        json!({"CA": area, "IV": volume, "CA/IV": ratio, "SD": displacement})
    };
    let pair = |truth, rgbd| json!({"GT-Mesh": columns(truth), "RGB-D": columns(rgbd)});
    let objects = rows.iter().map(|row| {
        let mut object = pair(row.truth.columns(), row.rgbd.columns());
        object["object"] = json!(row.name);
        object["note"] = json!(row.note);
        object["capture"] = json!(row.kind());
        object["views"] = json!(row.views);
        object["seconds"] = json!(row.seconds);
        object
    });
    let [truth, counted_truth, _, rgbd, counted_rgbd, _] = compared(rows).map(|(_, row)| row);
    json!({
        "schema": "graspd.table4/1",
        "units": {"CA": "cm^2", "IV": "cm^3", "CA/IV": "1/cm", "SD": "cm"},
        "starts": starts,
        "ours": pair(truth, rgbd),
        "ours_by_voxel_count": pair(counted_truth, counted_rgbd),
        "paper": pair(PAPER_TRUTH, PAPER_RGBD),
        "objects": objects.collect::<Vec<_>>(),
    })
}

/// The page, with a picture of the best grasp for each object and row.
pub(super) fn document(rows: &[ObjectRow], starts: usize, is_quick: bool) -> String {
    let rendered = rows.iter().filter(|row| row.is_rendered).count();
    let command = if is_quick { " --quick" } else { "" };
    let mut text = format!(
        "# Grasps from depth images (the paper's Table 4)\n\n\
         Written by `cargo xtask reproduce-table4{command}`: {starts} grasps of each of {} objects with the built-in \
         human hand,\noptimised on the true mesh and on a mesh reconstructed from a capture ({rendered} rendered, {} \
         real), both judged on the\ntrue mesh. Means over the two grasps of least simulation displacement (SD). CA: \
         contact area, IV: interpenetration\nvolume; CA/IV is the ratio of the means. How captures are made and read: \
         [docs/rgbd.md](../docs/rgbd.md).\n\n\
         The figures compare with the paper's in kind and not to the digit: it uses MANO and another judge. As we \
         read its\nappendix A.6, its contact area is the number of 1 mm voxels of the hand's surface inside the \
         object, each counted as\n1 mm²; the table gives this beside the true area.\n\n\
         | | CA [cm²] | IV [cm³] | CA/IV [1/cm] | SD [cm] |\n|---|---|---|---|---|\n",
        rows.len(),
        rows.len() - rendered,
    );
    for (name, columns) in compared(rows) {
        text += &format!("| {name} | {} |\n", cells(&columns).join(" | "));
    }
    text += "\n| object | capture | CA, true mesh | IV | SD | CA, RGB-D | IV | SD |\n";
    text += "|---|---|---|---|---|---|---|---|\n";
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
            "\n{0}\n\n![on the true mesh](pictures/table4-{0}-truth.png)\n\
             ![on the reconstruction](pictures/table4-{0}-rgbd.png)\n",
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
        let mut summary = json!({
            "grasps": 2, "epsilon": 0.5, "contact_area_cm2": 1.0, "contact_area_voxel_count_cm2": 1.4,
            "interpenetration_volume_cm3": 2.0, "sim_displacement_cm": 3.0,
        });
        let means = |summary: &Value| serde_json::from_value::<Means>(summary.clone());
        assert_eq!(means(&summary).unwrap().displacement_cm, 3.0);
        summary["contact_area_cm2"] = Value::Null;
        assert!(means(&summary).is_err());
    }
}
