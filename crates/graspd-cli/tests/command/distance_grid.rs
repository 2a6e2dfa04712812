//! `graspd sdf`: the distance grid as others read it.

use std::fs::File;
use std::path::Path;

use graspd_geom::{SignedDistance, TriangleMesh};
use graspd_mesh::{builtin_object, save_obj};
use nalgebra::Point3;
use ndarray::{Array1, Array3};
use ndarray_npy::NpzReader;
use tempfile::tempdir;

use crate::outcome::{command, graspd, outcome, text};

/// Values are rounded to single precision; distances here are below 0.2 m.
const ROUNDING: f64 = 2e-8;

struct Grid {
    sdf: Array3<f32>,
    origin: Array1<f64>,
    spacing: Array1<f64>,
}

fn read(file: &Path) -> Grid {
    let mut npz = NpzReader::new(File::open(file).unwrap()).unwrap();
    let mut names = npz.names().unwrap();
    names.sort();
    assert_eq!(names, ["origin", "sdf", "spacing"]);
    Grid {
        sdf: npz.by_name("sdf").unwrap(),
        origin: npz.by_name("origin").unwrap(),
        spacing: npz.by_name("spacing").unwrap(),
    }
}

impl Grid {
    /// The largest difference of `sdf[i, j, k]` from the distance at origin + (i, j, k) * spacing, the axes of the
    /// index taken in the order `axes`.
    fn largest_error(&self, mesh: &TriangleMesh, axes: [usize; 3]) -> f64 {
        let distance = SignedDistance::new(mesh).unwrap();
        let error = |(index, &value): ((usize, usize, usize), &f32)| {
            let index = [index.0, index.1, index.2];
            let at =
                |axis: usize| self.origin[axis] + index[axes[axis]] as f64 * self.spacing[axis];
            let exact = distance.signed_distance(&Point3::new(at(0), at(1), at(2)));
            (f64::from(value) - exact).abs()
        };
        self.sdf.indexed_iter().map(error).fold(0.0, f64::max)
    }
}

#[test]
fn values_are_where_the_documentation_says() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("mug.npz");
    let arguments = [
        "sdf",
        "mug",
        "--resolution",
        "21",
        "--padding",
        "0.02",
        "-o",
        text(&file),
        "--json",
    ];
    let told = graspd(arguments).gives_json();
    let grid = read(&file);
    assert_eq!(grid.sdf.dim(), (21, 21, 21));
    assert_eq!((grid.origin.len(), grid.spacing.len()), (3, 3));
    let mug = builtin_object("mug").unwrap();
    let (low, high) = mug.bounds().unwrap();
    for axis in 0..3 {
        assert!((grid.origin[axis] - (low[axis] - 0.02)).abs() < 1e-12);
        let top = grid.origin[axis] + 20.0 * grid.spacing[axis];
        assert!((top - (high[axis] + 0.02)).abs() < 1e-12);
        assert_eq!(told["origin_m"][axis], grid.origin[axis]);
        assert_eq!(told["spacing_m"][axis], grid.spacing[axis]);
    }
    assert!(grid.largest_error(&mug, [0, 1, 2]) < ROUNDING);
    // The mug, with its handle, would notice any other order of the axes.
    for axes in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        assert!(grid.largest_error(&mug, axes) > 0.005, "{axes:?}");
    }
    assert!(grid.sdf.iter().any(|&value| value < 0.0));
}

#[test]
fn files_are_scaled_and_the_grid_is_named_after_them() {
    let folder = tempdir().unwrap();
    let can = builtin_object("can").unwrap().scaled(100.0);
    save_obj(&can, folder.path().join("tin.obj")).unwrap();
    let arguments = [
        "sdf",
        "tin.obj",
        "--resolution",
        "9",
        "--scale",
        "0.01",
        "--quiet",
        "--threads",
        "1",
    ];
    let run = command(arguments)
        .current_dir(folder.path())
        .output()
        .unwrap();
    let run = outcome(run);
    assert_eq!(run.stderr, "");
    let line = run.succeeds();
    assert!(line.starts_with("tin.npz: 9^3 samples"), "{line}");
    let grid = read(&folder.path().join("tin.npz"));
    assert!(grid.largest_error(&can.scaled(0.01), [0, 1, 2]) < ROUNDING);
}
