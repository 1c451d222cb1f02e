//! Readings of noisy states that do not fit what the images show.
use super::Finding;
use super::graph::State;
use super::residuals::usual_distance;
use super::setup::Setup;
use handeye_solvers::manifold::so3;

/// A reading is wrong beyond this many standard deviations.
const WRONG: f64 = 10.0;

/// Samples whose readings are further from the estimated state than noise explains, in order.
pub(super) fn wrong_readings(setup: &Setup, state: &State) -> Vec<usize> {
    (0..setup.len()).filter(|&sample| state.placed[sample] && furthest(setup, state, sample) > WRONG).collect()
}

/// Largest error of a part of a sample's reading [standard deviations]; 0 where the state is exact or was not read.
fn furthest(setup: &Setup, state: &State, sample: usize) -> f64 {
    let (states, noise) = (&setup.states, &setup.rig.noise);
    if states.exact[sample] {
        return 0.0;
    }
    if states.chain {
        let Some(readings) = &states.readings[sample] else { return 0.0 };
        let errors = state.joints[sample].iter().zip(readings).map(|(joint, reading)| (joint - reading).abs());
        return errors.fold(0.0, f64::max) / noise.joints;
    }
    let Some(reading) = &states.poses[sample] else { return 0.0 };
    let tip = &state.tips[sample];
    let turned = so3::log(&(tip.rotation * reading.rotation.transpose())).amax();
    let moved = (tip.translation - reading.translation).amax();
    let part = |error: f64, sd: f64| if sd > 0.0 { error / sd } else { 0.0 };
    part(turned, noise.pose.rot).max(part(moved, noise.pose.xyz))
}

/// What is to be said of wrong readings: how far off the images are where the readings lead.
pub(super) fn findings(setup: &Setup, state: &State) -> Vec<Finding> {
    let wrong = (0..setup.len()).filter(|&sample| !state.trusted[sample] && state.placed[sample]);
    wrong
        .map(|sample| {
            let mut read = state.clone();
            if let Some(readings) = &setup.states.readings[sample] {
                read.joints[sample].clone_from(readings);
            }
            if let Some(pose) = setup.states.poses[sample].filter(|_| !setup.states.chain) {
                read.tips[sample] = pose;
            }
            let off = usual_distance(setup, &read, sample, |_| true);
            let by_pose = !setup.states.chain;
            Finding::WrongJoints { sample: setup.samples[sample], off, swapped_with: None, by_pose }
        })
        .collect()
}
