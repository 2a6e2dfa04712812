//! Pickles of plain values, and NumPy arrays of them, as `numpy.load(file, allow_pickle=True)` reads them.

/// A value of Python.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Python {
    /// `None`
    None,
    /// `True`, `False`
    Bool(bool),
    /// `int`
    Int(i64),
    /// `float`
    Float(f64),
    /// `str`
    Text(String),
    /// `dict`, in order
    Dict(Vec<(String, Python)>),
}

impl From<Option<f64>> for Python {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Self::None, Self::Float)
    }
}

/// An `.npy` file that holds a one-dimensional array of objects.
///
/// # Source
/// NEP 1 (the file format), and the opcodes of CPython's `pickletools`, protocol 3, which Python 3.0 and later
/// read. The array is rebuilt as `numpy.ndarray.__reduce__` has it.
pub(super) fn npy_of_objects(values: &[Python]) -> Vec<u8> {
    let count = values.len();
    let mut header = format!("{{'descr': '|O', 'fortran_order': False, 'shape': ({count},), }}");
    // Magic, version and length are 10 bytes; the whole is a multiple of 64, and ends in a line end.
    let padding = 64 - (10 + header.len() + 1) % 64;
    header += &" ".repeat(padding);
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    pickle_array(values, &mut bytes);
    bytes
}

fn pickle_array(values: &[Python], out: &mut Vec<u8>) {
    out.extend(b"\x80\x03");
    // _reconstruct(ndarray, (0,), b'b')
    out.extend(b"cnumpy.core.multiarray\n_reconstruct\n");
    out.extend(b"cnumpy\nndarray\n");
    out.extend(b"K\x00\x85");
    out.extend(b"C\x01b");
    out.extend(b"\x87R");
    // Its state: (version, shape, dtype, is_fortran, list)
    out.extend(b"(K\x01");
    put(&Python::Int(values.len() as i64), out);
    out.push(b'\x85');
    // dtype('O8', False, True) with its own state
    out.extend(b"cnumpy\ndtype\n");
    put(&Python::Text("O8".into()), out);
    out.extend(b"\x89\x88\x87R");
    out.extend(b"(K\x03");
    put(&Python::Text("|".into()), out);
    out.extend(b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK?tb");
    out.push(b'\x89');
    out.extend(b"](");
    for value in values {
        put(value, out);
    }
    out.extend(b"etb.");
}

fn put(value: &Python, out: &mut Vec<u8>) {
    match value {
        Python::None => out.push(b'N'),
        Python::Bool(true) => out.push(b'\x88'),
        Python::Bool(false) => out.push(b'\x89'),
        Python::Int(number) => {
            // LONG1, eight bytes in two's complement
            out.extend(b"\x8a\x08");
            out.extend(number.to_le_bytes());
        }
        Python::Float(number) => {
            out.push(b'G');
            out.extend(number.to_be_bytes());
        }
        Python::Text(text) => {
            out.push(b'X');
            out.extend((text.len() as u32).to_le_bytes());
            out.extend(text.as_bytes());
        }
        Python::Dict(items) => {
            out.extend(b"}(");
            for (name, value) in items {
                put(&Python::Text(name.clone()), out);
                put(value, out);
            }
            out.push(b'u');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_aligned_and_tells_the_shape() {
        for count in [0, 1, 12, 100_000] {
            let values = vec![Python::Int(1); count];
            let bytes = npy_of_objects(&values);
            let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            assert_eq!((10 + length) % 64, 0);
            let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
            assert!(header.contains(&format!("'shape': ({count},)")) && header.ends_with('\n'));
            assert_eq!(bytes[10 + length..][..2], *b"\x80\x03");
            assert_eq!(bytes.last(), Some(&b'.'));
        }
    }
}
