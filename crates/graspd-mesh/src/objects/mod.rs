//! Built-in objects to grasp: household things of about the size of well-known scans, made by code.

mod banana;
mod drill;
mod mug;
mod packages;

use nalgebra::Isometry3;

use graspd_geom::{MassProperties, TriangleMesh};

/// The longest edge that the built-in objects are made with \[m\] (diagonals are longer): short enough for smooth
/// normals, long enough for a few thousand faces.
const EDGE: f64 = 0.0045;

/// An object that needs no file.
#[derive(Clone, Copy, Debug)]
pub struct BuiltinObject {
    /// What [`builtin_object`] knows it by.
    pub name: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Extents along x, y and z \[m\].
    pub dimensions: [f64; 3],
    make: fn() -> TriangleMesh,
}

impl BuiltinObject {
    /// The object as a closed, outward oriented mesh, standing or lying as on a table with z up, its centre of mass
    /// (of the solid material, of constant density) at the origin.
    pub fn mesh(&self) -> TriangleMesh {
        let mesh = (self.make)();
        match MassProperties::new(&mesh, 1.0, self.name) {
            Ok(mass) => mesh.transformed(&Isometry3::from(-mass.center_of_mass.coords)),
            // Not reached: every built-in object is tested to have a volume.
            Err(_) => mesh,
        }
    }
}

/// All built-in objects.
pub const BUILTIN_OBJECTS: &[BuiltinObject] = &[
    BuiltinObject {
        name: "mug",
        description: "a mug with an inside and a handle that fingers fit through",
        dimensions: [0.117, 0.0931, 0.0813],
        make: mug::mug,
    },
    BuiltinObject {
        name: "can",
        description: "a food can with rims and recessed ends",
        dimensions: [0.0678, 0.0678, 0.1019],
        make: packages::can,
    },
    BuiltinObject {
        name: "box",
        description: "a carton with sharp edges",
        dimensions: [0.0495, 0.0942, 0.176],
        make: packages::carton,
    },
    BuiltinObject {
        name: "bottle",
        description: "an oval squeeze bottle with shoulders, cap and nozzle",
        dimensions: [0.0972, 0.0666, 0.1913],
        make: packages::bottle,
    },
    BuiltinObject {
        name: "bowl",
        description: "a bowl, open at the top, with a wall of 3 mm",
        dimensions: [0.161, 0.161, 0.055],
        make: packages::bowl,
    },
    BuiltinObject {
        name: "banana",
        description: "a banana lying on its side",
        dimensions: [0.1734, 0.0739, 0.0353],
        make: banana::banana,
    },
    BuiltinObject {
        name: "drill",
        description: "a cordless drill on its battery, chuck along x",
        dimensions: [0.184, 0.0573, 0.187],
        make: drill::drill,
    },
];

/// The mesh of a built-in object (see [`BuiltinObject::mesh`]); `None` if there is none of that name.
pub fn builtin_object(name: &str) -> Option<TriangleMesh> {
    let object = BUILTIN_OBJECTS.iter().find(|object| object.name == name)?;
    Some(object.mesh())
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_geom::{require_closed, signed_volume, topology};

    /// Polygons only come near the circles that the stated dimensions speak of.
    const DIMENSION_TOLERANCE: f64 = 0.001;
    const LONGEST_EDGE: f64 = 0.008;

    #[test]
    fn objects_are_closed_surfaces_of_the_stated_size() {
        for object in BUILTIN_OBJECTS {
            let name = object.name;
            let mesh = builtin_object(name).unwrap();
            require_closed(&mesh, name).unwrap();
            let topology = topology(&mesh);
            let (low, high) = mesh.bounds().unwrap();
            let extents = high - low;
            let volume_cm3 = 1e6 * signed_volume(&mesh);
            let longest = (0..mesh.faces.len())
                .flat_map(|face| {
                    let [a, b, c] = mesh.corners(face);
                    [(b - a).norm(), (c - b).norm(), (a - c).norm()]
                })
                .fold(0.0, f64::max);
            assert_eq!(topology.components, 1, "{name}");
            assert_eq!(topology.non_manifold_edges, 0, "{name}");
            // The handle makes the mug a torus, topologically; all else is a sphere.
            let euler_number = if name == "mug" { 0 } else { 2 };
            assert_eq!(topology.euler_number, euler_number, "{name}");
            for axis in 0..3 {
                let difference = extents[axis] - object.dimensions[axis];
                assert!(
                    difference.abs() < DIMENSION_TOLERANCE,
                    "{name} {axis} {difference}"
                );
            }
            let expected = match name {
                "mug" => 95.0..140.0,
                "can" => 310.0..350.0,
                "box" => 820.0..821.0,
                "bottle" => 550.0..650.0,
                "bowl" => 95.0..110.0,
                "banana" => 100.0..180.0,
                "drill" => 600.0..750.0,
                _ => unreachable!("{name} has no expected volume"),
            };
            assert!(expected.contains(&volume_cm3), "{name} {volume_cm3}");
            assert!(longest < LONGEST_EDGE, "{name} {longest}");
            let mass = MassProperties::new(&mesh, 1000.0, name).unwrap();
            assert!(mass.center_of_mass.coords.norm() < 1e-9, "{name}");
        }
    }

    #[test]
    fn unknown_names_give_nothing() {
        assert!(builtin_object("anvil").is_none());
    }
}
