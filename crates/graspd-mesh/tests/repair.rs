//! Repaired meshes are closed, oriented manifolds near the input, and what was good is as it was.

mod damage;

use std::collections::HashMap;

use graspd_geom::{
    GeometryError, TriangleMesh, TriangleTree, box_mesh, flipped, shared_file, signed_volume,
    sphere_mesh, topology, weld_exact,
};
use graspd_mesh::{RepairSettings, RepairTier, RepairedMesh, builtin_object, load_mesh, repair};
use nalgebra::{Point3, Vector3};

fn repaired(mesh: &TriangleMesh) -> RepairedMesh {
    let repaired = repair(mesh, &RepairSettings::default(), "mesh").unwrap();
    assert_solid(&repaired.mesh, "mesh");
    repaired
}

/// Every edge has exactly two faces that run along it in opposite directions, no face is without area, every vertex
/// is used, and the volume is positive.
fn assert_solid(mesh: &TriangleMesh, name: &str) {
    let mut uses: HashMap<(u32, u32), usize> = HashMap::new();
    let mut is_used = vec![false; mesh.vertices.len()];
    for (index, &[a, b, c]) in mesh.faces.iter().enumerate() {
        assert!(
            a != b && b != c && c != a,
            "{name}: face {index} repeats a vertex"
        );
        let [p, q, r] = [a, b, c].map(|v| mesh.vertices[v as usize]);
        let longest = (q - p).norm().max((r - q).norm()).max((p - r).norm());
        let height = (q - p).cross(&(r - p)).norm() / longest;
        assert!(
            height > 1e-10 * longest,
            "{name}: face {index} is flat: {p} {q} {r}"
        );
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *uses.entry((from, to)).or_default() += 1;
            is_used[from as usize] = true;
        }
    }
    for (&(from, to), &count) in &uses {
        assert_eq!(count, 1, "{name}: edge {from} -> {to}");
        assert!(
            uses.contains_key(&(to, from)),
            "{name}: edge {from} -> {to} is open"
        );
    }
    assert!(is_used.iter().all(|&used| used), "{name}: unused vertices");
    assert!(
        signed_volume(mesh) > 0.0,
        "{name}: volume {}",
        signed_volume(mesh)
    );
}

#[test]
fn defective_files_become_solids() {
    for (name, mended) in [
        ("bunny_stanford_holes.obj", true),
        ("camera_gopro.stl", true),
        ("remote_daydream_lowpoly.obj", false),
        ("remote_gearvr.obj", false),
        ("remote_magicleap.obj", false),
        // Loose triangles whose corners coincide: welded, they are a surface but for three holes.
        ("remote_oculusgo_soup.obj", true),
        ("teapot_utah.obj", false),
        ("trofast_box_double_faces.stl", true),
    ] {
        let Some(path) = shared_file(&format!("data/meshes_to_repair/{name}")) else {
            continue;
        };
        let mesh = load_mesh(path).unwrap();
        // A coarser surface where a new one is made: time.
        let settings = RepairSettings {
            resolution: 48,
            ..RepairSettings::default()
        };
        let RepairedMesh {
            mesh: result,
            report,
        } = repair(&mesh, &settings, name).unwrap();
        assert_solid(&result, name);
        assert_eq!(
            report.tier != RepairTier::Resurfaced,
            mended,
            "{name}: {}",
            report.summary()
        );
        // The new surface covers what the old one did.
        let (low, high) = mesh.bounds().unwrap();
        let (new_low, new_high) = result.bounds().unwrap();
        let gap = 0.05 * (high - low).norm();
        assert!(
            (low - new_low).norm() < gap && (high - new_high).norm() < gap,
            "{name}"
        );
        if mended {
            let diagonal = (high - low).norm();
            assert!(
                report.result_to_input < 0.1 * diagonal,
                "{name}: {}",
                report.summary()
            );
            assert!(
                report.input_to_result < 1e-6 * diagonal,
                "{name}: {}",
                report.summary()
            );
        }
    }
}

