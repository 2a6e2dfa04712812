//! Writes models the way Python 2's cPickle (protocol 2) writes those of MANO, and reads them back.

use std::collections::HashMap;

use graspd_hand::{JointPlacement, POSE_FEATURES, POSE_VALUES, SKINNED_JOINTS, SkinnedModel};
use graspd_hand::{load_hand, parse_skinned_model};

use crate::synthetic;

/// What a file says beyond the model.
#[derive(Clone, Debug)]
pub(crate) struct Extras {
    /// Rows of `hands_coeffs`.
    pub(crate) coefficients: Vec<Vec<f64>>,
    /// Store the array of that name first index fastest.
    pub(crate) fortran: Option<&'static str>,
    /// Store the array of that name in the other byte order.
    pub(crate) big_endian: Option<&'static str>,
    /// Leave out the array of that name.
    pub(crate) missing: Option<&'static str>,
    /// Give the array of that name another shape, of the same size or not.
    pub(crate) reshaped: Option<(&'static str, Vec<usize>)>,
    /// Put this number into the array of that name, at a place.
    pub(crate) changed: Option<(&'static str, usize, f64)>,
}

impl Default for Extras {
    fn default() -> Self {
        Self {
            coefficients: Vec::new(),
            fortran: Some("hands_components"),
            big_endian: None,
            missing: None,
            reshaped: None,
            changed: None,
        }
    }
}

/// A pickle being written.
#[derive(Default)]
pub(crate) struct Writer {
    pub(crate) bytes: Vec<u8>,
    memo: HashMap<Vec<u8>, u32>,
    next: u32,
}

impl Writer {
    fn put(&mut self) -> u32 {
        let index = self.next;
        self.next += 1;
        match u8::try_from(index) {
            Ok(short) => self.bytes.extend([b'q', short]),
            Err(_) => {
                self.bytes.push(b'r');
                self.bytes.extend(index.to_le_bytes());
            }
        }
        index
    }
    fn get(&mut self, index: u32) {
        match u8::try_from(index) {
            Ok(short) => self.bytes.extend([b'h', short]),
            Err(_) => {
                self.bytes.push(b'j');
                self.bytes.extend(index.to_le_bytes());
            }
        }
    }
    /// What has been written before is recalled, as picklers do with the same object.
    fn once(&mut self, key: &[u8], write: impl FnOnce(&mut Self)) {
        if let Some(&index) = self.memo.get(key) {
            return self.get(index);
        }
        write(self);
        let index = self.put();
        self.memo.insert(key.to_vec(), index);
    }
    pub(crate) fn global(&mut self, module: &str, name: &str) {
        let text = format!("c{module}\n{name}\n");
        self.once(text.as_bytes(), |w| w.bytes.extend(text.as_bytes()));
    }
    pub(crate) fn string(&mut self, text: &str) {
        let key = [b"string ", text.as_bytes()].concat();
        self.once(&key, |w| {
            w.bytes.extend([b'U', text.len() as u8]);
            w.bytes.extend(text.as_bytes());
        });
    }
    fn integer(&mut self, value: i64) {
        if let Ok(short) = u8::try_from(value) {
            self.bytes.extend([b'K', short]);
        } else if let Ok(short) = u16::try_from(value) {
            self.bytes.push(b'M');
            self.bytes.extend(short.to_le_bytes());
        } else {
            self.bytes.push(b'J');
            self.bytes.extend((value as i32).to_le_bytes());
        }
    }
    fn shape(&mut self, shape: &[usize]) {
        if shape.len() > 3 {
            self.bytes.push(b'(');
        }
        for &side in shape {
            self.integer(side as i64);
        }
        self.bytes
            .push(*[b')', 0x85, 0x86, 0x87].get(shape.len()).unwrap_or(&b't'));
        self.put();
    }
    /// numpy.core.multiarray._reconstruct(ndarray, (0,), 'b') with state (1, shape, dtype, order, bytes).
    fn array(&mut self, number: &str, order: char, shape: &[usize], fortran: bool, data: &[u8]) {
        self.global("numpy.core.multiarray", "_reconstruct");
        self.global("numpy", "ndarray");
        self.integer(0);
        self.bytes.push(0x85);
        self.put();
        self.string("b");
        self.bytes.push(0x87);
        self.put();
        self.bytes.push(b'R');
        self.put();
        self.bytes.push(b'(');
        self.integer(1);
        self.shape(shape);
        let key = format!("dtype {number} {order}");
        self.once(key.as_bytes(), |w| {
            w.global("numpy", "dtype");
            w.string(number);
            w.integer(0);
            w.integer(1);
            w.bytes.push(0x87);
            w.put();
            w.bytes.push(b'R');
        });
        self.bytes.push(b'(');
        self.integer(3);
        self.string(&order.to_string());
        self.bytes.extend(b"NNN");
        self.integer(-1);
        self.integer(-1);
        self.integer(0);
        self.bytes.push(b't');
        self.put();
        self.bytes.push(b'b');
        self.bytes.push(if fortran { 0x88 } else { 0x89 });
        if data.len() < 256 {
            self.bytes.extend([b'U', data.len() as u8]);
        } else {
            self.bytes.push(b'T');
            self.bytes.extend((data.len() as u32).to_le_bytes());
        }
        self.bytes.extend(data);
        self.put();
        self.bytes.push(b't');
        self.put();
        self.bytes.push(b'b');
    }
    /// class.__new__() with a dictionary as its state.
    fn instance(&mut self, module: &str, name: &str, state: impl FnOnce(&mut Self)) {
        self.global(module, name);
        self.bytes.extend([b')', 0x81]);
        self.put();
        self.bytes.push(b'}');
        self.put();
        self.bytes.push(b'(');
        state(self);
        self.bytes.extend(b"ub");
    }
}

/// First index fastest, from the other order.
fn fortran_order(values: &[f64], shape: &[usize]) -> Vec<f64> {
    let [rows, columns] = shape else {
        panic!("only matrices are stored that way here");
    };
    let place = |k: usize| (k % rows) * columns + k / rows;
    (0..values.len()).map(|k| values[place(k)]).collect()
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A file of MANO's, holding `model`.
pub(crate) fn pickled(model: &SkinnedModel, extras: &Extras) -> Vec<u8> {
    let mut w = Writer::default();
    w.bytes.extend([0x80, 2, b'}']);
    w.put();
    w.bytes.push(b'(');
    let vertices = model.template.len();
    w.string("bs_style");
    w.string("lbs");
    w.string("bs_type");
    w.string("lrotmin");
    let numbers = |w: &mut Writer, name: &'static str, shape: &[usize], mut values: Vec<f64>| {
        if extras.missing == Some(name) {
            return;
        }
        w.string(name);
        if let Some((_, place, value)) = extras.changed.filter(|changed| changed.0 == name) {
            values[place] = value;
        }
        let is_fortran = extras.fortran == Some(name);
        if is_fortran {
            values = fortran_order(&values, shape);
        }
        let mut data = doubles(&values);
        let is_big_endian = extras.big_endian == Some(name);
        if is_big_endian {
            data.as_chunks_mut::<8>()
                .0
                .iter_mut()
                .for_each(|bytes| bytes.reverse());
        }
        let shape = match &extras.reshaped {
            Some((reshaped, other)) if *reshaped == name => other,
            _ => shape,
        };
        let order = if is_big_endian { '>' } else { '<' };
        w.array("f8", order, shape, is_fortran, &data);
    };
    numbers(
        &mut w,
        "v_template",
        &[vertices, 3],
        model.template.concat(),
    );
    numbers(
        &mut w,
        "weights",
        &[vertices, SKINNED_JOINTS],
        model.weights.concat(),
    );
    if let Some(directions) = &model.pose_directions {
        numbers(
            &mut w,
            "posedirs",
            &[vertices, 3, POSE_FEATURES],
            directions.clone(),
        );
    }
    let components = model.pose_components.len();
    numbers(
        &mut w,
        "hands_components",
        &[components, POSE_VALUES],
        model.pose_components.concat(),
    );
    numbers(
        &mut w,
        "hands_mean",
        &[POSE_VALUES],
        model.pose_mean.to_vec(),
    );
    if !extras.coefficients.is_empty() {
        let rows = extras.coefficients.len();
        numbers(
            &mut w,
            "hands_coeffs",
            &[rows, components],
            extras.coefficients.concat(),
        );
    }
    if extras.missing != Some("f") {
        w.string("f");
        let data: Vec<u8> = model
            .faces
            .iter()
            .flatten()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        w.array("u4", '<', &[model.faces.len(), 3], false, &data);
    }
    if extras.missing != Some("kintree_table") {
        w.string("kintree_table");
        let parent = |p: &Option<usize>| p.map_or(4_294_967_295, |p| p as i64);
        let rows = model
            .parents
            .iter()
            .map(parent)
            .chain(0..SKINNED_JOINTS as i64);
        let data: Vec<u8> = rows.flat_map(i64::to_le_bytes).collect();
        w.array("i8", '<', &[2, SKINNED_JOINTS], false, &data);
    }
    if extras.missing != Some("J_regressor") {
        w.string("J_regressor");
        sparse(&mut w, model);
    }
    if !model.shape_directions.is_empty() {
        w.string("shapedirs");
        selection(&mut w, model);
    }
    w.bytes.extend(b"u.");
    w.bytes
}

/// The regressor as a scipy.sparse.csc_matrix.
fn sparse(w: &mut Writer, model: &SkinnedModel) {
    let JointPlacement::Regressed(rows) = &model.joints else {
        panic!("only regressed joints are pickled");
    };
    let vertices = model.template.len();
    let (mut data, mut indices, mut starts) = (Vec::new(), Vec::new(), vec![0_i32]);
    for vertex in 0..vertices {
        for (row, entries) in rows.iter().enumerate() {
            for &(_, factor) in entries.iter().filter(|(v, _)| *v as usize == vertex) {
                data.push(factor);
                indices.push(row as i32);
            }
        }
        starts.push(data.len() as i32);
    }
    let integers = |values: &[i32]| {
        values
            .iter()
            .flat_map(|i| i.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    w.instance("scipy.sparse.csc", "csc_matrix", |w| {
        w.string("_shape");
        w.shape(&[SKINNED_JOINTS, vertices]);
        w.string("maxprint");
        w.integer(50);
        w.string("data");
        w.array("f8", '<', &[data.len()], false, &doubles(&data));
        w.string("indices");
        w.array("i4", '<', &[indices.len()], false, &integers(&indices));
        w.string("indptr");
        w.array("i4", '<', &[starts.len()], false, &integers(&starts));
    });
}

/// The shape directions as chumpy holds them: the first s of twice as many, picked from a flat copy.
fn selection(w: &mut Writer, model: &SkinnedModel) {
    let rows = 3 * model.template.len();
    let count = model.shape_directions.len() / rows;
    let mut all = Vec::new();
    let mut places = Vec::new();
    for row in 0..rows {
        for k in 0..2 * count {
            if k < count {
                places.push(all.len() as i64);
                all.push(model.shape_directions[row * count + k]);
            } else {
                all.push(7.0);
            }
        }
    }
    let places: Vec<u8> = places.into_iter().flat_map(i64::to_le_bytes).collect();
    w.instance("chumpy.reordering", "Select", |w| {
        w.string("a");
        w.instance("chumpy.ch", "Ch", |w| {
            w.string("_dirty_vars");
            w.global("__builtin__", "set");
            w.bytes.push(b']');
            w.put();
            w.string("x");
            w.bytes.extend([b'a', 0x85]);
            w.put();
            w.bytes.push(b'R');
            w.put();
            w.string("x");
            w.array("f8", '<', &[rows / 3, 3, 2 * count], false, &doubles(&all));
        });
        w.string("idxs");
        w.array("i8", '<', &[places.len() / 8], false, &places);
        w.string("preferred_shape");
        w.shape(&[rows / 3, 3, count]);
    });
}

#[test]
fn a_model_is_read_back_as_it_was_written() {
    let mut model = synthetic::model(1);
    let read = parse_skinned_model(&pickled(&model, &Extras::default()), "made-up").unwrap();
    assert_eq!(read, model);
    for array in ["v_template", "weights", "hands_components"] {
        let extras = Extras {
            fortran: Some(array),
            big_endian: Some("posedirs"),
            ..Extras::default()
        };
        assert_eq!(
            parse_skinned_model(&pickled(&model, &extras), "made-up").unwrap(),
            model
        );
    }
    // Limits of three standard deviations: of 1, 2, 3, 4 about 2.5, and of 0.
    model.pose_components.truncate(2);
    let extras = Extras {
        coefficients: (1..=4).map(|k| vec![f64::from(k), 0.5]).collect(),
        ..Extras::default()
    };
    let read = parse_skinned_model(&pickled(&model, &extras), "made-up").unwrap();
    let limits = read.coefficient_limits.unwrap();
    let reach = 3.0 * (5.0_f64 / 3.0).sqrt();
    assert!((limits[0].lower - (2.5 - reach)).abs() < 1e-12);
    assert!((limits[0].upper - (2.5 + reach)).abs() < 1e-12);
    assert_eq!((limits[1].lower, limits[1].upper), (0.5, 0.5));
}

#[test]
fn a_pickle_on_disk_makes_a_hand_named_after_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("MANO_LEFT.pkl");
    std::fs::write(&path, pickled(&synthetic::model(1), &Extras::default())).unwrap();
    let hand = load_hand(path.to_str().unwrap()).unwrap();
    assert_eq!(hand.name(), "MANO_LEFT");
    assert_eq!(hand.contact_points().count, synthetic::VERTICES);
    assert_eq!(hand.contact_points().weight.len(), 784);
    assert_eq!(hand.articulation_names().len(), POSE_VALUES);
    assert_eq!(hand.shape_parameters(), Some(&[][..]));
    assert!(hand.limits().is_none());
}

#[test]
fn protocol_0_is_read_too() {
    // {'J': (1, 2L), 'v_template': 'a\x00\n'} as Python 2 writes it in text.
    let text = b"(dp0\nS'J'\np1\n(I1\nL2L\ntp2\nsS'v_template'\np3\nS'a\\x00\\n'\np4\ns.";
    let error = parse_skinned_model(text, "text").unwrap_err().to_string();
    assert_eq!(error, "array `v_template` is not an array of numbers");
}
