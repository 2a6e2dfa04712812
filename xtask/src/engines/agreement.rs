//! How far engines agree on the same grasps.

use std::fmt::Write;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::OUTSIDE;

/// A grasp holds where the object moves by less than this \[cm\].
const HELD: f64 = 0.5;
/// A difference in displacement that the list of disagreements begins at \[cm\].
const DISAGREEMENT: f64 = 0.5;

/// What one engine found about one grasp.
#[derive(Clone, Debug, PartialEq)]
struct Finding {
    /// With version.
    engine: String,
    /// SD under the protocol's gravity, and the mean over six directions \[cm\].
    displacement: f64,
    mean6: f64,
    /// Of the shake test's six forces.
    withstood: f64,
}

/// One grasp, judged by every engine.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Judged {
    object: String,
    hand: String,
    quality: String,
    pub(crate) index: u64,
    /// Deepest penetration \[mm\].
    depth: f64,
    findings: Vec<Finding>,
}

impl Judged {
    pub(crate) fn new(object: &str, hand: &str, quality: &str, index: u64) -> Self {
        Self {
            object: object.into(),
            hand: hand.into(),
            quality: quality.into(),
            index,
            depth: f64::NAN,
            findings: Vec::new(),
        }
    }

    /// Takes in the metrics that an engine gave.
    pub(crate) fn add(&mut self, engine: &str, metrics: &Value) -> Result<()> {
        let number = |name: &str| {
            let value = metrics[name].as_f64();
            value.with_context(|| format!("{engine} gives no {name}"))
        };
        self.depth = number("max_penetration_mm")?;
        self.findings.push(Finding {
            engine: metrics["sim_engine"].as_str().unwrap_or(engine).into(),
            displacement: number("sim_displacement_cm")?,
            mean6: number("sim_displacement_mean6_cm")?,
            withstood: number("shake_withstood")?,
        });
        Ok(())
    }

    pub(crate) fn json(&self) -> Value {
        let findings = self.findings.iter().map(|finding| {
            json!({
                "engine": finding.engine,
                "sim_displacement_cm": finding.displacement,
                "sim_displacement_mean6_cm": finding.mean6,
                "shake_withstood": finding.withstood,
            })
        });
        json!({
            "object": self.object, "hand": self.hand, "quality": self.quality, "index": self.index,
            "max_penetration_mm": self.depth,
            "engines": findings.collect::<Vec<_>>(),
        })
    }

    fn label(&self) -> String {
        format!(
            "{} {} {} #{}",
            self.object, self.hand, self.quality, self.index
        )
    }
}

/// One measure of a finding.
type Measure = fn(&Finding) -> f64;
const MEASURES: [(&str, Measure); 3] = [
    ("SD", |finding| finding.displacement),
    ("SD, mean of six directions", |finding| finding.mean6),
    ("forces withstood", |finding| finding.withstood),
];