#[test]
fn closed_scans_are_left_alone() {
    let Some(folder) = shared_file("data/ycb") else {
        return;
    };
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "obj") {
            let mesh = load_mesh(&path).unwrap();
            let result = repair(&mesh, &RepairSettings::default(), "scan").unwrap();
            assert_eq!(
                result.report.tier,
                RepairTier::Untouched,
                "{}",
                path.display()
            );
            assert_eq!(result.mesh, mesh, "{}", path.display());
            count += 1;
        }
    }
    assert_eq!(count, 14);
}

#[test]
fn a_missing_side_of_a_box_is_put_back() {
    let whole = box_mesh(Vector3::new(0.1, 0.1, 0.1), 0.1);
    let mut open = whole.clone();
    open.faces.drain(0..2);
    let RepairedMesh { mesh, report } = repaired(&open);
    assert_eq!(report.tier, RepairTier::Mended);
    assert_eq!(mesh.vertices, whole.vertices);
    assert_eq!(mesh.faces[..10], open.faces[..]);
    assert!((signed_volume(&mesh) - 1e-3).abs() < 1e-12);
    let [hole] = report.holes[..] else {
        panic!("{report:?}");
    };
    assert_eq!(hole.edges, 4);
    assert!((hole.length - 0.4).abs() < 1e-12);
    assert!((hole.diameter - 0.02_f64.sqrt()).abs() < 1e-12);
    assert!((hole.area - 0.01).abs() < 1e-12);
}

#[test]
fn a_hole_in_a_ball_gets_a_patch_as_fine_as_the_ball() {
    let whole = sphere_mesh(0.05, 0.004);
    let mut open = whole.clone();
    open.faces
        .retain(|face| !face.iter().any(|&v| whole.vertices[v as usize].z > 0.045));
    let RepairedMesh { mesh, report } = repaired(&open);
    assert_eq!(report.holes.len(), 1);
    let removed = whole.faces.len() - open.faces.len();
    let added = mesh.faces.len() - open.faces.len();
    assert!(
        (removed / 2..3 * removed).contains(&added),
        "{added} faces for {removed}"
    );
    // The lid is no farther from the ball than a flat one, which is 5 mm and the cut's teeth below the pole.
    assert!(report.result_to_input < 0.03);
    assert!((signed_volume(&mesh) / signed_volume(&whole) - 1.0).abs() < 0.04);
    assert_eq!(topology(&mesh).euler_number, 2);
}

#[test]
fn loose_flipped_doubled_triangles_become_the_box_again() {
    let whole = box_mesh(Vector3::new(0.1, 0.2, 0.3), 0.05);
    let mut soup = TriangleMesh::default();
    for (index, &[a, b, c]) in whole.faces.iter().enumerate() {
        let face = if index % 3 == 0 { [a, c, b] } else { [a, b, c] };
        for _ in 0..1 + usize::from(index % 5 == 0) {
            let one = TriangleMesh {
                vertices: face.map(|v| whole.vertices[v as usize]).to_vec(),
                faces: vec![[0, 1, 2]],
            };
            soup.append(&one);
        }
    }
    let RepairedMesh { mesh, report } = repaired(&soup);
    assert_eq!(report.tier, RepairTier::Mended, "{}", report.summary());
    assert!(report.holes.is_empty());
    assert_eq!(report.copies_dropped, whole.faces.len().div_ceil(5));
    assert_eq!(report.faces_flipped, whole.faces.len().div_ceil(3));
    assert_eq!(mesh.vertices.len(), whole.vertices.len());
    assert!((signed_volume(&mesh) - 6e-3).abs() < 1e-12);
}

#[test]
fn nearly_coincident_edges_are_welded_and_others_are_not() {
    let mut soup = box_mesh(Vector3::new(0.1, 0.1, 0.1), 0.1);
    // One side of the box with vertices of its own, a micrometre off.
    let side: Vec<[u32; 3]> = soup.faces.drain(0..2).collect();
    let mut lid = weld_exact(&TriangleMesh {
        vertices: soup.vertices.clone(),
        faces: side,
    });
    lid.vertices
        .iter_mut()
        .for_each(|p| *p += Vector3::new(3e-7, -2e-7, 4e-7));
    soup.append(&lid);
    let RepairedMesh { mesh, report } = repaired(&soup);
    assert_eq!((report.vertices_welded, report.holes.len()), (4, 0));
    assert_eq!((mesh.vertices.len(), mesh.faces.len()), (8, 12));
}

