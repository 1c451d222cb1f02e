//! A first state from what is known of the rig already: known cameras and features place the rest, however few the samples.
use super::evaluate::median;
use super::graph::State;
use super::observation::Observation;
use super::setup::Setup;
use crate::geometry::{align, resect};
use crate::rig::{Parameter, Parent};
use handeye_solvers::Pose;
use std::collections::BTreeMap;

/// Known features in one image from which the base is placed, at least.
const IN_IMAGE: usize = 4;

/// The state where everything known is, and which cameras and features are. `None` where none is, or the motion of the tip
/// is not known.
pub(super) fn known_parts(setup: &Setup) -> Option<(State, Vec<bool>, Vec<bool>)> {
    let rig = &setup.rig;
    let cameras: Vec<bool> = rig.cameras.iter().map(|camera| camera.pose.is_some()).collect();
    let features: Vec<bool> = rig.features.iter().map(|feature| feature.xyz.is_some()).collect();
    if !setup.motion_is_known() || !(cameras.contains(&true) || features.contains(&true)) {
        return None;
    }
    let mut state = State::new(setup);
    if setup.states.chain && rig.robot.base.is_none() && !rig.is_fixed(&Parameter::Base) {
        place_base(setup, &mut state, &cameras, &features);
    }
    Some((state, cameras, features))
}

/// Samples that place the base, spread evenly over the recording: all candidates are judged on all of them.
const SAMPLES: usize = 100;

/// Puts the base where known cameras see known features: the candidate of all images that explains most of them.
fn place_base(setup: &Setup, state: &mut State, cameras: &[bool], features: &[bool]) {
    let mut samples: BTreeMap<usize, BTreeMap<usize, Vec<&Observation>>> = BTreeMap::new();
    for seen in setup.observations.iter().filter(|seen| cameras[seen.camera] && features[seen.feature]) {
        if state.placed[seen.sample] && is_across(setup, seen) {
            samples.entry(seen.sample).or_default().entry(seen.camera).or_default().push(seen);
        }
    }
    let every = samples.len().div_ceil(SAMPLES).max(1);
    let samples: Vec<_> = samples.into_iter().step_by(every).collect();
    let images = || {
        samples.iter().flat_map(|(sample, images)| images.iter().map(move |(camera, seen)| (*sample, *camera, seen)))
    };
    let candidates = images().filter(|(.., seen)| seen.len() >= IN_IMAGE).flat_map(|(sample, camera, seen)| {
        let tip_from_base = state.model.tip(&state.joints[sample]).inverse();
        world_from_tip(setup, camera, seen).into_iter().map(move |tip| tip * tip_from_base)
    });
    let mut moved = state.clone();
    let mut usual_error = |base: &Pose| {
        moved.model.base = *base;
        let distances = samples.iter().flat_map(|(sample, images)| {
            let links = moved.links(setup, *sample);
            let distance = |seen: &&Observation| seen.error(&moved.model, &links).norm() / setup.sd(seen.kind());
            images.values().flatten().map(distance).collect::<Vec<f64>>()
        });
        median(&mut distances.collect::<Vec<f64>>())
    };
    let best = candidates.map(|base| (usual_error(&base), base)).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, base)) = best {
        state.model.base = base;
    }
}

/// A camera in the world that sees a feature on the tip, or the other way round.
fn is_across(setup: &Setup, seen: &Observation) -> bool {
    let parents = (setup.model.cameras[seen.camera].parent, setup.model.features[seen.feature].parent);
    matches!(parents, (Parent::World, Parent::Tip) | (Parent::Tip, Parent::World))
}

/// Where the tip may be, by one image.
fn world_from_tip(setup: &Setup, camera: usize, seen: &[&Observation]) -> Vec<Pose> {
    let camera = &setup.model.cameras[camera];
    let ray = |seen: &&Observation| Some((setup.model.features[seen.feature].xyz, seen.bearing(&setup.model)?));
    let (points, bearings): (Vec<_>, Vec<_>) = seen.iter().filter_map(ray).unzip();
    let point = |seen: &&Observation| Some((setup.model.features[seen.feature].xyz, seen.point()?));
    let (from, to): (Vec<_>, Vec<_>) = seen.iter().filter_map(point).unzip();
    let found = align(&from, &to).into_iter().chain(resect(&points, &bearings));
    match camera.parent {
        // camera_from_tip
        Parent::World => found.map(|pose| camera.pose * pose).collect(),
        // camera_from_world
        _ => found.map(|pose| (camera.pose * pose).inverse()).collect(),
    }
}
