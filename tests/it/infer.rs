//! What a rig infers from pixels, against the truth of the simulator: poses, joints, branches, their covariance.
use handeye::infer::{InferOptions, Inference, InverseKinematics, InverseOptions, Names, Prior, Sighting};
use handeye::rig::{Model, Rig, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use handeye::solvers::manifold::so3;
use nalgebra::{DVector, Vector6};

/// Sightings with noise, and the true joints, of random motions of a rig.
pub fn record(rig: &Rig, samples: usize, seed: u64) -> Vec<(Vec<Sighting>, Vec<f64>)> {
    let simulation = simulate(rig, &SimulateOptions { samples, seed, ..SimulateOptions::default() }).unwrap();
    let names = Names::new(rig, &simulation.recording);
    let samples = simulation.recording.samples.iter().zip(&simulation.truth.samples);
    samples.map(|(seen, truth)| (names.sightings(seen), truth.joints.clone().unwrap())).collect()
}

pub fn inference(rig: &Rig) -> Inference {
    Inference::new(rig, InferOptions::default()).unwrap()
}

/// The shipped UR5 with every joint free to turn by 2π to either side.
fn turning() -> Rig {
    let mut rig = catalog::rig("ur5").unwrap();
    for joint in &mut rig.robot.joints {
        (joint.limits.lower, joint.limits.upper) = (Some(-std::f64::consts::TAU), Some(std::f64::consts::TAU));
    }
    rig
}

pub fn wrap(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

/// χ² of n numbers with mean n and variance 2 n: within 4 standard deviations.
pub fn follows_chi_square(sum: f64, freedom: usize) {
    let n = freedom as f64;
    assert!((sum - n).abs() < 4.0 * (2.0 * n).sqrt(), "χ² is {sum}, {n} are expected");
}

#[test]
fn joints_and_poses_are_as_far_off_as_their_covariance_says() {
    let rig = catalog::rig("ur5").unwrap();
    let (model, mut inference) = (Model::new(&rig).unwrap(), inference(&rig));
    let (mut of_joints, mut of_poses, mut near) = (0.0, 0.0, 0.0);
    for seed in 0..100 {
        let (seen, truth) = record(&rig, 1, seed).remove(0);
        let branches = inference.joints(&seen, &Prior::none()).unwrap();
        let best = &branches[0];
        assert!(best.open.is_empty() && best.probability > 0.999);
        let error = DVector::from_iterator(6, best.joints.iter().zip(&truth).map(|(found, truth)| found - truth));
        of_joints += best.covariance.clone().cholesky().unwrap().solve(&error).dot(&error);
        let start: Vec<f64> = truth.iter().map(|joint| joint + 0.1).collect();
        let tracked = inference.joints_near(&seen, &Prior::start(&start)).unwrap();
        near += tracked.joints.iter().zip(&best.joints).map(|(a, b)| (a - b).abs()).sum::<f64>();
        let (pose, tip) = (&inference.poses(&seen)[0], model.tip(&truth));
        let turn = so3::log(&(pose.pose.rotation * tip.rotation.transpose()));
        let shift = pose.pose.translation - tip.translation;
        let error = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
        of_poses += pose.covariance.cholesky().unwrap().solve(&error).dot(&error);
    }
    follows_chi_square(of_joints, 600);
    follows_chi_square(of_poses, 600);
    assert!(near < 1e-3, "a search from nearby ends elsewhere by {near} rad over 100 samples");
}

#[test]
fn an_arm_that_turns_all_the_way_round_has_the_truth_among_its_branches() {
    let rig = turning();
    let mut inference = inference(&rig);
    let (mut listed, mut probability, mut branches) = (0, 0.0, 0);
    let samples = record(&catalog::rig("ur5").unwrap(), 100, 5);
    for (seen, truth) in &samples {
        let found = inference.joints(seen, &Prior::none()).unwrap();
        branches += found.len();
        let is_true = |joints: &[f64]| joints.iter().zip(truth).all(|(a, b)| wrap(a - b).abs() < 0.05);
        let hit = found.iter().find(|branch| is_true(&branch.joints));
        listed += usize::from(hit.is_some());
        probability += hit.map_or(0.0, |branch| branch.probability);
        assert!((found.iter().map(|branch| branch.probability).sum::<f64>() - 1.0).abs() < 1e-6);
        // All of them explain the pixels: nothing but the joints' own readings or other features could tell.
        assert!(found.iter().all(|branch| branch.rms_px < 1.2));
    }
    assert!(listed >= 98, "{listed} of 100");
    assert!(branches > 500, "{branches} branches in 100 samples");
    // The share of the truth is one of its number, on average over branches as probable as they claim.
    let expected = 100.0 * 100.0 / branches as f64;
    assert!((probability / expected - 1.0).abs() < 0.3, "{probability} of {expected}");
}

#[test]
fn inverse_kinematics_reaches_every_pose_that_joints_inside_the_limits_have() {
    for (name, _) in catalog::ALL {
        let rig = catalog::rig(name).unwrap();
        let arm = Rig { robot: rig.robot.clone(), ..Rig::default() };
        let model = Model::new(&arm).unwrap();
        let mut inverse = InverseKinematics::new(&arm, InverseOptions::default()).unwrap();
        for trial in 0..50 {
            let at = |seed: usize| -> Vec<f64> {
                let range = |(i, joint): (usize, &handeye::rig::Joint)| {
                    let (lower, upper) = (joint.limits.lower.unwrap_or(-3.0), joint.limits.upper.unwrap_or(3.0));
                    let share = 0.5 + 0.5 * ((seed * 37 + i * 101) as f64 * 0.917).sin();
                    lower + share * (upper - lower)
                };
                rig.robot.joints.iter().enumerate().map(range).collect()
            };
            let target = model.tip(&at(2 * trial + 1));
            let found = inverse.solve(&target, &at(2 * trial));
            let tip = model.tip(&found.joints);
            let (xyz, rot) = ((tip.translation - target.translation).norm(), tip.angle_to(&target));
            assert!(found.reached && xyz < 1e-6 && rot < 1e-6, "{name} {trial}: {xyz} m, {rot} rad off");
            for (joint, reading) in rig.robot.joints.iter().zip(&found.joints) {
                let limits = joint.limits;
                assert!(limits.lower.is_none_or(|lower| *reading >= lower), "{name} {}", joint.name);
                assert!(limits.upper.is_none_or(|upper| *reading <= upper), "{name} {}", joint.name);
            }
        }
    }
}