#[test]
fn boxes_that_share_an_edge_are_cut_apart() {
    let one = box_mesh(Vector3::repeat(0.1), 0.1);
    let mut two = one.clone();
    let mut other = one.clone();
    other
        .vertices
        .iter_mut()
        .for_each(|p| *p += Vector3::new(0.1, 0.1, 0.0));
    two.append(&other);
    let joined = weld_exact(&two);
    assert_eq!(joined.vertices.len(), 14);
    let RepairedMesh { mesh, report } = repaired(&joined);
    assert_eq!(report.tier, RepairTier::Mended);
    assert!(report.vertices_split >= 2, "{}", report.summary());
    assert_eq!(mesh.faces.len(), 24);
    assert!((signed_volume(&mesh) - 2e-3).abs() < 1e-12);
}

#[test]
fn inner_shells_and_crumbs_are_dropped_and_the_mesh_is_turned_outward() {
    let mut mesh = flipped(&sphere_mesh(0.05, 0.01));
    mesh.append(&sphere_mesh(0.02, 0.01));
    let mut crumb = sphere_mesh(0.0005, 0.0005);
    crumb.vertices.iter_mut().for_each(|p| p.x += 0.06);
    mesh.append(&crumb);
    // The crumb is open.
    mesh.faces.pop();
    let RepairedMesh { mesh, report } = repaired(&mesh);
    assert_eq!(report.tier, RepairTier::Mended);
    assert_eq!(
        (
            report.inner_components_dropped,
            report.small_components_dropped
        ),
        (1, 1)
    );
    assert_eq!(mesh.faces.len(), sphere_mesh(0.05, 0.01).faces.len());
    assert_eq!(report.faces_flipped, mesh.faces.len());
}

#[test]
fn a_wall_inside_a_box_is_dropped() {
    let whole = box_mesh(Vector3::repeat(0.1), 0.1);
    let mut walled = whole.clone();
    let corner = |x: f64, y: f64, z: f64| {
        let p = Point3::new(x, y, z);
        let found = whole
            .vertices
            .iter()
            .position(|q| (p - q).norm() < 1e-9)
            .unwrap();
        found as u32
    };
    let h = 0.05;
    let [a, b, c, d] = [
        corner(-h, -h, -h),
        corner(h, h, -h),
        corner(h, h, h),
        corner(-h, -h, h),
    ];
    walled.faces.push([a, b, c]);
    walled.faces.push([a, c, d]);
    let RepairedMesh { mesh, report } = repaired(&walled);
    assert_eq!(report.inner_components_dropped, 1, "{}", report.summary());
    assert_eq!(report.tier, RepairTier::Mended);
    assert_eq!(mesh.faces.len(), 12);
}

#[test]
fn crossing_solids_become_their_union() {
    let mut mesh = box_mesh(Vector3::new(0.1, 0.02, 0.02), 0.02);
    mesh.append(&box_mesh(Vector3::new(0.02, 0.1, 0.02), 0.02));
    mesh.faces.remove(7);
    let RepairedMesh { mesh, report } = repaired(&mesh);
    assert_eq!(report.tier, RepairTier::Resurfaced);
    let exact = 2.0 * 0.1 * 0.02 * 0.02 - 0.02_f64.powi(3);
    assert!(
        (signed_volume(&mesh) / exact - 1.0).abs() < 0.02,
        "{}",
        signed_volume(&mesh) / exact
    );
    assert_eq!(topology(&mesh).components, 1);
    // A face of 20 mm is missing in the input, and so its middle is a third of its height away from it.
    assert!(report.result_to_input < 0.007);
    // The edges of the boxes are cut off by less than a cell; the walls inside are gone.
    let tree = TriangleTree::new(&mesh).unwrap();
    assert!(tree.distance(&Point3::origin()) > 0.009);
}

