//! A constrained servo loop at 1 kHz: features to pixels, inside the image, inside the joints' range, speed and acceleration.
//!
//!     cargo run --release --example 05_servo_loop
use handeye::infer::Sighting;
use handeye::rig::catalog;
use handeye::servo::limits::{InImage, TipSpeed};
use handeye::servo::tasks::ImagePoints;
use handeye::servo::{Arm, Configuration, Goal, Limit, Stepper};
use handeye::simulate::{SimulateOptions, simulate};

fn main() -> Result<(), handeye::Error> {
    let rig = catalog::rig("ur5")?;
    let places = simulate(&rig, &SimulateOptions { samples: 2, seed: 1, ..SimulateOptions::default() })?.truth;
    let [mut joints, goal] = [0, 1].map(|index| places.samples[index].joints.clone().unwrap_or_default());
    let arm = Arm::new(&rig)?;
    let mut at = Configuration::default();

    // Where the features shall be: as they are seen at the goal.
    arm.configure(&goal, &mut at);
    let pairs = (0..rig.cameras.len()).flat_map(|camera| (0..rig.features.len()).map(move |feature| (camera, feature)));
    let see = |(camera, feature)| Some(Sighting { camera, feature, pixel: arm.pixel(&at, camera, feature)? });
    let task = ImagePoints { targets: pairs.filter_map(see).collect(), seen: Vec::new(), sd: 1.0 };
    // Errors fall by the rate 5/s, so that joints with limited acceleration can stop.
    let dt: f64 = 0.001;
    let goals = [Goal { share: 1.0 - (-5.0 * dt).exp(), ..Goal::new(&task) }];

    let image = InImage { camera: 0, features: (0..rig.features.len()).collect(), margin: 10.0, strength: 10.0 };
    let slow = TipSpeed { speed: 0.5, strength: 1.0 };
    let limits: [&dyn Limit; 2] = [&image, &slow];
    let mut stepper = Stepper::default();
    for tick in 0..6_000 {
        arm.configure(&joints, &mut at);
        let step = stepper.step(&arm, &at, &goals, &limits, dt);
        joints.iter_mut().zip(&step.motion).for_each(|(joint, motion)| *joint += motion);
        at.velocity.iter_mut().zip(&step.motion).for_each(|(velocity, motion)| *velocity = motion / dt);
        if tick % 500 == 0 {
            let rms = step.errors[0][0] / (task.targets.len() as f64).sqrt();
            println!("{:.1} s: {rms:8.3} px rms, {} constraints active", f64::from(tick) * dt, step.active.len());
        }
    }
    Ok(())
}