/// Tables: what each engine says of each quality, rank correlations, how often they agree that a grasp holds, and
/// where they do not.
pub(crate) fn document(judged: &[Judged]) -> String {
    let mut text = String::new();
    let engines: Vec<&str> = judged.first().map_or_else(Vec::new, |grasp| {
        let names = grasp.findings.iter().map(|f| f.engine.as_str());
        names.collect()
    });
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    line(format!(
        "{} grasps; {}.\n",
        judged.len(),
        engines.join(", ")
    ));
    line(format!(
        "| quality | engine | holds (SD < {HELD} cm) | SD, mean cm | SD6, mean cm | forces withstood, mean |"
    ));
    line("|---|---|---|---|---|---|".into());
    let mut qualities: Vec<&str> = Vec::new();
    for grasp in judged {
        if !qualities.contains(&grasp.quality.as_str()) {
            qualities.push(&grasp.quality);
        }
    }
    for quality in &qualities {
        let of: Vec<_> = judged.iter().filter(|g| g.quality == *quality).collect();
        for (at, engine) in engines.iter().enumerate() {
            let mean = |measure: Measure| {
                let sum: f64 = of.iter().map(|g| measure(&g.findings[at])).sum();
                sum / of.len() as f64
            };
            let held = of.iter().filter(|g| g.findings[at].displacement < HELD);
            line(format!(
                "| {quality} | {engine} | {} of {} | {:.2} | {:.2} | {:.2} |",
                held.count(),
                of.len(),
                mean(MEASURES[0].1),
                mean(MEASURES[1].1),
                mean(MEASURES[2].1)
            ));
        }
    }
    line("\n| engines | Spearman, SD | Spearman, SD6 | Spearman, forces | agree that it holds | median difference of SD, cm |".into());
    line("|---|---|---|---|---|---|".into());
    for (a, b) in pairs(engines.len()) {
        let correlation = |measure: Measure| {
            let of = |at: usize| -> Vec<f64> {
                judged.iter().map(|g| measure(&g.findings[at])).collect()
            };
            spearman(&of(a), &of(b)).map_or_else(|| "-".into(), |r| format!("{r:.2}"))
        };
        let holds = |g: &Judged, at: usize| g.findings[at].displacement < HELD;
        let agree = judged.iter().filter(|g| holds(g, a) == holds(g, b));
        let mut differences: Vec<f64> = judged
            .iter()
            .map(|g| (g.findings[a].displacement - g.findings[b].displacement).abs())
            .collect();
        differences.sort_by(f64::total_cmp);
        line(format!(
            "| {}, {} | {} | {} | {} | {} of {} | {:.3} |",
            engines[a],
            engines[b],
            correlation(MEASURES[0].1),
            correlation(MEASURES[1].1),
            correlation(MEASURES[2].1),
            agree.count(),
            judged.len(),
            differences.get(differences.len() / 2).unwrap_or(&f64::NAN)
        ));
    }
    line(format!(
        "\nGrasps whose SD differs by over {DISAGREEMENT} cm between two engines:\n"
    ));
    line(format!("| grasp | deepest, mm | {} |", engines.join(" | ")));
    line(format!("|---|---|{}", "---|".repeat(engines.len())));
    for grasp in judged {
        let of = grasp.findings.iter().map(|f| f.displacement);
        let (low, high) = (of.clone().fold(f64::MAX, f64::min), of.fold(0.0, f64::max));
        if high - low > DISAGREEMENT {
            let cells = grasp.findings.iter().map(|f| {
                format!(
                    "{:.2} cm (six: {:.2}), {:.0}/6",
                    f.displacement, f.mean6, f.withstood
                )
            });
            let cells: Vec<_> = cells.collect();
            line(format!(
                "| {} | {:.1} | {} |",
                grasp.label(),
                grasp.depth,
                cells.join(" | ")
            ));
        }
    }
    text
}

fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    debug_assert!(count <= OUTSIDE.len() + 1);
    (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
}

/// Ranks from 1; what is equal shares the mean of its ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let same = order[first..].iter();
        let count = same
            .take_while(|&&i| values[i] == values[order[first]])
            .count();
        for &index in &order[first..first + count] {
            ranks[index] = first as f64 + 0.5 * (count + 1) as f64;
        }
        first += count;
    }
    ranks
}

/// Spearman's rank correlation; `None` where one of the two does not vary.
fn spearman(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (ranks(a), ranks(b));
    let mean = 0.5 * (a.len() + 1) as f64;
    let product = |x: &[f64], y: &[f64]| -> f64 {
        let terms = x.iter().zip(y).map(|(x, y)| (x - mean) * (y - mean));
        terms.sum()
    };
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    (scale > 0.0).then(|| product(&a, &b) / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlations_share_ranks_among_equals() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 0.5]), [3.5, 2.0, 3.5, 1.0]);
        let rising = [1.0, 2.0, 5.0, 9.0];
        assert_eq!(spearman(&rising, &[0.1, 0.2, 0.3, 4.0]), Some(1.0));
        assert_eq!(spearman(&rising, &[4.0, 3.0, 2.0, 1.0]), Some(-1.0));
        assert_eq!(spearman(&rising, &[1.0; 4]), None);
        // 1 - 6 sum d^2 / (n (n^2 - 1)) without ties.
        let r = spearman(&rising, &[2.0, 1.0, 3.0, 4.0]).unwrap_or(f64::NAN);
        assert!((r - 0.8).abs() < 1e-12, "{r}");
    }

    #[test]
    fn tables_tell_of_grasps_that_engines_disagree_about() {
        let mut grasps = Vec::new();
        for (index, other) in [(0, 0.01), (1, 9.0)] {
            let mut grasp = Judged::new("mug", "human", "good", index);
            for (engine, displacement) in [("rapier", 0.02), ("pybullet", other)] {
                let metrics = json!({"max_penetration_mm": 0.4, "sim_engine": engine,
                    "sim_displacement_cm": displacement, "sim_displacement_mean6_cm": 0.1,
                    "shake_withstood": 6});
                grasp.add(engine, &metrics).unwrap();
            }
            grasps.push(grasp);
        }
        let text = document(&grasps);
        assert!(text.contains("| good | pybullet | 1 of 2 |"), "{text}");
        assert!(
            text.contains("| rapier, pybullet | - | - | - | 1 of 2 |"),
            "{text}"
        );
        assert!(
            text.contains("mug human good #1") && !text.contains("#0"),
            "{text}"
        );
        assert!(grasps[0].add("mujoco", &json!({})).is_err());
    }
}
