//! Presses a hand's palm into a ball, and prints how L_phys and its gradient grow with the depth.
//!
//! `cargo run --release -p graspd-sim --example press`

use graspd_geom::{Quaternion, SdfGrid, Vec3};
use graspd_hand::{Hand, HandOptions, HandPose, PoseGradient, allegro};
use graspd_sim::{Scene, SimulatedObject, SimulationParams};
use nalgebra::{Matrix3, Point3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 4 cm in radius, sampled every 2 mm; of the density of water.
    let corner = Vec3::new(-0.06, -0.06, -0.06);
    let spacing = Vec3::new(0.002, 0.002, 0.002);
    let sdf = SdfGrid::from_function(corner, spacing, [61; 3], |p| p.norm() - 0.04)?;
    let inertia = Matrix3::from_diagonal_element(1.7e-4);
    let ball = SimulatedObject::new(sdf, 0.268, Point3::origin(), inertia)?;
    let hand = allegro(&HandOptions::default())?;
    let params = SimulationParams::default();
    let mut scene = Scene::<f32>::new(&hand, &ball, &params);
    println!("depth [mm]   L_phys [N^2]   dL/dx [N^2/m]");
    let mut last = 0.0;
    for depth in [0.0005, 0.001, 0.002, 0.004] {
        // The palm faces along x.
        let pose = HandPose {
            translation: Vec3::new(depth - 0.04, 0.0, 0.0) - hand.palm().center.into(),
            rotation: Quaternion::identity(),
            articulation: hand.open_articulation().to_vec(),
        };
        scene.place(&pose);
        let loss = scene.physics_loss(&vec![0.0; scene.wrench_len()]);
        let mut gradient = PoseGradient::zero(pose.articulation.len());
        scene.pull_back(&pose, &mut gradient);
        println!(
            "{:10.1} {loss:14.4e} {:15.4e}",
            1e3 * depth,
            gradient.translation.x
        );
        assert!(loss > last, "deeper in, the forces grow");
        last = loss;
    }
    Ok(())
}
