//! A grasp that follows its object: fits a hand to the built-in mug, lets the mug grow, and moves the hand along by
//! the derivative of the fit by the object's shape, without fitting again.
//!
//! `cargo run --release -p graspd-tests --example follow_shape -- [HAND] [GROWTH_MM]`; by default `allegro 1`. The
//! same derivative leads a grasp along with a reconstruction: whatever changes the signed distance.

use std::error::Error;

use graspd::{GraspObject, NamedMesh, SynthesisSettings, draw_start};
use graspd_fit::{FittedHand, HandFitter, SkinFitSettings};
use graspd_geom::{Quaternion, SdfGrid, Vec3};
use graspd_hand::{HandPose, builtin_hand};

/// Samples of the object's distance grid along each axis.
const RESOLUTION: usize = 128;
/// Starts of which the best fit is taken.
const STARTS: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let hand =
        builtin_hand(arguments.next().as_deref().unwrap_or("allegro")).ok_or("no such hand")?;
    let growth = arguments
        .next()
        .map_or(Ok(1.0), |text| text.parse::<f64>())?
        * 1e-3;

    let settings = SkinFitSettings::default();
    let fitter = HandFitter::new(&*hand, &settings)?;
    let object = GraspObject::prepare(NamedMesh::load("mug", 1.0)?, RESOLUTION, 1000.0, &|_| {})?;
    let small = object.simulated.sdf();
    // Every distance is less by the growth.
    let larger = |p: Vec3<f64>| small.distance(p) - growth;
    let large = SdfGrid::from_function(small.origin(), small.spacing(), small.dims(), larger)?;

    let mut best: Option<FittedHand> = None;
    for index in 0..STARTS {
        let start = draw_start(&object, &*hand, &SynthesisSettings::default(), 0, index)?;
        let fitted = fitter.fit(small, &start, &mut |_, _| {});
        if best.as_ref().is_none_or(|best| fitted.cost < best.cost) {
            best = Some(fitted);
        }
    }
    let fitted = best.ok_or("no start")?;
    let rate = fitter.sensitivity(small, &fitted.pose, &|_| -1.0);
    let followed = moved(&fitted.pose, &rate, growth);

    // No iterations: how a pose stands to an object.
    let settings = SkinFitSettings {
        iterations: 0,
        ..settings.clone()
    };
    let looking = HandFitter::new(&*hand, &settings)?;
    let look = |sdf: &SdfGrid, pose: &HandPose| looking.refine(sdf, pose, &mut |_, _| {});
    let again = fitter.refine(&large, &fitted.pose, &mut |_, _| {});
    println!("                              contact [cm2]  deepest [mm]");
    for (name, found) in [
        ("fitted", look(small, &fitted.pose)),
        ("object grown, hand as it was", look(&large, &fitted.pose)),
        ("hand moved by the derivative", look(&large, &followed)),
        ("fitted again", again),
    ] {
        let (area, deepest) = (1e4 * found.contact_area, 1e3 * found.deepest);
        println!("{name:28}  {area:13.1}  {deepest:12.2}");
    }
    Ok(())
}

/// Moves a pose at a rate of (translation, rotation vector, joints).
fn moved(pose: &HandPose, rate: &[f64], by: f64) -> HandPose {
    let part = |first: usize| Vec3::new(rate[first], rate[first + 1], rate[first + 2]) * by;
    let joints = pose.articulation.iter().zip(&rate[6..]);
    HandPose {
        translation: pose.translation + part(0),
        rotation: Quaternion::exp(part(3)).compose(pose.rotation),
        articulation: joints.map(|(value, rate)| value + rate * by).collect(),
    }
}