#[test]
fn an_open_sheet_becomes_a_thin_shell() {
    let sheet = TriangleMesh {
        vertices: vec![
            Point3::new(0.0, 0.0, 0.0),
            Point3::new(0.1, 0.0, 0.0),
            Point3::new(0.1, 0.1, 0.0),
            Point3::new(0.0, 0.1, 0.0),
        ],
        faces: vec![[0, 1, 2], [0, 2, 3]],
    };
    let settings = RepairSettings {
        sheet_thickness: 0.004,
        ..RepairSettings::default()
    };
    let RepairedMesh { mesh, report } = repair(&sheet, &settings, "sheet").unwrap();
    assert_solid(&mesh, "sheet");
    assert_eq!(report.tier, RepairTier::Resurfaced);
    assert!(report.thickened > 0.99);
    assert!(
        (signed_volume(&mesh) / (0.01 * 0.004) - 1.0).abs() < 0.15,
        "{}",
        signed_volume(&mesh)
    );
    assert!(
        report.result_to_input < 0.0022 && report.input_to_result < 0.0022,
        "{}",
        report.summary()
    );
}

#[test]
fn a_mug_with_defects_stays_a_mug() {
    let whole = builtin_object("mug").unwrap();
    let damaged = damage::damaged(&whole, 7, [0.01, 0.02, 0.02, 0.02]);
    let RepairedMesh { mesh, report } = repaired(&damaged);
    assert_eq!(report.tier, RepairTier::Mended, "{}", report.summary());
    assert!((signed_volume(&mesh) / signed_volume(&whole) - 1.0).abs() < 0.02);
    // The handle is still there.
    assert_eq!(topology(&mesh).euler_number, topology(&whole).euler_number);
}

#[test]
fn a_scan_with_defects_is_mended_and_not_made_anew() {
    let Some(path) = shared_file("data/ycb/025_mug.obj") else {
        return;
    };
    let whole = load_mesh(path).unwrap();
    let damaged = damage::damaged(&whole, 5, [0.01, 0.02, 0.02, 0.0]);
    let RepairedMesh { mesh, report } = repaired(&damaged);
    assert_eq!(report.tier, RepairTier::Mended, "{}", report.summary());
    assert!((signed_volume(&mesh) / signed_volume(&whole) - 1.0).abs() < 0.01);
    // The faces that were good are there to the last bit, and nothing of the outer surface is missing.
    assert!(report.input_to_result < 1e-7, "{}", report.summary());
    let tree = TriangleTree::new(&mesh).unwrap();
    let farthest = whole.vertices.iter().map(|p| tree.distance(p));
    assert!(farthest.fold(0.0, f64::max) < 2e-3);
}

#[test]
fn bad_input_is_refused() {
    let message = |mesh: &TriangleMesh, settings: RepairSettings| {
        repair(mesh, &settings, "cup.obj").unwrap_err().to_string()
    };
    let settings = RepairSettings::default();
    assert!(message(&TriangleMesh::default(), settings).contains("no faces"));
    let good = box_mesh(Vector3::repeat(0.1), 0.1);
    let mut mesh = good.clone();
    mesh.vertices[3].y = f64::NAN;
    assert!(message(&mesh, settings).contains("vertex 3"));
    mesh = good.clone();
    mesh.faces[2][1] = 99;
    assert!(message(&mesh, settings).contains("vertex 99"));
    let point = TriangleMesh {
        vertices: vec![Point3::new(1.0, 2.0, 3.0); 3],
        faces: vec![[0, 1, 2]],
    };
    assert!(matches!(
        repair(&point, &settings, "x").unwrap_err(),
        GeometryError::NoVolume { .. }
    ));
    let refused = |change: fn(&mut RepairSettings)| {
        let mut settings = settings;
        change(&mut settings);
        message(&good, settings)
    };
    assert!(refused(|s| s.resolution = 4).contains("resolution"));
    assert!(refused(|s| s.weld_distance = -1.0).contains("weld_distance"));
    assert!(refused(|s| s.smallest_component = f64::NAN).contains("smallest_component"));
    assert!(refused(|s| s.sheet_thickness = f64::INFINITY).contains("sheet_thickness"));
}
