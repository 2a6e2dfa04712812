//! A histogram as a piece of SVG.

/// Most bins.
const BINS: usize = 24;
const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 120.0;
/// Room for the labels below.
const FOOT: f64 = 18.0;

/// The values in bins from the least to the greatest, with the median marked; nothing for no value.
pub(super) fn histogram(title: &str, unit: &str, values: &[f64]) -> String {
    let mut sorted: Vec<f64> = values
        .iter()
        .copied()
        .filter(|value| value.is_finite())
        .collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(&low), Some(&high)) = (sorted.first(), sorted.last()) else {
        return String::new();
    };
    let median = sorted[sorted.len() / 2];
    let span = if high > low { high - low } else { 1.0 };
    let bins = BINS.min(sorted.len().max(1));
    let mut counts = vec![0usize; bins];
    for value in &sorted {
        let bin = ((value - low) / span * bins as f64) as usize;
        counts[bin.min(bins - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1);
    let width = WIDTH / bins as f64;
    let mut svg = format!(
        "<figure><figcaption>{title}{}</figcaption><svg viewBox=\"0 0 {WIDTH} {}\" role=\"img\">",
        if unit.is_empty() {
            String::new()
        } else {
            format!(" [{unit}]")
        },
        HEIGHT + FOOT
    );
    for (bin, count) in counts.iter().enumerate() {
        let height = HEIGHT * *count as f64 / most as f64;
        let (from, to) = (
            low + span * bin as f64 / bins as f64,
            low + span * (bin + 1) as f64 / bins as f64,
        );
        svg += &format!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{height:.1}\"><title>{count}: {} to \
            {}</title></rect>",
            bin as f64 * width + 0.5,
            HEIGHT - height,
            (width - 1.0).max(0.5),
            short(from),
            short(to)
        );
    }
    let at = WIDTH * (median - low) / span;
    svg += &format!("<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"0\" y2=\"{HEIGHT}\"/>");
    let foot = HEIGHT + FOOT - 4.0;
    svg += &format!("<text x=\"0\" y=\"{foot}\">{}</text>", short(low));
    svg += &format!(
        "<text x=\"{}\" y=\"{foot}\" text-anchor=\"middle\">median {}</text>",
        WIDTH / 2.0,
        short(median)
    );
    svg += &format!(
        "<text x=\"{WIDTH}\" y=\"{foot}\" text-anchor=\"end\">{}</text>",
        short(high)
    );
    svg + "</svg></figure>"
}

/// About three digits.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if size < 1e-3 => format!("{value:.1e}"),
        size if size < 1.0 => format!("{value:.3}"),
        size if size < 100.0 => format!("{value:.2}"),
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_in_a_bar() {
        let values: Vec<f64> = (0..100).map(|k| f64::from(k * k)).collect();
        let svg = histogram("squares", "m", &values);
        let counts = svg.split("<title>").skip(1);
        let total: usize = counts
            .map(|rest| rest.split(':').next().unwrap().parse::<usize>().unwrap())
            .sum();
        assert_eq!(total, 100);
        assert!(
            svg.contains("squares [m]") && svg.contains("median 2500"),
            "{svg}"
        );
    }

    #[test]
    fn few_values_and_none() {
        assert_eq!(histogram("none", "", &[]), "");
        assert_eq!(histogram("none", "", &[f64::NAN]), "");
        for values in [&[3.0][..], &[3.0; 5]] {
            let svg = histogram("same", "", values);
            assert!(svg.contains("median 3.00") && !svg.contains("NaN"), "{svg}");
        }
    }
}
