//! Many views into one cloud with outward normals.

use graspd_settings::{Ranges, Validate, between, ranges};
use nalgebra::Point3;

use super::smoothing::smooth;
use super::tabletop::{dominant_plane, standing_on};
use super::{DepthView, Plane, RgbdCapture};
use crate::{KdTree, PointCloud};
use graspd_geom::GeometryError;

/// Every so many views are enough to find the table by.
const TABLE_VIEWS: usize = 4;
/// An object stands on a plane that its lowest points are so near to \[m\].
const STANDS_WITHIN: f64 = 0.01;

/// How views become a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusionSettings {
    /// Neighbourhood in which depths must not jump \[pixels in each direction\].
    pub edge_radius: usize,
    /// What is a jump \[m\].
    pub edge_jump: f64,
    /// Side of the cubes whose points are averaged \[m\].
    pub cell: f64,
    /// Points around each that give the surface to which it is moved, and its normal: 6 or more.
    pub neighbours: usize,
    /// Points whose mean distance to 16 neighbours is so many standard deviations above the mean are left out.
    pub outlier_deviations: f64,
}

impl Default for FusionSettings {
    fn default() -> Self {
        Self {
            edge_radius: 1,
            edge_jump: 0.015,
            cell: 0.0015,
            neighbours: 24,
            outlier_deviations: 2.0,
        }
    }
}

impl Validate for FusionSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            edge_radius: between(0.0, 50.0),
            edge_jump: between(1e-4, 10.0),
            cell: between(1e-5, 0.1),
            neighbours: between(6.0, 1000.0),
            outlier_deviations: between(0.1, 1e6),
        }
    }
}

/// What a view gave.
#[derive(Clone, Debug, PartialEq)]
pub struct FusedView {
    /// Its name.
    pub name: String,
    /// How many points of the object it gave.
    pub points: usize,
}

/// The points of all views.
#[derive(Clone, Debug, PartialEq)]
pub struct FusedCloud {
    /// In the frame of the capture, with outward normals.
    pub cloud: PointCloud,
    /// One for each view of the capture.
    pub views: Vec<FusedView>,
    /// Points before averaging and without the strays.
    pub raw_points: usize,
    /// What the object stands on, as the capture tells or as it was found.
    pub table: Option<Plane>,
}

/// Makes one cloud of all views: pixels at edges left out; of views without a mask only what stands on the table
/// (the capture's, or else the plane that most points lie on), the largest connected part; normals estimated in
/// each view by itself and turned to its camera; dense points averaged, those of the two sides of a wall apart;
/// stray points left out; the rest moved onto quadratic surfaces through their neighbours on the same side. Runs on
/// rayon's current thread pool, with the same result for any number of threads.
///
/// # Errors
/// Settings out of range; as [`PointCloud::require_points`] if what is left can be no object.
pub fn fuse(capture: &RgbdCapture, settings: &FusionSettings) -> Result<FusedCloud, GeometryError> {
    settings.validate()?;
    let mut clouds: Vec<PointCloud> = (capture.views.iter())
        .map(|view| seen_by(view, settings))
        .collect();
    let everything = joined(&clouds);
    let stood_on = keep_object(capture, &mut clouds);
    let views = (capture.views.iter().zip(&clouds))
        .map(|(view, cloud)| FusedView {
            name: view.name.clone(),
            points: cloud.points.len(),
        })
        .collect();
    for cloud in &mut clouds {
        cloud.estimate_normals_in_view(settings.neighbours);
    }
    let all = joined(&clouds);
    if all.require_points().is_err() {
        // A wrong unit shows better in all that was seen than in the little that then stands on a table.
        everything.require_points()?;
    }
    all.require_points()?;
    let table = stood_on.or_else(|| found_below(capture, &all, settings));
    let raw_points = all.points.len();
    let thinned = all.thinned(settings.cell)?;
    let mut cloud = thinned.without_outliers(16, settings.outlier_deviations);
    cloud.require_surface()?;
    smooth(&mut cloud, settings.neighbours);
    Ok(FusedCloud {
        cloud,
        views,
        raw_points,
        table,
    })
}

/// A view's points, each with the direction to the camera in place of its normal.
fn seen_by(view: &DepthView, settings: &FusionSettings) -> PointCloud {
    let points = view.points(settings.edge_radius, settings.edge_jump);
    let eye = view.eye();
    let directions = points.iter().map(|p| (eye - p).normalize()).collect();
    PointCloud {
        points,
        normals: directions,
    }
}

/// Leaves of the clouds without a mask only what stands on the table; gives the table, if there is one.
fn keep_object(capture: &RgbdCapture, clouds: &mut [PointCloud]) -> Option<Plane> {
    let unmasked: Vec<usize> = (0..clouds.len())
        .filter(|&i| capture.views[i].mask.is_none())
        .collect();
    let Some(&first) = unmasked.first() else {
        return capture.table;
    };
    let all = unmasked
        .iter()
        .flat_map(|&i| clouds[i].points.iter().copied());
    let all: Vec<Point3<f64>> = all.collect();
    let eye = capture.views[first].eye();
    // Without a table, everything is the object.
    let table = capture.table.or_else(|| dominant_plane(&all, &eye))?;
    let mut kept = standing_on(&all, &table).into_iter().peekable();
    let mut start = 0;
    for i in unmasked {
        let end = start + clouds[i].points.len();
        let mut own = Vec::new();
        while let Some(number) = kept.next_if(|&number| number < end) {
            own.push(number - start);
        }
        clouds[i] = clouds[i].selected(&own);
        start = end;
    }
    Some(table)
}

/// The table in views with masks: the plane that most points lie on of what is not masked, if the object stands on it.
fn found_below(
    capture: &RgbdCapture,
    object: &PointCloud,
    settings: &FusionSettings,
) -> Option<Plane> {
    let mut whole: Vec<Point3<f64>> = Vec::new();
    for view in capture.views.iter().step_by(TABLE_VIEWS) {
        let unmasked = DepthView {
            mask: None,
            ..view.clone()
        };
        whole.extend(unmasked.points(settings.edge_radius, settings.edge_jump));
    }
    let table = dominant_plane(&whole, &capture.views.first()?.eye())?;
    let heights = object.points.iter().map(|p| table.height(p));
    let mut heights: Vec<f64> = heights.collect();
    heights.sort_unstable_by(f64::total_cmp);
    // But for strays.
    let low = *heights.get(heights.len() / 100)?;
    (low.abs() < STANDS_WITHIN).then_some(table)
}

fn joined(clouds: &[PointCloud]) -> PointCloud {
    PointCloud {
        points: clouds
            .iter()
            .flat_map(|c| c.points.iter().copied())
            .collect(),
        normals: clouds
            .iter()
            .flat_map(|c| c.normals.iter().copied())
            .collect(),
    }
}

impl PointCloud {
    /// Puts normals in place of the directions to the camera that saw all the points: of the planes through each
    /// point and its nearest ones, turned to the camera. Of fewer points than make a surface, the directions stay.
    fn estimate_normals_in_view(&mut self, neighbours: usize) {
        if self.require_surface().is_err() {
            return;
        }
        let planes = self.plane_normals(&KdTree::new(&self.points), neighbours);
        for (normal, found) in self.normals.iter_mut().zip(planes) {
            *normal = if found.dot(normal) < 0.0 {
                -found
            } else {
                found
            };
        }
    }
}
