//! Objects by name and from files, and what they become for the simulation.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use graspd::{GraspError, GraspObject, NamedMesh, PAPER_PADDING};
use graspd_geom::{GeometryError, TriangleMesh, box_mesh};
use graspd_mesh::{BUILTIN_OBJECTS, builtin_object, save_obj};

/// A box of 40 x 60 x 100 mm about the origin.
const SIDES: [f64; 3] = [0.04, 0.06, 0.1];
/// The mass of a box is a sum of a dozen terms of its own size.
const ROUNDING: f64 = 1e-12;

/// A box of 12 faces.
fn whole_box(sides: [f64; 3]) -> TriangleMesh {
    box_mesh(sides.into(), 1.0)
}

fn saved(mesh: &TriangleMesh, folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    save_obj(mesh, &path).expect("the folder is ours");
    path
}

fn load_error(name_or_path: &str, scale: f64) -> GraspError {
    NamedMesh::load(name_or_path, scale).expect_err("it cannot be loaded")
}

#[test]
fn every_built_in_object_loads_by_name() {
    for object in BUILTIN_OBJECTS {
        let loaded = NamedMesh::load(object.name, 1.0).expect("it is built in");
        assert_eq!(
            (loaded.name.as_str(), loaded.label()),
            (object.name, object.name.into())
        );
        assert_eq!((&loaded.path, loaded.scale), (&None, 1.0));
        assert_eq!(Some(loaded.mesh), builtin_object(object.name));
    }
}

#[test]
fn a_file_gives_its_name_and_the_scale_multiplies_coordinates() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = saved(&whole_box(SIDES), folder.path(), "crate.v2.obj");
    let loaded = NamedMesh::load(&path.to_string_lossy(), 0.5).expect("it is a closed box");
    assert_eq!(loaded.name, "crate.v2");
    assert_eq!(loaded.label(), path.display().to_string());
    assert_eq!(loaded.scale, 0.5);
    assert!((loaded.largest_side() - 0.05).abs() < ROUNDING);
    let (low, high) = loaded.mesh.bounds().expect("it has vertices");
    for axis in 0..3 {
        assert!((high[axis] - low[axis] - 0.5 * SIDES[axis]).abs() < ROUNDING);
    }
}

#[test]
fn scales_that_make_no_sense_are_refused() {
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = load_error("mug", scale);
        assert!(
            matches!(&error, GraspError::Setting(fault) if fault.setting == "scale"),
            "{error}"
        );
    }
}

#[test]
fn errors_of_files_name_the_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut open = whole_box(SIDES);
    open.faces.pop();
    let open = saved(&open, folder.path(), "open.obj");
    let empty = folder.path().join("empty.obj");
    std::fs::write(&empty, "").expect("the folder is ours");
    let missing = folder.path().join("missing.stl");
    for path in [&open, &empty, &missing, &folder.path().to_owned()] {
        let path = path.to_string_lossy();
        let error = load_error(&path, 1.0);
        assert!(matches!(error, GraspError::Geometry(_)), "{error:?}");
        assert!(error.to_string().contains(&*path), "{error}");
    }
    let misspelt = load_error("mugg", 1.0).to_string();
    assert!(misspelt.contains("mugg"), "{misspelt}");
}

#[test]
fn the_simulation_sees_the_mass_and_a_padded_grid() {
    let source = NamedMesh {
        name: "box".into(),
        path: None,
        scale: 1.0,
        mesh: whole_box(SIDES),
        repair: None,
    };
    let progress = Mutex::new(Vec::new());
    let object = GraspObject::prepare(source, 16, 500.0, &|fraction| {
        progress
            .lock()
            .expect("no other thread panics")
            .push(fraction);
    })
    .expect("a box has a volume");

    let mass = 500.0 * SIDES.iter().product::<f64>();
    assert!((object.simulated.mass() - mass).abs() < ROUNDING * mass);
    assert!(object.simulated.center_of_mass().norm() < ROUNDING);
    let grid = object.simulated.sdf();
    assert_eq!(grid.dims(), [16; 3]);
    let (low, high) = grid.bounds();
    for axis in 0..3 {
        let reach = 0.5 * SIDES[axis] + PAPER_PADDING;
        assert!((low[axis] + reach).abs() < ROUNDING && (high[axis] - reach).abs() < ROUNDING);
    }
    // 20 mm from the faces along x.
    let inside = object.distance.signed_distance(&[0.0; 3].into());
    assert!((inside + 0.02).abs() < ROUNDING);

    let progress = progress.into_inner().expect("no thread panicked");
    assert!(
        progress
            .iter()
            .all(|fraction| (0.0..=1.0).contains(fraction))
    );
    assert!(progress.contains(&1.0), "{progress:?}");
}

#[test]
fn objects_that_cannot_be_simulated_are_refused() {
    let prepare = |mesh: TriangleMesh, resolution, density| {
        let source = NamedMesh {
            name: "thing".into(),
            path: None,
            scale: 1.0,
            mesh,
            repair: None,
        };
        GraspObject::prepare(source, resolution, density, &|_| {}).err()
    };
    let cube = || whole_box([0.05; 3]);
    assert!(prepare(cube(), 8, 1000.0).is_none());
    for resolution in [0, 1, 100_000] {
        assert!(matches!(
            prepare(cube(), resolution, 1000.0),
            Some(GraspError::Geometry(GeometryError::GridResolution { .. }))
        ));
    }
    for density in [0.0, -1.0, f64::NAN] {
        assert!(prepare(cube(), 8, density).is_some(), "density {density}");
    }
    let mut flat = cube();
    for vertex in &mut flat.vertices {
        vertex.z = 0.0;
    }
    assert!(prepare(flat, 8, 1000.0).is_some());
    assert!(prepare(TriangleMesh::default(), 8, 1000.0).is_some());
}
