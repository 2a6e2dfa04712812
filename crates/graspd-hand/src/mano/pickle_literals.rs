//! Integers, strings and names as pickles write them.

use crate::HandError;

/// Returns what is wrong with a pickle, as an error.
pub(crate) fn bad<T>(fault: impl Into<String>) -> Result<T, HandError> {
    Err(HandError::BadPickle(fault.into()))
}

/// Parses a decimal integer, with Python 2's `L` behind it or not.
pub(crate) fn decimal(digits: &[u8]) -> Result<i64, HandError> {
    let text = std::str::from_utf8(digits).unwrap_or_default();
    match text.trim_end_matches('L').parse() {
        Ok(number) => Ok(number),
        Err(_) => bad(format!(
            "it has `{}` where an integer is due",
            readable(digits)
        )),
    }
}

/// Reads a little-endian integer in two's complement.
pub(crate) fn long(bytes: &[u8]) -> Result<i64, HandError> {
    if bytes.len() > 8 {
        return bad("it has an integer of over 64 bits");
    }
    let is_negative = bytes.last().is_some_and(|&byte| byte >= 0x80);
    let mut all = [if is_negative { 0xff } else { 0 }; 8];
    all[..bytes.len()].copy_from_slice(bytes);
    Ok(i64::from_le_bytes(all))
}

/// Returns the bytes that a string between quotes stands for, as Python 2 writes it.
pub(crate) fn unquoted(line: &[u8]) -> Result<Vec<u8>, HandError> {
    const FAULT: &str = "it has a string that is not quoted as strings are";
    let inner = match line {
        [first @ (b'\'' | b'"'), inner @ .., last] if first == last => inner,
        _ => return bad(FAULT),
    };
    let mut bytes = Vec::with_capacity(inner.len());
    let mut rest = inner;
    while let [byte, after @ ..] = rest {
        rest = after;
        if *byte != b'\\' {
            bytes.push(*byte);
            continue;
        }
        let (value, after) = match rest {
            [b'n', after @ ..] => (b'\n', after),
            [b'r', after @ ..] => (b'\r', after),
            [b't', after @ ..] => (b'\t', after),
            [quoted @ (b'\\' | b'\'' | b'"'), after @ ..] => (*quoted, after),
            [b'x', high, low, after @ ..] => {
                let digit = |byte: u8| char::from(byte).to_digit(16);
                match (digit(*high), digit(*low)) {
                    (Some(high), Some(low)) => ((16 * high + low) as u8, after),
                    _ => return bad(FAULT),
                }
            }
            _ => return bad(FAULT),
        };
        bytes.push(value);
        rest = after;
    }
    Ok(bytes)
}

/// Returns a name from the file, fit for a message.
pub(crate) fn readable(name: &[u8]) -> String {
    const LONGEST: usize = 60;
    let text = String::from_utf8_lossy(&name[..name.len().min(LONGEST)]);
    text.chars()
        .map(|c| if c.is_control() { '?' } else { c })
        .collect()
}
