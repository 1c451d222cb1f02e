//! Infers poses and joints of a known rig from pixels: all branches, with probability, and told apart by a motion; and joints for a pose.
//!
//!     cargo run --release --example 04_infer
use handeye::infer::{InferOptions, Inference, InverseKinematics, InverseOptions, Moment, Names, Prior};
use handeye::rig::{Model, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use std::f64::consts::TAU;

fn main() -> Result<(), handeye::Error> {
    let mut rig = catalog::rig("ur5")?;
    rig.noise.joint_action = 0.01;
    let simulation = simulate(&rig, &SimulateOptions { samples: 2, seed: 1, ..SimulateOptions::default() })?;
    let (first, second) = (&simulation.recording.samples[0], &simulation.recording.samples[1]);

    // An arm that may turn all the way round has several branches that explain the same pixels.
    for joint in &mut rig.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (Some(-TAU), Some(TAU));
    }
    let names = Names::new(&rig, &simulation.recording);
    let mut inference = Inference::new(&rig, InferOptions::default())?;
    let seen = names.sightings(second);
    let pose = &inference.poses(&seen)[0];
    println!("tip at {:.4?} m, {:.2} mm sd", pose.pose.translation.as_slice(), 1e3 * pose.covariance[(3, 3)].sqrt());
    for branch in inference.joints(&seen, &Prior::none())? {
        println!("{:.2}: joints {:.3?} rad, {:.2} px rms", branch.probability, branch.joints, branch.rms_px);
    }

    // The motion that was commanded before tells which.
    let moments = [
        Moment { sightings: names.sightings(first), action: first.joint_action.clone() },
        Moment { sightings: seen.clone(), action: None },
    ];
    let known = inference.joints_of_history(&moments, &Prior::none())?.remove(0);
    println!("after a motion: joints {:.3?} rad, probability {:.3}", known.joints, known.probability);
    println!("the truth:      joints {:.3?} rad", simulation.truth.samples[1].joints.as_deref().unwrap_or_default());

    // One feature in one image leaves four directions open: the joints stay near the start there.
    let little = inference.joints_near(&seen[..1], &Prior::start(&known.joints))?;
    println!("one detection leaves {} directions open", little.open.len());

    // And back: joints for a pose 5 cm higher, by inverse kinematics alone.
    let mut inverse = InverseKinematics::new(&rig, InverseOptions::default())?;
    let mut target = Model::new(&rig)?.tip(&known.joints);
    target.translation.z += 0.05;
    let found = inverse.solve(&target, &known.joints);
    println!("5 cm higher:    joints {:.3?} rad, {:.1e} m off", found.joints, found.xyz);
    Ok(())
}
