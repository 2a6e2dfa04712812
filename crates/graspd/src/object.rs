//! An object made ready for synthesis: mesh, distance grid, mass, surface sampler.

use std::path::{Path, PathBuf};

use graspd_geom::{
    DiskCache, GeometryError, MassProperties, SdfGrid, SdfSampling, SignedDistance, TriangleMesh,
    closed_surface,
};
use graspd_mesh::{
    BUILTIN_OBJECTS, RepairReport, RepairSettings, builtin_object, load_mesh, repair,
};
use graspd_settings::POSITIVE;
use graspd_sim::SimulatedObject;

use crate::GraspError;

/// Distance by which the grid reaches beyond the mesh's bounding box \[m\]; paper: 1 cm.
pub const PAPER_PADDING: f64 = 0.01;
/// Samples of the grid along each axis; paper: 256.
pub const PAPER_RESOLUTION: usize = 256;

/// A closed mesh with its name and where it came from.
#[derive(Clone, Debug)]
pub struct NamedMesh {
    /// The built-in object's name, or the file's name without folder and extension.
    pub name: String,
    /// The file; `None` for a built-in object.
    pub path: Option<PathBuf>,
    /// The factor that the coordinates were multiplied by.
    pub scale: f64,
    /// The mesh after scaling, closed and outward oriented \[m\].
    pub mesh: TriangleMesh,
    /// What was done to close it, lengths after scaling; `None` if the file's own surface is closed.
    pub repair: Option<RepairReport>,
}

impl NamedMesh {
    /// A built-in object, or else the closed mesh in a file, multiplied by `scale`.
    ///
    /// # Errors
    /// [`GraspError::UnknownObject`] if there is neither; otherwise if the file cannot be read, the mesh is not
    /// closed, or the scale is not positive.
    pub fn load(name_or_path: &str, scale: f64) -> Result<Self, GraspError> {
        Self::load_with(name_or_path, scale, None)
    }

    /// As [`NamedMesh::load`], but a mesh that is open or not consistently oriented is repaired.
    ///
    /// There is no other closed surface to judge grasps against: everything downstream, the judge included, sees the
    /// repaired mesh only. [`NamedMesh::repair`] tells what was done.
    ///
    /// # Errors
    /// As [`NamedMesh::load`], and if the mesh encloses nothing even so.
    pub fn load_repaired(
        name_or_path: &str,
        scale: f64,
        settings: &RepairSettings,
    ) -> Result<Self, GraspError> {
        Self::load_with(name_or_path, scale, Some(settings))
    }

    fn load_with(
        name_or_path: &str,
        scale: f64,
        settings: Option<&RepairSettings>,
    ) -> Result<Self, GraspError> {
        POSITIVE.check("scale", &scale)?;
        if let Some(mesh) = builtin_object(name_or_path) {
            return Ok(Self {
                name: name_or_path.to_owned(),
                path: None,
                scale,
                mesh: mesh.scaled(scale),
                repair: None,
            });
        }
        let path = Path::new(name_or_path);
        let mesh = load_mesh(path).map_err(|error| match error {
            // A name that is no file's either is more likely misspelt than in need of conversion.
            GeometryError::UnsupportedFormat { .. } if !path.exists() => unknown(name_or_path),
            error => error.into(),
        })?;
        let (mesh, repair) = match (closed_surface(&mesh, name_or_path), settings) {
            (Ok(closed), _) => (closed.scaled(scale), None),
            // A closed surface that encloses nothing is no object with defects.
            (
                Err(
                    GeometryError::Open { .. }
                    | GeometryError::NotOriented { .. }
                    | GeometryError::DuplicateFaces { .. },
                ),
                Some(settings),
            ) => {
                let repaired = repair(&mesh.scaled(scale), settings, name_or_path)?;
                (repaired.mesh, Some(repaired.report))
            }
            (Err(error), _) => return Err(error.into()),
        };
        Ok(Self {
            name: path.file_stem().map_or_else(
                || name_or_path.into(),
                |stem| stem.to_string_lossy().into_owned(),
            ),
            path: Some(path.to_owned()),
            scale,
            mesh,
            repair,
        })
    }

    /// What errors call it: the file, or the built-in name.
    pub fn label(&self) -> String {
        self.path
            .as_ref()
            .map_or_else(|| self.name.clone(), |path| path.display().to_string())
    }

    /// The file as records keep it; `None` for a built-in object.
    pub fn path_text(&self) -> Option<String> {
        let path = self.path.as_ref()?;
        Some(path.to_string_lossy().into_owned())
    }

    /// How the surface was closed, as records keep it; `None` if it is closed as it is.
    pub fn repair_name(&self) -> Option<String> {
        let report = self.repair.as_ref()?;
        Some(report.tier.name().into())
    }

    /// The longest side of the bounding box \[m\].
    pub fn largest_side(&self) -> f64 {
        self.mesh
            .bounds()
            .map_or(0.0, |(low, high)| (high - low).max())
    }
}

fn unknown(name: &str) -> GraspError {
    let names: Vec<&str> = BUILTIN_OBJECTS.iter().map(|object| object.name).collect();
    GraspError::UnknownObject {
        name: name.to_owned(),
        built_in: names.join(", "),
    }
}

/// An object ready to be grasped.
pub struct GraspObject {
    /// Its mesh, name and origin.
    pub source: NamedMesh,
    /// Its exact signed distance.
    pub distance: SignedDistance,
    /// What the simulation sees.
    pub simulated: SimulatedObject,
    /// Where what takes long to compute about it is kept, if anywhere.
    pub cache: Option<DiskCache>,
}

impl GraspObject {
    /// Builds the distance grid of `resolution`^3 samples and the mass properties at `density` \[kg/m^3\].
    ///
    /// `progress` is called with the fraction of the grid that is done.
    ///
    /// # Errors
    /// If the mesh encloses no volume, or the resolution is out of range.
    pub fn prepare(
        source: NamedMesh,
        resolution: usize,
        density: f64,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, GraspError> {
        Self::prepare_cached(source, resolution, density, None, progress)
    }

    /// As [`GraspObject::prepare`], with the distance grid from `cache` if it is there, and stored there if not; the
    /// result is the same to the last bit. [`synthesize_grasps`](crate::synthesize_grasps) does so with what the
    /// judge needs. [`DiskCache::fault`] tells of a cache that cannot be used.
    ///
    /// # Errors
    /// As [`GraspObject::prepare`].
    pub fn prepare_cached(
        source: NamedMesh,
        resolution: usize,
        density: f64,
        cache: Option<DiskCache>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, GraspError> {
        let sampling = SdfSampling::exact(resolution, PAPER_PADDING);
        Self::prepare_sampled(source, &sampling, density, cache, progress)
    }

    /// As [`GraspObject::prepare_cached`], with any sampling of the distance grid: its padding, too, may differ from
    /// the paper's.
    ///
    /// # Errors
    /// As [`GraspObject::prepare`].
    pub fn prepare_sampled(
        source: NamedMesh,
        sampling: &SdfSampling,
        density: f64,
        cache: Option<DiskCache>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, GraspError> {
        let distance = SignedDistance::new(&source.mesh)?;
        let sdf = match &cache {
            Some(cache) => SdfGrid::sample_cached(&distance, sampling, cache, progress)?,
            None => SdfGrid::sample(&distance, sampling, progress)?,
        };
        let mass = MassProperties::new(&source.mesh, density, &source.label())?;
        let simulated = SimulatedObject::new(sdf, mass.mass, mass.center_of_mass, mass.inertia)?;
        Ok(Self {
            source,
            distance,
            simulated,
            cache,
        })
    }
}
