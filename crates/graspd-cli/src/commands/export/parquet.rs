//! One Parquet table of all grasps, a row each.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use graspd::{GraspRecord, write_atomically};
use graspd_eval::{Metric, MetricKind};
use parquet::data_type::{BoolType, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::writer::{
    SerializedColumnWriter, SerializedFileWriter, SerializedRowGroupWriter,
};
use parquet::schema::parser::parse_message_type;

use super::source::GraspSource;

/// Rows that are written together.
const GROUP_ROWS: usize = 20_000;

/// One row: a grasp with its run and its joints in the hand's order.
struct Row {
    run: Option<String>,
    record: GraspRecord,
    joint_names: Vec<String>,
    joints: Vec<f64>,
}

/// How a column is read from a row. Texts, numbers and switches may be null; lists may be empty.
#[derive(Clone, Copy)]
enum Column {
    Text(fn(&Row) -> Option<String>),
    Integer(fn(&Row) -> Option<i64>),
    Number(fn(&Row) -> Option<f64>),
    Switch(fn(&Row) -> Option<bool>),
    Numbers(fn(&Row) -> Vec<f64>),
    Texts(fn(&Row) -> Vec<String>),
    Metric(&'static Metric),
}

use Column::{Integer, Number, Numbers, Switch, Text, Texts};

/// The joints of another posture in the order of `joint_names`.
fn ordered(row: &Row, joints: Option<&std::collections::BTreeMap<String, f64>>) -> Vec<f64> {
    let Some(joints) = joints else {
        return Vec::new();
    };
    row.joint_names
        .iter()
        .filter_map(|name| joints.get(name).copied())
        .collect()
}

/// Name and content of the columns before those of the metrics.
const BEFORE: &[(&str, Column)] = &[
    ("run", Text(|r| r.run.clone())),
    ("object", Text(|r| Some(r.record.object.clone()))),
    ("object_path", Text(|r| r.record.object_path.clone())),
    ("object_scale", Number(|r| Some(r.record.object_scale))),
    ("object_repair", Text(|r| r.record.object_repair.clone())),
    ("hand", Text(|r| Some(r.record.hand.clone()))),
    ("seed", Integer(|r| r.record.seed.map(|seed| seed as i64))),
    ("index", Integer(|r| Some(r.record.index as i64))),
    ("rank", Integer(|r| r.record.rank.map(|rank| rank as i64))),
    (
        "translation_m",
        Numbers(|r| r.record.pose.translation_m.to_vec()),
    ),
    (
        "rotation_wxyz",
        Numbers(|r| r.record.pose.rotation_wxyz.to_vec()),
    ),
    ("joint_names", Texts(|r| r.joint_names.clone())),
    ("joints", Numbers(|r| r.joints.clone())),
    (
        "pre_translation_m",
        Numbers(|r| {
            r.record
                .pre_grasp
                .as_ref()
                .map_or_else(Vec::new, |p| p.pose.translation_m.to_vec())
        }),
    ),
    (
        "pre_rotation_wxyz",
        Numbers(|r| {
            r.record
                .pre_grasp
                .as_ref()
                .map_or_else(Vec::new, |p| p.pose.rotation_wxyz.to_vec())
        }),
    ),
    (
        "pre_joints",
        Numbers(|r| ordered(r, r.record.pre_grasp.as_ref().map(|p| &p.joints_rad))),
    ),
    (
        "squeeze_joints",
        Numbers(|r| ordered(r, r.record.squeeze.as_ref().map(|s| &s.joints_rad))),
    ),
    (
        "squeeze_torques_nm",
        Numbers(|r| {
            ordered(
                r,
                r.record
                    .squeeze
                    .as_ref()
                    .and_then(|s| s.torques_nm.as_ref()),
            )
        }),
    ),
];

/// Metrics without a column.
const LEFT_OUT: [&str; 2] = ["contact_area_voxel_count_cm2", "self_penetration_mm"];

/// Columns after those of the metrics.
const AFTER: &[(&str, Column)] = &[
    ("holds", Switch(|r| r.record.metrics.as_ref()?.holds())),
    (
        "preset",
        Text(|r| Some(r.record.optimizer.as_ref()?.preset.clone())),
    ),
    (
        "steps",
        Integer(|r| Some(r.record.optimizer.as_ref()?.steps as i64)),
    ),
    (
        "l_phys",
        Number(|r| Some(r.record.optimizer.as_ref()?.l_phys)),
    ),
    (
        "l_task",
        Number(|r| Some(r.record.optimizer.as_ref()?.l_task)),
    ),
    (
        "task_satisfied",
        Switch(|r| Some(r.record.optimizer.as_ref()?.task_satisfied)),
    ),
];

/// Lists name and content of every column.
fn columns() -> Vec<(&'static str, Column)> {
    let metrics = Metric::exported(&LEFT_OUT).into_iter();
    let metrics = metrics.map(|metric| (metric.key, Column::Metric(metric)));
    (BEFORE.iter().copied())
        .chain(metrics)
        .chain(AFTER.iter().copied())
        .collect()
}

/// Writes the schema of the table in Parquet's own language.
fn schema(columns: &[(&str, Column)]) -> String {
    let mut text = String::from("message graspd_grasps {\n");
    for (name, column) in columns {
        let field = match column {
            Text(_) => format!("OPTIONAL BYTE_ARRAY {name} (UTF8)"),
            Column::Metric(metric) => match metric.kind {
                MetricKind::Count => format!("OPTIONAL INT64 {name}"),
                MetricKind::Truth => format!("OPTIONAL BOOLEAN {name}"),
                MetricKind::Number | MetricKind::Ratio(..) => format!("OPTIONAL DOUBLE {name}"),
            },
            Integer(_) => format!("OPTIONAL INT64 {name}"),
            Number(_) => format!("OPTIONAL DOUBLE {name}"),
            Switch(_) => format!("OPTIONAL BOOLEAN {name}"),
            Numbers(_) => {
                text += &format!(
                    "REQUIRED GROUP {name} (LIST) {{ REPEATED GROUP list {{ REQUIRED DOUBLE element; }} }}\n"
                );
                continue;
            }
            Texts(_) => {
                text += &format!(
                    "REQUIRED GROUP {name} (LIST) {{ REPEATED GROUP list {{ REQUIRED BYTE_ARRAY element (UTF8); \
                    }} }}\n"
                );
                continue;
            }
        };
        text += &format!("{field};\n");
    }
    text + "}"
}

/// Writes `grasps.parquet`.
pub(super) fn write(source: &mut GraspSource<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let columns = columns();
    let schema = Arc::new(parse_message_type(&schema(&columns))?);
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::default())?;
    let mut rows = Vec::new();
    for number in 0..source.len() {
        rows.extend(rows_of(source, number)?);
        if rows.len() >= GROUP_ROWS || number + 1 == source.len() {
            let mut group = writer.next_row_group()?;
            write_group(&mut group, &columns, &rows)?;
            group.close()?;
            rows.clear();
        }
    }
    let path = folder.join("grasps.parquet");
    write_atomically(&path, &writer.into_inner()?)?;
    Ok(vec![path])
}

fn rows_of(source: &mut GraspSource<'_>, number: usize) -> Result<Vec<Row>> {
    let run = source.run(number)?;
    let hand = source.hand(&run)?;
    let names = hand.articulation_names();
    let mut rows = Vec::with_capacity(run.records.len());
    for record in &run.records {
        let pose = record
            .hand_pose(names)
            .with_context(|| source.context(&run, record))?;
        rows.push(Row {
            run: run.name.clone(),
            record: record.clone(),
            joint_names: names.to_vec(),
            joints: pose.articulation,
        });
    }
    Ok(rows)
}

fn write_group<W: std::io::Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    columns: &[(&str, Column)],
    rows: &[Row],
) -> Result<()> {
    for (name, column) in columns {
        let mut writer = group
            .next_column()?
            .with_context(|| format!("column {name}"))?;
        write_column(&mut writer, column, rows)?;
        writer.close()?;
    }
    Ok(())
}

