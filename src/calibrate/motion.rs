//! A first camera and its features from a motion that is known beforehand: that of a given chain, or recorded tip poses.
//!
//! Where images show too little to be explained by themselves (few features, seldom shared), the known motion of what carries
//! them still does: a feature is taken to be somewhere near the tip, which gives the camera, and both are refined.
use super::graph::{Freedom, State};
use super::observation::Observation;
use super::setup::Setup;
use super::stage::{Stage, Stages};
use crate::Error;
use crate::geometry::resect;
use crate::rig::Parent;
use handeye_solvers::{LevenbergMarquardt, Loss, Pose, Solver};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::time::Instant;

/// Places that are tried for the features.
const TRIALS: usize = 40;

/// Detections from which a camera is placed.
const POINTS: usize = 60;

/// Width of Cauchy's loss [standard deviations], and most iterations of a trial.
const WIDTH: f64 = 50.0;
const ITERATIONS: usize = 50;

/// A state in which one camera and its features are placed, and which those are.
pub(super) struct FromMotion {
    pub state: State,
    pub cameras: Vec<bool>,
    pub features: Vec<bool>,
}

/// Places the camera with most detections. `None` where nothing moves before it, or no trial ends.
pub(super) fn from_motion(seed: u64, stages: &mut Stages<'_>) -> Result<Option<FromMotion>, Error> {
    let setup = stages.setup;
    let start = State::new(setup);
    let links = start.all_links(setup);
    let moves = |seen: &Observation| {
        let (camera, feature) = (setup.model.cameras[seen.camera].parent, setup.model.features[seen.feature].parent);
        start.placed[seen.sample] && (camera == Parent::World) != (feature == Parent::World)
    };
    let count = |camera: usize| setup.observations.iter().filter(|seen| seen.camera == camera && moves(seen)).count();
    let Some(camera) = (0..setup.rig.cameras.len()).rev().max_by_key(|&camera| count(camera)) else { return Ok(None) };
    let takes_part = |index: usize| setup.observations[index].camera == camera && moves(&setup.observations[index]);
    let seen: Vec<&Observation> =
        (0..setup.observations.len()).filter(|&i| takes_part(i)).map(|i| &setup.observations[i]).collect();
    if seen.is_empty() {
        return Ok(None);
    }
    let mut features = vec![false; setup.rig.features.len()];
    seen.iter().for_each(|seen| features[seen.feature] = true);
    let mut freedom = Freedom::nothing(setup);
    freedom.cameras[camera] = [false; 6];
    for (held, seen) in freedom.features.iter_mut().zip(&features) {
        *held = [!seen; 3];
    }
    let stage = Stage {
        name: "one camera from the known motion",
        freedom: &freedom,
        loss: Loss::Cauchy(WIDTH),
        takes_part: &takes_part,
    };
    let started = Instant::now();
    let (mut best, mut iterations, mut first) = (None::<(f64, State)>, 0, f64::INFINITY);
    for trial in 0..TRIALS {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(trial as u64);
        let mut state = start.clone();
        let place = if trial == 0 { Vector3::zeros() } else { Vector3::from_fn(|_, _| random.sample(StandardNormal)) };
        guess_features(setup, &mut state, &links, &features, place);
        for pose in candidates(setup, &state, &links, &seen, camera) {
            let mut state = state.clone();
            state.model.cameras[camera].pose = pose;
            let mut built = stages.build(&stage, &state);
            let minimizer = LevenbergMarquardt { max_iterations: ITERATIONS, ..Default::default() };
            let mut solver = Solver::new(&built.graph);
            let Ok(report) =
                minimizer.minimize_with(&mut built.graph, &mut solver, &mut |_| std::ops::ControlFlow::Continue(()))
            else {
                continue;
            };
            iterations += report.iterations;
            first = first.min(report.initial_cost);
            if best.as_ref().is_none_or(|best| report.final_cost < best.0) {
                built.read(&mut state);
                best = Some((report.final_cost, state));
            }
        }
    }
    let Some((cost, state)) = best else { return Ok(None) };
    stages.record(stage.name, iterations, (first, cost), started);
    let mut cameras = vec![false; setup.rig.cameras.len()];
    cameras[camera] = true;
    Ok(Some(FromMotion { state, cameras, features }))
}

/// Puts all unknown features at one place, in units of how far the tip moves: on the tip about it, in the world about its mean.
fn guess_features(setup: &Setup, state: &mut State, links: &[Vec<Pose>], features: &[bool], place: Vector3<f64>) {
    let tips: Vec<Vector3<f64>> = links.iter().map(|links| links[links.len() - 1].translation).collect();
    let mean = tips.iter().sum::<Vector3<f64>>() / tips.len() as f64;
    let spread = (tips.iter().map(|tip| (tip - mean).norm_squared()).sum::<f64>() / tips.len() as f64).sqrt();
    let given = setup.rig.features.iter().map(|feature| feature.xyz.is_some());
    for ((feature, given), seen) in state.model.features.iter_mut().zip(given).zip(features) {
        if *seen && !given {
            feature.xyz = if feature.parent == Parent::World { mean + 3.0 * spread * place } else { spread * place };
        }
    }
}

/// Where the camera may be, given all features.
fn candidates(setup: &Setup, state: &State, links: &[Vec<Pose>], seen: &[&Observation], camera: usize) -> Vec<Pose> {
    let model = &state.model;
    let lens = &model.cameras[camera];
    let (mut points, mut bearings) = (Vec::new(), Vec::new());
    for seen in seen.iter().step_by(seen.len().div_ceil(POINTS)) {
        if let Some(bearing) = seen.bearing(model) {
            let feature = &model.features[seen.feature];
            let in_world = model.carrier(feature.parent, &links[seen.sample]).transform(&feature.xyz);
            points.push(model.carrier(lens.parent, &links[seen.sample]).inverse_transform(&in_world));
            bearings.push(bearing);
        }
    }
    if setup.rig.cameras[camera].pose.is_some() {
        return vec![lens.pose];
    }
    resect(&points, &bearings).into_iter().map(|camera_from_points| camera_from_points.inverse()).collect()
}
