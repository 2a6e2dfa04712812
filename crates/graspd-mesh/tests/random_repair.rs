//! Whatever is done to a mesh, it comes back as a solid.

mod damage;

use std::collections::HashMap;

use graspd_geom::{TriangleMesh, box_mesh, signed_volume, sphere_mesh};
use graspd_mesh::{RepairSettings, builtin_object, repair};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// Whether every directed edge occurs once and has its opposite, every face has an area, and the volume is positive.
fn is_solid(mesh: &TriangleMesh) -> Result<(), String> {
    let mut uses: HashMap<(u32, u32), usize> = HashMap::new();
    for (index, &[a, b, c]) in mesh.faces.iter().enumerate() {
        let [p, q, r] = [a, b, c].map(|v| mesh.vertices[v as usize]);
        let longest = (q - p).norm().max((r - q).norm()).max((p - r).norm());
        let twice_area = (q - p).cross(&(r - p)).norm();
        if a == b || b == c || c == a || twice_area <= 1e-10 * longest * longest {
            return Err(format!("face {index} is degenerate"));
        }
        for side in [(a, b), (b, c), (c, a)] {
            *uses.entry(side).or_default() += 1;
        }
    }
    for (&(from, to), &count) in &uses {
        if count != 1 || !uses.contains_key(&(to, from)) {
            return Err(format!("edge {from} -> {to}: {count} uses"));
        }
    }
    let volume = signed_volume(mesh);
    if volume > 0.0 {
        Ok(())
    } else {
        Err(format!("volume {volume}"))
    }
}

fn shapes() -> Vec<TriangleMesh> {
    vec![
        box_mesh(Vector3::new(0.1, 0.2, 0.05), 0.03),
        sphere_mesh(0.05, 0.012),
        builtin_object("mug").unwrap(),
        builtin_object("drill").unwrap(),
    ]
}

/// So many random cases, unless `PROPTEST_CASES` asks for another number.
fn cases(usual: u32) -> ProptestConfig {
    if std::env::var_os("PROPTEST_CASES").is_some() {
        ProptestConfig::default()
    } else {
        ProptestConfig::with_cases(usual)
    }
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn damaged_meshes_come_back_as_solids(
        shape in 0_usize..4,
        seed: u64,
        parts in [0.0..0.15, 0.0..0.5, 0.0..0.2, 0.0..0.3],
    ) {
        let whole = &shapes()[shape];
        let mesh = damage::damaged(whole, seed, parts);
        let settings = RepairSettings { resolution: 32, ..RepairSettings::default() };
        let repaired = repair(&mesh, &settings, "damaged").unwrap();
        prop_assert_eq!(is_solid(&repaired.mesh), Ok(()), "{}", repaired.report.summary());
        let ratio = signed_volume(&repaired.mesh) / signed_volume(whole);
        prop_assert!((0.2..3.0).contains(&ratio), "{} {}", ratio, repaired.report.summary());
    }
}

proptest! {
    #![proptest_config(cases(64))]

    /// Triangles anywhere, which share vertices at random.
    #[test]
    fn any_triangles_become_a_solid(
        points in prop::collection::vec([-0.1..0.1, -0.1..0.1, -0.1..0.1], 4..12),
        corners in prop::collection::vec([0_usize..100, 0..100, 0..100], 1..24),
    ) {
        let mesh = TriangleMesh {
            faces: corners.iter().map(|c| c.map(|v| (v % points.len()) as u32)).collect(),
            vertices: points.iter().map(|&[x, y, z]| Point3::new(x, y, z)).collect(),
        };
        let settings = RepairSettings { resolution: 16, ..RepairSettings::default() };
        match repair(&mesh, &settings, "triangles") {
            Ok(repaired) => {
                prop_assert_eq!(is_solid(&repaired.mesh), Ok(()), "{}", repaired.report.summary());
            }
            // Only if no face has an area.
            Err(error) => prop_assert!(mesh.area() < 1e-12, "{error}"),
        }
    }
}