fn write_column(
    writer: &mut SerializedColumnWriter<'_>,
    column: &Column,
    rows: &[Row],
) -> Result<()> {
    match column {
        Text(of) => {
            let texts = rows.iter().map(|row| Some(of(row)?.as_str().into()));
            write_optional::<ByteArrayType>(writer, texts)
        }
        Integer(of) => write_optional::<Int64Type>(writer, rows.iter().map(of)),
        Number(of) => write_optional::<DoubleType>(writer, rows.iter().map(of)),
        Switch(of) => write_optional::<BoolType>(writer, rows.iter().map(of)),
        Column::Metric(metric) => {
            let values = rows
                .iter()
                .map(|row| (metric.get)(row.record.metrics.as_ref()?));
            match metric.kind {
                MetricKind::Count => {
                    write_optional::<Int64Type>(writer, values.map(|v| Some(v? as i64)))
                }
                MetricKind::Truth => {
                    write_optional::<BoolType>(writer, values.map(|v| Some(v? != 0.0)))
                }
                MetricKind::Number | MetricKind::Ratio(..) => {
                    write_optional::<DoubleType>(writer, values)
                }
            }
        }
        Numbers(of) => write_lists::<DoubleType>(writer, rows.iter().map(of)),
        Texts(of) => {
            let texts = |row| of(row).iter().map(|text| text.as_str().into()).collect();
            write_lists::<ByteArrayType>(writer, rows.iter().map(texts))
        }
    }
}

fn write_optional<T: DataType>(
    writer: &mut SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<()> {
    let (values, levels) = optional(cells);
    writer
        .typed::<T>()
        .write_batch(&values, Some(&levels), None)?;
    Ok(())
}

fn write_lists<T: DataType>(
    writer: &mut SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Vec<T::T>>,
) -> Result<()> {
    let (values, there, again) = listed(cells);
    writer
        .typed::<T>()
        .write_batch(&values, Some(&there), Some(&again))?;
    Ok(())
}

/// The values that are there, and for each row whether it has one (its definition level).
fn optional<T>(cells: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    (values, levels)
}

/// All items; for each, or for an empty list, whether it is there (definition level) and whether it goes on with the
/// list before (repetition level).
fn listed<T>(cells: impl Iterator<Item = Vec<T>>) -> (Vec<T>, Vec<i16>, Vec<i16>) {
    let (mut values, mut there, mut again) = (Vec::new(), Vec::new(), Vec::new());
    for cell in cells {
        if cell.is_empty() {
            there.push(0);
            again.push(0);
        }
        for (place, value) in cell.into_iter().enumerate() {
            there.push(1);
            again.push(i16::from(place > 0));
            values.push(value);
        }
    }
    (values, there, again)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_those_of_the_format() {
        let (values, levels) = optional([Some(1), None, Some(3)].into_iter());
        assert_eq!((values, levels), (vec![1, 3], vec![1, 0, 1]));
        let (values, there, again) = listed([vec![1, 2], vec![], vec![3]].into_iter());
        assert_eq!(values, [1, 2, 3]);
        assert_eq!((there, again), (vec![1, 1, 0, 1], vec![0, 1, 0, 0]));
        parse_message_type(&schema(&columns())).unwrap();
    }
}
