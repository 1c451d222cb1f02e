//! A closed loop around a robot that errs: measure, ask, move, until the loop says why it stops.
//!
//!     cargo run --release --example 06_closed_loop
use handeye::infer::Names;
use handeye::recording::Sample;
use handeye::rig::catalog;
use handeye::servo::{LoopSettings, Measurement, ModelBased, ServoLoop, Takes};
use handeye::simulate::world::{Execution, Tracker, World, WorldOptions};

fn main() -> Result<(), handeye::Error> {
    let rig = catalog::rig("ur5")?;
    // Stands in for a robot and its cameras: every motion is 5 % off, pixels by 0.3 px, readings by 1 mrad.
    let options = WorldOptions {
        execution: Execution { share: 0.05, ..Execution::default() },
        readings: Some(1e-3),
        tracker: Tracker::Gaussian(0.3),
        ..WorldOptions::default()
    };
    let mut robot = World::new(&rig, &[-0.6, -1.7, 1.7, -1.2, -1.2, -0.5], options)?;
    let names = Names::new(&rig, robot.header());

    let mut controller = ModelBased::new(&rig)?;
    controller.takes = Takes::JointVelocity;
    let mut servo = ServoLoop::new(controller, LoopSettings { tolerance_px: 0.6, ..LoopSettings::default() });
    // Where the features shall be: as they are seen with other joints.
    let goal = robot.exact(&[0.5, -1.3, 1.2, -1.6, -1.7, 0.6]);
    servo.aim(&names.sightings(&Sample { pixels: goal, ..Sample::default() }));

    let dt = 0.5;
    loop {
        let sample = robot.look();
        let seen = names.sightings(&sample);
        let joints = sample.joints.as_deref().unwrap_or_default();
        let measured = Measurement { time: sample.time.unwrap_or(f64::NAN), joints, seen: &seen, points: &[] };
        let tick = servo.tick(robot.time(), &measured, &[], dt)?;
        println!("{:4.1} s: {:8.3} px", robot.time(), tick.error_px.unwrap_or(f64::NAN));
        if let Some(stop) = tick.stop {
            println!("{}", stop.words(&rig, &[]));
            return Ok(());
        }
        robot.execute(&tick.command, dt)?;
    }
}
