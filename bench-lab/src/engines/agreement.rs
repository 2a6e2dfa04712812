//! How far engines agree on the same grasps.

use std::fmt::Write;

use anyhow::{Context, Result};
use graspd_eval::{GraspMetrics, HOLDS_BELOW_CM};
use serde::Serialize;

/// A difference in displacement that the list of disagreements begins at \[cm\].
const DISAGREEMENT: f64 = 0.5;

/// What one engine found about one grasp.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Finding {
    /// With version.
    engine: String,
    /// SD under the protocol's gravity \[cm\].
    sim_displacement_cm: f64,
    /// The mean over six directions of gravity \[cm\].
    sim_displacement_mean6_cm: f64,
    /// How many of the shake test's six forces.
    shake_withstood: f64,
}

/// One grasp, judged by every engine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Judged {
    object: String,
    hand: String,
    quality: String,
    pub(super) index: usize,
    /// Deepest penetration \[mm\].
    max_penetration_mm: f64,
    #[serde(rename = "engines")]
    findings: Vec<Finding>,
}

impl Judged {
    pub(super) fn new(object: &str, hand: &str, quality: &str, index: usize) -> Self {
        Self {
            object: object.into(),
            hand: hand.into(),
            quality: quality.into(),
            index,
            max_penetration_mm: f64::NAN,
            findings: Vec::new(),
        }
    }

    /// Adds the metrics that an engine gave.
    pub(super) fn add(&mut self, engine: &str, metrics: &GraspMetrics) -> Result<()> {
        let lacks = |name: &str| format!("{engine} gives no {name}");
        let withstood = metrics
            .shake_withstood
            .with_context(|| lacks("shake_withstood"))?;
        self.max_penetration_mm = metrics
            .max_penetration_mm
            .with_context(|| lacks("max_penetration_mm"))?;
        self.findings.push(Finding {
            engine: metrics.sim_engine.as_deref().unwrap_or(engine).to_owned(),
            sim_displacement_cm: (metrics.sim_displacement_cm)
                .with_context(|| lacks("sim_displacement_cm"))?,
            sim_displacement_mean6_cm: (metrics.sim_displacement_mean6_cm)
                .with_context(|| lacks("sim_displacement_mean6_cm"))?,
            shake_withstood: withstood as f64,
        });
        Ok(())
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
    ("SD", |finding| finding.sim_displacement_cm),
    ("SD, mean of six directions", |finding| {
        finding.sim_displacement_mean6_cm
    }),
    ("forces withstood", |finding| finding.shake_withstood),
];

/// Tables: what each engine says of each quality, rank correlations, how often they agree that a grasp holds, and
/// where they do not.
pub(super) fn document(judged: &[Judged]) -> String {
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
        "| quality | engine | holds (SD < {HOLDS_BELOW_CM} cm) | SD, mean cm | SD6, mean cm | forces withstood, mean |"
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
            let held = of
                .iter()
                .filter(|g| g.findings[at].sim_displacement_cm < HOLDS_BELOW_CM);
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
    line(
        "\n| engines | Spearman, SD | Spearman, SD6 | Spearman, forces | agree that it holds \
         | median difference of SD, cm |"
            .into(),
    );
    line("|---|---|---|---|---|---|".into());
    for (a, b) in pairs(engines.len()) {
        let correlation = |measure: Measure| {
            let of = |at: usize| -> Vec<f64> {
                judged.iter().map(|g| measure(&g.findings[at])).collect()
            };
            spearman(&of(a), &of(b)).map_or_else(|| "-".into(), |r| format!("{r:.2}"))
        };
        let holds = |g: &Judged, at: usize| g.findings[at].sim_displacement_cm < HOLDS_BELOW_CM;
        let agree = judged.iter().filter(|g| holds(g, a) == holds(g, b));
        let mut differences: Vec<f64> = judged
            .iter()
            .map(|g| (g.findings[a].sim_displacement_cm - g.findings[b].sim_displacement_cm).abs())
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
        let of = grasp.findings.iter().map(|f| f.sim_displacement_cm);
        let (low, high) = (of.clone().fold(f64::MAX, f64::min), of.fold(0.0, f64::max));
        if high - low > DISAGREEMENT {
            let cells = grasp.findings.iter().map(|f| {
                format!(
                    "{:.2} cm (six: {:.2}), {:.0}/6",
                    f.sim_displacement_cm, f.sim_displacement_mean6_cm, f.shake_withstood
                )
            });
            let cells: Vec<_> = cells.collect();
            line(format!(
                "| {} | {:.1} | {} |",
                grasp.label(),
                grasp.max_penetration_mm,
                cells.join(" | ")
            ));
        }
    }
    text
}

fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
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
                let metrics = GraspMetrics {
                    max_penetration_mm: Some(0.4),
                    sim_engine: Some(engine.to_owned()),
                    sim_displacement_cm: Some(displacement),
                    sim_displacement_mean6_cm: Some(0.1),
                    shake_withstood: Some(6),
                    ..GraspMetrics::default()
                };
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
        assert!(grasps[0].add("mujoco", &GraspMetrics::default()).is_err());
    }
}
