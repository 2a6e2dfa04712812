//! Masks of YCB captures: portable bitmaps, the object black.

use std::path::Path;

use graspd_geom::GeometryError;
use graspd_mesh::{file_bytes, parse_error, write_whole};

/// Reads a bitmap of `width` x `height` pixels (PBM, text or binary, or an 8-bit grey PGM) in which the object is
/// black and all else white.
pub(super) fn read(path: &Path, width: usize, height: usize) -> Result<Vec<bool>, GeometryError> {
    let bytes = file_bytes(path)?;
    let fail = |what: String| parse_error(path, None, what);
    let mut at = 0;
    let magic = word(&bytes, &mut at);
    let numbers = match magic.as_str() {
        "P1" | "P4" => 2,
        "P5" => 3,
        _ => return Err(fail("not a PBM bitmap".into())),
    };
    let mut size = Vec::new();
    for _ in 0..numbers {
        let number = word(&bytes, &mut at);
        size.push(
            number
                .parse::<usize>()
                .map_err(|_| fail("its header is damaged".into()))?,
        );
    }
    if size[..2] != [width, height] {
        return Err(fail(format!(
            "the mask has {} x {} pixels, not {width} x {height}",
            size[0], size[1]
        )));
    }
    if size.get(2).is_some_and(|&highest| highest != 255) {
        return Err(fail("its grey levels are not 0 to 255".into()));
    }
    let data = bytes.get(at..).unwrap_or_default();
    let object: Vec<bool> = match magic.as_str() {
        "P1" => data
            .iter()
            .filter(|byte| !byte.is_ascii_whitespace())
            .map(|&byte| byte == b'1')
            .collect(),
        // One white space ends the header.
        "P4" => data
            .get(1..)
            .unwrap_or_default()
            .chunks(width.div_ceil(8))
            .flat_map(|row| {
                (0..width).filter_map(|x| Some(row.get(x / 8)? >> (7 - x % 8) & 1 == 1))
            })
            .collect(),
        _ => data
            .get(1..)
            .unwrap_or_default()
            .iter()
            .map(|&grey| grey == 0)
            .collect(),
    };
    if object.len() < width * height {
        return Err(fail(format!(
            "the mask is cut off after {} of {} pixels",
            object.len(),
            width * height
        )));
    }
    Ok(object[..width * height].to_vec())
}

/// Writes such a bitmap, binary.
pub(super) fn write(path: &Path, width: usize, object: &[bool]) -> Result<(), GeometryError> {
    write_whole(path, |out| {
        writeln!(out, "P4\n{width} {}", object.len() / width)?;
        for row in object.chunks(width) {
            let bytes: Vec<u8> = row
                .chunks(8)
                .map(|bits| {
                    bits.iter()
                        .enumerate()
                        .fold(0, |byte, (place, &bit)| byte | u8::from(bit) << (7 - place))
                })
                .collect();
            out.write_all(&bytes)?;
        }
        Ok(())
    })
}

/// The next word of the header; comments are passed over.
fn word(bytes: &[u8], at: &mut usize) -> String {
    loop {
        while bytes.get(*at).is_some_and(u8::is_ascii_whitespace) {
            *at += 1;
        }
        if bytes.get(*at) != Some(&b'#') {
            break;
        }
        while bytes.get(*at).is_some_and(|&byte| byte != b'\n') {
            *at += 1;
        }
    }
    let start = *at;
    while bytes
        .get(*at)
        .is_some_and(|byte| !byte.is_ascii_whitespace())
    {
        *at += 1;
    }
    String::from_utf8_lossy(&bytes[start..*at]).into_owned()
}
