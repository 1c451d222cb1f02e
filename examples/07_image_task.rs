//! A task in images without a rig: checked for what it leaves open, then carried out by what two cameras see.
//!
//!     cargo run --release --example 07_image_task
use handeye::servo::LimitRows;
use handeye::servo::image_tasks::{CheckSettings, Geometry, ImageTask, catalog, check};
use handeye::servo::uncalibrated::{Quantity, Settings, Uncalibrated};
use handeye::solvers::Pose;
use handeye::solvers::nalgebra::Vector3;

fn main() -> Result<(), handeye::Error> {
    let (name, text) = catalog::ALL[0];
    let task = ImageTask::parse(text, name)?;
    // Stands in for a hand and two cameras, of which the controller knows nothing.
    let world = Geometry::drawn(&task, 1);
    let found = check(&task, &world, &CheckSettings::default())?;
    println!("{name}: {} rows fix {} degrees of freedom", found.rows, found.fixed);
    found.free.words.iter().for_each(|words| println!("  free: {words}"));
    found.alternatives.iter().for_each(|other| println!("  may also end {}", other.words));

    // What is moved: the hand's rotation vector [rad], and its position in units of 0.1 m.
    let pose = |at: &[f64]| Pose::new(Vector3::new(at[0], at[1], at[2]), 0.1 * Vector3::new(at[3], at[4], at[5]));
    let mut at = [0.3, -0.2, 0.25, 0.4, -0.3, 0.5];
    let quantities = (0..6).map(|i| Quantity { name: format!("q{i}"), ..Quantity::default() }).collect();
    let rows = task.signals(&world.see(&task, &pose(&at)))?;
    let mut servo = Uncalibrated::new(quantities, rows, Settings::default())?;
    let mut limits = LimitRows::default();
    limits.clear(at.len());
    for step in 0..=40 {
        let errors: Vec<f64> = task.errors(&world.see(&task, &pose(&at))).iter().map(|row| row.error).collect();
        let command = servo.step(&at, &errors, &limits, 1.0)?;
        if step % 5 == 0 {
            let worst = errors.iter().fold(0.0, |most: f64, error| most.max(error.abs()));
            println!("step {step:2}: {worst:8.3} px at most, {:?}", command.phase);
        }
        at.iter_mut().zip(command.motion).for_each(|(at, motion)| *at += motion);
    }
    Ok(())
}
