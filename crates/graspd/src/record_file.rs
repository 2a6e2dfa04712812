//! `grasps.jsonl`: grasp records, one a line.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

use serde_json::Value;

use crate::GraspError;
use crate::SCHEMA;
use crate::record::GraspRecord;

/// A line longer than this is no record, but might fill the memory \[bytes\].
const LONGEST_LINE: u64 = 1 << 24;

/// Reads a `grasps.jsonl`, written by this program or by anyone.
///
/// A record that lacks `schema`, `object_scale` or `index` (or has null for it) is of [`SCHEMA`], not scaled, and
/// numbered by its place among the records, from 0. Fields that [`GraspRecord`] does not have are ignored, and so
/// are blank lines.
///
/// # Errors
/// If the file cannot be read, or a line is not a record; names the file and the line.
pub fn read_records(path: &Path) -> Result<Vec<GraspRecord>, GraspError> {
    let failed = |source| GraspError::Read {
        path: path.to_owned(),
        source,
    };
    let fault = |line, fault| GraspError::ParseRecord {
        path: path.to_owned(),
        line,
        fault,
    };
    let mut reader = BufReader::new(File::open(path).map_err(failed)?);
    let mut records = Vec::new();
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        let mut limited = reader.by_ref().take(LONGEST_LINE);
        let length = limited.read_until(b'\n', &mut line).map_err(failed)?;
        if length == 0 {
            break;
        }
        if length as u64 == LONGEST_LINE {
            let too_long = format!("it is longer than {} MiB", LONGEST_LINE >> 20);
            return Err(fault(number, too_long));
        }
        // A byte order mark is not part of the first record.
        let text = line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&line);
        let text = std::str::from_utf8(text).map_err(|_| {
            let what = format!("line {number} is not text in UTF-8");
            failed(std::io::Error::new(ErrorKind::InvalidData, what))
        })?;
        let text = text.trim_end();
        if !text.is_empty() {
            let record = parse(text, records.len()).map_err(|what| fault(number, what))?;
            records.push(record);
        }
    }
    if records.is_empty() {
        return Err(fault(0, "it holds no grasp".into()));
    }
    Ok(records)
}

/// One record, or what is wrong with it; `place` is how many come before it.
fn parse(text: &str, place: usize) -> Result<GraspRecord, String> {
    let mut value: Value = serde_json::from_str(text).map_err(|error| {
        // Its own line number counts from the start of this line.
        let message = error.to_string();
        let what = message.split(" at line ").next().unwrap_or_default();
        format!("{what} (column {})", error.column())
    })?;
    let fields = value.as_object_mut().ok_or("it is no JSON object")?;
    match fields.get("schema") {
        Some(Value::String(schema)) if schema != SCHEMA => {
            return Err(format!(
                "its schema `{schema}` is not known to this version"
            ));
        }
        _ => {}
    }
    let place = Value::from(place);
    for (name, default) in [
        ("schema", Value::from(SCHEMA)),
        ("object_scale", Value::from(1.0)),
        ("index", place),
    ] {
        let field = fields.entry(name).or_insert(Value::Null);
        if field.is_null() {
            *field = default;
        }
    }
    serde_json::from_value(value).map_err(|error| error.to_string())
}

/// Writes records one a line, atomically.
///
/// # Errors
/// If the file cannot be written, or a record holds a number that is not finite, which JSON has no word for (metrics
/// become null instead).
pub fn write_records(path: &Path, records: &[GraspRecord]) -> Result<(), GraspError> {
    let mut text = String::new();
    for record in records {
        if !record.is_finite() {
            return Err(GraspError::InvalidRecord {
                index: record.index,
                fault: "it has a number that is not finite".into(),
            });
        }
        let line = serde_json::to_string(record).map_err(|error| GraspError::ParseRecord {
            path: path.to_owned(),
            line: 0,
            fault: error.to_string(),
        })?;
        text.push_str(&line);
        text.push('\n');
    }
    write_atomically(path, text.as_bytes())
}

/// Writes a file under a temporary name beside it, flushes it to the disk and renames it into place.
///
/// # Errors
/// If any of this fails; names the path.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), GraspError> {
    graspd_geom::write_atomically(path, |out| out.write_all(bytes)).map_err(|source| {
        GraspError::Write {
            path: path.to_owned(),
            source,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const BARE: &str = r#"{"object": "mug", "hand": "allegro", "joints_rad": {"a": 0.16156765941089155},
        "pose": {"translation_m": [0, 0, 0.1], "rotation_wxyz": [1, 0, 0, 0]}}"#;

    fn read(text: &str) -> Result<Vec<GraspRecord>, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_records(file.path()).map_err(|error| error.to_string())
    }

    #[test]
    fn bare_records_get_defaults_and_are_numbered() {
        let bare = BARE.replace('\n', " ");
        let records = read(&format!("\u{feff}{bare}\n\n{bare}\r\n{bare}")).unwrap();
        assert_eq!(
            records.iter().map(|r| r.index).collect::<Vec<_>>(),
            [0, 1, 2]
        );
        let first = &records[0];
        assert_eq!((first.schema.as_str(), first.object_scale), (SCHEMA, 1.0));
        assert!(first.seed.is_none() && first.metrics.is_none() && first.rank.is_none());
        // Ordinary parsing of this number is off in its last bit.
        assert_eq!(
            first.joints_rad.as_ref().unwrap()["a"],
            0.161_567_659_410_891_55
        );
        let direct: GraspRecord = serde_json::from_str(&bare).unwrap();
        assert_eq!(direct, *first);
    }

    #[test]
    fn faults_name_the_line() {
        let bare = BARE.replace('\n', " ");
        for (line, fault) in [
            ("{\"object\"", "EOF while parsing an object (column 9)"),
            ("[1, 2]", "it is no JSON object"),
            ("{}", "missing field `object`"),
            (
                "{\"schema\": \"graspd.grasp/2\"}",
                "`graspd.grasp/2` is not known",
            ),
        ] {
            let error = read(&format!("{bare}\n{line}\n")).unwrap_err();
            assert!(
                error.contains(", line 2: ") && error.contains(fault),
                "{error}"
            );
        }
        let error = read("\n").unwrap_err();
        assert!(
            error.contains("it holds no grasp") && !error.contains("line 0"),
            "{error}"
        );
    }

    #[test]
    fn lines_without_end_are_refused() {
        let error = read_records(Path::new("/dev/zero"));
        if Path::new("/dev/zero").exists() {
            assert!(
                error
                    .unwrap_err()
                    .to_string()
                    .contains("longer than 16 MiB")
            );
        }
    }
}
