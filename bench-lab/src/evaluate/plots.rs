//! `plot`: runs of `evaluate` as pictures: contact against penetration, displacements, quality against time.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::metrics::{COLUMNS, Column};
use super::read_evaluation;
use super::report::Evaluation;
use super::summary::{SELECTIONS, estimate};

/// One colour for each run; told apart in grey and by most who are colour-blind.
///
/// # Source
/// M. Okabe, K. Ito, "Color universal design", 2008.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];
const SIZE: (u32, u32) = (720, 440);
/// Displacements below this are drawn there \[cm\]: the axis is logarithmic.
const MIN_DISPLACEMENT: f64 = 0.005;
/// The object falls about this far when nothing holds it \[cm\].
const LARGEST_DISPLACEMENT: f64 = 20.0;
/// What the paper reports on true meshes: CA \[cm^2\], IV \[cm^3\], SD \[cm\].
///
/// # Source
/// Grasp'D (ECCV 2022), supplementary, table 4.
const PAPER: [f64; 3] = [42.6, 2.83, 0.41];

type Chart<'a, X, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>;

/// Draws the runs' results into `folder`: `contact.svg`, `displacement.svg` and `time.svg`.
pub(crate) fn plot(runs: &[PathBuf], folder: &Path) -> Result<()> {
    let runs = (runs.iter().map(|run| read_evaluation(run))).collect::<Result<Vec<_>>>()?;
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for (name, draw) in [
        (
            "contact",
            contact as fn(&Canvas<'_>, &[Evaluation]) -> Result<()>,
        ),
        ("displacement", displacement),
        ("time", time),
    ] {
        let path: PathBuf = folder.join(format!("{name}.svg"));
        let mut picture = String::new();
        {
            let canvas = SVGBackend::with_string(&mut picture, SIZE).into_drawing_area();
            drawn(canvas.fill(&WHITE))?;
            draw(&canvas, &runs)?;
            drawn(canvas.present())?;
        }
        fs::write(&path, picture).with_context(|| format!("cannot write {}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The backend's errors hold what is not `Sync`.
fn drawn<T, E: std::fmt::Display>(result: Result<T, E>) -> Result<T> {
    result.map_err(|error| anyhow!("cannot draw: {error}"))
}

/// CA against IV of every grasp; the best two of each object are filled.
fn contact(canvas: &Canvas<'_>, runs: &[Evaluation]) -> Result<()> {
    let column = column("ca_over_iv")?;
    let points = |run: &Evaluation, best: Option<usize>| -> Vec<(f64, f64)> {
        (run.objects.iter())
            .flat_map(|object| object.best(best.unwrap_or(usize::MAX)))
            .map(|grasp| {
                let [area, volume] = grasp.terms(column);
                (volume, area)
            })
            .collect()
    };
    let all: Vec<_> = runs.iter().flat_map(|run| points(run, None)).collect();
    let most =
        |of: fn(&(f64, f64)) -> f64, least: f64| 1.05 * all.iter().map(of).fold(least, f64::max);
    let axes = (0.0..most(|p| p.0, PAPER[1]), 0.0..most(|p| p.1, PAPER[0]));
    let mut chart = chart(
        canvas,
        ["interpenetration volume [cm³]", "contact area [cm²]"],
        axes,
    )?;
    for (run, colour) in runs.iter().zip(COLOURS.iter().cycle()) {
        let hollow = points(run, None).into_iter();
        drawn(chart.draw_series(hollow.map(|p| Circle::new(p, 3, colour.mix(0.5)))))?;
        let filled = points(run, Some(2)).into_iter();
        drawn(chart.draw_series(filled.map(|p| Circle::new(p, 3, colour.filled()))))?
            .label(&run.title)
            .legend(|(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
    }
    let paper = [(PAPER[1], PAPER[0])].into_iter();
    drawn(chart.draw_series(paper.map(|p| Cross::new(p, 6, BLACK.stroke_width(2)))))?
        .label("the paper's mean (voxels counted)")
        .legend(|(x, y)| Cross::new((x + 10, y), 5, BLACK.stroke_width(2)));
    legend(&mut chart, SeriesLabelPosition::LowerRight)
}

/// The share of all grasps that move less than so far.
fn displacement(canvas: &Canvas<'_>, runs: &[Evaluation]) -> Result<()> {
    let axes = (
        (MIN_DISPLACEMENT..LARGEST_DISPLACEMENT).log_scale(),
        0.0..100.0,
    );
    let mut chart = chart(
        canvas,
        [
            "simulation displacement [cm]",
            "share of grasps that move less [%]",
        ],
        axes,
    )?;
    let column = column("sim_displacement_cm")?;
    for (run, colour) in runs.iter().zip(COLOURS.iter().cycle()) {
        let mut values: Vec<f64> = (run.objects.iter())
            .flat_map(|object| &object.grasps)
            .map(|grasp| grasp.terms(column)[0])
            .map(|value| value.clamp(MIN_DISPLACEMENT, LARGEST_DISPLACEMENT))
            .collect();
        values.sort_by(f64::total_cmp);
        let share = |count: usize| 100.0 * count as f64 / values.len() as f64;
        let mut line = vec![(MIN_DISPLACEMENT, 0.0)];
        for (count, &value) in values.iter().enumerate() {
            line.extend([(value, share(count)), (value, share(count + 1))]);
        }
        line.push((LARGEST_DISPLACEMENT, 100.0));
        drawn(chart.draw_series(LineSeries::new(line, colour.stroke_width(2))))?
            .label(&run.title)
            .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    }
    legend(&mut chart, SeriesLabelPosition::LowerRight)
}

/// Contact area of the best two of each object against the time that a grasp takes. (CA/IV would favour hands that
/// hardly touch.)
fn time(canvas: &Canvas<'_>, runs: &[Evaluation]) -> Result<()> {
    let best_two = SELECTIONS[0];
    let every = SELECTIONS[SELECTIONS.len() - 1];
    let (seconds, quality) = (column("synthesis_seconds")?, column("contact_area_cm2")?);
    let points: Vec<(f64, f64)> = (runs.iter())
        .map(|run| {
            let seconds = estimate(&run.objects, every, seconds).value;
            let quality = estimate(&run.objects, best_two, quality).value;
            (seconds, quality)
        })
        .collect();
    let times = points.iter().map(|p| p.0);
    let least = times.clone().fold(f64::MAX, f64::min);
    let most = times.fold(f64::MIN_POSITIVE, f64::max);
    let best = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let axes = ((0.5 * least..3.0 * most).log_scale(), 0.0..1.1 * best);
    let mut chart = chart(
        canvas,
        [
            "seconds of one core a grasp, without judging",
            "contact area of the best two of each object [cm²]",
        ],
        axes,
    )?;
    for ((run, &point), colour) in runs.iter().zip(&points).zip(COLOURS.iter().cycle()) {
        drawn(chart.draw_series([Circle::new(point, 5, colour.filled())]))?
            .label(&run.title)
            .legend(|(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
    }
    legend(&mut chart, SeriesLabelPosition::UpperRight)
}

fn column(key: &str) -> Result<&'static Column> {
    let mut columns = COLUMNS.iter();
    let found = columns.find(|column| column.key == key);
    found.with_context(|| format!("there is no column {key}"))
}

/// Axes with a grid and their names.
fn chart<'a, X, Y>(
    canvas: &Canvas<'a>,
    titles: [&str; 2],
    (x, y): (X, Y),
) -> Result<Chart<'a, X::CoordDescType, Y::CoordDescType>>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut builder = ChartBuilder::on(canvas);
    builder
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(54);
    let mut chart = drawn(builder.build_cartesian_2d(x, y))?;
    drawn(
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.12))
            .x_desc(titles[0])
            .y_desc(titles[1])
            .axis_desc_style(("sans-serif", 14))
            .label_style(("sans-serif", 12))
            .draw(),
    )?;
    Ok(chart)
}

fn legend<X, Y>(chart: &mut Chart<'_, X, Y>, position: SeriesLabelPosition) -> Result<()>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    drawn(
        chart
            .configure_series_labels()
            .position(position)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 13))
            .draw(),
    )
}

#[cfg(test)]
mod tests {
    use super::super::metrics::ObjectResult;
    use super::super::metrics::tests::grasp;
    use super::super::report::SCHEMA;
    use super::*;
    use crate::command::write_json;

    #[test]
    fn every_run_is_named_in_every_picture() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let runs = [("one", 12.0), ("two", 20.0)].map(|(title, area)| {
            let grasps = vec![grasp(0, area, 0.02), grasp(1, area / 2.0, 3.0)];
            let run = Evaluation {
                schema: SCHEMA.into(),
                title: title.into(),
                command: String::new(),
                objects: vec![ObjectResult::new("can", None, grasps).unwrap()],
            };
            let file = folder.join(format!("{title}.json"));
            write_json(&file, &run.json()).unwrap();
            file
        });
        plot(&runs, folder).unwrap();
        for name in ["contact", "displacement", "time"] {
            let picture = fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
            assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
            for run in ["one", "two"] {
                assert!(picture.contains(run), "{name}");
            }
        }
    }
}
